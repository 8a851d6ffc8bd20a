#pragma once

/// @file
/// The result of a capture as plain data (CaptureResult), and its files. Public, kept stable.

#include <filesystem>
#include <string>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

struct CaptureProblem;

/// The text of summary.json (docs/formats/summary.md).
std::string summary_json(const CaptureResult& result);

/// Writes summary.json, scene.json and, if the run has them, scenario.json and timeseries.h5, as `grapnel run` does.
/// Creates the folder. @throws std::runtime_error if a file cannot be written.
void save_results(const CaptureProblem& problem, const CaptureResult& result, const std::filesystem::path& folder);

}  // namespace grapnel
