#include <nlohmann/json.hpp>

#include "grapnel/campaign/campaign_report.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

void add_proportion(Json& json, const Proportion& p) {
  json["estimate"] = p.estimate;
  json["lower"] = p.lower;
  json["upper"] = p.upper;
}

std::string name_of_number(const Campaign& campaign, std::size_t i) {
  return i < campaign.columns.size() ? campaign.columns[i].name : campaign.inputs[i - campaign.columns.size()].name;
}

Json values_of(const StudyAxis& axis) {
  Json values = Json::array();
  for (const AxisValue& value : axis.values) values.push_back(axis.is_numeric ? Json(value.number) : Json(value.label));
  return values;
}

Json settings_of(const Campaign& campaign) {
  return {{"name", campaign.name},
          {"description", campaign.description},
          {"file", std::filesystem::path(campaign.file).filename().string()},
          {"sha256", campaign.sha256},
          {"seed", std::to_string(campaign.seed)},
          {"sampling", name_of(campaign.sampling)},
          {"simulate", name_of(campaign.mode)},
          {"plan", name_of(campaign.plan)},
          {"cases", campaign.cases},
          {"total", campaign.total()}};
}

Json criteria_of(const Campaign& campaign, const CampaignReport& report) {
  Json list = Json::array();
  for (std::size_t c = 0; c < campaign.success.size(); ++c) {
    const Criterion& criterion = campaign.success[c];
    Json item{{"name", criterion.name()}, {"text", criterion.text()}, {"met", report.criteria[c].met}};
    add_proportion(item, wilson(report.criteria[c].met, report.rows, campaign.confidence));
    item["only_this"] = report.criteria[c].only_this;
    item["not_checked"] = report.criteria[c].not_checked;
    item["reads"] = Json::array();
    for (const std::size_t i : criterion.reads()) item["reads"].push_back(name_of_number(campaign, i));
    item["limits"] = Json::array();
    for (const CriterionLimit& limit : criterion.limits())
      item["limits"].push_back({{"name", name_of_number(campaign, limit.number)},
                                {limit.at_most ? "at_most" : "at_least", limit.bound},
                                {"magnitude", limit.magnitude}});
    list.push_back(std::move(item));
  }
  return list;
}

Json distribution_of(const CampaignReport::Numbers& numbers) {
  const Description& d = numbers.description;
  Json item{{"name", numbers.head.name},
            {"unit", numbers.head.unit},
            {"description", numbers.head.description},
            {"count", d.count},
            {"missing", d.missing},
            {"mean", d.mean},
            {"mean_error", d.mean_error},
            {"standard_deviation", d.standard_deviation},
            {"least", d.least},
            {"largest", d.largest}};
  item["quantiles"] = Json::array();
  for (const QuantileEstimate& q : d.quantiles)
    item["quantiles"].push_back(
        {{"probability", q.probability}, {"value", q.value}, {"lower", q.lower}, {"upper", q.upper}});
  const Histogram& h = numbers.histogram;
  item["histogram"] = {{"begin", h.begin}, {"end", h.end},    {"counts", h.counts}, {"successes", numbers.successes},
                       {"below", h.below}, {"above", h.above}};
  return item;
}

Json inputs_of(const CampaignReport& report) {
  Json list = Json::array();
  for (std::size_t i = 0; i < report.inputs.size(); ++i) {
    Json item = distribution_of(report.inputs[i]);
    const CampaignReport::SuccessBy& by = report.success_by[i];
    item["success_by"] = {{"from", by.from}, {"to", by.to}, {"trials", by.trials}, {"successes", by.successes}};
    list.push_back(std::move(item));
  }
  return list;
}

void add_indices(const std::vector<Sensitivity>& indices, Json& item) {
  for (const char* key : {"first_order", "error", "rank_correlation"}) item[key] = Json::array();
  for (const Sensitivity& s : indices) {
    item["first_order"].push_back(s.first_order);
    item["error"].push_back(s.error);
    item["rank_correlation"].push_back(s.rank_correlation);
  }
}

const char* name_of(CampaignReport::Measure::Of of) {
  switch (of) {
    case CampaignReport::Measure::Of::success:
      return "success";
    case CampaignReport::Measure::Of::criterion:
      return "criterion";
    case CampaignReport::Measure::Of::column:
      break;
  }
  return "column";
}

Json sensitivity_of_all(const CampaignReport& report) {
  Json names = Json::array(), groups = Json::array(), measures = Json::array();
  for (const CampaignReport::Numbers& input : report.inputs) names.push_back(input.head.name);
  for (const CampaignReport::InputGroup& group : report.groups) {
    Json members = Json::array();
    for (const std::size_t i : group.inputs) members.push_back(report.inputs[i].head.name);
    groups.push_back({{"name", group.name}, {"design", group.inputs.empty()}, {"inputs", std::move(members)}});
  }
  for (const CampaignReport::Measure& measure : report.measures) {
    Json item{{"name", measure.name}, {"unit", measure.unit}, {"of", name_of(measure.of)}, {"count", measure.count}};
    add_indices(measure.inputs, item);
    item["groups"] = Json::object();
    add_indices(measure.groups, item["groups"]);
    item["unexplained"] = measure.unexplained;
    measures.push_back(std::move(item));
  }
  return {{"inputs", std::move(names)},
          {"groups", std::move(groups)},
          {"measures", std::move(measures)},
          {"left_out", report.measures_left_out},
          {"rounding", report.rounding}};
}

Json worst_of(const Campaign& campaign, const CampaignReport& report) {
  Json list = Json::array();
  for (const CampaignReport::Worst& worst : report.worst) {
    Json cases = Json::array();
    for (const CampaignReport::Case& found : worst.cases)
      cases.push_back({{"index", found.index},
                       {"value", found.value},
                       {"success", found.success},
                       {"inputs", found.inputs},
                       {"replay", replay_command(campaign, found.index)}});
    const Column& column = campaign.columns[worst.number];
    list.push_back({{"by", column.name},
                    {"unit", column.unit},
                    {"direction", worst.largest ? "largest" : "least"},
                    {"magnitude", worst.magnitude},
                    {"cases", std::move(cases)}});
  }
  return list;
}

Json grasps_of(const CampaignReport& report) {
  Json list = Json::array();
  for (const CampaignReport::Grasp& grasp : report.grasps) {
    Json tolerances = Json::array();
    for (const CampaignReport::Grasp::Tolerance& t : grasp.tolerances)
      tolerances.push_back({{"name", t.name}, {"exceeded", t.exceeded}, {"limiting", t.limiting}});
    list.push_back({{"end_effector", grasp.end_effector},
                    {"captured", grasp.captured},
                    {"missed", grasp.missed},
                    {"tolerances", std::move(tolerances)}});
  }
  return list;
}

Json reasons_of(const Campaign& campaign, const std::vector<CampaignReport::Reason>& reasons) {
  Json list = Json::array();
  for (const CampaignReport::Reason& reason : reasons) {
    Json examples = Json::array();
    for (const auto& [k, text] : reason.examples)
      examples.push_back({{"index", k}, {"reason", text}, {"replay", replay_command(campaign, k)}});
    list.push_back({{"status", name_of(reason.status)},
                    {"reason", reason.text},
                    {"count", reason.count},
                    {"examples", std::move(examples)}});
  }
  return list;
}

Json envelope_json(const Campaign& campaign, const CampaignReport& report) {
  Json axes = Json::array();
  for (const StudyAxis& axis : campaign.design)
    axes.push_back({{"name", axis.name},
                    {"unit", axis.unit},
                    {"description", axis.description},
                    {"is_numeric", axis.is_numeric},
                    {"values", values_of(axis)}});
  Json json{{"axes", std::move(axes)}, {"confidence", campaign.confidence}};
  for (const char* key : {"trials", "ok", "successes", "estimate", "lower", "upper"}) json[key] = Json::array();
  for (const EnvelopePoint& point : report.envelope) {
    json["trials"].push_back(point.success.trials);
    json["ok"].push_back(point.ok);
    json["successes"].push_back(point.success.successes);
    json["estimate"].push_back(point.success.estimate);
    json["lower"].push_back(point.success.lower);
    json["upper"].push_back(point.success.upper);
  }
  json["unmet"] = Json::array();
  for (std::size_t c = 0; c < campaign.success.size(); ++c) {
    Json counts = Json::array();
    for (const EnvelopePoint& point : report.envelope) counts.push_back(point.unmet[c]);
    json["unmet"].push_back({{"criterion", campaign.success[c].name()}, {"counts", std::move(counts)}});
  }
  json["deciding"] = Json::array();
  for (const EnvelopePoint& point : report.envelope) {
    const std::string deciding = deciding_text(campaign, point);
    json["deciding"].push_back(deciding.empty() ? Json() : Json(deciding));
  }
  json["above"] = Json::array();
  for (const double level : {0.5, 0.9, 0.99})
    json["above"].push_back({{"level", level}, {"points", points_above(report.envelope, level)}});
  return json;
}

}  // namespace

std::string campaign_json(const Campaign& campaign, const CampaignReport& report, const std::string& version) {
  Json json{{"schema", "grapnel-campaign-report/1"},
            {"version", version},
            {"campaign", settings_of(campaign)},
            {"rows", report.rows}};
  json["counts"] = Json::object();
  for (const CaseStatus status : {CaseStatus::ok, CaseStatus::failed, CaseStatus::unreachable})
    json["counts"][name_of(status)] = report.status[static_cast<std::size_t>(status)];
  json["counts"]["success"] = report.success;
  json["success"] = Json::object();
  add_proportion(json["success"], wilson(report.success, report.rows, campaign.confidence));
  json["success"]["confidence"] = campaign.confidence;
  json["success"]["assumed"] = report.assumed;
  json["warnings"] = report.warnings;
  json["criteria"] = criteria_of(campaign, report);
  json["inputs"] = inputs_of(report);
  json["columns"] = Json::array();
  for (const CampaignReport::Numbers& column : report.columns) json["columns"].push_back(distribution_of(column));
  json["sensitivity"] = sensitivity_of_all(report);
  json["worst"] = worst_of(campaign, report);
  json["failures"] = reasons_of(campaign, report.failures);
  json["failures_left_out"] = report.failures_left_out;
  json["grasps"] = grasps_of(report);
  json["reasons"] = reasons_of(campaign, report.reasons);
  json["reasons_left_out"] = report.reasons_left_out;
  if (!campaign.design.empty()) json["envelope"] = envelope_json(campaign, report);
  json["text"] = campaign.text;
  // A campaign file is UTF-8 by its check; a program's own need not be.
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string sweep_json(const Campaign& sweep, std::span<const CaseRow> rows, const std::string& version) {
  Json json{{"schema", "grapnel-study-table/1"},
            {"version", version},
            {"study",
             {{"name", sweep.name},
              {"file", std::filesystem::path(sweep.file).filename().string()},
              {"sha256", sweep.sha256},
              {"simulate", name_of(sweep.mode)}}},
            {"points", rows.size()}};
  for (const CaseStatus status : {CaseStatus::ok, CaseStatus::failed, CaseStatus::unreachable})
    json[name_of(status)] = count_of(rows, status);
  json["axes"] = Json::array();
  for (const StudyAxis& axis : sweep.design)
    json["axes"].push_back(
        {{"name", axis.name}, {"unit", axis.unit}, {"description", axis.description}, {"values", values_of(axis)}});
  json["columns"] = Json::array();
  for (const Column& column : sweep.columns)
    json["columns"].push_back({{"name", column.name}, {"unit", column.unit}, {"description", column.description}});
  json["text"] = sweep.text;
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace grapnel
