#pragma once

/// @file
/// Optimization files: YAML text to an Optimization. docs/formats/optimization.md describes the format.

#include <filesystem>

#include "grapnel/study/optimization.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// Reads an optimization and the scenario it names, once: its points are made from the trees. Checked are the file, the
/// scenario as it is, and each variable at both ends, the others as they are. @throws InputError with all faults.
/// Into `doubts`: as of load_scenario(), of the scenario as it is.
Optimization load_optimization(const std::filesystem::path& path, std::vector<Fault>* doubts = nullptr);

}  // namespace grapnel
