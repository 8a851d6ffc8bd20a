#include "grapnel/plan/path_segment.hpp"

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/integrate/integrate.hpp"

namespace grapnel {
namespace {

// y: position and quaternion_wxyz of the base, then, column by column, dxi/dfinal and dxi/dfinal_rate.
constexpr int kPosition = 0, kQuaternion = 3, kPose = 7;

Manifold manifold(int columns) {
  Manifold m;
  m.size = kPose + 6 * columns;
  m.quaternions = {kQuaternion};
  return m;
}

Tolerances tolerances(double rtol, double atol) {
  Tolerances t;
  t.rtol = rtol, t.atol = atol;
  return t;
}

StepControl control(std::int64_t most_steps) {
  StepControl c;
  c.max_steps = most_steps;
  return c;
}

Posed pose_in(std::span<const double> y) {
  return {rotation_matrix(Quaterniond{y[kQuaternion], y[kQuaternion + 1], y[kQuaternion + 2], y[kQuaternion + 3]}),
          {y[kPosition], y[kPosition + 1], y[kPosition + 2]}};
}

}  // namespace

Momentumd FreeMotion::in_base(double t, const Posed& X_WB) const {
  const double s = t - time;
  const Vector3d com = p_WCom + (s / mass) * h.linear + (0.5 * s * s) * gravity;
  const Momentumd now{h.angular, h.linear + (mass * s) * gravity};
  return transposed_times(X_WB.R, shift(now, X_WB.p - com));
}

FreeMotion free_motion(const Model& model, const State& state, double time, const Vector3d& gravity) {
  const Kinematics k = forward_kinematics(model, state);
  const Vector3d com = center_of_mass(model, k);
  return {time, com, momentum_about(model, k, com), model.mass(), gravity};
}

PathSegment::PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion, double relative_tolerance,
                         double absolute_tolerance)
    : base_(base),
      start_(std::move(start)),
      motion_(motion),
      tolerances_(tolerances(relative_tolerance, absolute_tolerance)),
      plain_(manifold(0), tolerances_, control(start_.most_steps)),
      with_sensitivities_(manifold(2 * base.joints()), tolerances_, control(start_.most_steps)),
      theta_(base.joints()),
      theta_dot_(base.joints()) {}

JointPath PathSegment::path(int j, double position, double rate) const {
  return {start_.profile, start_.end - start_.begin, start_.position[j], position, start_.rate[j], rate};
}

void PathSegment::rates(double t, std::span<const double> y, std::span<double> dydt, bool sensitivities) {
  ++evaluations_;
  const double s = t - start_.begin;
  for (int j = 0; j < base_.joints(); ++j) {
    const JointPoint p = evaluate(path(j, final_[j], final_rate_[j]), s);
    theta_[j] = p.position, theta_dot_[j] = p.rate;
  }
  const Posed X_WB = pose_in(y);
  const Momentumd h_B = motion_.in_base(t, X_WB);
  base_.place(theta_);
  base_.move(theta_dot_, h_B);
  const Twistd V_B = twist_from(base_.base_twist());
  const Vector3d velocity = X_WB.R * V_B.linear;
  const Quaterniond q{y[kQuaternion], y[kQuaternion + 1], y[kQuaternion + 2], y[kQuaternion + 3]};
  const Quaterniond dq = quaternion_rate(q, V_B.angular);
  for (int k = 0; k < 3; ++k) dydt[kPosition + k] = velocity[k];
  dydt[kQuaternion] = dq.w, dydt[kQuaternion + 1] = dq.x, dydt[kQuaternion + 2] = dq.y, dydt[kQuaternion + 3] = dq.z;
  if (!sensitivities) return;
  // a(t) and b(t): all joints share them.
  const double T = start_.end - start_.begin;
  const JointPoint a = evaluate(JointPath{start_.profile, T, 0, 1, 0, 0}, s);
  const JointPoint b = evaluate(JointPath{start_.profile, T, 0, 0, 0, 1}, s);
  const int n = base_.joints();
  const Eigen::Map<const Matrix6Xd> D(y.data() + kPose, 6, 2 * n);
  Eigen::Map<Matrix6Xd> dD(dydt.data() + kPose, 6, 2 * n);
  dD.noalias() = base_.displacement_rate(h_B).lazyProduct(D);
  dD.leftCols(n) += a.position * base_.per_angle() + a.rate * base_.per_rate();
  dD.rightCols(n) += b.position * base_.per_angle() + b.rate * base_.per_rate();
}

SegmentEnd PathSegment::fly(std::span<const double> position, std::span<const double> rate, bool sensitivities) {
  const int n = base_.joints();
  SegmentEnd end;
  if (!base_.floats()) {
    end.finished = true;
    end.X_WB = start_.X_WB;
    end.per_position = end.per_rate = Matrix6Xd::Zero(6, n);
    return end;
  }
  final_.assign(position.begin(), position.end());
  final_rate_.assign(rate.begin(), rate.end());
  auto& stepper = sensitivities ? with_sensitivities_ : plain_;
  std::vector<double> y(stepper.manifold().size, 0.0);
  const Quaterniond q = quaternion_from(start_.X_WB.R);
  for (int k = 0; k < 3; ++k) y[kPosition + k] = start_.X_WB.p[k];
  y[kQuaternion] = q.w, y[kQuaternion + 1] = q.x, y[kQuaternion + 2] = q.y, y[kQuaternion + 3] = q.z;
  const auto rhs = [&](double t, std::span<const double> now, std::span<double> dydt) {
    rates(t, now, dydt, sensitivities);
  };
  const IntegrationResult result = integrate(stepper, rhs, start_.begin, y, start_.end);
  end.finished = result.finished();
  if (!end.finished) {
    end.failure = result.explanation();
    return end;
  }
  end.X_WB = pose_in(stepper.state());
  if (sensitivities) {
    const Eigen::Map<const Matrix6Xd> D(stepper.state().data() + kPose, 6, 2 * n);
    end.per_position = D.leftCols(n);
    end.per_rate = D.rightCols(n);
  }
  return end;
}

}  // namespace grapnel
