#include "grapnel/linear/plant.hpp"

#include <cmath>

#include "grapnel/constraint/loop_derivatives.hpp"

namespace grapnel {
namespace {

// Forces of springs and friction, and their derivatives by the same joint's position and rate.
SpringForces joint_forces(const OperatingPoint& point) {
  const Model& model = point.model();
  SpringForces forces = spring_forces(model, point.state);
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const JointFriction& f = body.description.joint.friction;
    const auto v = static_cast<std::size_t>(body.v);
    const double rate = point.state.v[v];
    forces.force[v] -= f.viscous * rate, forces.dv[v] -= f.viscous;
    if (f.coulomb == 0) continue;
    if (f.model == JointFriction::Model::sticking) {  // a joint at rest is held or begins to slide
      forces.force[v] -= std::copysign(f.coulomb, rate);
      continue;
    }
    const double share = std::tanh(rate / f.transition_rate);
    forces.force[v] -= f.coulomb * share, forces.dv[v] -= f.coulomb / f.transition_rate * (1 - share * share);
  }
  return forces;
}

}  // namespace

std::optional<Derivative> analytical_rates(const OperatingPoint& point, MinimalCoordinates& coordinates,
                                           const PhaseSetup& setup, const Eigen::VectorXd& constant) {
  constexpr double kSameAcceleration = 1e-9, kContradiction = 1e-8, kRounding = 1e-14;
  if (setup.orbit || !setup.loads.empty() || !setup.slips.empty() || !setup.tendons.empty()) return {};
  const Model& model = point.model();
  const Eigen::Index n = model.velocities();
  if (coordinates.size() == 0) return {};
  EvaluatedPhase phase(point, setup);
  const Eigen::VectorXd vdot = phase.accelerations(point.state) + coordinates.response(point.state, constant);
  const SpringForces joints = joint_forces(point);
  const auto numbers = [](const std::vector<double>& x) {
    return Eigen::VectorXd::Map(x.data(), static_cast<Eigen::Index>(x.size()));
  };
  const Eigen::VectorXd force = constant + numbers(joints.force);
  PrescribedMotion given{phase.prescribed(), {vdot.begin(), vdot.end()}};
  for (std::size_t v = 0; v < given.prescribed.size(); ++v) {
    if (point.elsewhere[v]) given.prescribed[v] = 1;  // these trees do not deviate, as in response()
  }
  LoopDynamicsDerivatives d;
  LoopDerivatives(model, setup.closures)
      .evaluate(point.state, {{force.begin(), force.end()}, {}, setup.gravity}, given, 0, d);
  // Both evaluations have the same forces, or something acts that the closed form does not contain.
  const double difference = (numbers(d.motion.vdot) - vdot).norm();
  if (!(difference <= kSameAcceleration * std::max(vdot.norm(), 1e-6))) return {};
  if (!(d.contradiction_of_derivatives <= kContradiction)) return {};

  // (27.4a): positions move along N, and velocities with them, so that loops remain closed.
  const Eigen::MatrixXd& N = coordinates.basis();
  const Eigen::MatrixXd closing = d.closing_dq * N;
  const Eigen::MatrixXd along = closing - N * closing(coordinates.independent(), Eigen::all);
  const Eigen::MatrixXd by_q = d.motion.dq + d.motion.dtau * numbers(joints.dq).asDiagonal();
  const Eigen::MatrixXd by_v = d.motion.dv + d.motion.dtau * numbers(joints.dv).asDiagonal();
  const Eigen::Index m = N.cols();
  Eigen::MatrixXd deviation = Eigen::MatrixXd::Zero(2 * n, 2 * m), accelerations(n, 2 * m);
  deviation.topLeftCorner(n, m) = N, deviation.bottomLeftCorner(n, m) = along;
  deviation.bottomRightCorner(n, m) = N;
  accelerations << by_q * N + by_v * along, by_v * N;
  Derivative rates{Eigen::MatrixXd(2 * m, 2 * m), {}};
  for (Eigen::Index i = 0; i < 2 * m; ++i) {
    Eigen::VectorXd all(2 * n);
    all << coordinates.position_rates(deviation.col(i)), accelerations.col(i);
    rates.value.col(i) = coordinates.independent_of(all);
  }
  if (!rates.value.allFinite()) return {};
  rates.error.setConstant(2 * m, 2 * m, kRounding * rates.value.cwiseAbs().maxCoeff());
  return rates;
}

Derivative rates_by_differences(const OperatingPoint& point, MinimalCoordinates& coordinates, const PhaseSetup& setup,
                                const Eigen::VectorXd& constant) {
  const Eigen::Index n = point.model().velocities();
  EvaluatedPhase phase(point, setup);
  return derivative_of(coordinates, [&](const State& state) {
    Eigen::VectorXd all(2 * n);
    all.head(n) = coordinates.position_rates(coordinates.deviation(state));
    all.tail(n) = phase.accelerations(state) + coordinates.response(state, constant);
    return coordinates.independent_of(all);
  });
}

Plant plant_of(const OperatingPoint& point, MinimalCoordinates& coordinates, const PhaseSetup& setup,
               const Eigen::VectorXd& commands, const std::vector<LinearInput>& inputs) {
  const Model& model = point.model();
  const Eigen::Index n = model.velocities();
  Eigen::VectorXd constant = Eigen::VectorXd::Zero(n);
  for (std::size_t j = 0; j < model.joints().size(); ++j)
    constant[model.joint_body(j).v] += commands[static_cast<Eigen::Index>(j)];
  for (int k = 0; k < 3 && point.has_free_base(); ++k)
    constant[point.base_velocity() + k] += commands[static_cast<Eigen::Index>(model.joints().size()) + k];
  std::optional<Derivative> rates = analytical_rates(point, coordinates, setup, constant);
  if (!rates) rates = rates_by_differences(point, coordinates, setup, constant);
  Plant plant{rates->value, Eigen::MatrixXd::Zero(coordinates.size(), static_cast<Eigen::Index>(inputs.size())),
              rates->error};
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    Eigen::VectorXd all = Eigen::VectorXd::Zero(2 * n);
    all.tail(n) = coordinates.response(point.state, inputs[i].force);
    plant.B.col(static_cast<Eigen::Index>(i)) = coordinates.independent_of(all);
  }
  return plant;
}

}  // namespace grapnel
