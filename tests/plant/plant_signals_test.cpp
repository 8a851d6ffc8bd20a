/// The signals of an exported plant equal those of a controller inside the run, and so do the effects of commands.

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/control/plugin_controller.hpp"
#include "grapnel/plant/plant_problem.hpp"
#include "grapnel/plant/plant_run.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "plant/short_capture.hpp"

namespace grapnel::testing {
namespace plant_signals_test {

// ---- A controller by the C interface, which records its inputs ----

struct Record {
  std::vector<InputValues> inputs;
  std::vector<double> first_commands;  // per command signal, as returned
};
Record* t_record = nullptr;

// Command k of the signal at time t [s].
double commanded(std::size_t signal, std::size_t k, double t) {
  if (std::string(command_signals.at(signal).about.name) == "thruster") return t >= 1 && k == 0 ? 1 : 0;
  return 0.02 * std::sin(3 * t + static_cast<double>(signal) + 0.5 * static_cast<double>(k));
}

int create(const grapnel_controller_setup* setup, void** instance, char*, std::size_t) {
  EXPECT_EQ(setup->base_actuators, 1);
  EXPECT_NE(std::strstr(setup->model, R"("gyros":["cmg"],"thrusters":["x+"],"targets":["debris"])"), nullptr)
      << setup->model;
  *instance = t_record;
  return 0;
}
int update(void* instance, const grapnel_controller_input* in, const grapnel_controller_access*,
           grapnel_controller_output* out) {
  InputValues& values = static_cast<Record*>(instance)->inputs.emplace_back();
  for (std::size_t s = 0; s < kInputSignals; ++s) {
    const std::size_t count =
        owner_count(input_signals[s].about.owner, *in) * static_cast<std::size_t>(input_signals[s].about.size);
    for (std::size_t i = 0; i < count; ++i) values[s].push_back(input_signals[s].value(*in, i));
  }
  const auto command = [&](double* list, int count, std::size_t signal) {
    for (int k = 0; k < count; ++k) list[k] = commanded(signal, static_cast<std::size_t>(k), in->time);
  };
  command(out->effort, in->joints, 0), command(out->wheel_torque, in->wheels, 2);
  command(out->gimbal_rate, in->gyros, 3), command(out->thruster, in->thrusters, 4);
  return 0;
}
void destroy(void*) {}
constexpr grapnel_controller_plugin kFunctions = {sizeof(grapnel_controller_plugin),
                                                  GRAPNEL_CONTROLLER_VERSION,
                                                  create,
                                                  nullptr,
                                                  update,
                                                  nullptr,
                                                  nullptr,
                                                  destroy,
                                                  nullptr};
class RecordingSource final : public ControllerSource {
 public:
  std::shared_ptr<Controller> make(const ControlTiming& timing, const std::string& parameters, ControlledRobot robot,
                                   const Model& model) const override {
    return std::make_shared<PluginController>(std::make_shared<const ControllerPlugin>(kFunctions, "the recorder"),
                                              timing, parameters, std::move(robot), model);
  }
};

// ---- A capture with every kind of part and sensor ----

CaptureProblem problem() {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("grapnel-signals-" + std::to_string(::getpid()));
  std::filesystem::create_directories(folder);
  std::string robot = kShortRobot;
  const std::string base = "inertia: [4, 4, 4]}\n";
  robot.insert(
      robot.find(base) + base.size(),
      "wheel_array: {configuration: orthogonal, inertia: 0.05, torque: 0.2, rate: 300}\n"
      "gyros: [{name: cmg, gimbal_axis: [0, 0, 1], spin_axis: [1, 0, 0], inertia: 0.02, "
      "gimbal_inertia: 0.03, spin_rate: 100, torque: 2, rate: 1}]\n"
      "thrusters: [{name: x+, position: [-1, 0, 0], direction: [1, 0, 0], force: 1, specific_impulse: 200}]\n");
  std::ofstream(folder / "robot.yaml") << robot;
  std::ofstream(folder / "short.yaml")
      << kShortCapture << "sensors:\n  joints: {noise: 1e-5}\n  wheels: {noise: 1e-3}\n  gyro: {noise: 1e-5}\n"
      << "  force_torque: [{end_effector: tip, force_noise: 0.01}]\n"
      << "  relative_pose: [{target: debris, position_noise: 1e-4, velocity_noise: 1e-5}]\n";
  CaptureProblem loaded = load_scenario(
      folder / "short.yaml", std::vector<Override>{{"control", "{period: 0.01, external: true, base_actuators: true}"},
                                                   {"approach.tracking", "{mode: controller}"},
                                                   {"post_impact", "{duration: 1.5, joints: controller}"}});
  std::filesystem::remove_all(folder);
  return loaded;
}

bool same(double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); }

TEST(PlantSignals, EqualThoseOfTheCInterface) {
  Record record;
  t_record = &record;
  CaptureProblem inside = problem();
  inside.control->source = std::make_shared<const RecordingSource>();
  const CaptureResult result = simulate_capture(inside);
  ASSERT_TRUE(result.post_impact_end) << result.failure;
  ASSERT_EQ(record.inputs.size(), 350u);

  CaptureProblem plant = plant_of(problem(), false);
  ASSERT_TRUE(plant.control->base_actuators);
  PlantVariables variables = plant_variables(plant, {});
  const auto has = [&](const std::string& name) {
    return std::ranges::find(variables.all, name, &PlantVariable::name) != variables.all.end();
  };
  for (const char* name :
       {"end_effector.tip.wrench[6]", "wheel.wheel-3.rate", "gyro.cmg.angle", "target.debris.held",
        "target.debris.pose[7]", "target.debris.motion[6]", "gyro.cmg.gimbal_rate", "thruster.x+.on"})
    EXPECT_TRUE(has(name)) << name;
  const ControlledRobot robot = variables.robot;
  PlantRun run(std::move(plant), std::move(variables));
  run.begin();
  std::size_t differences = 0, numbers = 0, forces = 0;
  for (std::size_t k = 0; !run.has_ended() && k < record.inputs.size(); ++k) {
    for (std::size_t s = 0; s < kInputSignals; ++s) {
      const std::vector<double>&in_c = record.inputs[k][s], &outside = run.outputs().signals[s];
      ASSERT_EQ(in_c.size(), outside.size()) << input_signals[s].about.name;
      ASSERT_FALSE(in_c.empty()) << input_signals[s].about.name;
      for (std::size_t i = 0; i < in_c.size(); ++i) {
        differences += same(in_c[i], outside[i]) ? 0 : 1;
        ++numbers;
      }
    }
    forces += run.outputs()["wrench"][0] != 0 ? 1 : 0;
    std::vector<double> commands;
    for (std::size_t c = 0; c < kCommandSignals; ++c) {
      if (!is_commanded(command_signals[c], robot)) continue;
      for (std::size_t i = 0; i < owner_count(command_signals[c].about.owner, robot); ++i)
        commands.push_back(commanded(c, i, run.outputs()["time"][0]));
    }
    run.step(0.01 * static_cast<double>(k + 1), commands);
  }
  std::printf("[ measured ] %zu numbers, %zu differ\n", numbers, differences);
  EXPECT_EQ(differences, 0u);
  EXPECT_GT(forces, 100u);
  // The commands had an effect, the same one.
  EXPECT_TRUE(run.has_ended());
  EXPECT_EQ(run.outputs()["position"], result.post_impact_end->joints.position);
  for (std::size_t w = 0; w < 3; ++w) EXPECT_EQ(run.outputs()["wheel_rate"][w], result.wheels[w].rate_after);
  EXPECT_NE(result.wheels[0].rate_after, 0);
  EXPECT_EQ(run.outputs()["gimbal_angle"][0], result.gyros->each[0].angle_after);
  EXPECT_NE(result.gyros->each[0].angle_after, 0);
  EXPECT_EQ(run.outputs()["target_held"][0], 1);
}

}  // namespace plant_signals_test
}  // namespace grapnel::testing
