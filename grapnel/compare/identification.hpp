#pragma once

/// @file
/// Identification files: parameters of a scenario that logs determine. read_identification.cpp describes every key;
/// docs/formats/identification.md documents them.

#include <filesystem>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "grapnel/compare/comparison_report.hpp"
#include "grapnel/compare/log_fit.hpp"
#include "grapnel/text/faults.hpp"

namespace grapnel {

/// An identification that is ready to run. The logs of `problem` are in the order of `logs`.
struct Identification {
  struct Log {
    std::string name;
    ComparisonReport::Run run;  ///< its scenario, with the values of the file
    ComparisonReport::Log log;
  };
  std::string name;
  std::string file;                             ///< path given by the user
  std::string text;                             ///< its bytes
  std::string sha256;                           ///< of those and of the scenarios with their included files
  std::vector<std::vector<std::string>> paths;  ///< per parameter
  std::vector<Log> logs;
  LogFitProblem problem;
  /// The scenario with values of the parameters, as a file at a path.
  std::function<std::string(std::span<const double>, const std::filesystem::path& place, const std::string& comment)>
      scenario_text;
};

/// Reads the file, the scenario, the logs and their mappings; checks each parameter at both ends, and simulates the
/// starts once, since the series of a run are needed to relate a log to them. Warnings of load_scenario() are added to
/// `warnings`. @throws InputError with all errors; FitStopped
Identification load_identification(const std::filesystem::path& path, const std::stop_token& stop = {},
                                   std::vector<Fault>* warnings = nullptr);

/// The published schema of identification files.
std::string identification_schema();

}  // namespace grapnel
