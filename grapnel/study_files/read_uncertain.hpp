#pragma once

/// @file
/// The uncertain values of a campaign file.

#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/uncertain_value.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/study_files/uncertain_places.hpp"

namespace grapnel {

/// An uncertain value of a scenario.
struct ReadUncertain {
  UncertainPaths where;  // of an orientation the path of its quaternion
  UncertainValue value;
  std::vector<Node> choices;  // of a ChosenValue
  bool choices_are_numbers = false;
  std::vector<CampaignInput> inputs;
};

/// Reads `entry`, whose structure has been checked, for a scenario with the schema's defaults. `problem` was read from
/// it.
ReadUncertain read_uncertain(const UncertainFile& file, const Node& entry, const UncertainPaths& where,
                             const Node& scenario, const CaptureProblem& problem, FaultList& faults);

/// Column heads of the numbers of an uncertain value, one per number of DrawnValue::shown. `form`: the values at the
/// places, or their form if they are absent.
std::vector<CampaignInput> inputs_of(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
                                     const CaptureProblem& problem);

/// The units of the numbers at the places.
std::vector<std::string> units_at(const ReadUncertain& uncertain, const UncertainForm& form, const Node& scenario,
                                  const CaptureProblem& problem);

/// The values of the scenario for drawn numbers.
std::vector<Change> changes_of(const ReadUncertain& uncertain, const UncertainForm& form,
                               const std::vector<double>& numbers);

}  // namespace grapnel
