// Figures of campaigns and maps: how often criteria are met, distributions of numbers, success over a design.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <stdexcept>

#include "grapnel/report/campaign_source.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/report/figure_script.hpp"
#include "grapnel/report/series_table.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostDistributions = 6, kMostCriteria = 20;

struct CampaignSource {
  std::filesystem::path folder, path;
  Json statistics;  // campaign.json
  TimeSeriesMetadata metadata;
};

CampaignSource read_campaign_source(const std::filesystem::path& folder) {
  CampaignSource source{folder, folder / "campaign.json", {}, {}};
  source.statistics = read_json_document(source.path, "grapnel-campaign-report/1");
  source.metadata = {required_text(source.statistics, "/version", source.path),
                     required_text(source.statistics, "/campaign/name", source.path),
                     required_text(source.statistics, "/campaign/sha256", source.path)};
  return source;
}

double number_at(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return object.is_object() && found != object.end() && found->is_number() ? found->get<double>() : NAN;
}

Figure empty_figure(const CampaignSource& source, const FigureRequest& request) {
  Figure figure;
  figure.what = request.what;
  figure.heads = figure_heads(source.metadata, request);
  figure.width = request.width > 0 ? request.width : 8.8;
  figure.height = request.height;
  return figure;
}

// ---- How often criteria are met ----

struct Share {
  std::string name;
  double estimate, lower, upper;
};

std::vector<Share> shares_of(const CampaignSource& source) {
  std::vector<Share> shares;
  const auto add = [&](const std::string& name, const Json& entry) {
    shares.push_back({name, number_at(entry, "estimate"), number_at(entry, "lower"), number_at(entry, "upper")});
  };
  if (!source.statistics.contains("success"))
    throw std::runtime_error(source.path.string() + ": key 'success' is missing");
  add("success", source.statistics["success"]);
  for (const Json& criterion : list_of(source.statistics, "criteria", source.path)) {
    if (shares.size() > kMostCriteria) break;
    add(text_of(criterion, "name", source.path, "criteria"), criterion);
  }
  return shares;
}

Figure criteria_figure(const CampaignSource& source, const FigureRequest& request) {
  const std::vector<Share> shares = shares_of(source);
  Figure figure = empty_figure(source, request);
  FigureBlock block{"from above: the probability of success, then the criteria",
                    {"line", "share [%]", "lower end of its interval [%]", "upper end [%]"},
                    {}};
  FigurePanel panel;
  panel.x_label = fmt::format("share of cases [%], with its {:g} % interval",
                              100 * number_at(source.statistics["success"], "confidence"));
  panel.x_range = {0, 100};
  panel.y_range = {-0.5, static_cast<double>(shares.size()) - 0.1};
  panel.settings = {"unset ytics; unset grid; set grid xtics back lc rgb '#e4e4e4' lw 0.5 dt solid"};
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double y = static_cast<double>(shares.size() - 1 - i);
    block.rows.push_back({y, 100 * shares[i].estimate, 100 * shares[i].lower, 100 * shares[i].upper});
    panel.labels.push_back({shares[i].name, fmt::format("at graph 0.015, first {:g} left font ',6.5'", y + 0.42)});
    figure.heads.push_back(fmt::format("line {:g}: {}", y, shares[i].name));
  }
  figure.blocks.push_back(std::move(block));
  panel.items.push_back(
      {0,
       fmt::format("using (0):1:(0):2:($1-0.16):($1+0.16) with boxxyerror fc rgb '{}' fs solid noborder",
                   lightened(series_color(0), 0.55)),
       "",
       {}});
  panel.items.push_back(
      {0, fmt::format("using 2:1:3:4 with xerrorbars lc rgb '{}' lw 1 pt 7 ps 0.3", series_color(0)), "", {}});
  figure.panels.push_back(std::move(panel));
  figure.panel_height = 0.7 + 0.62 * static_cast<double>(shares.size());
  return figure;
}

// ---- Distributions ----

// Limits of criteria on single numbers.
std::vector<double> limits_of(const CampaignSource& source, const std::string& name) {
  std::vector<double> limits;
  for (const Json& criterion : list_of(source.statistics, "criteria", source.path)) {
    if (!criterion.is_object() || !criterion.contains("limits") || !criterion["limits"].is_array()) continue;
    for (const Json& limit : criterion["limits"]) {
      if (!limit.is_object() || limit.value("name", "") != name) continue;
      for (const double value : {number_at(limit, "at_most"), number_at(limit, "at_least")})
        if (std::isfinite(value)) limits.push_back(value);
    }
  }
  return limits;
}

bool has_numbers(const Json& distribution) {
  const double least = number_at(distribution, "least"), largest = number_at(distribution, "largest");
  return std::isfinite(least) && std::isfinite(largest) && least < largest;
}

// The requested columns; else those that criteria limit, then the first that are not constant.
std::vector<std::string> distributions_shown(const CampaignSource& source, const FigureRequest& request) {
  std::vector<std::string> all, shown;
  std::set<std::string> varying;
  for (const char* list : {"columns", "inputs"}) {
    for (const Json& entry : list_of(source.statistics, list, source.path)) {
      all.push_back(text_of(entry, "name", source.path, list));
      if (has_numbers(entry)) varying.insert(all.back());
    }
  }
  for (const std::string& name : request.columns) {
    if (std::find(all.begin(), all.end(), name) == all.end())
      throw std::runtime_error(
          fmt::format("the campaign has no column or input '{}'; it has: {}", name, fmt::join(all, ", ")));
    shown.push_back(name);
  }
  const auto add = [&](const std::string& name) {
    if (shown.size() < kMostDistributions && varying.contains(name) &&
        std::find(shown.begin(), shown.end(), name) == shown.end())
      shown.push_back(name);
  };
  if (!shown.empty()) return shown;
  for (const std::string& name : all)
    if (!limits_of(source, name).empty()) add(name);
  if (shown.empty())
    for (const std::string& name : all) add(name);
  if (shown.empty()) throw std::runtime_error(source.path.string() + ": all numbers are the same in all cases");
  return shown;
}

CampaignRows rows_with(const CampaignSource& source, const std::vector<std::string>& names) {
  CampaignQuery query;
  query.sha256 = source.metadata.scenario_sha256;
  query.most_without_success = 0;
  std::set<std::string> inputs;
  for (const Json& entry : list_of(source.statistics, "inputs", source.path))
    inputs.insert(text_of(entry, "name", source.path, "inputs"));
  for (const std::string& name : names) (inputs.contains(name) ? query.inputs : query.columns).push_back(name);
  return read_campaign_rows(source.folder / "table.h5", query);
}

const CampaignColumn& column_named(const CampaignRows& rows, const std::string& name) {
  for (const auto* list : {&rows.columns, &rows.inputs})
    for (const CampaignColumn& column : *list)
      if (column.name == name) return column;
  throw std::runtime_error("the table has no column '" + name + "'");
}

// The share of finite numbers up to each value, as steps.
FigureBlock cumulative(const CampaignColumn& column) {
  std::vector<double> values;
  for (const float value : column.values)
    if (std::isfinite(value)) values.push_back(static_cast<double>(value));
  std::sort(values.begin(), values.end());
  FigureBlock block{column.name, {column_label({column.name, column.unit, "", {}, {}}), "share [%]"}, {}};
  if (!values.empty()) block.rows.push_back({values.front(), 0});
  for (std::size_t i = 0; i < values.size(); ++i)
    block.rows.push_back({values[i], 100 * static_cast<double>(i + 1) / static_cast<double>(values.size())});
  return block;
}

Figure distribution_figure(const CampaignSource& source, const FigureRequest& request) {
  const std::vector<std::string> names = distributions_shown(source, request);
  const CampaignRows rows = rows_with(source, names);
  Figure figure = empty_figure(source, request);
  if (rows.index.size() < rows.table_rows)
    figure.heads.push_back(fmt::format("of an even sample of {} of {} cases", rows.index.size(), rows.table_rows));
  figure.columns = names.size() > 3 ? 2 : 1;
  if (figure.columns == 2 && request.width <= 0) figure.width = 17.8;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const CampaignColumn& column = column_named(rows, names[k]);
    FigurePanel panel;
    panel.x_label = column_label({column.name, column.unit, "", {}, {}});
    panel.y_label = "cases [%]";
    panel.y_range = {0, 100};
    const int block = static_cast<int>(figure.blocks.size());
    figure.blocks.push_back(cumulative(column));
    panel.items.push_back({block, "using 1:2 with steps " + line_style(series_color(0), 0), "", {}});
    const std::vector<double> limits = limits_of(source, names[k]);
    for (const double limit : limits) {
      panel.items.push_back({static_cast<int>(figure.blocks.size()),
                             "using 1:2 with lines " + line_style(series_color(1), 1, 1),
                             "",
                             {}});
      figure.blocks.push_back(
          {"limit of a criterion on " + names[k], {"limit", "share [%]"}, {{limit, 0}, {limit, 100}}});
    }
    figure.panels.push_back(std::move(panel));
  }
  figure.panel_height = 3.4;
  return figure;
}

// ---- Success over a design ----

// An axis and the value index of each point: the first axis varies slowest.
StudyColumn map_axis(const Json& axis, std::size_t points, std::size_t inner, const std::filesystem::path& path) {
  StudyColumn column{text_of(axis, "name", path, "success_map.axes"), text_of(axis, "unit", path, "success_map.axes"),
                     ""};
  const Json& values = list_of(axis, "values", path);
  if (values.empty()) throw std::runtime_error(path.string() + ": an axis of success_map has no values");
  std::vector<double> numbers;
  for (const Json& value : values) {
    if (value.is_string()) column.labels.push_back(value.get<std::string>());
    numbers.push_back(value.is_number() ? value.get<double>() : static_cast<double>(numbers.size()));
  }
  for (std::size_t i = 0; i < points; ++i) column.values.push_back(numbers[i / inner % numbers.size()]);
  return column;
}

StudySource map_source(const CampaignSource& source) {
  const Json& map = source.statistics.at("success_map");
  StudySource study;
  study.folder = source.folder;
  study.metadata = source.metadata;
  const Json& estimate = list_of(map, "estimate", source.path);
  study.points = estimate.size();
  const Json& axes = list_of(map, "axes", source.path);
  std::size_t inner = study.points;
  for (const Json& axis : axes) {
    const std::size_t size = list_of(axis, "values", source.path).size();
    if (size == 0 || inner % size != 0)
      throw std::runtime_error(source.path.string() + ": success_map does not fit its axes");
    inner /= size;
    study.axes.push_back(map_axis(axis, study.points, std::max<std::size_t>(inner, 1), source.path));
  }
  for (const auto& [key, name] : {std::pair{"estimate", "probability of success"},
                                  {"lower", "lower end of its interval"},
                                  {"upper", "upper end of its interval"}}) {
    StudyColumn column{name, "1", ""};
    const Json& values = list_of(map, key, source.path);
    if (values.size() != study.points)
      throw std::runtime_error(source.path.string() + ": success_map does not fit its axes");
    for (const Json& value : values) column.values.push_back(value.is_number() ? value.get<double>() : NAN);
    study.columns.push_back(std::move(column));
  }
  return study;
}

Figure map_figure(const CampaignSource& source, FigureRequest request) {
  const StudySource study = map_source(source);
  if (request.columns.empty()) request.columns = {study.columns.front().name};
  const bool two_numeric = study.axes.size() > 1 && study.axes[0].labels.empty() && study.axes[1].labels.empty();
  request.heat_map = request.heat_map || (two_numeric && request.lines_axis.empty());
  return study_figure(study, request);
}

}  // namespace

bool is_campaign_folder(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "campaign.json");
}

std::vector<FigureOffer> campaign_offers(const std::filesystem::path& folder) {
  const CampaignSource source = read_campaign_source(folder);
  std::vector<FigureOffer> offers{{"criteria", "how often each criterion is met, with its interval"},
                                  {"distribution", "cumulative distributions of columns and inputs (--column)"}};
  if (source.statistics.contains("success_map"))
    offers.insert(offers.begin(), {"success-map", "probability of success over the design"});
  return offers;
}

Figure campaign_figure(const FigureRequest& request) {
  const CampaignSource source = read_campaign_source(request.folder);
  if (request.what == "criteria") return criteria_figure(source, request);
  if (request.what == "distribution") return distribution_figure(source, request);
  return map_figure(source, request);
}

}  // namespace grapnel
