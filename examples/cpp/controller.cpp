// A controller of the program: after the capture it holds the joints by computed torques, and damps the rotation of the
// base.
#include <Eigen/LU>
#include <algorithm>
#include <iostream>

#include "grapnel/api/capture.hpp"
#include "grapnel/api/controller.hpp"
#include "grapnel/api/scenario.hpp"

namespace {

using grapnel::ControllerInput, grapnel::ControllerModel, grapnel::ControllerOutput;

// Its state: the largest effort so far.
class HoldPosture {
 public:
  void operator()(const ControllerInput& in, const ControllerModel& model, ControllerOutput& out) {
    const Eigen::Map<const Eigen::VectorXd> position(in.position, in.joints), rate(in.rate, in.joints),
        desired(in.desired_position, in.joints);
    const Eigen::VectorXd acceleration = 1.0 * (desired - position) - 2.0 * rate;
    // The base reacts: the inertia of the joints on a free-floating base.
    const Eigen::MatrixXd M = model.mass_matrix();
    const Eigen::MatrixXd I_bm = M.topRightCorner(6, M.cols() - 6);
    const Eigen::MatrixXd I = M.bottomRightCorner(M.cols() - 6, M.cols() - 6) -
                              I_bm.transpose() * Eigen::MatrixXd(M.topLeftCorner(6, 6)).inverse() * I_bm;
    Eigen::Map<Eigen::VectorXd>(out.effort, in.joints) = I.topLeftCorner(in.joints, in.joints) * acceleration;
    for (int k = 0; k < 3; ++k) out.base_torque[k] = -100 * in.base_angular_velocity[k];
    largest_ = std::max(largest_, Eigen::Map<Eigen::VectorXd>(out.effort, in.joints).cwiseAbs().maxCoeff());
    if (largest_ > 1000) throw std::runtime_error("the efforts are implausible");  // ends the run with this message
  }

 private:
  double largest_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "usage: controller SCENARIO.yaml\n", 2;
  try {
    grapnel::CaptureProblem problem = grapnel::load_scenario(argv[1]);
    set_controller(
        problem, [] { return HoldPosture(); }, "hold posture");
    problem.control->base_torque = true;
    problem.control->timing = {0.01, 0.01};  // period and delay [s]
    for (grapnel::PostImpactSetup& phase : problem.post_impact)
      phase.joints = grapnel::PostImpactSetup::Joints::controller;

    const grapnel::CaptureResult result = grapnel::simulate_capture(problem);
    if (result.status != grapnel::CaptureStatus::completed) return std::cerr << result.failure << '\n', 1;
    double largest = 0;
    for (const double rate : result.post_impact_end->joints.velocity) largest = std::max(largest, std::abs(rate));
    std::cout << "controller: " << result.control->plugin << '\n'
              << "largest joint rate at the end: " << largest << " rad/s\n"
              << "rotation of the base at the end: " << norm(result.post_impact_end->base.angular_velocity)
              << " rad/s\n"
              << "ledger: " << (result.ledger.pass() ? "pass" : "FAIL") << '\n';
    return result.ledger.pass() && largest < 1e-3 ? 0 : 1;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
