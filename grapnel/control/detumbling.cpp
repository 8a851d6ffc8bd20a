#include "grapnel/control/detumbling.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/control/load_shares.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Directions with singular values below this part of the largest are faded out.
constexpr double kWeak = 5e-3;
// Share of every limit for the target's motion if joints have further freedom; damping uses the rest.
constexpr double kForTarget = 0.9;
constexpr double kMinLimit = 1e-9;  // replaces a limit of 0 [N m or N]

using Vector6d = Eigen::Matrix<double, 6, 1>;

Eigen::Vector3d eigen_of(const Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector3d spatial(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }
Vector6d stacked(const Vector3d& angular, const Vector3d& linear) {
  Vector6d v;
  v << eigen_of(angular), eigen_of(linear);
  return v;
}

// Response of the target to efforts: the acceleration at its centre of mass is rows tau + free [rad/s^2; m/s^2].
struct TargetResponse {
  HeldBody body;
  Vector3d gyroscopic;  // w x I w
  Vector3d falling;     // acceleration due to gravity
  Eigen::MatrixXd rows;
  Vector6d free;
};

// Response of the robot => acceleration of the target at its centre of mass, rows tau + free, from its point Jacobian.
TargetResponse target_response(const DetumblingLaw& law, const EffortResponse& response, const Vector3d& gravity) {
  const Model& model = response.model();
  const Kinematics& k = response.kinematics();
  const int target = law.target();
  TargetResponse t;
  t.body = held_body(model, k, law.bodies);
  const Vector3d w = t.body.motion.angular, arm = t.body.com - k.X_WB[target].p;
  t.gyroscopic = cross(w, t.body.inertia * w);
  t.falling = gravity;
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, target, t.body.com, J);
  const BodyAcceleration& terms = response.velocity_terms()[target];
  t.free =
      J * response.free() + stacked(terms.angular, terms.linear + cross(terms.angular, arm) + cross(w, cross(w, arm)));
  t.rows = J * response.response();
  return t;
}

// Limited loads for given efforts: each driven joint with a limit, then force and moment of each hold with a limit.
class Loads {
 public:
  Loads(const DetumblingLaw& law, const TargetResponse& target, const EffortResponse& response)
      : law_(law), target_(target), response_(response) {
    for (std::size_t j = 0; j < response.limits().size(); ++j) {
      if (std::isfinite(response.limits()[j])) add(response.limits()[j], static_cast<int>(j));
    }
    joints_ = limits_.size();
    for (std::size_t i = 0; i < law.holds.size(); ++i) {
      const int at = static_cast<int>(response.limits().size() + 2 * i);
      if (std::isfinite(law.holds[i].force)) add(law.holds[i].force, at);
      if (std::isfinite(law.holds[i].moment)) add(law.holds[i].moment, at + 1);
    }
  }

  const std::vector<double>& limits() const { return limits_; }
  int source(int load) const { return load < 0 ? -1 : sources_[load]; }

  // The loads for these efforts; without the free part: their change.
  std::vector<Eigen::Vector3d> at(const Eigen::VectorXd& effort, bool with_free) const {
    std::vector<Eigen::Vector3d> loads;
    for (std::size_t i = 0; i < joints_; ++i) loads.emplace_back(effort[sources_[i]], 0, 0);
    if (limits_.size() > joints_) add_holds(effort, with_free, loads);
    return loads;
  }

 private:
  void add(double limit, int source) { limits_.push_back(std::max(limit, kMinLimit)), sources_.push_back(source); }

  // Wrenches on the target in W, at the grasps.
  std::vector<Wrenchd> wrenches(const Eigen::VectorXd& effort, bool with_free) const {
    Eigen::VectorXd rows;
    if (!response_.closures().empty()) rows = response_.multiplier_response() * effort;
    if (with_free && rows.size() > 0) rows += response_.free_multipliers();
    std::vector<Wrenchd> all(law_.holds.size(), Wrenchd::zero());
    std::vector<int> first;  // first row of each closure
    int next = 0;
    for (const LoopClosure& closure : response_.closures()) first.push_back(next), next += row_count(closure.model);
    Vector6d a = target_.rows * effort;
    if (with_free) a += target_.free - stacked(Vector3d::zero(), target_.falling);
    // About the centre of mass: the wrench of the tree's own grasp that complements the others.
    Wrenchd left{target_.body.inertia * spatial(a.head<3>()), target_.body.mass * spatial(a.tail<3>())};
    if (with_free) left.angular += target_.gyroscopic;
    for (std::size_t i = 0; i < law_.holds.size(); ++i) {
      const DetumblingLaw::Hold& hold = law_.holds[i];
      if (hold.closure < 0) continue;
      const Posed X_WC = response_.kinematics().X_WB[hold.frames.body_a] * hold.frames.X_AC;
      const std::span<const double> own(rows.data() + first[hold.closure],
                                        static_cast<std::size_t>(row_count(hold.frames.model)));
      const Wrenchd F = closure_wrench(hold.frames, own);
      all[i] = {X_WC.R * F.angular, X_WC.R * F.linear};
      left.linear -= all[i].linear;
      left.angular -= all[i].angular + cross(X_WC.p - target_.body.com, all[i].linear);
    }
    for (std::size_t i = 0; i < law_.holds.size(); ++i) {
      if (law_.holds[i].closure >= 0) continue;
      const Vector3d p = (response_.kinematics().X_WB[law_.holds[i].frames.body_a] * law_.holds[i].frames.X_AC).p;
      all[i] = {left.angular - cross(p - target_.body.com, left.linear), left.linear};
    }
    return all;
  }

  void add_holds(const Eigen::VectorXd& effort, bool with_free, std::vector<Eigen::Vector3d>& loads) const {
    const std::vector<Wrenchd> all = wrenches(effort, with_free);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (std::isfinite(law_.holds[i].force)) loads.push_back(eigen_of(all[i].linear));
      if (std::isfinite(law_.holds[i].moment)) loads.push_back(eigen_of(all[i].angular));
    }
  }

  const DetumblingLaw& law_;
  const TargetResponse& target_;
  const EffortResponse& response_;
  std::vector<double> limits_;
  std::vector<int> sources_;
  std::size_t joints_ = 0;  // number of loads that are efforts
};

// Efforts for accelerations of the target: minimum sum of tau^2/damping, damped for small singular values (Nakamura and
// Hanafusa, J. Dyn. Sys. Meas. Control 108 (1986) 163-171), and the remaining freedom.
class EffortMap {
 public:
  EffortMap(const Eigen::MatrixXd& rows, const Vector6d& size, const Eigen::VectorXd& root) : size_(size), root_(root) {
    const Eigen::MatrixXd A = size.asDiagonal() * rows * root.asDiagonal();
    svd_.compute(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
    const Eigen::VectorXd& s = svd_.singularValues();
    inverse_ = Eigen::VectorXd::Zero(s.size());
    for (Eigen::Index i = 0; i < s.size() && s[0] > 0; ++i) {
      const double weak = kWeak * s[0], share = s[i] / weak;
      const double square = share < 1 ? 0.25 * weak * weak * (1 - share * share) : 0;
      inverse_[i] = s[i] / (s[i] * s[i] + square);
    }
  }

  double condition() const {
    const Eigen::VectorXd& s = svd_.singularValues();
    return s.size() >= 6 && s[0] > 0 ? s[5] / s[0] : 0;
  }
  Eigen::VectorXd efforts(const Vector6d& acceleration) const {
    const Eigen::VectorXd along = svd_.matrixU().transpose() * (size_.asDiagonal() * acceleration);
    return root_.cwiseProduct(svd_.matrixV() * inverse_.cwiseProduct(along));
  }
  // Component of a vector, divided by the roots, that does not move the target (or barely).
  Eigen::VectorXd beside(const Eigen::VectorXd& x) const {
    const Eigen::VectorXd along = svd_.matrixV().transpose() * x;
    return x - svd_.matrixV() * inverse_.cwiseProduct(svd_.singularValues()).cwiseProduct(along);
  }

 private:
  Vector6d size_;
  Eigen::VectorXd root_, inverse_;
  Eigen::JacobiSVD<Eigen::MatrixXd> svd_;
};

// Efforts that damp the remaining motion, with time constants of at least `settling`.
Eigen::VectorXd damping_efforts(const DetumblingLaw& law, const State& state, const EffortResponse& response,
                                const EffortMap& map, const Eigen::VectorXd& root) {
  const Eigen::Index n = root.size();
  Eigen::VectorXd rates(n);
  Eigen::MatrixXd own(n, n);  // accelerations of the driven joints due to their efforts
  for (Eigen::Index j = 0; j < n; ++j) {
    const int v = response.velocity(static_cast<std::size_t>(j));
    rates[j] = state.v[v], own.row(j) = response.response().row(v);
  }
  Eigen::MatrixXd free(n, n);  // (1 - V V^T) D^1/2
  for (Eigen::Index j = 0; j < n; ++j) free.col(j) = map.beside(Eigen::VectorXd::Unit(n, j) * root[j]);
  const Eigen::MatrixXd fall = free * own * free.transpose();
  const double fastest =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(0.5 * (fall + fall.transpose())))
          .eigenvalues()
          .maxCoeff();
  const double slowed = std::min(1.0, 1 / std::max(fastest * law.settling, 1e-300));
  return -slowed * root.cwiseProduct(map.beside(root.cwiseProduct(rates)));
}

}  // namespace

// Angular momentum [N m s] and torque [N m] => time until it vanishes under a constant opposite torque [s].
double detumbling_time(const Vector3d& angular_momentum, double torque) { return norm(angular_momentum) / torque; }

// State and forces => efforts by (15.5): affine in the rate k, with the largest k up to (15.3) within all limits, plus
// damping of the remaining motion within the remaining limits.
DetumblingCommand detumbling_command(const DetumblingLaw& law, const State& state, std::span<const double> force,
                                     const Vector3d& gravity, EffortResponse& response) {
  response.update(state, force, gravity);
  const Model& model = response.model();
  const TargetResponse target = target_response(law, response, gravity);
  const HeldBody& body = target.body;
  const TargetMotion3d motion = target_motion(model, response.kinematics(), law.bodies);
  const double L = norm(motion.angular_momentum);

  // Accelerations are weighted with the target's radius of gyration.
  Vector6d size = Vector6d::Ones();
  size.head<3>().setConstant(std::sqrt((body.inertia.xx + body.inertia.yy + body.inertia.zz) / (2 * body.mass)));
  const Eigen::VectorXd root = as_vector(law.damping).cwiseSqrt();
  const EffortMap map(target.rows, size, root);

  // Free rotation and fall: (15.5) with k = 0; and the change per unit of k: -[w; v].
  const Symmetric3d& I = body.inertia;
  const Eigen::Matrix3d inertia{{I.xx, I.xy, I.xz}, {I.xy, I.yy, I.yz}, {I.xz, I.yz, I.zz}};
  const Vector3d turning = spatial(inertia.llt().solve(eigen_of(target.gyroscopic)));
  const Vector6d undamped = stacked(-turning, model.has_free_root(law.target()) ? gravity : Vector3d::zero());
  const Eigen::VectorXd fixed = map.efforts(undamped - target.free);
  const Eigen::VectorXd slope = map.efforts(-stacked(body.motion.angular, motion.velocity));
  const Eigen::VectorXd still = damping_efforts(law, state, response, map, root);

  const Loads loads(law, target, response);
  const std::vector<Eigen::Vector3d> at_zero = loads.at(fixed, true), per_rate = loads.at(slope, false),
                                     of_still = loads.at(still, false);
  const double for_target = root.size() > 6 ? kForTarget : 1;
  std::vector<LimitedLoad> limited;
  for (std::size_t i = 0; i < loads.limits().size(); ++i)
    limited.push_back({at_zero[i], per_rate[i], for_target * loads.limits()[i]});
  const double wanted = L > 0 ? law.torque / std::max(L, law.torque * law.shortest) : 0;  // (15.3)
  const LoadShare share = largest_within(limited, wanted);

  DetumblingCommand command;
  command.condition = map.condition();
  command.rate = share.k;
  command.scale = wanted > 0 ? share.k / wanted : 0;
  command.demand = for_target * share.share, command.limiting = loads.source(share.load);
  command.within_limits = command.demand <= 1;
  const double scaled = 1 / std::max(1.0, command.demand);
  command.effort = scaled * (fixed + share.k * slope);
  // Damping uses the remaining limits, in the same manner for both signs.
  double part = 1;
  for (std::size_t i = 0; i < limited.size(); ++i) {
    const double taken = scaled * (at_zero[i] + share.k * per_rate[i]).norm(), more = of_still[i].norm();
    const double room = std::max(0.0, loads.limits()[i] - taken);
    if (more > room) part = std::min(part, room / more);
  }
  command.effort += part * still;
  for (Eigen::Index j = 0; j < root.size(); ++j) {  // rounding error
    const double limit = response.limits()[j];
    command.effort[j] = std::clamp(command.effort[j], -limit, limit);
  }
  return command;
}

JointLawCommand Detumbling::at(double, const State& state, std::span<const double> force) {
  DetumblingCommand c = detumbling_command(law_, state, force, gravity_, response_);
  JointLawCommand command{std::move(c.effort), c.scale, c.within_limits, c.condition};
  command.demand = c.demand, command.limiting = c.limiting;
  return command;
}

}  // namespace grapnel
