#pragma once

/// @file
/// A campaign: many captures, and the stored values of each. They differ in values that are drawn at random, in stated
/// values (the design: the points of a grid), or in both. Plain data, functions that define a case, and functions that
/// compute cases alone or in blocks; campaign/study_files.hpp reads campaigns from files. Thread safety: plain
/// values; the functions may be called from any thread.

#include <chrono>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/campaign/column.hpp"
#include "grapnel/campaign/criterion.hpp"
#include "grapnel/campaign/grid.hpp"
#include "grapnel/capture/capture_steps.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel {

/// Kind of the campaign's file, which determines the result files. A sweep draws no values and has one case at every
/// point of its design, integrated alone as by `grapnel run`; docs/formats/study.md is its contract.
enum class CampaignKind { sweep, campaign };

/// A number that is drawn for every case.
struct CampaignInput {
  std::string name;  // "targets.target-1.mass", "targets.target-1.state.angular_velocity/x"
  std::string unit;  // unit of the displayed number
  std::string description;
};

/// Sampling of the unit cube before the transformation to values.
enum class Sampling { random, latin_hypercube, sobol };
template <>
struct Described<Sampling> : Enumeration<Sampling, "Sampling", "random", "latin_hypercube", "sobol"> {};

/// nominal: the approach is planned once for the nominal scenario, and every case follows that plan. per_case: the
/// planner uses each case's true values.
enum class CampaignPlan { nominal, per_case };
template <>
struct Described<CampaignPlan> : Enumeration<CampaignPlan, "CampaignPlan", "nominal", "per_case"> {};

/// Cases that are stored with complete results and time series, as by `grapnel run`, in separate folders.
struct SeriesSelection {
  std::uint64_t sample = 0;    // number of first cases
  std::uint64_t failures = 0;  // largest number of failed cases, the first ones
  std::uint64_t worst = 0;     // number of cases with the largest `worst_by`
  std::string worst_by;        // a column
};

/// Limit on the number of cases of a campaign, at all points of its design together and including extensions.
inline constexpr std::uint64_t kMostCases = 1'000'000'000;

struct Campaign {
  CampaignKind kind = CampaignKind::campaign;
  std::string name;
  std::string description;
  std::string file;    // path given by the user
  std::string text;    // its bytes
  std::string sha256;  // of the campaign's bytes and of its scenarios, with included files and settings
  StudyMode mode = StudyMode::run;
  std::uint64_t cases = 0;  // N; with design axes: per point of the design
  std::uint64_t seed = 0;
  Sampling sampling = Sampling::random;
  CampaignPlan plan = CampaignPlan::nominal;
  std::vector<CampaignInput> inputs;
  std::vector<StudyAxis> design;  // axes of a sweep or a success map; the first varies slowest. Empty: none
  std::vector<Column> columns;    // stored values of each case
  /// A case is a success if it is ok and meets all these criteria for the numbers of its columns, followed by its
  /// inputs.
  std::vector<Criterion> success;
  double confidence = 0.95;                                                // of the intervals in the results, two-sided
  std::vector<double> quantiles{0.01, 0.05, 0.25, 0.5, 0.75, 0.95, 0.99};  // probabilities, increasing
  SeriesSelection series;
  double time_limit = 0;  // wall time of one case [s]; 0: none

  /// The numbers of case k, one per input: a function of (campaign, seed, k) alone; with a design, of k % cases, so
  /// that its points meet the same numbers (common random numbers: their differences are the design's). Without a
  /// design k may be beyond `cases`: an extended campaign continues with new numbers (`cases` here is then raised by
  /// the program, while draw() uses the number in the file).
  std::function<std::vector<double>(std::uint64_t k)> draw;
  /// The problem of case k. @throws std::exception if there is none; its message becomes the case's reason.
  std::function<StudyCase(std::uint64_t k)> problem;
  /// The same as a complete scenario file at a path. @throws as `problem` does.
  std::function<std::string(std::uint64_t k, const std::filesystem::path& place, const std::string& comment)>
      scenario_text;

  /// Number of all cases: `cases` times the points of the design. Case k belongs to design point k / cases.
  std::uint64_t total() const;
  /// The value on every axis of the design that point `point` has (grid_position()).
  std::vector<std::size_t> position(std::uint64_t point) const;
};

// Cases of a campaign, alone and in blocks. Blocks only divide the work; rows do not depend on them.

/// Cases begin to end (not included).
struct Block {
  std::uint64_t number = 0;
  std::uint64_t begin = 0, end = 0;
};

/// Block `number` of a division of `total` cases into blocks of `size` cases.
Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total);
std::uint64_t block_count(std::uint64_t size, std::uint64_t total);

/// Computes the rows of a block, in the order of their indices. Errors of cases are the reasons of their rows. Called
/// concurrently from several threads, also with a part of a block (long blocks are divided). After a stop request it
/// returns the first rows that are complete without a gap.
using BlockWork = std::function<std::vector<CaseRow>(const Block&, const std::stop_token&)>;

/// Selects the function that computes rows: SIMD lanes if they support the campaign (docs/modules.md), else case by
/// case. The campaign must outlive it.
BlockWork block_work(const Campaign& campaign);

/// Number of concurrent cases of a block: 16 per AVX-512 lane, so that lanes are rarely empty, and few enough to keep
/// their memory allocated: 390 concurrent cases took 5 % more time, most of it system time for releasing and requesting
/// pages (docs/performance.md).
inline constexpr std::size_t kCasesInProgress = 128;

/// Computes the rows of a block concurrently: segments are integrated in SIMD lanes, all other work is done case by
/// case. A segment that lanes do not support (reason_alone()) is integrated alone, as by run_campaign_case(). This
/// selection, and every number of a row, depend only on the case. After a stop request it returns fewer rows, or none.
/// `in_progress`: as kCasesInProgress, at least one; rows do not depend on it.
std::vector<CaseRow> run_block_in_lanes(const Campaign& campaign, const Block& block, lanes::InstructionSet set,
                                        const std::stop_token& stop, std::size_t in_progress = kCasesInProgress);

/// Why a segment is integrated alone; empty: it is integrated in lanes.
std::string reason_alone(const MotionTask& task);

/// Computes one case alone, as `block_work` without lanes. Empty if it was stopped. A case that exceeds the campaign's
/// time limit becomes a failed row without values; the limit is checked when the capture reports progress.
std::optional<CaseRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop = {});

/// Whether an ok row meets all criteria. Their numbers are a row's columns, then its inputs.
bool is_success(const Campaign& campaign, const CaseRow& row);

// --- Time limits and stop requests ---

/// Thrown through an abandoned simulation. Not a std::exception, because it is not an error of the case.
struct CaseStopped {};
/// Start of the reason of a case that exceeded the time limit.
inline constexpr std::string_view kTookTooLong = "took longer than the time limit of";
/// Thrown through a simulation that exceeds the time limit. Not a std::runtime_error, which a capture would report as a
/// numerical failure.
struct CaseTooLong : std::exception {
  explicit CaseTooLong(double limit);
  const char* what() const noexcept override { return text.c_str(); }
  std::string text;
};

/// Measures the time of one case, from resume() to pause().
class CaseClock {
 public:
  CaseClock(const Campaign& campaign, std::stop_token stop) : limit_(campaign.time_limit), stop_(std::move(stop)) {}
  void resume() { since_ = Clock::now(); }
  void pause() { spent_ += Clock::now() - since_; }
  /// @throws CaseStopped, CaseTooLong. Between resume() and pause().
  void check() const;
  /// For simulate_capture() and CaptureSteps; the clock must outlive it.
  CaptureProgress watch() const {
    return [this](const std::string&, double, double) { check(); };
  }

 private:
  using Clock = std::chrono::steady_clock;
  double limit_;  // [s]; 0: none
  std::stop_token stop_;
  Clock::time_point since_ = Clock::now();
  Clock::duration spent_{};
};

}  // namespace grapnel
