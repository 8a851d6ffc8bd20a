#pragma once

/// @file
/// What a campaign's rows say: campaign.json and the terminal's summary. docs/formats/campaign.md is the contract of
/// the former. Thread safety: reentrant.

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/campaign_table.hpp"
#include "grapnel/campaign/envelope.hpp"
#include "grapnel/campaign/sensitivity.hpp"
#include "grapnel/campaign/statistics.hpp"

namespace grapnel {

/// Numbers of all rows, without the rows.
struct CampaignReport {
  /// Rows that are ok and meet a criterion, and those that are ok and fail nothing else.
  struct CriterionCount {
    std::uint64_t met = 0, only_this = 0;
  };
  struct Numbers {
    CampaignTable::Head head;
    Description description;
    Histogram histogram;
    std::vector<std::uint64_t> successes;  // per bin
  };
  /// Groups of rows by the value of an input.
  struct SuccessBy {
    std::vector<double> from, to;  // least and largest value of each group
    std::vector<std::uint64_t> trials, successes;
  };
  /// A number that is compared with every input.
  struct Measure {
    std::string name, unit;
    std::uint64_t count = 0;
    std::vector<Sensitivity> inputs;
  };
  struct Case {
    std::uint64_t index = 0;
    double value = 0;
    bool success = false;
    std::vector<double> inputs;
  };
  struct Worst {
    std::size_t number = 0;  // of the columns, then the inputs
    bool largest = true;     // else least
    bool magnitude = false;
    std::vector<Case> cases;
  };
  struct Reason {
    CaseStatus status = CaseStatus::failed;
    std::string text;  // numbers are replaced
    std::uint64_t count = 0;
    std::vector<std::pair<std::uint64_t, std::string>> examples;
  };

  std::uint64_t rows = 0;
  std::array<std::uint64_t, 3> status{};  // per CaseStatus
  std::uint64_t success = 0;
  std::vector<CriterionCount> criteria;
  std::vector<Numbers> inputs, columns;
  std::vector<SuccessBy> success_by;  // per input
  std::vector<Measure> measures;      // the first is success; numbers that are all the same are left out
  std::uint64_t measures_left_out = 0;
  std::vector<Worst> worst;
  std::vector<Reason> reasons;
  std::uint64_t reasons_left_out = 0;  // cases with others
  std::vector<EnvelopePoint> envelope;
};

/// Reads a column at a time: about 200 bytes a row at once, whatever their number. The same rows give the same report,
/// bit for bit. @throws std::runtime_error naming path and fault, also if the table is of another campaign.
CampaignReport analyze_campaign(const Campaign& campaign, const CampaignTable& table);

/// Text of campaign.json. `version` is the program's.
std::string campaign_json(const Campaign& campaign, const CampaignReport& report, const std::string& version);

/// What the terminal shows at the end: probability with its interval, criteria, quantiles of the criteria's numbers,
/// what matters most, worst cases with the command that replays each, why cases failed.
std::string campaign_summary(const Campaign& campaign, const CampaignReport& report);

/// The command that runs a case again, with its full report.
std::string replay_command(const Campaign& campaign, std::uint64_t k);

/// A reason without its numbers, so that cases of one kind are counted together: "no convergence at t = … s".
std::string without_numbers(const std::string& reason);

}  // namespace grapnel
