/// FMUs as controllers of captures, from scenario files.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/control/fmu_controller.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace fmu_controller_test {

constexpr const char* kInputs =
    "{'goal[1]': 'desired_position[1]', 'goal[2]': arm-1-joint-2.desired_position, 'goal[3]': 'desired_position[3]', "
    "'goal[4]': 'desired_position[4]', 'goal[5]': 'desired_position[5]', 'goal[6]': arm-2-joint-3.desired_position}";
constexpr const char* kGains = "kp: 20, kd: 60, base_kd: 100";

std::string fmu_file(const std::string& name) { return GRAPNEL_TEST_FMUS "/" + name + ".fmu"; }

CaptureProblem with(const std::string& control) {
  return load_scenario(GRAPNEL_OWN_SCENARIO,
                       std::vector<Override>{{"control", "{period: 0.01, base_torque: true, " + control + "}"},
                                             {"post_impact.duration", "3"}});
}
CaptureProblem with_fmu(const std::string& name, const std::string& parameters = kGains,
                        const std::string& inputs = kInputs) {
  return with("fmu: " + fmu_file(name) + ", inputs: " + inputs + ", parameters: {" + parameters + "}");
}

std::string fault_of(const std::string& name, const std::string& parameters = kGains,
                     const std::string& inputs = kInputs) {
  try {
    with_fmu(name, parameters, inputs);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

void expect_has(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << text;
}

double apart(const CaptureResult& a, const CaptureResult& b) {
  double most = 0;
  for (std::size_t j = 0; j < 6; ++j) {
    most = std::max({most, std::abs(a.post_impact_end->joints.position[j] - b.post_impact_end->joints.position[j]),
                     std::abs(a.post_impact_end->joints.velocity[j] - b.post_impact_end->joints.velocity[j])});
  }
  return most;
}

// The FMU's outputs use inputs that are one sample old. They equal those of the same controller in C with a delay of
// one sample, up to rounding of the output times.
TEST(FmuController, SameLawWithOneSampleDelay) {
  const CaptureResult in_c =
      simulate_capture(with(std::string("delay: 0.01, plugin: ") + GRAPNEL_OWN_PD + ", parameters: {" + kGains + "}"));
  ASSERT_TRUE(in_c.post_impact_end) << in_c.failure;
  const CaptureResult at_once =
      simulate_capture(with(std::string("plugin: ") + GRAPNEL_OWN_PD + ", parameters: {" + kGains + "}"));
  std::vector<CaptureResult> results;
  for (const char* name : {"fmu_2", "fmu_3"}) {
    const CaptureResult result = results.emplace_back(simulate_capture(with_fmu(name)));
    ASSERT_TRUE(result.post_impact_end) << name << ": " << result.failure;
    EXPECT_TRUE(result.ledger.pass());
    EXPECT_EQ(result.control->plugin, fmu_file(name));
    EXPECT_EQ(result.control->plugin_sha256.size(), 64u);
    std::printf("[ measured ] %s against the law in C, a sample late: %.3g; in the same sample: %.3g\n", name,
                apart(result, in_c), apart(result, at_once));
    EXPECT_LT(apart(result, in_c), 1e-10);
    EXPECT_GT(apart(result, at_once), 1e-7);
  }
  EXPECT_EQ(apart(results[0], results[1]), 0);  // both versions, bit for bit
}

// Inputs other than signals: of every type, constants or start values. The FMU adds a gain if its switch is on, its
// count is 3 and its name is "fine".
TEST(FmuController, InputsOtherThanSignals) {
  SKIP_UNDER_SANITIZERS();
  const auto inputs = [](const std::string& more) {
    return std::string(kInputs).substr(0, std::string(kInputs).size() - 1) + more + "}";
  };
  for (const char* name : {"fmu_inputs_2", "fmu_inputs_3"}) {
    // Unset inputs of other types are accepted; an unset real input is an error.
    expect_has(fault_of(name), "its input 'unused' is without a value");
    EXPECT_EQ(fault_of(name, kGains, inputs(", unused: start")), "");
    EXPECT_EQ(fault_of(name, kGains, inputs(", unused: null")), "");
    const CaptureResult plain = simulate_capture(with_fmu(name, kGains, inputs(", unused: start")));
    const CaptureResult same =
        simulate_capture(with_fmu(name, kGains, inputs(", unused: 7.5, switched: true, counted: 3, called: fine")));
    ASSERT_TRUE(plain.post_impact_end && same.post_impact_end) << plain.failure << same.failure;
    EXPECT_EQ(apart(plain, same), 0);
    const CaptureResult refused =
        simulate_capture(with_fmu(name, kGains + std::string(", does: checks"), inputs(", unused: 7.5")));
    expect_has(refused.failure, "its inputs are not as they should be");
    const CaptureResult taken =
        simulate_capture(with_fmu(name, kGains + std::string(", does: checks"),
                                  inputs(", unused: 7.5, switched: true, counted: 3, called: fine")));
    EXPECT_EQ(taken.failure, "");
    expect_has(fault_of(name, kGains, inputs(", unused: start, counted: 1.5")), "which 1.5 is not");
    expect_has(fault_of(name, kGains, inputs(", unused: start, counted: 'time'")), "expected a ");
    expect_has(fault_of(name, kGains, inputs(", unused: 'text'")), "'text' is not a signal");
  }
}

// A controller in C whose first effort is one value of a signal, a sample late.
std::size_t t_signal = 0, t_index = 0;
double t_before = 0;
class PassingSource final : public ControllerSource {
  struct Functions {
    static int create(const grapnel_controller_setup*, void** instance, char*, std::size_t) {
      *instance = nullptr;
      t_before = 0;
      return 0;
    }
    static int update(void*, const grapnel_controller_input* in, const grapnel_controller_access*,
                      grapnel_controller_output* out) {
      out->effort[0] = std::exchange(t_before, input_signals.at(t_signal).value(*in, t_index));
      return 0;
    }
    static void destroy(void*) {}
  };
  static constexpr grapnel_controller_plugin kFunctions = {sizeof(grapnel_controller_plugin),
                                                           GRAPNEL_CONTROLLER_VERSION,
                                                           Functions::create,
                                                           nullptr,
                                                           Functions::update,
                                                           nullptr,
                                                           nullptr,
                                                           Functions::destroy,
                                                           nullptr};

 public:
  std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters, ControlledRobot robot,
                                   const Model& model) const override {
    return std::make_shared<PluginController>(std::make_shared<const ControllerPlugin>(kFunctions, "it"), timing,
                                              parameters, std::move(robot), model);
  }
};

// Signals of sensors and targets, by both forms of their names, have the values that a controller in C receives.
TEST(FmuController, ReceivesTheSignalsOfTheCInterface) {
  constexpr const char* kSensors =
      "{force_torque: [{end_effector: tip-1, force_bias: [0.3, 0.2, 0.1]}], relative_pose: [{target: debris, "
      "position_noise: 0.01}]}";
  const auto problem = [&](const std::string& control) {
    return load_scenario(GRAPNEL_OWN_SCENARIO, std::vector<Override>{{"control", "{period: 0.01, " + control + "}"},
                                                                     {"sensors", kSensors},
                                                                     {"post_impact.duration", "1"}});
  };
  const auto fmu = [&](const std::string& signal) {
    return "fmu: " + fmu_file("fmu_inputs_3") + ", parameters: {does: passes, kp: 0, kd: 0}, inputs: " +
           std::string(kInputs).substr(0, std::string(kInputs).size() - 1) + ", unused: '" + signal + "'}";
  };
  struct Case {
    const char *name, *signal;
    std::size_t index;
  };
  for (const Case& one : {Case{"debris.target_pose[2]", "target_pose", 1}, Case{"target_pose[1,4]", "target_pose", 3},
                          Case{"target_motion[1,6]", "target_motion", 5}, Case{"wrench[1,2]", "wrench", 1},
                          Case{"debris.target_held", "target_held", 0}, Case{"piece", "piece", 0}}) {
    t_signal = input_signal(one.signal), t_index = one.index;
    CaptureProblem in_c = problem("external: true");
    in_c.control->source = std::make_shared<const PassingSource>();
    const CaptureResult expected = simulate_capture(in_c), result = simulate_capture(problem(fmu(one.name)));
    ASSERT_TRUE(expected.post_impact_end && result.post_impact_end) << expected.failure << result.failure;
    EXPECT_LT(apart(result, expected), 1e-10) << one.name;
    EXPECT_GT(std::abs(result.post_impact_end->joints.velocity[0]), 1e-6) << one.name;
  }
  const auto rejected = [&](const std::string& signal, const std::string& more) {
    try {
      load_scenario(GRAPNEL_OWN_SCENARIO,
                    std::vector<Override>{{"control", "{period: 0.01, " + more + fmu(signal) + "}"}});
      return std::string();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
  };
  expect_has(rejected("target_pose[1,1]", ""),
             "its input target_pose of target 'debris' is not measured; add the sensor to sensors.relative_pose");
  expect_has(rejected("tip-2.wrench[1]", ""), "its input wrench of end-effector 'tip-2' is not measured");
  expect_has(rejected("piece", "base_actuators: true, "), "the robot has no wheels, gyros or thrusters");
}

// Each actuator's command must be an output.
TEST(FmuController, CommandsActuators) {
  const fmi::FmuControllers controllers(fmu_file("fmu_2"), "it.fmu", "{}", R"({"effort[6]": "wheel_torque[2]"})");
  ControlledRobot robot;
  robot.joints = {"arm-1-joint-1", "arm-1-joint-2", "arm-1-joint-3", "arm-2-joint-1", "arm-2-joint-2"};
  robot.joints.push_back("arm-2-joint-3");
  robot.wheels = {{"x", "wheel:x"}, {"y", "wheel:y"}};
  robot.thrusters = {"jet"};
  robot.commands_actuators = true;
  std::string all;
  for (const fmi::FmuMisfit& misfit : controllers.misfits(robot, "{}", 0.01)) all += misfit.text + "\n";
  expect_has(all, "none of its outputs is wheel_torque[1], of wheel 'x'");
  expect_has(all, "none of its outputs is thruster[1], of thruster 'jet'");
  expect_has(all, "none of its outputs is effort[6], of joint 'arm-2-joint-3'");
  EXPECT_EQ(all.find("wheel_torque[2]"), std::string::npos) << all;
}

TEST(FmuController, EndsWithFmuMessage) {
  const auto failure = [](const char* name, const std::string& parameters) {
    const CaptureResult result = simulate_capture(with_fmu(name, parameters));
    EXPECT_TRUE(result.approach_end);  // earlier phases are recorded
    return result.failure;
  };
  for (const std::string version : {"2", "3"}) {
    const std::string name = "fmu_" + version;
    expect_has(failure(name.c_str(), "does: fails"), "at t = 20.01 s update() of the FMU '" + fmu_file(name) +
                                                         "' failed: fmi" + version +
                                                         "DoStep() returned error: the sun is out");
    expect_has(failure(name.c_str(), "does: discards"), "DoStep() returned discard");
    expect_has(failure(name.c_str(), "does: refuses, on: true, count: 7"), "refused, as it was asked to");
    expect_has(failure(name.c_str(), "does: nan"),
               "returns an effort of nan at joint 'arm-2-joint-1', which is not finite");
  }
}

TEST(FmuControllerDeathTest, CrashNamesFmu) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const CaptureProblem problem = with_fmu("fmu_3", "does: crashes");
  EXPECT_EXIT(simulate_capture(problem), ::testing::ExitedWithCode(1),
              "grapnel: the FMU '.*fmu_3.fmu' crashed \\(segmentation fault\\) in fmi3DoStep\\(\\) at t = 20.000000 s");
}

// Unpacked temporary files are removed even after a crash.
TEST(FmuControllerDeathTest, CrashLeavesNoFiles) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  // The child process runs this too, with another folder of temporary files.
  const std::filesystem::path folder = std::filesystem::absolute("grapnel_fmu_crash_test");
  const char* const before = std::getenv("TMPDIR");
  const std::string previous = before ? before : "/tmp";
  std::filesystem::create_directories(folder);
  ::setenv("TMPDIR", folder.c_str(), 1);
  EXPECT_EXIT(simulate_capture(with_fmu("fmu_3", "does: crashes")), ::testing::ExitedWithCode(1), "crashed");
  EXPECT_EXIT(
      {
        const auto problem = with_fmu("fmu_3");
        ::raise(SIGKILL);
      },
      ::testing::KilledBySignal(SIGKILL), "");
  { const auto problem = with_fmu("fmu_3"); }
  ::setenv("TMPDIR", previous.c_str(), 1);
  for (int i = 0; i < 500 && !std::filesystem::is_empty(folder); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(std::filesystem::is_empty(folder));
  std::filesystem::remove_all(folder);
}

TEST(FmuController, RejectsMismatch) {
  EXPECT_EQ(fault_of("fmu_2"), "");
  expect_has(fault_of("nowhere"), "nowhere.fmu");
  expect_has(fault_of("fmu_of_version_1"), "it follows FMI '1.0', expected 2.0 or 3.0");
  expect_has(fault_of("fmu_of_another_binary"), "its binary follows FMI '1.0', its modelDescription.xml 2.0");
  expect_has(fault_of("fmu_without_step"), "its binary has no function fmi2DoStep()");
  expect_has(fault_of("fmu_for_windows"),
             "it has no binary for this system, binaries/linux64/test_fmu.so; it has: win64");
  expect_has(fault_of("fmu_with_tool"), "it requires the tool that made it");
  expect_has(fault_of("fmu_of_steps"), "has steps of 0.004 s (fixedInternalStepSize); control.period");
  // Errors in variables include the location of their entry.
  expect_has(fault_of("fmu_2", kGains, "{'goal[7]': 'position[1]'}"), "has no variable 'goal[7]'; did you mean 'goal[");
  expect_has(fault_of("fmu_2", kGains, "{'goal[1]': 'positoin[1]'}"),
             "control.inputs: 'positoin[1]' is not a signal; did you mean 'position[1]'?");
  expect_has(fault_of("fmu_2", kGains, "{'effort[1]': 'position[1]'}"), "has causality output, expected input");
  expect_has(fault_of("fmu_2", kGains, "{}"),
             "its inputs 'goal[1]', 'goal[2]', 'goal[3]', 'goal[4]', 'goal[5]', 'goal[6]' are without a value");
  // All errors are reported together.
  const std::string all = fault_of("fmu_2", "ki: 3, kp: true", "{'goal[7]': 'position[1]', 'goal[1]': 'positoin[1]'}");
  for (const char* part : {"has no variable 'ki'", "is a Real, which true is not", "has no variable 'goal[7]'",
                           "'positoin[1]' is not a signal", "its inputs 'goal[2]', "})
    expect_has(all, part);
  expect_has(fault_of("fmu_2", "ki: 3"), "has no variable 'ki'");
  expect_has(fault_of("fmu_2", "inside: 3"), "has causality local, expected parameter");
  expect_has(fault_of("fmu_2", "kp: true"), "is a Real, which true is not");
  expect_has(fault_of("fmu_3", "count: 1.5"), "is a Int32, which 1.5 is not");
  // Files that are not FMUs.
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "grapnel_no.fmu";
  std::ofstream(file) << "not a ZIP archive";
  EXPECT_THROW(fmi::Fmu(file, "no.fmu"), fmi::FmuError);
  std::filesystem::remove(file);
}

// canBeInstantiatedOnlyOncePerProcess: runs wait for each other, with the results of a single run.
TEST(FmuController, SingleInstancePerProcess) {
  const CaptureProblem problem = with_fmu("fmu_once");
  const CaptureResult alone = simulate_capture(problem);
  ASSERT_TRUE(alone.post_impact_end) << alone.failure;
  std::vector<CaptureResult> together(3);
  std::vector<std::thread> threads;
  for (CaptureResult& result : together) threads.emplace_back([&] { result = simulate_capture(problem); });
  for (std::thread& thread : threads) thread.join();
  for (const CaptureResult& result : together) {
    ASSERT_TRUE(result.post_impact_end) << result.failure;
    EXPECT_EQ(result.post_impact_end->joints.position, alone.post_impact_end->joints.position);
  }
}

// Other controllers run the cases of a block concurrently; with this one, cases run one after the other.
TEST(FmuController, SingleInstanceInCampaigns) {
  const CaptureProblem problem = with_fmu("fmu_once");
  Campaign campaign;
  campaign.cases = 3;
  campaign.columns = standard_columns(problem, true);
  std::erase_if(campaign.columns, [](const Column& c) { return c.needs_loads; });
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [&](std::uint64_t) { return StudyCase{problem, inward_normals(problem)}; };
  for (const CaseRow& row : run_block_in_lanes(campaign, {0, 0, 3}, lanes::InstructionSet::one_lane, {}))
    EXPECT_EQ(row.status, CaseStatus::ok) << row.reason;
}

}  // namespace fmu_controller_test
}  // namespace grapnel::testing
