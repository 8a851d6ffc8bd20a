// Mass properties of a captured target from noisy rates while the arm moves it; the momentum is unknown except for the
// impulse of the attitude control. Fails if an estimate deviates by more than three standard deviations, or by more
// than a millionth without noise.
#include <cmath>
#include <cstdio>
#include <iostream>

#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/identify/identify_target.hpp"
#include "grapnel/identify/rate_noise.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace {

// Sensor readings twice per second in one segment of the run.
std::vector<grapnel::MotionSample> simulate(const grapnel::MotionTask& task) {
  std::vector<grapnel::MotionSample> samples;
  grapnel::PhaseDynamics dynamics(*task.model, *task.setup);
  const auto record = [&](const grapnel::PhaseSample& sample) {
    const grapnel::Momentumd& impulse = sample.integrals.external_impulse;
    samples.push_back({sample.state, {impulse.angular, impulse.linear}});
  };
  grapnel::simulate_phase(dynamics, {task.start, task.begin, task.end, 0.5}, task.integration, {.observe = record});
  return samples;
}

// Prints the estimate; false: it deviates from the target's properties.
bool compare(const grapnel::IdentificationTask& task, const grapnel::TargetSetup& target) {
  const grapnel::Symmetric3d& I = target.inertia;
  const grapnel::InertialParameters truth{target.mass, target.com[0], target.com[1], target.com[2], I.xx,
                                          I.yy,        I.zz,          I.xy,          I.xz,          I.yz};
  const grapnel::IdentifiedBody found = identify_target(task);
  std::printf("rank %d of 10, condition %.3g, residual %.3g\n", found.rank, found.condition, found.residual);
  for (const grapnel::UnseenChange& unseen : found.unseen) std::cout << "not seen: " << unseen_text(unseen) << '\n';
  bool fits = found.converged && found.all_determined() && found.impossible.empty();
  for (int i = 0; i < grapnel::kInertialParameters; ++i) {
    const double value = found.value[i].value_or(NAN), deviation = found.deviation[i].value_or(0);
    std::printf("%-11s %14.6f +- %-10.2g true %14.6f\n", grapnel::inertial_parameter_name(i).data(), value, deviation,
                truth[i]);
    const double size = i == 0 ? target.mass : i < 4 ? std::sqrt((I.xx + I.yy + I.zz) / target.mass) : I.zz;
    fits = fits && std::abs(value - truth[i]) <= (deviation > 0 ? 3 * deviation : 1e-6 * size);
  }
  return fits;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) return std::cerr << "usage: identify_target SCENARIO.yaml\n", 2;
  try {
    grapnel::CaptureProblem problem = grapnel::load_scenario(argv[1]);
    // The arm moves after the capture: without motion, and with unknown momentum, only ratios are identifiable.
    if (!problem.post_impact || problem.targets.empty() || problem.joint_position.size() != 7) {
      std::cerr << "a scenario of one seven-joint arm with post_impact is needed\n";
      return 2;
    }
    grapnel::PostImpactSetup& after = *problem.post_impact;
    after.joints = grapnel::PostImpactSetup::Joints::computed_torque;
    after.kp.assign(7, 0.09), after.kd.assign(7, 0.6);
    after.duration = 120;
    after.move.emplace();
    after.move->duration = 100;
    after.move->joints = {0.8, 0.5, -0.9, 2, -0.9, 0.4, 0.5};

    grapnel::CaptureSteps steps(problem, grapnel::CaptureDetail::columns);
    bool fits = false;
    while (const grapnel::MotionTask* task = steps.next()) {
      if (task->phase != "post_impact") continue;
      const grapnel::Model& model = *task->model;
      const int frame = model.frame_index("target:" + problem.targets[0].name);
      grapnel::IdentificationTask exact{model, frame, simulate(*task)}, noisy = exact;
      noisy.noise = {1e-6, 1e-6, 1e-6};
      const int root = model.bodies()[model.frames()[frame].body].root;
      const std::vector<double> deviations = rate_deviations(model, root, noisy.noise);
      for (std::size_t i = 0; i < noisy.samples.size(); ++i)
        noisy.samples[i].state = with_rate_noise(noisy.samples[i].state, deviations, 1, static_cast<std::uint32_t>(i));
      std::cout << "without noise: ";
      fits = compare(exact, problem.targets[0]);
      std::cout << "with noise: ";
      fits = compare(noisy, problem.targets[0]) && fits;
    }
    return fits ? 0 : 1;
  } catch (const std::exception& error) {
    return std::cerr << error.what() << '\n', 2;
  }
}
