#pragma once

/// @file
/// A scenario for tests of plants.

namespace grapnel::testing {

/// A capture that takes little time: a planar arm with two joints reaches a target, which it then holds.
inline constexpr const char* kShortCapture = R"(schema: grapnel-scenario/1
name: short <capture> & "more"
robot: robot.yaml
initial: {joints: [0.6, -1.2]}
targets:
  - name: debris
    mass: 10
    inertia: [1, 1, 1]
    state: {at: capture, position: [1.9, 0.1, 0], angular_velocity: [0, 0, 0.2]}
    grasp_points: [{name: grip, position: [-0.2, 0, 0]}]
grasps: [{end_effector: tip, target: debris, point: grip}]
approach:
  duration: 2
  final_joints: [0.5, -1.0]
  tracking: {mode: pd, kp: [40, 30], kd: [60, 40]}
contact: {gap: translate_target, largest_gap: any}
impact: {}
post_impact: {duration: 1.5, joints: pd, kp: [40, 30], kd: [60, 40]}
control: {period: 10 ms}
)";
inline constexpr const char* kShortRobot = R"(schema: grapnel-robot/1
name: two joints
base: {name: base, mass: 50, inertia: [4, 4, 4]}
links:
  - name: upper
    parent: base
    joint: {name: shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0.5, 0, 0]}, limits: {effort: 30}}
    mass: 3
    com: [0.4, 0, 0]
    inertia: [0.1, 0.2, 0.2]
  - name: lower
    parent: upper
    joint: {name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [0.8, 0, 0]}, limits: {effort: 30}}
    mass: 2
    com: [0.3, 0, 0]
    inertia: [0.05, 0.1, 0.1]
end_effectors: [{name: tip, link: lower, position: [0.6, 0, 0]}]
)";

}  // namespace grapnel::testing
