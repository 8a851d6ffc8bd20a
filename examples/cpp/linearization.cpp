// A linear model of a free-floating robot at the initial state of a scenario, its poles under feedback of the joints,
// and a comparison with the nonlinear dynamics.
#include <Eigen/Eigenvalues>
#include <iostream>

#include "grapnel/api/linearization.hpp"
#include "grapnel/api/scenario.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "usage: linearization SCENARIO.yaml\n", 2;
  try {
    const auto [model, state, base, joints, end_effectors] = servicer_of(grapnel::load_scenario(argv[1]));
    const grapnel::Linearization linear = linearize(model, state);
    const int n = model.velocities(), m = static_cast<int>(joints.size());
    std::cout << "x has " << 2 * n << " components, u has " << n << '\n';

    // Torques -kp dq - kd dq' at every joint.
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(n, 2 * n);
    for (const int joint : joints) {
      const int v = model.bodies()[joint].v;
      K(v, v) = 20, K(v, n + v) = 60;
    }
    const Eigen::VectorXcd poles = (linear.A - linear.B * K).eigenvalues();
    int stable = 0;
    for (const std::complex<double>& pole : poles) stable += pole.real() < -1e-6 ? 1 : 0;
    // The base floats: its displacement and, with the momentum, its velocity remain.
    std::cout << stable << " of " << 2 * n << " poles are stable, " << 2 * m << " belong to the joints\n"
              << "fastest pole: " << poles.real().minCoeff() << " 1/s\n";

    // The response to a torque on the first joint, by the linear model and by the dynamics.
    grapnel::Forces forces;
    forces.generalized.assign(n, 0.0);
    forces.generalized[model.bodies()[joints[0]].v] = 1e-3;
    const std::vector<double> vdot = forward_dynamics(model, state, forces);
    const Eigen::VectorXd predicted = linear.B.bottomRows(n).col(model.bodies()[joints[0]].v) * 1e-3;
    double error = 0;
    for (int i = 0; i < n; ++i) error = std::max(error, std::abs(vdot[i] - linear.vdot[i] - predicted[i]));
    std::cout << "the prediction agrees: " << (error < 1e-12 ? "yes" : "no") << '\n';
    return stable == 2 * m && error < 1e-12 ? 0 : 1;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
