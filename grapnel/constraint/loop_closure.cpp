#include "grapnel/constraint/loop_closure.hpp"

#include <cmath>

#include "grapnel/model/coupling.hpp"

namespace grapnel {

// Poses and twists => position, angle and rate defects of a closure in its constrained directions.
ClosureDefect closure_defect(const LoopClosure& closure, const Kinematics& kinematics) {
  const Posed X_WC = kinematics.X_WB[closure.body_a] * closure.X_AC;
  const Posed X_WD = kinematics.X_WB[closure.body_b] * closure.X_BD;
  const Twistd V_C = shift(kinematics.V_WB[closure.body_a], X_WC.p - kinematics.X_WB[closure.body_a].p);
  const Twistd V_D = shift(kinematics.V_WB[closure.body_b], X_WC.p - kinematics.X_WB[closure.body_b].p);
  const Vector3d w = V_D.angular - V_C.angular;
  ClosureDefect defect;
  if (linear_row_count(closure.model) > 0) {
    defect.position = norm(X_WD.p - X_WC.p);
    defect.velocity = norm(V_D.linear - V_C.linear);
  }
  if (closure.model == GraspModel::rigid || closure.model == GraspModel::orientation) {
    defect.angle = rotation_angle(transpose(X_WC.R) * X_WD.R);
    defect.angular_velocity = norm(w);
  } else if (turns_about_axis(closure.model)) {
    const Vector3d h = X_WC.R * closure.hinge_C, h_D = X_WD.R * closure.hinge_C;
    defect.angle = std::atan2(norm(cross(h, h_D)), dot(h, h_D));
    defect.angular_velocity = norm(w - dot(w, h) * h);
  }
  return defect;
}

ClosureDefect coupling_defects(const Model& model, const State& state) {
  ClosureDefect largest;
  for (const JointCoupling& coupling : model.couplings()) {
    const double position = std::abs(coupling_defect(model, coupling, state.q));
    const double rate = std::abs(coupling_rate(model, coupling, state.v));
    const bool slides = slides_along_axis(model.bodies()[dependent_body(coupling)].description.joint.type);
    largest.raise(slides ? ClosureDefect{position, 0, rate, 0} : ClosureDefect{0, position, 0, rate});
  }
  return largest;
}

void ClosureDefect::raise(const ClosureDefect& other) {
  const auto take = [](double& most, double value) {
    if (!(value <= most)) most = value;
  };
  take(position, other.position);
  take(angle, other.angle);
  take(velocity, other.velocity);
  take(angular_velocity, other.angular_velocity);
}

int forbidden_turns(const LoopClosure& closure, Vector3d (&axes)[3]) {
  const bool hinge = turns_about_axis(closure.model);
  const Rotationd R = hinge ? rotation_between({0, 0, 1}, closure.hinge_C) : Rotationd::identity();
  for (int k = 0; k < 3; ++k) axes[k] = R.column(k);
  return row_count(closure.model) - linear_row_count(closure.model);
}

Wrenchd closure_wrench(const LoopClosure& closure, std::span<const double> rows) {
  Vector3d axes[3];
  const int turns = forbidden_turns(closure, axes);
  Wrenchd F = Wrenchd::zero();
  for (int r = 0; r < turns; ++r) F.angular += rows[r] * axes[r];
  for (int r = 0; r < linear_row_count(closure.model); ++r) F.linear[r] = rows[turns + r];
  return F;
}

int closure_rows(std::span<const LoopClosure> closures) {
  int rows = 0;
  for (const LoopClosure& closure : closures) rows += row_count(closure.model);
  return rows;
}

}  // namespace grapnel
