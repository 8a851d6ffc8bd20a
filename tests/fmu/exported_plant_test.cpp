/// An exported plant moves as in `grapnel run` of its scenario, for any source of commands.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <thread>

#include "fmu/master.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/control/fmu_instance.hpp"
#include "grapnel/scenario/scenario.hpp"

namespace grapnel::testing {
namespace exported_plant_test {

class ExportedPlant : public ExportFmu {
 protected:
  void SetUp() override {
    ExportFmu::SetUp();
    write("robot.yaml", kShortRobot);
    scenario_ = write("short.yaml", kShortCapture).string();
  }
  CaptureResult built_in(const std::vector<Override>& changes = {}) const {
    return simulate_capture(load_scenario(scenario_, changes));
  }
  std::string scenario_;
};

// The controller `pd` in kShortCapture, computed from the plant's outputs.
struct Pd {
  std::array<double, 2> kp{40, 30}, kd{60, 40};
  std::array<double, 2> operator()(Master& plant) const {
    std::array<double, 2> tau{};
    for (const std::size_t j : {0, 1}) {
      const std::string joint = j == 0 ? "joint.shoulder." : "joint.elbow.";
      tau[j] = kp[j] * (plant.get(joint + "desired_position") - plant.get(joint + "position")) +
               kd[j] * (plant.get(joint + "desired_rate") - plant.get(joint + "rate"));
    }
    return tau;
  }
};

void command(Master& plant, const std::array<double, 2>& tau) {
  EXPECT_EQ(plant.set("joint.shoulder.effort", tau[0]), fmi::kOk);
  EXPECT_EQ(plant.set("joint.elbow.effort", tau[1]), fmi::kOk);
}

// Simulates to the end, with commands computed from current readings, or from readings one sample older.
void simulate(Master& plant, bool late, double start = 0) {
  std::array<double, 2> before{};
  for (int k = 0; !plant.terminates && k < 350; ++k) {
    const std::array<double, 2> now = Pd()(plant);
    command(plant, late ? before : now);
    before = now;
    ASSERT_EQ(plant.step(start + k * 0.01, 0.01), fmi::kOk) << plant.last_message;
  }
}

std::ptrdiff_t thread_count() {
  const std::filesystem::directory_iterator tasks("/proc/self/task");
  return std::distance(begin(tasks), end(tasks));
}

double apart(Master& plant, const PhaseEnd& end) {
  double most = 0;
  const auto compare = [&](double a, double b) { most = std::max(most, std::abs(a - b)); };
  for (const std::size_t j : {0, 1}) {
    const std::string joint = j == 0 ? "joint.shoulder." : "joint.elbow.";
    compare(plant.get(joint + "position"), end.joints.position[j]);
    compare(plant.get(joint + "rate"), end.joints.velocity[j]);
  }
  const std::vector<double> p = plant.get_list("base.position", 3), v = plant.get_list("base.velocity", 3),
                            t = plant.get_list("target.debris.position", 3);
  for (std::size_t k = 0; k < 3; ++k) {
    compare(p[k], end.base.position[static_cast<int>(k)]);
    compare(v[k], end.base.velocity[static_cast<int>(k)]);
    compare(t[k], end.targets[0].position[static_cast<int>(k)]);
  }
  return most;
}

// A master that reads outputs, computes commands and then steps has no delay: the motion equals that with the built-in
// controller. With commands one sample late, it equals that with the built-in controller and this delay.
TEST_F(ExportedPlant, MatchesBuiltInLaw) {
  const CaptureResult at_once = built_in(), late = built_in({{"control.delay", "0.01"}});
  ASSERT_TRUE(at_once.post_impact_end && late.post_impact_end);
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version));
    ASSERT_TRUE(plant.instantiate()) << plant.last_message;
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.last_message;
    simulate(plant, false);
    const double same = apart(plant, *at_once.post_impact_end), not_same = apart(plant, *late.post_impact_end);
    ASSERT_EQ(plant.plain("Reset"), fmi::kOk);
    plant.terminates = false;
    ASSERT_EQ(plant.initialize(100), fmi::kOk) << plant.last_message;  // any start time of the master
    simulate(plant, true, 100);
    const double same_late = apart(plant, *late.post_impact_end);
    std::printf(
        "[ measured ] FMI %d against the built-in law: %.3g; both a sample late: %.3g; one of them late: %.3g\n",
        version, same, same_late, not_same);
    EXPECT_EQ(same, 0);           // measured 0
    EXPECT_LT(same_late, 1e-12);  // measured 0
    EXPECT_GT(not_same, 1e-5);
  }
}

TEST_F(ExportedPlant, ReportsOutcomeOfCapture) {
  const CaptureResult reference = built_in();
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version));
    ASSERT_TRUE(plant.instantiate()) << plant.last_message;
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.last_message;
    EXPECT_EQ(plant.get("joint.shoulder.position"), 0.6);  // known after initialization
    EXPECT_EQ(plant.get_whole("phase"), 0);
    EXPECT_EQ(plant.get_whole("piece"), 0);
    EXPECT_FALSE(plant.get_flag("target.debris.held"));
    int k = 0;
    const auto on = [&](int until) {
      for (; k < until; ++k) {
        command(plant, Pd()(plant));
        ASSERT_EQ(plant.step(k * 0.01, 0.01), fmi::kOk) << plant.last_message;
      }
    };
    on(199);
    EXPECT_EQ(plant.get_whole("phase"), 0);
    EXPECT_FALSE(plant.get_flag("target.debris.held"));
    on(200);  // the grasp closes at the end of the approach
    EXPECT_EQ(plant.get_whole("phase"), 1);
    EXPECT_EQ(plant.get_whole("piece"), 1);
    EXPECT_TRUE(plant.get_flag("target.debris.held"));
    EXPECT_FALSE(plant.get_flag("end.ended"));
    EXPECT_EQ(plant.get("end.capture_time"), 0);
    on(349);
    EXPECT_FALSE(plant.terminates);
    on(350);
    EXPECT_EQ(plant.terminates, version == 3);  // 2.0 reports it only after the next step
    EXPECT_EQ(plant.get_whole("phase"), 2);
    for (const char* flag : {"end.ended", "end.completed", "end.conserved", "end.captured[1]", "target.debris.held"})
      EXPECT_TRUE(plant.get_flag(flag)) << flag;
    EXPECT_FALSE(plant.get_flag("end.feasible"));  // no body has a shape
    EXPECT_EQ(plant.get("end.capture_time"), 2);
    EXPECT_EQ(plant.get("end.impact_energy_lost"),
              reference.impact()->kinetic_energy_before - reference.impact()->kinetic_energy_after);
    EXPECT_GT(plant.get("end.impact_energy_lost"), 0.01);
    EXPECT_LT(plant.get("end.angular_momentum_drift"), 1e-11);  // measured 6e-16
    EXPECT_GT(plant.get("end.work_energy_residual"), 0);
    // Later steps are rejected.
    EXPECT_EQ(plant.step(3.5, 0.01), fmi::kDiscard);
    EXPECT_NE(plant.last_message.find("the run has ended at t = 3.5"), std::string::npos) << plant.last_message;
    EXPECT_TRUE(plant.terminates);
    EXPECT_NEAR(plant.reached, 3.5, 1e-12);
    EXPECT_EQ(plant.plain("Terminate"), fmi::kOk);
    EXPECT_EQ(plant.get("end.capture_time"), 2);  // still available
  }
}

// A step over several control periods holds the commands; the run's end may lie within a step.
TEST_F(ExportedPlant, StepsOverSeveralSamples) {
  Master plant(exported(scenario_, 2)), fine(exported(scenario_, 3));
  for (Master* one : {&plant, &fine}) {
    ASSERT_TRUE(one->instantiate()) << one->last_message;
    ASSERT_EQ(one->initialize(), fmi::kOk) << one->last_message;
    command(*one, {1.5, -0.5});
  }
  for (int k = 0; k < 3; ++k) ASSERT_EQ(plant.step(k * 1.0, 1.0), fmi::kOk) << plant.last_message;
  for (int k = 0; k < 300; ++k) ASSERT_EQ(fine.step(k * 0.01, 0.01), fmi::kOk) << fine.last_message;
  for (const char* name : {"joint.shoulder.position", "joint.elbow.rate", "base.position[1]"})
    EXPECT_EQ(plant.get(name), fine.get(name)) << name;
  EXPECT_EQ(plant.step(3, 1), fmi::kDiscard);
  EXPECT_NE(plant.last_message.find("the run ended within the step, at t = 3.5"), std::string::npos)
      << plant.last_message;
  EXPECT_TRUE(plant.terminates);
  EXPECT_NEAR(plant.reached, 3.5, 1e-12);
  EXPECT_TRUE(plant.get_flag("end.completed"));
}

// A parameter has the same effect as --set.
TEST_F(ExportedPlant, TakesParameters) {
  const CaptureResult heavy = built_in({{"targets[0].mass", "25"}, {"initial.joints[1]", "-1.1"}});
  for (const int version : {2, 3}) {
    Master plant(exported(scenario_, version));
    EXPECT_EQ(plant.variables().count("initial.joints[1]"), 1u);
    ASSERT_TRUE(plant.instantiate()) << plant.last_message;
    EXPECT_EQ(plant.get("targets[0].mass"), 10);
    EXPECT_EQ(plant.set("targets[0].mass", 25), fmi::kOk);
    ASSERT_EQ(plant.enter(), fmi::kOk) << plant.last_message;
    EXPECT_EQ(plant.get("joint.elbow.position"), -1.2);
    EXPECT_EQ(plant.set("initial.joints[1]", -1.1), fmi::kOk);
    EXPECT_EQ(plant.get("joint.elbow.position"), -1.1);
    ASSERT_EQ(plant.plain("ExitInitializationMode"), fmi::kOk) << plant.last_message;
    simulate(plant, false);
    EXPECT_EQ(apart(plant, *heavy.post_impact_end), 0);
    EXPECT_EQ(plant.plain("Reset"), fmi::kOk);
    EXPECT_EQ(plant.get("targets[0].mass"), 10);
  }
}

// Instances are independent, whether they run alternately or concurrently. Freeing an instance during its run ends the
// run and its thread.
TEST_F(ExportedPlant, SeveralInstances) {
  const CaptureResult reference = built_in();
  const std::filesystem::path file = exported(scenario_, 3);
  Master first(file), second(file);
  for (Master* one : {&first, &second}) {
    ASSERT_TRUE(one->instantiate()) << one->last_message;
    ASSERT_EQ(one->initialize(), fmi::kOk) << one->last_message;
  }
  for (int k = 0; k < 120; ++k) {
    command(first, Pd()(first));
    ASSERT_EQ(first.step(k * 0.01, 0.01), fmi::kOk);
    command(second, {1, 1});
    ASSERT_EQ(second.step(k * 0.01, 0.01), fmi::kOk);
  }
  // Ends its own thread only.
  const std::ptrdiff_t before = thread_count();
  second.free();
  EXPECT_EQ(thread_count(), before - 1);
  for (int k = 120; k < 350; ++k) {
    command(first, Pd()(first));
    ASSERT_EQ(first.step(k * 0.01, 0.01), fmi::kOk);
  }
  EXPECT_EQ(apart(first, *reference.post_impact_end), 0);
  std::vector<double> distances(3, NAN);
  std::vector<std::thread> threads;
  for (double& distance : distances) {
    threads.emplace_back([&] {
      Master own(file);
      if (!own.instantiate() || own.initialize() != fmi::kOk) return;
      simulate(own, false);
      distance = apart(own, *reference.post_impact_end);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const double distance : distances) EXPECT_EQ(distance, 0);
}

// Grapnel's reader of FMUs accepts it.
TEST_F(ExportedPlant, ReadableByOwnImport) {
  for (const int version : {2, 3}) {
    const auto fmu = std::make_shared<const fmi::Fmu>(exported(scenario_, version), "plant.fmu");
    EXPECT_EQ(fmu->model().version, version);
    EXPECT_EQ(fmu->model().name, "short <capture> & \"more\"");
    fmi::FmuInstance instance(fmu);
    instance.begin_initialization(0);
    instance.end_initialization();
    instance.step(0, 0.01);
    EXPECT_THROW(instance.step(0.01, 0.015), fmi::FmuError);
  }
}

// ---- The base's actuators ----

// Two wheels and a thruster on a base with one joint; no capture.
constexpr const char* kActuated = R"(schema: grapnel-scenario/1
name: actuators
robot:
  schema: grapnel-robot/1
  name: actuated
  base: {name: base, mass: 100, inertia: [20, 20, 20]}
  wheels:
    - {name: z, axis: [0, 0, 1], inertia: 0.1, torque: 0.5, rate: 20}
    - {name: x, axis: [1, 0, 0], inertia: 0.1, torque: 0.5, rate: 100}
  thrusters:
    - {name: push, position: [-0.5, 0, 0], direction: [1, 0, 0], force: 2, specific_impulse: 200, min_on_time: 35 ms}
  links:
    - {name: arm, parent: base, joint: {name: joint, type: revolute, axis: [1, 0, 0]}, mass: 1, inertia: [1, 1, 1]}
  end_effectors: [{name: tip, link: arm, envelope: {position: 0.1}}]
initial: {joints: [0]}
targets: [{name: far, mass: 1, inertia: [1, 1, 1], state: {at: start, position: [50, 0, 0]}, grasp_points: [{name: g}]}]
grasps: [{end_effector: tip, target: far, point: g}]
approach: {duration: 20, final_joints: [0], tracking: {mode: pd, kp: 10, kd: 10}}
impact: {}
control: {period: 10 ms}
)";

TEST_F(ExportedPlant, CommandsEachWheelAndThruster) {
  const std::string scenario = write("actuated.yaml", kActuated).string();
  for (const int version : {2, 3}) {
    Master plant(exported(scenario, version));
    ASSERT_TRUE(plant.instantiate()) << plant.last_message;
    ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.last_message;
    int k = 0;
    const auto on = [&](int steps) {
      for (const int end = k + steps; k < end; ++k)
        ASSERT_EQ(plant.step(k * 0.01, 0.01), fmi::kOk) << plant.last_message;
    };
    // The wheel's motor torque reacts on the base: base and joint counter-rotate, (20 + 1) w + 0.1 W = 0.
    ASSERT_EQ(plant.set("wheel.z.torque", 0.3), fmi::kOk);
    on(200);
    const double W = plant.get("wheel.z.rate"), w = plant.get_list("base.angular_velocity", 3)[2];
    EXPECT_NEAR(0.1 * (W + w) + 20.9 * w, 0, 1e-12);  // measured 1e-16; the wheel's inertia is part of the base's 20
    EXPECT_NEAR(0.1 * (W + w), 0.3 * 2, 1e-9);
    EXPECT_NEAR(plant.get("wheel.x.rate"), 0, 1e-15);  // measured 3e-18
    // Saturation at the motor's limit: the command is twice the maximum torque.
    ASSERT_EQ(plant.set("wheel.z.torque", 0), fmi::kOk);
    ASSERT_EQ(plant.set("wheel.x.torque", 1), fmi::kOk);
    on(100);
    EXPECT_NEAR(0.1 * (plant.get("wheel.x.rate") + plant.get("base.angular_velocity[1]")), 0.5, 2e-3);
    ASSERT_EQ(plant.set("wheel.x.torque", 0), fmi::kOk);
    // A wheel at its maximum rate remains at that rate.
    ASSERT_EQ(plant.set("wheel.z.torque", 0.5), fmi::kOk);
    on(400);
    EXPECT_NEAR(plant.get("wheel.z.rate"), 20, 1e-9);
    ASSERT_EQ(plant.set("wheel.z.torque", -0.5), fmi::kOk);
    on(100);
    EXPECT_LT(plant.get("wheel.z.rate"), 16);
    ASSERT_EQ(plant.set("wheel.z.torque", 0), fmi::kOk);
    // A valve opens for the commanded time, but at least for its minimum time: 0.5 s, then 35 ms instead of 10 ms.
    const auto speed = [&] {
      const std::vector<double> v = plant.get_list("base.velocity", 3);
      return std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    };
    EXPECT_LT(speed(), 1e-12);
    ASSERT_EQ(plant.set_flag("thruster.push.on", true), fmi::kOk);
    on(50);
    ASSERT_EQ(plant.set_flag("thruster.push.on", false), fmi::kOk);
    on(10);
    const double first = speed();
    EXPECT_NEAR(first, 2 * 0.5 / 101, 2e-4);  // the base turns slightly during this time
    ASSERT_EQ(plant.set_flag("thruster.push.on", true), fmi::kOk);
    on(1);
    ASSERT_EQ(plant.set_flag("thruster.push.on", false), fmi::kOk);
    on(10);
    EXPECT_NEAR(speed() - first, 2 * 0.035 / 101, 1e-5);
    on(2000 - k);
    EXPECT_TRUE(plant.get_flag("end.completed"));
    EXPECT_TRUE(plant.get_flag("end.conserved"));
    EXPECT_FALSE(plant.get_flag("end.captured[1]"));
  }
}

// With --base-torque the base's torque is commanded, and the wheels produce it.
TEST_F(ExportedPlant, CommandsBaseTorque) {
  const std::string scenario = write("actuated.yaml", kActuated).string();
  Master plant(exported(scenario, 2,
                        "--base-torque --set 'robot.wheels=[{name: z, axis: [0, 0, 1], inertia: 0.1}, "
                        "{name: x, axis: [1, 0, 0], inertia: 0.1}, {name: y, axis: [0, 1, 0], inertia: 0.1}]'"));
  EXPECT_EQ(plant.variables().count("wheel.z.torque"), 0u);
  EXPECT_EQ(plant.variables().count("thruster.push.on"), 0u);
  ASSERT_TRUE(plant.instantiate()) << plant.last_message;
  ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.last_message;
  ASSERT_EQ(plant.set("base.torque[3]", 0.3), fmi::kOk);
  for (int k = 0; k < 100; ++k) ASSERT_EQ(plant.step(k * 0.01, 0.01), fmi::kOk) << plant.last_message;
  const double W = plant.get("wheel.z.rate"), w = plant.get("base.angular_velocity[3]");
  EXPECT_NEAR(20.9 * w, 0.3, 1e-9);
  EXPECT_NEAR(0.1 * (W + w), -0.3, 1e-9);
}

// Compliant grasps: no samples are taken during the impact; outputs remain constant until the next sample.
TEST_F(ExportedPlant, WaitsDuringCompliantImpact) {
  const std::string compliant =
      "--set 'impact={law: compliant, grasp: {linear_stiffness: 1000, linear_damping: 20, angular_stiffness: 100, "
      "angular_damping: 2}}'";
  Master plant(exported(scenario_, 3, compliant));
  ASSERT_TRUE(plant.instantiate()) << plant.last_message;
  ASSERT_EQ(plant.initialize(), fmi::kOk) << plant.last_message;
  int waited = 0;
  double before = NAN;
  for (int k = 0; k < 350 && !plant.terminates; ++k) {
    command(plant, Pd()(plant));
    ASSERT_EQ(plant.step(k * 0.01, 0.01), fmi::kOk) << plant.last_message;
    const double position = plant.get("joint.shoulder.position");
    if (position == before) ++waited;
    before = position;
  }
  std::printf("[ measured ] the impact took %d samples\n", waited);
  EXPECT_GT(waited, 0);
}

}  // namespace exported_plant_test
}  // namespace grapnel::testing
