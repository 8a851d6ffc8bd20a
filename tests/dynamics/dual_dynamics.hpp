#pragma once

/// @file
/// The recursions on dual numbers, as a reference for analytical derivatives.

#include <utility>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/dynamics/link_motion.hpp"
#include "grapnel/dynamics/newton_euler_kernel.hpp"
#include "grapnel/spatial/dual.hpp"

namespace grapnel::testing {

/// Roots and joints with given accelerations in some cases; none in others.
inline PrescribedMotion some_prescribed(const Case& c, int index) {
  PrescribedMotion given;
  if (index % 2 == 0) return given;
  Random random(200000 + index);
  given.prescribed.assign(c.model.velocities(), 0);
  for (const Body& b : c.model.bodies()) {
    const bool chosen = random.chance(b.parent < 0 ? 0.5 : 0.3);
    for (int k = 0; k < velocity_count(b.description.joint.type); ++k) given.prescribed[b.v + k] = chosen;
  }
  given.vdot = random.values(c.model.velocities(), 3);
  return given;
}

// The kernels on dual numbers: the derivatives along one direction of coordinates, velocities or forces.
class DualDynamics {
 public:
  DualDynamics(const Case& c, const PrescribedMotion& given)
      : model_(c.model),
        tree_(convert_tree<Dual>(c.model.tree())),
        workspace_(tree_),
        given_(given),
        q_(c.state.q.begin(), c.state.q.end()),
        v_(c.state.v.begin(), c.state.v.end()),
        force_(c.forces.generalized.begin(), c.forces.generalized.end()),
        motion_(tree_.links.size()),
        wrench_(tree_.links.size()) {
    link_motion<Dual>(tree_, q_, {}, motion_);
    for (const ExternalWrench& e : c.forces.external) {
      const int link = model_.bodies()[e.body].placement.link;
      const Pose<Dual> X_LW = inverse(motion_[link].X_WL);
      external_.push_back({link, {dual(e.F_W.angular), dual(e.F_W.linear)}, X_LW * dual(e.p_WP)});
    }
    gravity_ = dual(c.forces.gravity);
  }

  std::vector<Dual>& q() { return q_; }
  std::vector<Dual>& v() { return v_; }
  std::vector<Dual>& force() { return force_; }

  Eigen::VectorXd forward() {
    std::vector<Dual> vdot(v_.size()), required(v_.size()), acceleration(given_.vdot.begin(), given_.vdot.end());
    DynamicsInput<Dual> in = input();
    in.force = force_, in.prescribed = given_.prescribed, in.acceleration = acceleration;
    articulated_body<Dual>(tree_, in, workspace_, vdot, required);
    return derivatives(vdot);
  }
  Eigen::VectorXd inverse_of(const std::vector<double>& vdot) {
    const DynamicsInput<Dual> in = input();
    return derivatives(required(in, vdot));
  }

  // In parts, for further wrenches on links.
  const std::vector<LinkMotion<Dual>>& move() {
    link_motion<Dual>(tree_, q_, {}, motion_);
    return motion_;
  }
  void add(int link, const Wrench<Dual>& at_its_origin) { more_.emplace_back(link, at_its_origin); }
  std::vector<Dual> required(DynamicsInput<Dual> in, const std::vector<double>& vdot) {
    std::vector<Dual> tau(v_.size()), acceleration(vdot.begin(), vdot.end());
    in.acceleration = acceleration;
    newton_euler<Dual>(tree_, in, workspace_, tau);
    return tau;
  }
  // After required().
  const LinkScratch<Dual>& link(int n) const { return workspace_.links[static_cast<std::size_t>(n)]; }
  static Eigen::VectorXd derivatives(const std::vector<Dual>& x) {
    Eigen::VectorXd result(x.size());
    for (std::size_t i = 0; i < x.size(); ++i) result[static_cast<Eigen::Index>(i)] = x[i].derivative;
    return result;
  }
  DynamicsInput<Dual> input() {
    move();
    wrench_.assign(wrench_.size(), Wrench<Dual>::zero());
    for (const Applied& e : external_) wrench_[e.link] += shift(transposed_times(motion_[e.link].X_WL.R, e.F_W), -e.p);
    for (const auto& [link, F] : more_) wrench_[static_cast<std::size_t>(link)] += F;
    more_.clear();
    DynamicsInput<Dual> in;
    in.q = q_, in.v = v_, in.link_wrench = wrench_, in.gravity = gravity_;
    return in;
  }

 private:
  struct Applied {
    int link;
    Wrench<Dual> F_W;
    Vector3<Dual> p;  // of the point, in the link
  };
  static Vector3<Dual> dual(const Vector3d& a) { return {a[0], a[1], a[2]}; }

  const Model& model_;
  Tree<Dual> tree_;
  DynamicsWorkspace<Dual> workspace_;
  PrescribedMotion given_;
  std::vector<Dual> q_, v_, force_;
  std::vector<LinkMotion<Dual>> motion_;
  std::vector<Wrench<Dual>> wrench_;
  std::vector<Applied> external_;
  std::vector<std::pair<int, Wrench<Dual>>> more_;
  Vector3<Dual> gravity_;
};

// Columns of a derivative with respect to q, v or the forces: evaluate() along one direction at a time.
enum class By { q, v, force };
template <class Evaluate>
Eigen::MatrixXd columns(const Case& c, DualDynamics& dynamics, By by, Evaluate evaluate) {
  const int n = c.model.velocities();
  Eigen::MatrixXd result;
  std::vector<double> direction(n);
  for (int j = 0; j < n; ++j) {
    std::vector<Dual>& x = by == By::q ? dynamics.q() : by == By::v ? dynamics.v() : dynamics.force();
    direction.assign(n, 0.0);
    direction[j] = 1;
    if (by == By::q) direction = rates_of(c.model, c.state.q, direction);
    for (std::size_t i = 0; i < x.size(); ++i) x[i].derivative = direction[i];
    const Eigen::VectorXd column = evaluate();
    if (j == 0) result.resize(column.size(), n);
    result.col(j) = column;
    for (Dual& value : x) value.derivative = 0;
    direction.resize(n);
  }
  return result;
}

}  // namespace grapnel::testing
