/// Captures under sampled control and with plugins, from their scenarios.

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace plugin_capture_test {

CaptureProblem own(std::vector<Override> overrides, const std::string& plugin = GRAPNEL_OWN_PD) {
  if (!plugin.empty()) overrides.insert(overrides.begin(), {"control.plugin", plugin});
  overrides.push_back({"post_impact.duration", "3"});
  return load_scenario(GRAPNEL_OWN_SCENARIO, overrides);
}

std::string fault_of(const std::vector<Override>& overrides, const std::string& plugin = GRAPNEL_OWN_PD) {
  try {
    own(overrides, plugin);
    return {};
  } catch (const InputError& error) {
    return error.what();
  }
}

void expect_passes(const CaptureResult& result) {
  EXPECT_EQ(result.status, CaptureStatus::completed) << result.failure;
  for (const LedgerEntry& row : result.ledger.entries) {
    EXPECT_TRUE(row.kind != LedgerEntry::Kind::conservation || row.pass()) << row.name << " " << row.value;
  }
}

// The built-in pd, with damping of the base, gives the same result as the example's plugin, with equal sampling and
// delay.
TEST(PluginCapture, ExampleEqualsBuiltInLaw) {
  const CaptureResult plugin = simulate_capture(own({}));
  expect_passes(plugin);
  ASSERT_TRUE(plugin.control);
  EXPECT_EQ(plugin.control->period, 0.01);
  EXPECT_EQ(plugin.control->delay, 0.01);
  EXPECT_EQ(plugin.control->plugin, GRAPNEL_OWN_PD);
  EXPECT_EQ(plugin.control->plugin_sha256.size(), 64u);
  CaptureProblem law = own({});
  law.control->plugin.clear(), law.control->parameters = "{}", law.control->base_torque = false;
  law.post_impact->joints = PostImpactSetup::Joints::pd;
  law.post_impact->kp.assign(6, 20), law.post_impact->kd.assign(6, 60);
  law.post_impact->base_control = BaseControlSetup{};
  law.post_impact->base_control->kd = {100, 100, 100};
  const CaptureResult built_in = simulate_capture(law);
  expect_passes(built_in);
  ASSERT_TRUE(plugin.post_impact_end && built_in.post_impact_end);
  double off = 0;
  for (std::size_t j = 0; j < 6; ++j)
    off = std::max(off,
                   std::abs(plugin.post_impact_end->joints.position[j] - built_in.post_impact_end->joints.position[j]));
  std::printf("[ measured ] plugin against the built-in law: %.3g rad\n", off);
  EXPECT_LT(off, 1e-10);
}

// The same with sensors: plugin and built-in controller receive the same readings, which differ from the true values.
TEST(PluginCapture, ReceivesSensorReadings) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<Override> sensors = {{"sensors",
                                          "{seed: 5, joints: {noise: 1e-3, quantum: 1e-3, rate: sensor, rate_noise: "
                                          "1e-3}, gyro: {noise: 1e-3, bias: [1e-3, "
                                          "0, 0]}}"}};
  const CaptureResult plugin = simulate_capture(own(sensors)), truth = simulate_capture(own({}));
  expect_passes(plugin);
  CaptureProblem law = own(sensors);
  law.control->plugin.clear(), law.control->parameters = "{}", law.control->base_torque = false;
  law.post_impact->joints = PostImpactSetup::Joints::pd;
  law.post_impact->kp.assign(6, 20), law.post_impact->kd.assign(6, 60);
  law.post_impact->base_control = BaseControlSetup{};
  law.post_impact->base_control->kd = {100, 100, 100};
  const CaptureResult built_in = simulate_capture(law);
  ASSERT_TRUE(plugin.post_impact_end && built_in.post_impact_end && truth.post_impact_end) << plugin.failure;
  double off = 0, by_noise = 0;
  for (std::size_t j = 0; j < 6; ++j) {
    const double here = plugin.post_impact_end->joints.position[j];
    off = std::max(off, std::abs(here - built_in.post_impact_end->joints.position[j]));
    by_noise = std::max(by_noise, std::abs(here - truth.post_impact_end->joints.position[j]));
  }
  std::printf("[ measured ] plugin against the built-in law: %.3g rad, against the truth: %.3g rad\n", off, by_noise);
  EXPECT_LT(off, 1e-9);
  EXPECT_GT(by_noise, 1e-6);
}

TEST(PluginCapture, WrapsGeneratedCodePerInstance) {
  const std::vector<Override> plain = {{"control.base_torque", "false"}, {"control.parameters", "{}"}};
  const CaptureProblem problem = own(plain, GRAPNEL_GENERATED_PD);
  const CaptureResult alone = simulate_capture(problem);
  expect_passes(alone);
  std::vector<CaptureResult> together(4);
  std::vector<std::thread> threads;
  for (CaptureResult& result : together) threads.emplace_back([&] { result = simulate_capture(problem); });
  for (std::thread& thread : threads) thread.join();
  for (const CaptureResult& result : together) {
    ASSERT_TRUE(result.post_impact_end) << result.failure;
    EXPECT_EQ(result.post_impact_end->joints.position, alone.post_impact_end->joints.position);  // bit for bit
  }
  const CaptureResult slower =
      simulate_capture(own({{"control.base_torque", "false"}, {"control.period", "20 ms"}}, GRAPNEL_GENERATED_PD));
  EXPECT_NE(slower.failure.find("the model was generated for a period of 0.01 s, control.period is 0.02 s"),
            std::string::npos)
      << slower.failure;
  EXPECT_TRUE(slower.approach_end);  // earlier phases are recorded
}

TEST(PluginCapture, EndsWithPluginMessage) {
  const auto run = [](const char* parameters) {
    return simulate_capture(own({{"control.parameters", parameters}}, GRAPNEL_TEST_PLUGIN));
  };
  const CaptureResult nan = run("{does: nan}");
  EXPECT_EQ(nan.status, CaptureStatus::failed);
  EXPECT_NE(
      nan.failure.find("libtest_plugin.so' returns an effort of nan at joint 'arm-2-joint-3', which is not finite"),
      std::string::npos)
      << nan.failure;
  EXPECT_TRUE(nan.approach_end.has_value());
  const CaptureResult refused = run("{does: refuses}");
  EXPECT_NE(refused.failure.find("created no controller: not with 6 joints"), std::string::npos) << refused.failure;
  const CaptureResult failing = run("{does: fails}");
  EXPECT_NE(failing.failure.find("failed: the sun is out"), std::string::npos) << failing.failure;
}

TEST(PluginCapture, RejectsMismatch) {
  const auto expect = [](const std::vector<Override>& overrides, const char* text,
                         const char* plugin = GRAPNEL_OWN_PD) {
    const std::string fault = fault_of(overrides, plugin);
    EXPECT_NE(fault.find(text), std::string::npos) << fault;
  };
  expect({{"control.plugin", "nowhere.so"}}, "nowhere.so", "");
  expect({}, "does not export the function grapnel_controller()", GRAPNEL_TEST_PLUGIN_WITHOUT_SYMBOL);
  expect({}, "has version 7 of the controller interface, expected 1", GRAPNEL_TEST_PLUGIN_OF_ANOTHER_VERSION);
  expect({{"control.period", "0"}}, "control.period");
  expect({{"control.delay", "-1"}}, "control.delay");
  expect({{"control.period", "1e-9"}}, "makes 2.3e+10 samples in the run's 23 s; at most 10000000");
  expect({{"control.period", "30"}}, "control.period is 30 [s], must be less than 23, the duration of the run");
  expect({{"control.delay", "30"}}, "control.delay is 30 [s], must be less than 23");
  expect({{"post_impact.joints", "free"}}, "control.plugin drives nothing");
  expect({{"approach.tracking", "{mode: controller}"}, {"control", "{period: 0.01}"}},
         "needs the plugin, the FMU or the log that drives them", "");
  expect({{"post_impact.base_control", "{kp: 1, kd: 1}"}},
         "control.base_torque assigns the base's torque to the controller");
  expect({{"control", "{period: 0.01, base_torque: true}"}}, "plugin", "");
}

// A folder with a CSV file of torques.
class Torques {
 public:
  explicit Torques(const std::string& text) { std::ofstream(file_) << text; }
  ~Torques() { std::filesystem::remove(file_); }
  std::vector<Override> overrides(const std::string& more = "") const {
    return {{"control", "{period: 0.01, torques: " + file_.string() + more + "}"}};
  }

 private:
  std::filesystem::path file_ = std::filesystem::temp_directory_path() / "grapnel_torques.csv";
};
constexpr const char* kJoints = "arm-1-joint-1,arm-1-joint-2,arm-1-joint-3,arm-2-joint-1,arm-2-joint-2,arm-2-joint-3";

// Joint efforts and base torques recorded at a run's samples, written to a log and replayed, give the same motion.
TEST(SampledCapture, ReplaysTorqueLog) {
  CaptureProblem problem = own({{"control.delay", "0"}});
  problem.output_interval = 0.005;  // includes the middle between two samples of the controller
  const CaptureResult first = simulate_capture(problem);
  expect_passes(first);
  const auto series = [&](const char* path) -> const Series& {
    for (const Series& one : first.series.series) {
      if (one.path == path) return one;
    }
    throw std::runtime_error(path);
  };
  std::string text = std::string("# replayed\ntime,") + kJoints + ",base.x,base.y,base.z\n0,0,0,0,0,0,0,0,0,0\n";
  const Series &effort = series("joints/effort"), &torque = series("base/control_torque");
  for (std::size_t i = 0; i < first.series.time.size(); ++i) {
    const double t = first.series.time[i];
    const double tick = std::floor(t / 0.01);
    if (first.series.phases[first.series.phase[i]] != "post_impact" || std::abs(t / 0.01 - tick - 0.5) > 0.1) continue;
    text += fmt::format("{}", tick / 100);
    for (std::size_t j = 0; j < 6; ++j) text += fmt::format(",{}", effort.data[6 * i + j]);
    for (std::size_t k = 0; k < 3; ++k) text += fmt::format(",{}", torque.data[3 * i + k]);
    text += "\n";
  }
  const Torques file(text);
  const CaptureProblem replay = own(file.overrides(), "");
  EXPECT_TRUE(replay.control->base_torque);
  EXPECT_EQ(replay.control->log->times.size(), 301u);
  const CaptureResult second = simulate_capture(replay);
  expect_passes(second);
  ASSERT_TRUE(first.post_impact_end && second.post_impact_end);
  double off = 0, moved = 0;
  for (std::size_t j = 0; j < 6; ++j) {
    off =
        std::max(off, std::abs(first.post_impact_end->joints.position[j] - second.post_impact_end->joints.position[j]));
    moved = std::max(moved, std::abs(effort.data[effort.data.size() - 6 + j]));
  }
  std::printf("[ measured ] replayed torques against the run they come from: %.3g rad\n", off);
  EXPECT_LT(off, 1e-10);
  EXPECT_GT(moved, 1e-6);
}

TEST(SampledCapture, RejectsMismatchedLogs) {
  const auto fault = [](const std::string& header, const std::string& rows, const std::string& more = "") {
    return fault_of(Torques(header + "\n" + rows).overrides(more), "");
  };
  const auto expect = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  const std::string header = std::string("time,") + kJoints, rows = "0,0,0,0,0,0,0\n0.01,1,1,1,1,1,1\n";
  EXPECT_EQ(fault(header, rows), "");
  expect(fault(header, "0,0,0,0,0,0,0\n0.015,1,1,1,1,1,1\n"),
         "control.torques has a row at 0.015 [s], which is not a multiple of control.period, 0.01");
  expect(fault(header + ",base.x,base.y", "0,0,0,0,0,0,0,0,0\n1,0,0,0,0,0,0,0,0\n"), "must have all or none");
  expect(fault(header + ",elbow", "0,0,0,0,0,0,0,0\n"), "unknown column 'elbow'");
  expect(fault("time,arm-1-joint-1", "0,0\n1,0\n"), "the header lacks joints: ");
  expect(fault(header, "0,0,0,0,0,0,x\n"), "arm-2-joint-3 must be a number [N m or N], not the text 'x'");
  expect(fault(header, rows, ", plugin: here.so"), "plugin");
  expect(fault_of({{"control", "{period: 0.01, torques: nowhere.csv}"}}, ""), "nowhere.csv");
}

TEST(PluginCapture, HashesThePlugin) {
  const CaptureProblem a = own({{"control.parameters", "{}"}}),
                       b = own({{"control.parameters", "{}"}}, GRAPNEL_TEST_PLUGIN);
  EXPECT_NE(a.control->sha256, b.control->sha256);
  EXPECT_TRUE(std::filesystem::path(a.control->file).is_absolute());
  EXPECT_EQ(own({{"control.parameters", "{kp: 3, names: [a, b], on: true, deep: {x: 1.5}}"}}).control->parameters,
            R"({"kp":3,"names":["a","b"],"on":true,"deep":{"x":1.5}})");
}

// With any controller, sampled and held control passes the ledger across grasps, impacts and releases.
TEST(SampledCapture, LedgerPassesThroughAllSegments) {
  const CaptureResult result = simulate_capture(
      own({{"control", "{period: 0.004, delay: 0.006}"},
           {"approach.tracking", "{mode: pd, kp: 40, kd: 20, noise: {position: 1e-4, seed: 3}}"},
           {"post_impact",
            "{duration: 3, joints: computed_torque, kp: 1, kd: 2, release: [{after: 1.23}], base_control: "
            "{kp: 10, kd: 60}}"}},
          ""));
  expect_passes(result);
  ASSERT_TRUE(result.post_impact_end);
}

}  // namespace plugin_capture_test
}  // namespace grapnel::testing
