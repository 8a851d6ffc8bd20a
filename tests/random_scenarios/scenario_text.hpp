#pragma once

/// @file
/// Random valid scenarios, as the text of a file.

#include <rapidcheck.h>

#include <iosfwd>
#include <string>

namespace grapnel::testing {

/// A scenario with its robot inline, one that the reader must accept.
struct ScenarioText {
  std::string yaml;
};

/// What RapidCheck prints of a case: the file itself, to be saved and run.
std::ostream& operator<<(std::ostream& out, const ScenarioText& scenario);

/// Robots of one to three arms with one to seven joints each (some arms branch; revolute, continuous, prismatic and
/// fixed joints; limits, friction and rotors or none) on a free, held or fixed base; tumbling targets, often
/// with several arms to one; grasps of every model, closing together, at stated times or on arrival, and letting go;
/// every profile, control and phase. Numbers have few digits, so that a case can be read.
///
/// Sizes: one scale of mass per robot from 0.1 to 10,000 kg; links and targets weigh 0.003 to 10 times as much. Links
/// are 0.1 to 1.5 m long. Rates are up to about 1 rad/s and 0.5 m/s, control is up to 10 rad/s fast, phases take 0.1 to
/// 1 s.
rc::Gen<ScenarioText> scenario_text();

}  // namespace grapnel::testing
