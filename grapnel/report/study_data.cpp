#include "grapnel/report/study_data.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "grapnel/report/shell_word.hpp"
#include "grapnel/report/study_source.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNumbers = 5'000'000;  // about 50 MB

// Nine digits are more than a plot shows; the table beside the report has all. JSON has no NaN.
Json shown_number(double value) {
  if (!std::isfinite(value)) return nullptr;
  const std::string text = fmt::format("{:.9g}", value);
  double rounded = value;
  std::from_chars(text.data(), text.data() + text.size(), rounded);  // whatever the locale
  return rounded;
}

Json shown_numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double value : values) list.push_back(shown_number(value));
  return list;
}

Json head_of(const StudyColumn& column) {
  return {{"name", column.name}, {"unit", column.unit}, {"description", column.description}};
}

Json heads_of(const std::vector<StudyColumn>& columns) {
  Json heads = Json::array();
  for (const StudyColumn& column : columns) heads.push_back(head_of(column));
  return heads;
}

// ---- Sweeps ----

// Per axis, per point: numbers, or which label.
Json axis_values(const std::vector<StudyColumn>& axes) {
  Json all = Json::array();
  for (const StudyColumn& axis : axes) {
    Json values = Json::array();
    for (const double value : axis.values)
      values.push_back(axis.labels.empty() ? shown_number(value) : Json(static_cast<std::size_t>(value)));
    all.push_back(std::move(values));
  }
  return all;
}

Json axis_heads(const std::vector<StudyColumn>& axes) {
  Json heads = Json::array();
  for (const StudyColumn& axis : axes) {
    Json head = head_of(axis);
    if (!axis.labels.empty()) head["labels"] = axis.labels;
    heads.push_back(std::move(head));
  }
  return heads;
}

// How a point is looked at, where the settings say which file the study was.
std::string point_command(const Json& settings) {
  const Json::json_pointer file("/study/file");
  if (!settings.contains(file) || !settings.at(file).is_string()) return {};
  const std::string study = settings.at(file).get<std::string>();
  const std::string stem = fs::path(study).stem().string();
  return fmt::format("grapnel sweep {} --only {{K}} -o {}", shell_word(study),
                     shell_word("out/" + stem + "-point-") + "{K}");
}

}  // namespace

Json sweep_data(const fs::path& folder) {
  StudySource study = read_study_source(folder, kMostNumbers);
  Json values = Json::array();
  for (const StudyColumn& column : study.columns) values.push_back(shown_numbers(column.values));
  const std::string command = point_command(study.settings);
  return {{"settings", std::move(study.settings)},  {"command", command},         {"axes", axis_heads(study.axes)},
          {"axis_values", axis_values(study.axes)}, {"status", study.status},     {"reason", study.reason},
          {"columns", heads_of(study.columns)},     {"values", std::move(values)}};
}

// ---- Optimizations ----

Json optimization_data(const fs::path& folder) {
  const fs::path path = folder / "comparison.json";
  Json comparison = read_json_document(path, "grapnel-optimization-result/1");
  const std::vector<StudyColumn> variables = described_columns(comparison, "variables", path, "variable of the search");
  const Json objective = comparison.value("objective", Json::object());
  const StudyColumn goal{"objective", text_of(objective, "unit", path, "objective"),
                         text_of(objective, "name", path, "objective")};

  // The columns of numbers, as the report shows them and as the table heads them; a limit's name has its unit.
  std::vector<StudyColumn> columns{{"point", "1", "in the order of the search"}};
  std::vector<std::string> expected{"point", "search"};
  const auto add = [&](const StudyColumn& column, const std::string& head) {
    columns.push_back(column);
    expected.push_back(head);
  };
  for (const StudyColumn& v : variables) add(v, table_head(v));
  expected.insert(expected.end(), {"status", "reason"});
  add({"acceptable", "1", "1: within all limits"}, "acceptable");
  add(goal, table_head(goal));
  add({"violation", "1", "how far beyond limits, relative to these"}, "violation");
  for (const StudyColumn& limit : described_columns(comparison, "limits", path, "limited")) add(limit, limit.name);
  for (const StudyColumn& c : described_columns(comparison, "columns", path)) add(c, table_head(c));

  CsvTable table(folder / "evaluations.csv");
  expect_heads(table, expected, "comparison.json");
  const std::size_t status_at = 2 + variables.size();
  Json search = Json::array(), status = Json::array(), reason = Json::array();
  std::vector<Json> values(columns.size(), Json::array());
  std::vector<std::string> fields;
  while (table.next(fields)) {
    search.push_back(fields[1]);
    status.push_back(fields[status_at]);
    reason.push_back(fields[status_at + 1]);
    expect_size(status.size(), columns.size(), kMostNumbers, folder / "evaluations.csv");
    std::size_t column = 0;
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (f != 1 && f != status_at && f != status_at + 1)
        values[column++].push_back(shown_number(table.number(fields, f)));
    }
  }
  const fs::path best = folder / "best.yaml";
  const std::string command =
      fs::exists(best) ? "grapnel run " + shell_word(best.lexically_normal().generic_string()) : "";
  return {{"comparison", std::move(comparison)}, {"command", command},          {"columns", heads_of(columns)},
          {"values", std::move(values)},         {"search", std::move(search)}, {"status", std::move(status)},
          {"reason", std::move(reason)}};
}

}  // namespace grapnel
