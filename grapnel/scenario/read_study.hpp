#pragma once

/// @file
/// Study files: YAML text to a sweep. docs/formats/study.md describes the format.

#include <filesystem>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Reads a study and the scenarios it names, once: its points are made from the trees. Checked are the study itself,
/// the scenario with the first value of every axis, and with every listed value of each axis (the ends of a range), the
/// other axes at their first. What only a combination gets wrong is that point's reason. @throws InputError with all
/// faults. Into `doubts`: as of load_scenario(), of the first point's scenario.
Campaign load_study(const std::filesystem::path& path, std::vector<Fault>* doubts = nullptr);

}  // namespace grapnel
