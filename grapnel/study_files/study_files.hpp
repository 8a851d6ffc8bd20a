#pragma once

/// @file
/// Loaders of study, campaign and optimization files, for run_study(), run_campaign() and optimize().
/// docs/formats/study.md, campaign.md and optimization.md describe the formats. Files are read once: all points and
/// cases use the same bytes. Each loader throws InputError with all errors that can be detected before the run, and
/// adds the warnings of load_scenario() for the first point or the unchanged scenario to `warnings`. Public, kept
/// stable.

#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/study/optimization.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Checks the study, the scenario with the first value of every axis, and the scenario with every listed value of each
/// axis (the ends of a range), the other axes at their first value. An error of a combination becomes the reason of
/// that point.
Campaign load_study(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// Checks every uncertain value alone at its median and at the ends that `cases` draws reach, and every value of the
/// design's axes alone. With `plan: nominal` this plans the design's first point, which takes as long as a plan does:
/// an uncertain value may be at a place that only the plan fills, such as the arms' initial position, and is checked
/// there.
Campaign load_campaign(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// Checks the file, the unchanged scenario, and each variable at both ends, the others unchanged.
Optimization load_optimization(const std::filesystem::path& path, std::vector<Fault>* warnings = nullptr);

/// The published JSON Schemas (draft 7).
std::string study_schema();
std::string campaign_schema();
std::string optimization_schema();

}  // namespace grapnel
