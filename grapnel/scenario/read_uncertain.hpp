#pragma once

/// @file
/// The uncertain values of a campaign file.

#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/uncertain_value.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/scenario/uncertain_places.hpp"

namespace grapnel {

/// An uncertain value of a scenario.
struct ReadUncertain {
  UncertainPaths where;  // of an orientation the path of its quaternion
  UncertainValue value;
  std::vector<Node> choices;  // of a ChosenValue
  bool choices_are_numbers = false;
  std::vector<CampaignInput> inputs;
};

/// An entry whose structure has been checked, for a scenario that has the schema's defaults. `problem` was read from
/// it.
ReadUncertain read_uncertain(const Node& entry, const UncertainPaths& where, const Node& scenario,
                             const CaptureProblem& problem, FaultList& faults);

/// What drawn numbers put into the scenario.
std::vector<Change> changes_of(const ReadUncertain& uncertain, const UncertainForm& form,
                               const std::vector<double>& numbers);

}  // namespace grapnel
