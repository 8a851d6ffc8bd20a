#pragma once

/// @file
/// A campaign: many captures, and what is kept of each. They differ in values that are drawn at random, in stated ones
/// (its design: the points of a grid), or in both. Plain data and functions that say what a case is;
/// study_files/study_files.hpp makes them from files. Thread safety: plain values; the
/// functions may be called from any thread.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/campaign/criterion.hpp"
#include "grapnel/study/column.hpp"
#include "grapnel/study/grid.hpp"

namespace grapnel {

/// Which kind of file a campaign is of, and with it which files its results are. A sweep draws nothing and has one case
/// at every point of its design, integrated alone as `grapnel run` does it; docs/formats/study.md is its contract.
enum class CampaignKind { sweep, campaign };

/// One number that is drawn for every case.
struct CampaignInput {
  std::string name;  // "targets.target-1.mass", "targets.target-1.state.angular_velocity/x"
  std::string unit;  // of the number as shown
  std::string description;
};

/// How numbers are spread over the unit cube before they become values.
enum class Sampling { random, latin_hypercube, sobol };
template <>
struct Described<Sampling> : Enumeration<Sampling, "Sampling", "random", "latin_hypercube", "sobol"> {};

/// nominal: the approach is planned once, for the scenario as it stands, and every case follows that plan. per_case:
/// the planner knows each case's true values.
enum class CampaignPlan { nominal, per_case };
template <>
struct Described<CampaignPlan> : Enumeration<CampaignPlan, "CampaignPlan", "nominal", "per_case"> {};

/// Of which cases a complete run with its time series is kept: results as of `grapnel run`, in folders of their own.
struct SeriesToKeep {
  std::uint64_t sample = 0;    // the first so many cases
  std::uint64_t failures = 0;  // at most so many cases that failed, the first
  std::uint64_t worst = 0;     // so many cases with the largest `worst_by`
  std::string worst_by;        // a column
};

/// More cases than these a campaign cannot have, at all points of its design together and with those added later.
inline constexpr std::uint64_t kMostCases = 1'000'000'000;

struct Campaign {
  CampaignKind kind = CampaignKind::campaign;
  std::string name;
  std::string description;
  std::string file;    // as the user named it
  std::string text;    // its bytes
  std::string sha256;  // of the campaign's bytes and of its scenarios, with what those include and their settings
  StudyMode mode = StudyMode::run;
  std::uint64_t cases = 0;  // N; with design axes: per point of the design
  std::uint64_t seed = 0;
  Sampling sampling = Sampling::random;
  CampaignPlan plan = CampaignPlan::nominal;
  std::vector<CampaignInput> inputs;
  std::vector<StudyAxis> design;  // of a sweep or a success map; the first varies slowest. Empty: none
  std::vector<Column> columns;    // what is kept of each case
  /// A case is a success if it is ok and all of these hold for its columns' numbers followed by its inputs'.
  std::vector<Criterion> success;
  double confidence = 0.95;                                                // of the intervals in the results, two-sided
  std::vector<double> quantiles{0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};  // probabilities, increasing
  SeriesToKeep series;
  double time_limit = 0;  // of one case, on the wall [s]; 0: none

  /// The numbers of case k, one per input: a function of (campaign, seed, k) alone; with a design, of k % cases, so
  /// that its points meet the same numbers (common random numbers: their differences are the design's). Without a
  /// design k may be beyond `cases`: an extended campaign goes on with new numbers (`cases` here is then raised by the
  /// program, while draw() keeps what the file says).
  std::function<std::vector<double>(std::uint64_t k)> draw;
  /// The problem of case k. @throws std::exception where there is none; it becomes the case's reason.
  std::function<StudyCase(std::uint64_t k)> problem;
  /// The same as a complete scenario file, for a place on disk. @throws as `problem` does.
  std::function<std::string(std::uint64_t k, const std::filesystem::path& place, const std::string& comment)>
      scenario_text;

  /// All cases: `cases` times the points of the design. Case k belongs to design point k / cases.
  std::uint64_t total() const;
  /// The value on every axis of the design that point `point` has (grid_position()).
  std::vector<std::size_t> position(std::uint64_t point) const;
};

}  // namespace grapnel
