#pragma once

// A platform on a rail with friction stops a block: a scenario of a few milliseconds, and logs of it.

#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/compare/run_curve.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/fault_texts.hpp"

namespace grapnel::test {

/// A folder with text files.
class ExperimentFolder {
 public:
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return folder_.path() / name;
  }
  std::filesystem::path path() const { return folder_.path(); }

 private:
  ScratchFolder folder_;
};

inline const std::string kSlider = R"(schema: grapnel-scenario/1
name: slider
robot:
  name: rail
  base: {name: table, mode: fixed, mass: 100, inertia: [10, 10, 10]}
  links:
    - name: platform
      parent: table
      joint: {name: rail, type: prismatic, axis: [1, 0, 0], friction: {coulomb: 0.05, transition_rate: 1e-3}}
      mass: 10
      inertia: [1, 1, 1]
  end_effectors:
    - {name: gripper, link: platform, position: [0.5, 0, 0], approach_axis: [1, 0, 0]}
initial:
  joints: {rail: 0}
targets:
  - name: block
    mass: 4
    inertia: [0.1, 0.1, 0.1]
    state: {position: [0.6, 0, 0], velocity: [-0.2, 0, 0]}
    grasp_points:
      - {name: face, position: [-0.1, 0, 0], approach_direction: [1, 0, 0]}
grasps:
  - {end_effector: gripper, target: block, point: face}
impact: {law: plastic, duration: 10 ms}
post_impact: {duration: 4, joints: free}
clearance: {enabled: false}
output: {interval: 0.1}
)";

inline const std::string kSliderMap = R"(schema: grapnel-mapping/1
time: {column: t, offset: 0.5}
quantities:
  - {name: rail, run: joints/position/rail, log: x, uncertainty: 2e-4}
)";

// A log of the rail's position at 25 Hz with noise, of the scenario with overrides; its clock is 0.5 s behind.
inline std::string slider_log(const std::filesystem::path& scenario, const std::vector<Override>& overrides,
                              unsigned seed, double noise = 2e-4) {
  const CaptureResult result = simulate_capture(load_scenario(scenario, overrides));
  std::vector<double> values;
  for (const Series& one : result.series.series) {
    if (one.path == "joints/position") values = one.data;
  }
  const RunCurve curve(result.series.time, values, 1);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::ostringstream text;
  text.precision(12);
  text << "t,x\n";
  for (double t = 0.02; t < 3.99; t += 0.04) {
    double x = 0;
    curve.value(t, {&x, 1});
    text << t - 0.5 << ',' << x + noise * normal(random) << '\n';
  }
  return text.str();
}

}  // namespace grapnel::test
