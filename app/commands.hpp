#pragma once

/// @file
/// What the program's subcommands do. Each returns the exit code: 0 done, 1 the simulation failed, 2 bad input, 3 some
/// points of a study failed.

#include <filesystem>
#include <string>
#include <vector>

namespace grapnel::app {

inline constexpr int kDone = 0;
inline constexpr int kSimulationFailed = 1;
inline constexpr int kBadInput = 2;
inline constexpr int kSomeFailed = 3;

struct RunOptions {
  std::filesystem::path scenario;
  std::filesystem::path output;        // empty: named after the scenario, below out/
  std::vector<std::string> overrides;  // path=value
  bool quiet = false;
};
int run(const RunOptions& options);

struct SweepOptions {
  std::filesystem::path study;
  std::filesystem::path output;  // empty: named after the study, below out/
  int threads = 0;               // 0: one per processor
  bool quiet = false;
};
int sweep(const SweepOptions& options);

struct OptimizeOptions {
  std::filesystem::path study;
  std::filesystem::path output;  // empty: named after the study, below out/
  int threads = 0;               // 0: one per processor
  bool quiet = false;
};
int optimize(const OptimizeOptions& options);

int check(const std::filesystem::path& scenario, const std::vector<std::string>& overrides);
int print_schema(const std::string& which);
int export_result(const std::filesystem::path& folder, bool csv, bool mat);
int info(const std::filesystem::path& robot);

}  // namespace grapnel::app
