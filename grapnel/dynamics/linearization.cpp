#include "grapnel/dynamics/linearization.hpp"

#include <stdexcept>

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/dual.hpp"

namespace grapnel {
namespace {

// Accelerations along one direction of the state: forward dynamics of dual numbers.
class DirectionalDynamics {
 public:
  DirectionalDynamics(const Model& model, const State& state, const Forces& forces)
      : tree_(convert_tree<Dual>(model.tree())),
        kernel_(tree_),
        q_(state.q.begin(), state.q.end()),
        v_(state.v.begin(), state.v.end()),
        force_(v_.size()),
        vdot_(v_.size()),
        required_(v_.size()),
        gravity_{forces.gravity[0], forces.gravity[1], forces.gravity[2]} {
    if (!forces.generalized.empty()) force_.assign(forces.generalized.begin(), forces.generalized.end());
    if (forces.external.empty()) return;
    links_.resize(tree_.links.size());
    wrench_.resize(tree_.links.size());
    link_motion<Dual>(tree_, q_, {}, links_);
    for (const ExternalWrench& e : forces.external) {
      const int link = model.bodies().at(e.body).placement.link;
      const Pose<Dual>& X_WL = links_[link].X_WL;
      // The lever from the point to the link's origin, in the link's frame, does not change.
      external_.push_back({link, dual(e.F_W.angular), dual(e.F_W.linear), transpose(X_WL.R) * (X_WL.p - dual(e.p_WP))});
    }
  }

  std::vector<Dual>& q() { return q_; }
  std::vector<Dual>& v() { return v_; }
  std::vector<Dual>& force() { return force_; }

  const std::vector<Dual>& accelerations() {
    DynamicsInput<Dual> in;
    in.q = q_, in.v = v_, in.force = force_, in.gravity = gravity_;
    if (!external_.empty()) {
      link_motion<Dual>(tree_, q_, {}, links_);
      wrench_.assign(wrench_.size(), Wrench<Dual>::zero());
      for (const LinkWrench& e : external_) {
        const Rotation<Dual> R_LW = transpose(links_[e.link].X_WL.R);
        wrench_[e.link] += shift(Wrench<Dual>{R_LW * e.moment, R_LW * e.force}, e.lever);
      }
      in.link_wrench = wrench_;
    }
    articulated_body<Dual>(tree_, in, kernel_, vdot_, required_);
    return vdot_;
  }

 private:
  struct LinkWrench {
    int link;
    Vector3<Dual> moment, force;  // in W
    Vector3<Dual> lever;          // in the link's frame
  };
  static Vector3<Dual> dual(const Vector3d& a) { return {a[0], a[1], a[2]}; }

  Tree<Dual> tree_;
  DynamicsWorkspace<Dual> kernel_;
  std::vector<Dual> q_, v_, force_, vdot_, required_;
  Vector3<Dual> gravity_;
  std::vector<LinkMotion<Dual>> links_;
  std::vector<Wrench<Dual>> wrench_;
  std::vector<LinkWrench> external_;
};

// Subtracts the matrix of the cross product with a from a 3 x 3 block.
void subtract_cross(Eigen::MatrixXd& A, int row, int column, const double* a) {
  A(row, column + 1) += a[2], A(row, column + 2) -= a[1];
  A(row + 1, column) -= a[2], A(row + 1, column + 2) += a[0];
  A(row + 2, column) += a[1], A(row + 2, column + 1) -= a[0];
}

}  // namespace

Linearization linearize(const Model& model, const State& state, const Forces& forces) {
  if (!model.couplings().empty()) throw std::invalid_argument("linearize: the model has coupled joints");
  if (!model.tree().chains.empty()) throw std::invalid_argument("linearize: the model has modal joints");
  Linearization result;
  result.vdot = forward_dynamics(model, state, forces);  // checks the sizes
  const int n = model.velocities();
  result.A.setZero(2 * n, 2 * n);
  result.B.setZero(2 * n, n);

  // xi' = dv - ad_v xi: the rotations and displacements are in the axes of moving bodies.
  result.A.topRightCorner(n, n).setIdentity();
  for (const Body& body : model.bodies()) {
    const JointType type = body.description.joint.type;
    const double* v = state.v.data() + body.v;
    if (type == JointType::spherical || type == JointType::free) subtract_cross(result.A, body.v, body.v, v);
    if (type != JointType::free) continue;
    subtract_cross(result.A, body.v + 3, body.v, v + 3);
    subtract_cross(result.A, body.v + 3, body.v + 3, v);
  }

  DirectionalDynamics dynamics(model, state, forces);
  const auto write = [&](auto column) {
    const std::vector<Dual>& vdot = dynamics.accelerations();
    for (int i = 0; i < n; ++i) column[i] = vdot[i].derivative;
  };
  std::vector<double> direction(n), qdot(model.coordinates());
  for (int j = 0; j < n; ++j) {
    direction[j] = 1;
    coordinate_rates(model, state.q, direction, qdot);
    direction[j] = 0;
    for (std::size_t i = 0; i < qdot.size(); ++i) dynamics.q()[i].derivative = qdot[i];
    write(result.A.col(j).tail(n));
    for (Dual& q : dynamics.q()) q.derivative = 0;
    dynamics.v()[j].derivative = 1;
    write(result.A.col(n + j).tail(n));
    dynamics.v()[j].derivative = 0;
    dynamics.force()[j].derivative = 1;
    write(result.B.col(j).tail(n));
    dynamics.force()[j].derivative = 0;
  }
  return result;
}

}  // namespace grapnel
