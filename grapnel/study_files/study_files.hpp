#pragma once

/// @file
/// Study, campaign and optimization files: YAML text to what run_study(), run_campaign() and optimize() take.
/// docs/formats/study.md, campaign.md and optimization.md describe the formats. Files are read once: the points and
/// cases see the same bytes ever after. Each loader throws InputError with all faults that can be known beforehand, and
/// adds to `warnings` those of load_scenario(), of the first point or of the scenario as it is. Public, kept stable.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/study/optimization.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Checked are the study itself, the scenario with the first value of every axis, and with every listed value of each
/// axis (the ends of a range), the other axes at their first. What only a combination gets wrong is that point's
/// reason.
Campaign load_study(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// Checked are every uncertain value by itself at its median and at the ends that `cases` draws reach, and every value
/// of the design's axes by itself.
/// With `plan: nominal` this plans the design's first point, which takes as long as a plan does: an uncertain value may
/// stand at a place that only the plan fills, such as the arms' starting position, and is checked there.
Campaign load_campaign(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// Checked are the file, the scenario as it is, and each variable at both ends, the others as they are.
Optimization load_optimization(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// The published JSON Schemas (draft 7).
std::string study_schema();
std::string campaign_schema();
std::string optimization_schema();

}  // namespace grapnel
