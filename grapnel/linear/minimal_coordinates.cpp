#include "grapnel/linear/minimal_coordinates.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/articulated_body.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

Quaterniond turned_by(const Vector3d& phi) {
  const double angle = norm(phi), share = angle > 1e-9 ? std::sin(0.5 * angle) / angle : 0.5;
  return {std::cos(0.5 * angle), share * phi[0], share * phi[1], share * phi[2]};
}

Quaterniond quaternion_at(const State& state, int q) {
  return {state.q[q], state.q[q + 1], state.q[q + 2], state.q[q + 3]};
}

void put(const Quaterniond& value, State& state, int q) {
  state.q[q] = value.w, state.q[q + 1] = value.x, state.q[q + 2] = value.y, state.q[q + 3] = value.z;
}

// The rotation vector from a to b, in the axes of a.
Vector3d rotation_between(const Quaterniond& a, const Quaterniond& b) {
  Quaterniond d = Quaterniond{a.w, -a.x, -a.y, -a.z} * b;
  if (d.w < 0) d = {-d.w, -d.x, -d.y, -d.z};
  const Vector3d v{d.x, d.y, d.z};
  const double s = norm(v);
  return (s > 1e-9 ? 2 * std::atan2(s, d.w) / s : 2.0) * v;
}

Vector3d vector_at(std::span<const double> v, int i) { return {v[i], v[i + 1], v[i + 2]}; }

// Calls each body with its kind of joint: free or spherical bodies turn.
template <class Free, class Turning, class Single>
void for_each_joint(const Model& model, Free&& free, Turning&& turning, Single&& single) {
  for (const Body& body : model.bodies()) {
    const JointType type = body.description.joint.type;
    if (type == JointType::free)
      free(body);
    else if (type == JointType::spherical)
      turning(body);
    else
      for (int k = 0; k < velocity_count(type); ++k) single(body.q + k, body.v + k);
  }
}

}  // namespace

MinimalCoordinates::MinimalCoordinates(const Model& model, std::span<const LoopClosure> closures, State at,
                                       std::vector<std::uint8_t> fixed)
    : model_(model), at_(std::move(at)), fixed_(std::move(fixed)), workspace_(model) {
  if (!closures.empty() || !model.couplings().empty()) loops_.emplace(model, closures);
  const int n = model.velocities();
  std::vector<int> open;
  for (int v = 0; v < n; ++v) {
    if (!fixed_[static_cast<std::size_t>(v)]) open.push_back(v);
  }
  if (!loops_ && model.tree().chains.empty()) {
    independent_ = open;
    basis_ = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(open.size()));
    for (std::size_t i = 0; i < open.size(); ++i) basis_(open[i], static_cast<Eigen::Index>(i)) = 1;
    return;
  }
  // Velocities that modal joints and loops allow: the range of the projector (I - M^-1 J^T W^+ J) Pi, whose trace is
  // its rank.
  Eigen::MatrixXd modal = Eigen::MatrixXd::Identity(n, n);
  project_columns(model.tree(), modal);
  Eigen::MatrixXd allowed = Eigen::MatrixXd::Zero(n, static_cast<Eigen::Index>(open.size()));
  double trace = 0;
  std::vector<double> v(static_cast<std::size_t>(n));
  for (std::size_t i = 0; i < open.size(); ++i) {
    Eigen::VectorXd::Map(v.data(), n) = modal.col(open[i]);
    if (loops_) loops_->close_velocities(at_.q, fixed_, workspace_, v);
    allowed.col(static_cast<Eigen::Index>(i)) = as_vector(v);
    trace += v[static_cast<std::size_t>(open[i])];
  }
  find_independent(static_cast<int>(std::lround(trace)), allowed);
}

// Allowed velocities, as columns => independent ones, by pivots of the rows of an orthonormal basis, and all velocities
// by them.
void MinimalCoordinates::find_independent(int count, const Eigen::MatrixXd& allowed) {
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> columns(allowed);
  const Eigen::MatrixXd Q = columns.householderQ() * Eigen::MatrixXd::Identity(allowed.rows(), count);
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rows(Eigen::MatrixXd(Q.transpose()));
  for (int i = 0; i < count; ++i) independent_.push_back(rows.colsPermutation().indices()[i]);
  std::sort(independent_.begin(), independent_.end());
  const Eigen::MatrixXd square = Q(independent_, Eigen::all);
  basis_ = lu_solution(Eigen::MatrixXd(square.transpose()), Eigen::MatrixXd(Q.transpose())).transpose();
}

State MinimalCoordinates::moved(Eigen::Index i, double step) {
  const auto m = static_cast<Eigen::Index>(independent_.size());
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(basis_.rows());
  return i < m ? moved_by(step * basis_.col(i), none) : moved_by(none, step * basis_.col(i - m));
}

State MinimalCoordinates::moved_by(const Eigen::VectorXd& xi, const Eigen::VectorXd& dv) {
  State state = at_;
  for (Eigen::Index k = 0; k < dv.size(); ++k) state.v[static_cast<std::size_t>(k)] += dv[k];
  if (xi.isZero(0)) return state;
  const std::vector<double> d(xi.begin(), xi.end());
  const auto turn = [&](int q, int v) { put(quaternion_at(at_, q) * turned_by(vector_at(d, v)), state, q); };
  for_each_joint(
      model_,
      [&](const Body& body) {
        const Vector3d p = rotation_matrix(quaternion_at(at_, body.q + 3)) * vector_at(d, body.v + 3);
        for (int k = 0; k < 3; ++k) state.q[body.q + k] += p[k];
        turn(body.q + 3, body.v);
      },
      [&](const Body& body) { turn(body.q, body.v); }, [&](int q, int v) { state.q[q] += d[v]; });
  if (loops_) loops_->project(fixed_, workspace_, state.q, state.v);
  return state;
}

Eigen::VectorXd MinimalCoordinates::deviation(const State& state) const {
  const int n = model_.velocities();
  Eigen::VectorXd x(2 * n);
  x.tail(n) = as_vector(state.v) - as_vector(at_.v);
  const auto turn = [&](int q, int v) {
    const Vector3d phi = rotation_between(quaternion_at(at_, q), quaternion_at(state, q));
    for (int k = 0; k < 3; ++k) x[v + k] = phi[k];
  };
  for_each_joint(
      model_,
      [&](const Body& body) {
        const Vector3d p = transposed_times(rotation_matrix(quaternion_at(at_, body.q + 3)),
                                            Vector3d(vector_at(state.q, body.q) - vector_at(at_.q, body.q)));
        for (int k = 0; k < 3; ++k) x[body.v + 3 + k] = p[k];
        turn(body.q + 3, body.v);
      },
      [&](const Body& body) { turn(body.q, body.v); }, [&](int q, int v) { x[v] = state.q[q] - at_.q[q]; });
  return x;
}

Eigen::VectorXd MinimalCoordinates::independent_of(const Eigen::VectorXd& all) const {
  const Eigen::Index n = all.size() / 2;
  Eigen::VectorXd x(size());
  x << Eigen::VectorXd(all.head(n)(independent_)), Eigen::VectorXd(all.tail(n)(independent_));
  return x;
}

Eigen::VectorXd MinimalCoordinates::position_rates(const Eigen::VectorXd& deviation) const {
  const int n = model_.velocities();
  Eigen::VectorXd rates = deviation.tail(n);
  const auto subtract = [&](int v, const Vector3d& w, int of) {
    const Vector3d d = cross(w, Vector3d{deviation[of], deviation[of + 1], deviation[of + 2]});
    for (int k = 0; k < 3; ++k) rates[v + k] -= d[k];
  };
  for_each_joint(
      model_,
      [&](const Body& body) {
        const Vector3d w = vector_at(at_.v, body.v), u = vector_at(at_.v, body.v + 3);
        subtract(body.v, w, body.v);
        subtract(body.v + 3, u, body.v);
        subtract(body.v + 3, w, body.v + 3);
      },
      [&](const Body& body) { subtract(body.v, vector_at(at_.v, body.v), body.v); }, [](int, int) {});
  return rates;
}

Eigen::VectorXd MinimalCoordinates::response(const State& state, const Eigen::VectorXd& force) {
  const auto n = static_cast<std::size_t>(model_.velocities());
  const std::vector<double> zero(n, 0.0), given(force.begin(), force.end());
  std::vector<double> vdot(n);
  DynamicsInput<double> in;
  in.q = state.q, in.v = zero, in.force = given, in.prescribed = fixed_, in.acceleration = zero;
  if (loops_)
    loops_->accelerations(in, 0, workspace_, vdot, workspace_.force);
  else
    articulated_body<double>(model_.tree(), in, workspace_.kernel, vdot, workspace_.force);
  return as_vector(vdot);
}

}  // namespace grapnel
