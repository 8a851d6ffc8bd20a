#pragma once

/// @file
/// Random valid scenarios, as the text of a file.

#include <rapidcheck.h>

#include <iosfwd>
#include <string>

namespace grapnel::testing {

/// A valid scenario with its robot inline.
struct ScenarioText {
  std::string yaml;
};

/// RapidCheck prints a case as its scenario file, which can be saved and run.
std::ostream& operator<<(std::ostream& out, const ScenarioText& scenario);

/// Robots of one to three arms with one to seven joints each (some branched; revolute, continuous, prismatic and fixed
/// joints; with or without limits, friction and rotors) on a free, held or fixed base. Tumbling targets, often several
/// arms per target. Grasps of every model, closing together, at stated times or on arrival, and released. Every
/// profile, controller and phase. Numbers have few digits, for readability.
///
/// Sizes: one mass scale per robot from 0.1 to 10,000 kg; links and targets have 0.003 to 10 times that mass. Links are
/// 0.1 to 1.5 m long. Rates are up to about 1 rad/s and 0.5 m/s, control bandwidths up to 10 rad/s, phases last 0.1 to
/// 1 s.
rc::Gen<ScenarioText> scenario_text();

}  // namespace grapnel::testing
