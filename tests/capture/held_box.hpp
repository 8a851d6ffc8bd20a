#pragma once

/// @file
/// A servicer that holds a box by one grasp: the scene of the tests of grasps with limits.

#include <string>

#include "capture/scenario_run.hpp"

namespace grapnel::testing::held_box {

/// Masses [kg] and moments of inertia about the x axis [kg m^2] of base, arm and box, whose centres are on that axis.
inline constexpr double kBase = 100, kArm = 5, kBox = 20, kAll = kBase + kArm + kBox;
inline constexpr double kTurn = 10 + 0.1 + 1;

/// A base with a braked arm along x that holds a box by its near face from t = 0 on. `grasp`: further keys of the
/// grasp; `rest`: further keys of the scenario.
inline std::string scene(const std::string& grasp, const std::string& rest, double duration = 4,
                         const std::string& target = "{at: start, position: [1, 0, 0]}") {
  return "schema: grapnel-scenario/1\n"
         "name: held box\n"
         "robot:\n"
         "  name: r\n"
         "  base: {name: base, mass: 100, inertia: [10, 10, 10], geometry: {shape: sphere, radius: 0.3}}\n"
         "  links:\n"
         "    - name: arm\n"
         "      parent: base\n"
         "      joint: {name: slide, type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, 0, 0]}}\n"
         "      mass: 5\n"
         "      inertia: [0.1, 0.1, 0.1]\n"
         "      geometry: {shape: sphere, radius: 0.05, position: [0.24, 0, 0]}\n"
         "  end_effectors: [{name: tip, link: arm, position: [0.3, 0, 0], envelope: {position: 0.02}}]\n"
         "initial: {joints: [0]}\n"
         "targets:\n"
         "  - {name: box, mass: 20, inertia: [1, 1, 1], geometry: {shape: box, size: [0.4, 0.4, 0.4]}, state: " +
         target +
         ", grasp_points: [{name: face, position: [-0.2, 0, 0]}]}\n"
         "grasps: [{end_effector: tip, target: box, point: face" +
         (grasp.empty() ? "" : ", " + grasp) +
         "}]\n"
         "impact: {duration: 1e-2, joints: braked}\n"
         "post_impact: {duration: " +
         std::to_string(duration) + ", joints: braked}\n" + rest;
}

/// A load on the base: rows [t, Fx, Fy, Fz, Mx, My, Mz].
inline std::string pushed(const std::string& rows) {
  return "external_wrenches: [{body: base, time: {shape: table, values: [" + rows + "]}}]\n";
}

/// Two braked arms hold a box at opposite sides, at the height of its centre; a force of 10 N/s acts on the base.
/// `first`, `second`: keys of the limits of both grasps.
inline std::string held_by_two(const std::string& first, const std::string& second) {
  const std::string arms =
      "    - {name: left, parent: base, joint: {name: a, type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, "
      "0.2, "
      "0]}}, mass: 5, inertia: [0.1, 0.1, 0.1]}\n"
      "    - {name: right, parent: base, joint: {name: b, type: prismatic, axis: [1, 0, 0], origin: {position: [0.5, "
      "-0.2, "
      "0]}}, mass: 5, inertia: [0.1, 0.1, 0.1]}\n";
  return "schema: grapnel-scenario/1\nname: pair\nrobot:\n  name: r\n"
         "  base: {name: base, mass: 95, inertia: [10, 10, 10]}\n  links:\n" +
         arms +
         "  end_effectors: [{name: tip, link: left, position: [0.3, 0, 0]}, {name: other, link: right, position: "
         "[0.3, 0, "
         "0]}]\n"
         "initial: {joints: [0, 0]}\n"
         "targets: [{name: box, mass: 20, inertia: [1, 1, 1], state: {at: start, position: [0.8, 0, 0]}, "
         "grasp_points: "
         "[{name: l, position: [0, 0.2, 0]}, {name: r, position: [0, -0.2, 0]}]}]\n"
         "grasps: [{end_effector: tip, target: box, point: l, holds: {" +
         first + "}}, {end_effector: other, target: box, point: r, holds: {" + second +
         "}}]\n"
         "impact: {duration: 1e-2, joints: braked}\npost_impact: {duration: 4, joints: braked}\n" +
         pushed("[0, 0, 0, 0, 0, 0, 0], [10, 100, 0, 0, 0, 0, 0]");
}

}  // namespace grapnel::testing::held_box
