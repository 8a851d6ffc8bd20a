#pragma once

/// @file
/// Results from the rows of a campaign or a sweep: campaign.json, study.json, the terminal's summary, and warnings.
/// CampaignReport and SweepReport are these documents; campaign_json.cpp describes their fields, from which
/// docs/formats/campaign.md and study.md are generated.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/statistics.hpp"
#include "grapnel/campaign/success_map.hpp"
#include "grapnel/result/campaign_table.hpp"

namespace grapnel {

/// Statistics of all rows: campaign.json.
struct CampaignReport {
  struct Settings {
    std::string name, description, file, sha256, seed;
    Sampling sampling = Sampling::random;
    StudyMode simulate = StudyMode::run;
    CampaignPlan plan = CampaignPlan::nominal;
    std::uint64_t cases = 0, total = 0;
  };
  struct Limit {
    std::string name;
    bool at_most = true;  // false: at least
    double bound = 0;
    bool magnitude = false;
  };
  /// Rows that are ok and meet a criterion, those that are ok and in which no other one fails (others may not have been
  /// checked), and those that are ok but have not the numbers to check it; of these, those that no criterion refuses.
  struct CriterionCount {
    std::string name, text;
    std::uint64_t met = 0, only_this = 0, not_checked = 0, undecided = 0;
    Proportion share = {};  // of all rows that meet it
    std::vector<std::string> reads = {};
    std::vector<Limit> limits = {};
  };
  /// Groups of rows by the value of an input.
  struct SuccessBy {
    std::vector<double> from, to;  // least and largest value of each group
    std::vector<std::uint64_t> trials, successes;
  };
  struct Numbers {
    CampaignTable::Head head;
    Description description;
    Histogram histogram;
    std::vector<std::uint64_t> successes;  // per bin
    std::optional<SuccessBy> success_by;   // of inputs
  };
  /// Inputs that belong together, as the coordinates of a grasp point do; or one axis of the design.
  struct InputGroup {
    std::string name;
    std::vector<std::size_t> inputs;      // none: a design axis
    std::vector<std::string> names = {};  // of these
  };
  /// A number that is compared with every input.
  struct Measure {
    enum class Of { success, criterion, column };
    std::string name, unit;
    std::uint64_t count = 0;
    std::vector<Sensitivity> inputs;
    std::vector<Sensitivity> groups;  // rank correlations of groups of one only
    double unexplained = 0;           // share of the variance that no group alone explains; NaN if one is unknown
    Of of = Of::column;
  };
  struct Case {
    std::uint64_t index = 0;
    double value = 0;
    bool success = false;
    std::vector<double> inputs;
    std::string replay;  // replay_command()
  };
  struct Worst {
    std::size_t number = 0;  // of the columns
    std::string name, unit;  // of this one
    bool largest = true;     // false: smallest
    bool magnitude = false;
    std::vector<Case> cases;
  };
  /// Results of one grasp, over the rows that are ok.
  struct Grasp {
    struct Tolerance {
      std::string name;
      std::uint64_t exceeded = 0;  // number of rows
      std::uint64_t limiting = 0;  // number of rows in which it was exceeded by the largest factor
    };
    std::string end_effector;
    std::uint64_t captured = 0, missed = 0;
    std::vector<Tolerance> tolerances;  // of its envelope; empty: no envelope
  };
  struct Example {
    std::uint64_t index = 0;
    std::string reason, replay;
  };
  struct Reason {
    CaseStatus status = CaseStatus::failed;
    std::string text;  // numbers are replaced
    std::uint64_t count = 0;
    std::vector<Example> examples;
  };

  std::string version;  // the program's
  Settings settings;
  std::uint64_t rows = 0;
  std::array<std::uint64_t, 3> status{};  // per CaseStatus
  std::uint64_t success = 0;
  double confidence = 0.95;  // of all intervals
  std::vector<CriterionCount> criteria;
  std::vector<Numbers> inputs, columns;
  std::vector<InputGroup> groups;  // every input is in one
  std::vector<Measure> measures;   // the first is success; numbers that are all the same are left out
  std::uint64_t measures_left_out = 0;
  std::vector<std::string> rounding;  // columns whose numbers differ only by rounding error
  std::vector<Worst> worst;
  std::vector<Reason> reasons;
  std::uint64_t reasons_left_out = 0;  // cases with others
  std::vector<Reason> failures;        // why cases are no success, each counted once: their status, or unmet criteria
  std::uint64_t failures_left_out = 0;
  std::vector<Grasp> grasps;
  std::uint64_t assumed = 0;          // successes with a grasp that is assumed to hold without an envelope
  std::vector<std::string> warnings;  // limits of the numbers above
  std::vector<StudyAxis> axes;        // of the design
  std::vector<SuccessMapPoint> success_map;
  std::string text;  // of the campaign file

  Proportion success_rate() const { return wilson(success, rows, confidence); }
};
template <>
const Type& type_of<CampaignReport>();

/// Settings of a sweep and how its points ended: study.json.
struct SweepReport {
  struct Settings {
    std::string name, file, sha256;
    StudyMode simulate = StudyMode::run;
  };
  std::string version;  // the program's
  Settings settings;
  std::uint64_t points = 0;
  std::array<std::uint64_t, 3> status{};  // per CaseStatus
  std::vector<StudyAxis> axes;
  std::vector<Column> columns;
  std::string text;  // of the study file
};
template <>
const Type& type_of<SweepReport>();

/// Each of at most eight of the `threads` reads one column at a time: about 200 bytes per row, for any number of
/// columns. The same rows give the same report, bit for bit. `version` is the program's. @throws std::runtime_error
/// naming path and error, also if the table belongs to another campaign.
CampaignReport analyze_campaign(const Campaign& campaign, const CampaignTable& table, const std::string& version,
                                int threads = 1);

/// Text of campaign.json.
std::string campaign_json(const CampaignReport& report);

/// Summary for the terminal: probability with its interval, criteria, reasons for which cases are not a success,
/// quantiles of the criteria's numbers, the most influential inputs, worst cases with the command that replays each.
std::string campaign_summary(const Campaign& campaign, const CampaignReport& report);

/// Text of study.json.
std::string sweep_json(const Campaign& sweep, std::span<const CaseRow> rows, const std::string& version);

/// The same for a terminal: points and how they ended, the axes, minimum and maximum of the main columns, and the
/// reasons of points that are not ok, the most frequent first.
std::string sweep_summary(const Campaign& sweep, std::span<const CaseRow> rows);

/// How many rows have a status.
std::size_t count_of(std::span<const CaseRow> rows, CaseStatus status);

/// The command that runs a case again, with its full report.
std::string replay_command(const Campaign& campaign, std::uint64_t k);

/// A reason without its numbers, so that cases of one kind are counted together: "no convergence at t = … s".
std::string without_numbers(const std::string& reason);

// --- Access to the rows for the parts of the analysis. For campaign_*.cpp. ---

/// Input of all parts of the analysis.
struct Rows {
  const Campaign& campaign;
  const CampaignTable& table;
  std::vector<std::uint64_t> index;
  std::vector<std::uint8_t> status, success;

  std::size_t count() const { return index.size(); }
  bool ok(std::size_t row) const { return status[row] == static_cast<std::uint8_t>(CaseStatus::ok); }
  /// A number by its index among columns and inputs.
  std::vector<double> numbers(std::size_t i) const { return table.numbers(head(i)); }
  void read(std::size_t i, std::size_t first, std::span<double> out) const { table.read(head(i), first, out); }
  const CampaignTable::Head& head(std::size_t i) const {
    const std::size_t columns = table.columns().size();
    return i < columns ? table.columns()[i] : table.inputs()[i - columns];
  }
};

/// Writes `criteria`, `failures` of rows that are ok, `assumed`, and the decisive criteria of the success map.
void count_criteria(const Rows& rows, CampaignReport& report);
/// Writes `reasons`, and adds them to `failures`.
void count_reasons(const Rows& rows, CampaignReport& report);
/// Writes `grasps`.
void count_grasps(const Rows& rows, CampaignReport& report);
/// Writes `warnings`, from all counts.
void name_missing(const Campaign& campaign, CampaignReport& report);
/// Writes `groups`, `measures` and `rounding`. `inputs`: their rankings; reads `columns`.
void measure_influences(const Rows& rows, const std::vector<Ranking>& inputs, int threads, CampaignReport& report);

/// An input for the measurement of its influence: without the influence of the design.
std::vector<double> apart_from_design(const Rows& rows, std::vector<double> numbers);

/// The name of a number by its index among columns and inputs.
const std::string& name_of_number(const Campaign& campaign, std::size_t i);

/// A column's index; the number of columns if there is none of the name.
std::size_t column_named(const Campaign& campaign, const std::string& name);

}  // namespace grapnel
