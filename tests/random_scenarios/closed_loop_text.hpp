#pragma once

/// @file
/// Random captures with closed loops, as the text of a scenario.

#include "random_scenarios/scenario_text.hpp"

namespace grapnel::testing {

/// Planar and spatial servicers on a free, moving base with two or three arms of two to seven revolute joints. Two or
/// three of the arms grasp one target; sometimes the third arm grasps a second one. Grasps of every model, usually
/// rigid. Half of the cases start at their grasp points and close at t = 0; the others plan an approach to them. 20 to
/// 60 s of free motion follow.
///
/// Sizes: bases of 50 to 2000 kg and about 1 m, links of 0.3 to 1 m, targets of 0.05 to 3 times the base's mass. Rates
/// are up to 0.05 m/s and 0.1 rad/s, a tenth of that for a base with an approach. Grasp points have all digits, so that
/// cases without an approach start without a gap.
rc::Gen<ScenarioText> closed_loop_text();

}  // namespace grapnel::testing
