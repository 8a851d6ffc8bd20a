#pragma once

/// @file
/// The thesis's planar dual-arm robot and its targets (Tables 4.1, 4.2), without input files.

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/state.hpp"

namespace grapnel::testing {

/// Units of length and mass, in metres and kilograms: values below are divided by them.
struct Units {
  double length = 1;
  double mass = 1;
};

/// "base", "arm-1-link-1" … "arm-2-link-3" on joints "arm-1-joint-1" …; the base's mass and inertia may be multiplied.
std::vector<BodyDescription> thesis_robot(double base_factor = 1, const Units& units = {});
/// "tip-1" and "tip-2", `along` [m] from the joints of the third links.
std::vector<FrameDescription> thesis_tips(double along = 1, const Units& units = {});
/// A solid sphere of 10 kg, 0.5 m radius, free.
BodyDescription thesis_target(const std::string& name, const Units& units = {});

/// Sets the base's twist to zero total momentum of the robot, with the joint rates in `state`.
void stop_momentum(const Model& model, State& state);

/// Configuration of the reference impulses: base (0, 0.0194, 0.6762), joints at Table 4.3's final angles, two targets
/// whose points (0, +-0.5) from the centre are at the tips, turning at 0.2 rad/s.
struct ReferenceImpact {
  Model model;
  State state;
  std::vector<Grasp> grasps;
};
/// End-effectors move at (-+speed, 0) without turning.
ReferenceImpact reference_impact(GraspModel model, double speed, double base_factor = 1);

}  // namespace grapnel::testing
