#pragma once

/// @file
/// Random captures with contacts between shapes, as the text of a scenario.

#include "random_scenarios/scenario_text.hpp"

namespace grapnel::testing {

/// Robots of one or two arms with one to four joints each (some coupled by `mimic`, some with stops or friction) on a
/// free, held or fixed base, and one to three tumbling targets of one to three shapes that fly towards the base; half
/// of the cases with a floor and a post. All bodies may touch, by a compliant or a hard material. Half of the cases
/// close grasps after an approach, most of them with limits (`holds`); the others are motion only. Links, targets and
/// obstacles may overlap at the start, which the program reports.
///
/// Sizes: bases of 1 to 1,000 kg and 0.6 m, links of 0.01 to 0.3 times that mass and 0.3 to 0.5 m, targets of 0.01 to 3
/// times. Targets approach by 0.3 to 2.5 m/s.
rc::Gen<ScenarioText> contact_text();

}  // namespace grapnel::testing
