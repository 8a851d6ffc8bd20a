// Reasons for which cases are not a success, and warnings about success rates.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "grapnel/campaign/campaign_report.hpp"

namespace grapnel {
namespace {

using Reason = CampaignReport::Reason;

constexpr std::size_t kRowsAtOnce = 1 << 14;  // for code that needs many columns together
constexpr std::size_t kMostReasons = 50;
constexpr std::size_t kMostKinds = 10000;  // of reasons that are counted separately
constexpr std::size_t kExamples = 3;
constexpr double kEdge = 1e-9;  // a grasp that closes by an event is at its tolerance to within rounding error

// Calls `take` with every row that is ok and its numbers, of which only those at `reads` are set.
template <class Take>
void for_each_ok_row(const Rows& rows, const std::set<std::size_t>& reads, Take&& take) {
  std::map<std::size_t, std::vector<double>> block;
  std::vector<double> numbers(rows.campaign.columns.size() + rows.campaign.inputs.size(), NAN);
  for (std::size_t first = 0; first < rows.count(); first += kRowsAtOnce) {
    const std::size_t size = std::min(kRowsAtOnce, rows.count() - first);
    for (const std::size_t i : reads) {
      block[i].resize(size);
      rows.read(i, first, block[i]);
    }
    for (std::size_t row = 0; row < size; ++row) {
      if (!rows.ok(first + row)) continue;
      for (const auto& [i, values] : block) numbers[i] = values[row];
      take(first + row, numbers);
    }
  }
}

// --- Grasps ---

// The columns of a grasp's outcome.
struct GraspColumns {
  std::string end_effector;
  std::size_t captured = 0;
  std::vector<std::pair<std::string, std::size_t>> tolerances;  // by name: value over tolerance
  std::optional<std::size_t> lost = {};                         // of a grasp with limits: time of a loss

  // Why it is not captured: 0, it is; one plus its limiting tolerance; then without a cause, and by a loss.
  std::size_t cause(const std::vector<double>& numbers) const {
    if (numbers[captured] != 0) return 0;
    const std::size_t worst = limiting(numbers);
    const bool by_loss = worst == tolerances.size() && lost && !std::isnan(numbers[*lost]);
    return 1 + worst + by_loss;
  }

  // The tolerance that is exceeded by the largest factor; the number of tolerances if none is exceeded.
  std::size_t limiting(const std::vector<double>& numbers) const {
    std::size_t worst = tolerances.size();
    for (std::size_t t = 0; t < tolerances.size(); ++t) {
      const double used = numbers[tolerances[t].second];
      if (used > 1 + kEdge && (worst == tolerances.size() || used > numbers[tolerances[worst].second])) worst = t;
    }
    return worst;
  }
};

std::vector<GraspColumns> grasp_columns(const Campaign& campaign) {
  constexpr std::string_view kGrasps = "grasps/", kCaptured = "/captured", kUsed = "/tolerance_used/";
  std::vector<GraspColumns> grasps;
  for (std::size_t i = 0; i < campaign.columns.size(); ++i) {
    const std::string& name = campaign.columns[i].name;
    if (!name.starts_with(kGrasps) || !name.ends_with(kCaptured)) continue;
    const std::string prefix = name.substr(0, name.size() - kCaptured.size());
    GraspColumns grasp{prefix.substr(kGrasps.size()), i, {}};
    for (std::size_t j = 0; j < campaign.columns.size(); ++j) {
      const std::string& other = campaign.columns[j].name;
      if (other.starts_with(prefix + std::string(kUsed)))
        grasp.tolerances.emplace_back(other.substr(prefix.size() + kUsed.size()), j);
      if (other == prefix + "/lost") grasp.lost = j;
    }
    grasps.push_back(std::move(grasp));
  }
  return grasps;
}

void add_reads(const std::vector<GraspColumns>& grasps, std::set<std::size_t>& reads) {
  for (const GraspColumns& grasp : grasps) {
    reads.insert(grasp.captured);
    for (const auto& [name, column] : grasp.tolerances) reads.insert(column);
    if (grasp.lost) reads.insert(*grasp.lost);
  }
}

// --- Kinds of failures ---

void add_example(const Rows& rows, std::size_t row, const std::string& text, Reason& reason) {
  ++reason.count;
  if (reason.examples.size() < kExamples)
    reason.examples.push_back({rows.index[row], text, replay_command(rows.campaign, rows.index[row])});
}

// The most frequent first; those beyond the list are counted.
void put_in_order(std::vector<Reason>& reasons, std::uint64_t& left_out) {
  std::stable_sort(reasons.begin(), reasons.end(), [](const Reason& a, const Reason& b) {
    return a.count != b.count ? a.count > b.count : a.examples.front().index < b.examples.front().index;
  });
  for (std::size_t i = kMostReasons; i < reasons.size(); ++i) left_out += reasons[i].count;
  if (reasons.size() > kMostReasons) reasons.resize(kMostReasons);
}

bool reads_capture(const Campaign& campaign, const Criterion& criterion) {
  return std::any_of(criterion.reads().begin(), criterion.reads().end(), [&](std::size_t i) {
    if (i >= campaign.columns.size()) return false;
    const std::string& name = campaign.columns[i].name;
    return name == "captured" || (name.starts_with("grasps/") && name.ends_with("/captured"));
  });
}

CampaignReport::CriterionCount not_counted(const Campaign& campaign, const Criterion& criterion) {
  CampaignReport::CriterionCount made{criterion.name(), criterion.text()};
  for (const std::size_t i : criterion.reads()) made.reads.push_back(name_of_number(campaign, i));
  for (const CriterionLimit& limit : criterion.limits())
    made.limits.push_back({name_of_number(campaign, limit.number), limit.at_most, limit.bound, limit.magnitude});
  return made;
}

// The failure of a row as numbers for fast comparison: per criterion its verdict, per grasp GraspColumns::cause().
using Signature = std::vector<std::uint16_t>;  // not bytes: g++ 12 warns falsely of their comparison at -O3

class CriteriaCounter {
 public:
  CriteriaCounter(const Rows& rows, CampaignReport& report)
      : rows_(rows), report_(report), criteria_(rows.campaign.success), grasps_(grasp_columns(rows.campaign)) {
    for (const Criterion& criterion : criteria_) capture_ = capture_ || reads_capture(rows.campaign, criterion);
    judged_ = capture_ ? column_named(rows.campaign, "captured/judged") : rows.campaign.columns.size();
    for (const Criterion& criterion : criteria_) report.criteria.push_back(not_counted(rows.campaign, criterion));
  }

  void count() {
    std::set<std::size_t> reads;
    for (const Criterion& criterion : criteria_) reads.insert(criterion.reads().begin(), criterion.reads().end());
    if (capture_) add_reads(grasps_, reads);
    if (judged_ < rows_.campaign.columns.size()) reads.insert(judged_);
    for_each_ok_row(rows_, reads, [&](std::size_t row, const std::vector<double>& numbers) { take(row, numbers); });
    for (auto& [signature, reason] : kinds_) report_.failures.push_back(std::move(reason));
    for (CampaignReport::CriterionCount& criterion : report_.criteria)
      criterion.share = wilson(criterion.met, report_.rows, rows_.campaign.confidence);
  }

 private:
  void take(std::size_t row, const std::vector<double>& numbers) {
    Signature signature;
    std::size_t unmet = 0, refused = 0;
    for (const Criterion& criterion : criteria_) {
      const Verdict verdict = criterion.judge(numbers);
      signature.push_back(static_cast<std::uint8_t>(verdict));
      unmet += verdict != Verdict::yes;
      refused += verdict == Verdict::no;
    }
    for (std::size_t c = 0; c < criteria_.size(); ++c) {
      const auto verdict = static_cast<Verdict>(signature[c]);
      CampaignReport::CriterionCount& counted = report_.criteria[c];
      counted.met += verdict == Verdict::yes;
      // If a criterion fails, criteria that could not be checked, such as impulses without a capture, do not count.
      const bool fails = refused > 0 ? verdict == Verdict::no : verdict != Verdict::yes;
      counted.only_this += fails && (refused > 0 ? refused : unmet) == 1;
      counted.not_checked += verdict == Verdict::not_checked;
      counted.undecided += refused == 0 && verdict == Verdict::not_checked;
      if (fails && !report_.success_map.empty())
        ++report_.success_map[rows_.index[row] / rows_.campaign.cases].unmet[c];
    }
    if (unmet == 0) {
      report_.assumed += judged_ < rows_.campaign.columns.size() && numbers[judged_] == 0;
      return;
    }
    if (capture_) {
      for (const GraspColumns& grasp : grasps_) signature.push_back(static_cast<std::uint8_t>(grasp.cause(numbers)));
    }
    auto kind = kinds_.find(signature);
    if (kind == kinds_.end()) {
      if (kinds_.size() >= kMostKinds) {
        ++report_.failures_left_out;
        return;
      }
      kind = kinds_.emplace(signature, Reason{CaseStatus::ok, text_of(signature), 0, {}}).first;
    }
    add_example(rows_, row, kind->second.text, kind->second);
  }

  std::string names_of(const Signature& signature, Verdict verdict) const {
    std::string names;
    for (std::size_t c = 0; c < criteria_.size(); ++c) {
      if (static_cast<Verdict>(signature[c]) == verdict) names += (names.empty() ? "" : ", ") + criteria_[c].name();
    }
    return names;
  }

  // "not met: captured (tip-1 misses by position); not checked: soft"
  std::string text_of(const Signature& signature) const {
    std::string misses;
    for (std::size_t g = 0; criteria_.size() + g < signature.size(); ++g) {
      const std::size_t code = signature[criteria_.size() + g];
      if (code == 0) continue;
      const auto& tolerances = grasps_[g].tolerances;
      misses += (misses.empty() ? "" : ", ") + grasps_[g].end_effector;
      misses += code - 1 > tolerances.size() ? " loses its target" : " misses";
      if (code - 1 < tolerances.size()) misses += " by " + tolerances[code - 1].first;
    }
    const std::string refused = names_of(signature, Verdict::no), unknown = names_of(signature, Verdict::not_checked);
    std::string text;
    if (!refused.empty()) text = "not met: " + refused;
    if (!unknown.empty()) text += (text.empty() ? "" : "; ") + std::string("not checked: ") + unknown;
    return misses.empty() ? text : text + " (" + misses + ")";
  }

  const Rows& rows_;
  CampaignReport& report_;
  const std::vector<Criterion>& criteria_;
  const std::vector<GraspColumns> grasps_;
  bool capture_ = false;    // a criterion requires closed grasps
  std::size_t judged_ = 0;  // column
  std::map<Signature, Reason> kinds_;
};

// Failed conservation checks are one kind; the reasons of the cases name the row and its value.
std::string kind_of(const std::string& reason) {
  constexpr std::string_view kConservation = "conservation check failed";
  return reason.starts_with(kConservation) ? std::string(kConservation) : without_numbers(reason);
}

}  // namespace

const std::string& name_of_number(const Campaign& campaign, std::size_t i) {
  return i < campaign.columns.size() ? campaign.columns[i].name : campaign.inputs[i - campaign.columns.size()].name;
}

std::size_t column_named(const Campaign& campaign, const std::string& name) {
  const auto found = std::find_if(campaign.columns.begin(), campaign.columns.end(),
                                  [&](const Column& column) { return column.name == name; });
  return static_cast<std::size_t>(found - campaign.columns.begin());
}

void count_criteria(const Rows& rows, CampaignReport& report) { CriteriaCounter(rows, report).count(); }

void count_grasps(const Rows& rows, CampaignReport& report) {
  const std::vector<GraspColumns> grasps = grasp_columns(rows.campaign);
  for (const GraspColumns& grasp : grasps) {
    report.grasps.push_back({grasp.end_effector, 0, 0, {}});
    for (const auto& [name, column] : grasp.tolerances) report.grasps.back().tolerances.push_back({name, 0, 0});
  }
  std::set<std::size_t> reads;
  add_reads(grasps, reads);
  if (reads.empty()) return;
  for_each_ok_row(rows, reads, [&](std::size_t, const std::vector<double>& numbers) {
    for (std::size_t g = 0; g < grasps.size(); ++g) {
      CampaignReport::Grasp& counted = report.grasps[g];
      const double captured = numbers[grasps[g].captured];
      counted.captured += captured == 1;
      counted.missed += captured == 0;
      for (std::size_t t = 0; t < grasps[g].tolerances.size(); ++t)
        counted.tolerances[t].exceeded += numbers[grasps[g].tolerances[t].second] > 1 + kEdge;
      const std::size_t limiting = captured == 0 ? grasps[g].limiting(numbers) : grasps[g].tolerances.size();
      if (limiting < grasps[g].tolerances.size()) ++counted.tolerances[limiting].limiting;
    }
  });
}

void count_reasons(const Rows& rows, CampaignReport& report) {
  const std::vector<std::int32_t> numbers = rows.table.reasons();
  std::map<std::int32_t, std::string> texts;  // cache of the last texts: many rows have the same
  std::map<std::pair<std::uint8_t, std::string>, Reason> kinds;
  for (std::size_t row = 0; row < rows.count(); ++row) {
    if (rows.ok(row)) continue;
    auto known = texts.find(numbers[row]);
    if (known == texts.end()) {
      if (texts.size() >= kMostKinds) texts.clear();
      known = texts.emplace(numbers[row], rows.table.reason_texts({numbers[row]})[0]).first;
    }
    const std::string kind = kind_of(known->second);
    auto group = kinds.find({rows.status[row], kind});
    if (group == kinds.end()) {
      if (kinds.size() >= kMostKinds) {
        ++report.reasons_left_out;
        continue;
      }
      const Reason first{static_cast<CaseStatus>(rows.status[row]), kind, 0, {}};
      group = kinds.emplace(std::pair(rows.status[row], kind), first).first;
    }
    add_example(rows, row, known->second, group->second);
  }
  report.failures_left_out += report.reasons_left_out;
  for (auto& [key, reason] : kinds) {
    report.failures.push_back(reason);
    report.reasons.push_back(std::move(reason));
  }
  put_in_order(report.reasons, report.reasons_left_out);
  put_in_order(report.failures, report.failures_left_out);
}

void name_missing(const Campaign& campaign, CampaignReport& report) {
  const std::uint64_t ok = report.status[static_cast<std::size_t>(CaseStatus::ok)];
  const auto warn = [&](std::string text) { report.warnings.push_back(std::move(text)); };
  if (ok == 0) return;
  if (campaign.success.empty())
    warn("no criteria are given: every completed case counts as a success without further checks");
  const bool all_assumed = report.assumed > 0 && report.assumed == report.success;
  if (report.assumed > 0)
    warn(
        fmt::format("{} successes the grasps are assumed to close: end-effectors without an 'envelope' hold without a "
                    "check of position and velocity",
                    all_assumed ? "in all" : fmt::format("in {} of {}", report.assumed, report.success)));
  for (std::size_t c = 0; c < campaign.success.size(); ++c) {
    const CampaignReport::CriterionCount& counted = report.criteria[c];
    const std::string name = "criterion '" + campaign.success[c].name() + "'";
    if (counted.undecided > 0)
      warn(
          fmt::format("{} was not checked in {} of {} cases, because a number that it reads does not exist: they do "
                      "not count as a success",
                      name, counted.undecided, ok));
    if (counted.met == ok && !(all_assumed && reads_capture(campaign, campaign.success[c])))
      warn(fmt::format("{} never fails: all {} cases that are ok meet it, so it has no effect", name, ok));
    else if (counted.met == 0 && counted.not_checked < ok)
      warn(fmt::format("{} never holds: none of {} cases that are ok meets it", name, ok));
  }
}

std::string without_numbers(const std::string& reason) {
  const auto is_digit = [&](std::size_t i) { return i < reason.size() && reason[i] >= '0' && reason[i] <= '9'; };
  // Digits in names remain: "tip-1", "arm2".
  const auto in_word = [&](std::size_t i) {
    const auto c = static_cast<unsigned char>(reason[i]);
    return std::isalnum(c) || c == '_' || c == '-' || c == '.' || c == '/' || c == '\'' || c >= 0x80;
  };
  std::string text;
  for (std::size_t i = 0; i < reason.size();) {
    const bool begins = i == 0 || !in_word(i - 1);
    std::size_t end = i;
    if (begins && (reason[end] == '-' || reason[end] == '+')) ++end;
    if (!begins || !is_digit(end)) {
      text += reason[i++];
      continue;
    }
    while (is_digit(end) || (end < reason.size() && reason[end] == '.' && is_digit(end + 1))) ++end;
    std::size_t power = end;
    if (power < reason.size() && (reason[power] == 'e' || reason[power] == 'E')) {
      ++power;
      if (power < reason.size() && (reason[power] == '-' || reason[power] == '+')) ++power;
      if (is_digit(power)) {
        end = power;
        while (is_digit(end)) ++end;
      }
    }
    text += "…";
    i = end;
  }
  return text;
}

}  // namespace grapnel
