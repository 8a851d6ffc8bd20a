#pragma once

/// @file
/// Scenarios whose linear models have closed forms.

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <complex>
#include <filesystem>
#include <string>

#include "grapnel/linear/linearize.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {

inline constexpr double kHingeInertia = 0.5;  // [kg m^2]

/// A hinge on a fixed base under pd. `more`: further sections.
inline std::string hinge(double kp, double kd, const std::string& more = "", const std::string& joint_keys = "") {
  return "schema: grapnel-scenario/1\n"
         "name: hinge\n"
         "robot:\n"
         "  name: hinge\n"
         "  base: {name: bench, mode: fixed, mass: 100, inertia: [10, 10, 10]}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: bench\n"
         "      joint: {name: elbow, type: revolute, axis: [0, 0, 1]" +
         joint_keys +
         "}\n"
         "      mass: 2\n"
         "      inertia: [0.1, 0.4, 0.5]\n"
         "initial: {joints: [0.3]}\n"
         "motion:\n"
         "  - {name: hold, duration: 10, joints: pd, kp: " +
         std::to_string(kp) + ", kd: " + std::to_string(kd) + "}\n" + more;
}

/// A floating base with an arm of two joints that moves, and no forces on it but those of pd in the joints, or none.
inline std::string floating_arm(const std::string& motion) {
  return "schema: grapnel-scenario/1\n"
         "name: floating arm\n"
         "robot:\n"
         "  name: floating arm\n"
         "  base: {name: bus, mass: 60, com: [0.1, 0, 0.05], inertia: [8, 6, 5, 0.5, -0.3, 0.2]}\n"
         "  links:\n"
         "    - name: upper\n"
         "      parent: bus\n"
         "      joint: {name: shoulder, type: revolute, axis: [0, 1, 0], origin: {position: [0.4, 0, 0.3]}, friction: "
         "{viscous: 0.2}}\n"
         "      mass: 6\n"
         "      com: [0, 0.05, 0.4]\n"
         "      inertia: [0.5, 0.5, 0.05]\n"
         "    - name: lower\n"
         "      parent: upper\n"
         "      joint: {name: slide, type: prismatic, axis: [0.6, 0, 0.8], origin: {position: [0, 0, 0.8]}}\n"
         "      mass: 4\n"
         "      com: [0.05, 0, 0.3]\n"
         "      inertia: [0.24, 0.25, 0.03]\n"
         "initial:\n"
         "  base: {angular_velocity: [0.1, -0.2, 0.15], velocity: [0.02, 0.01, 0]}\n"
         "  joints: [0.4, 0.1]\n"
         "  joint_rates: [0.3, -0.1]\n"
         "motion:\n"
         "  - {name: move, duration: 10, " +
         motion + "}\n";
}

inline std::filesystem::path shipped(const std::string& name) {
  return std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios" / name;
}

inline CaptureProblem problem_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text));
}

inline LinearModel linear_model(const std::string& text, double at = 0) {
  return linearize(problem_of(text), {.time = at});
}

}  // namespace grapnel::testing
