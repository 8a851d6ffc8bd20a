#pragma once

/// @file
/// A campaign: many captures, and what is kept of each. They differ in values that are drawn at random, in stated ones
/// (its design: the points of a grid), or in both. Plain data and functions that say what a case is, and compute cases
/// alone or in blocks; study_files/study_files.hpp makes them from files. Thread safety: plain values; the functions
/// may be called from any thread.

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

#include "grapnel/campaign/criterion.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/pack/dispatch.hpp"
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

// Cases of a campaign, alone and in blocks. Blocks only divide the work; no row depends on them.

/// Cases begin to end (not included).
struct Block {
  std::uint64_t number = 0;
  std::uint64_t begin = 0, end = 0;
};

/// Number `number` of the blocks of `size` cases that make up `total` cases.
Block block_at(std::uint64_t number, std::uint64_t size, std::uint64_t total);
std::uint64_t block_count(std::uint64_t size, std::uint64_t total);

/// Rows of a block, in the order of their indices. Faults of cases are their rows' reasons. Called from several threads
/// at once, also with a part of a block (a long one is done in parts). A stop request may end it early: it then returns
/// the first rows, as many as are complete without a gap.
using BlockWork = std::function<std::vector<CaseRow>(const Block&, const std::stop_token&)>;

/// The way from cases to rows that suits the campaign: lanes where they can (docs/modules.md), else one by
/// one. The campaign must outlive it.
BlockWork block_work(const Campaign& campaign);

/// Cases of a block that are under way at once: 16 for each of AVX-512's lanes, so that lanes are rarely empty, and so
/// few that what they hold is still at hand: 390 at once took 5 % more time, most of it the system's, for pages given
/// back and asked for again (docs/performance.md).
inline constexpr std::size_t kCasesUnderWay = 128;

/// The rows of a block's cases side by side: their pieces of motion are integrated in SIMD lanes, everything else case
/// by case. A piece of motion that lanes do not know (reason_alone()) is integrated alone, as run_campaign_case()
/// does it. Which pieces those are, and every number of a row, follow from the case alone. After a stop request fewer
/// rows, or none. `under_way`: as kCasesUnderWay, at least one; rows do not depend on it.
std::vector<CaseRow> run_block_in_lanes(const Campaign& campaign, const Block& block, lanes::InstructionSet set,
                                        const std::stop_token& stop, std::size_t under_way = kCasesUnderWay);

/// Why a piece of motion is integrated alone; empty: it is for lanes.
std::string reason_alone(const MotionTask& task);

/// One case, one by one: as `block_work` without lanes does it. Nothing if it was stopped. A case that takes longer
/// than the campaign's time limit is a failed row without values; the limit is looked at when the capture reports
/// progress.
std::optional<CaseRow> run_campaign_case(const Campaign& campaign, std::uint64_t k, const std::stop_token& stop = {});

/// Whether an ok row meets all criteria. Their numbers are a row's columns, then its inputs.
bool is_success(const Campaign& campaign, const CaseRow& row);

// --- How long a case may take, and whether anybody still wants it ---

/// Thrown through a simulation that is given up. Not a std::exception: it is no fault of the case.
struct CaseStopped {};
/// How the reason of a case that took too long begins.
inline constexpr std::string_view kTookTooLong = "took longer than the time limit of";
/// Thrown through a simulation that takes too long. Not a std::runtime_error, which a capture takes for a numerical
/// failure of its own.
struct CaseTooLong : std::exception {
  explicit CaseTooLong(double limit);
  const char* what() const noexcept override { return text.c_str(); }
  std::string text;
};

/// Counts a case's own time, from resume() to pause().
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
