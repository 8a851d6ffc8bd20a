#include "grapnel/report/study_data.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "grapnel/report/csv_table.hpp"
#include "grapnel/report/json_document.hpp"
#include "grapnel/report/report_data.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNumbers = 5'000'000;  // about 50 MB

// Nine digits are more than a plot shows; the table beside the report has all. JSON has no NaN.
Json shown_number(double value) {
  if (!std::isfinite(value)) return nullptr;
  return std::strtod(fmt::format("{:.9g}", value).c_str(), nullptr);
}

std::string head_of(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

// An entry of a list of things with names and units.
struct Named {
  std::string name, unit, description;
  Json column() const { return {{"name", name}, {"unit", unit}, {"description", description}}; }
};

std::string text_of(const Json& entry, const char* key, const fs::path& path, const std::string& list) {
  const auto found = entry.is_object() ? entry.find(key) : entry.end();
  if (!entry.is_object() || found == entry.end() || !found->is_string())
    throw std::runtime_error(fmt::format("{}: an entry of '{}' lacks the text '{}'", path.string(), list, key));
  return found->get<std::string>();
}

const Json& list_of(const Json& document, const std::string& key, const fs::path& path) {
  const auto found = document.find(key);
  if (found == document.end() || !found->is_array())
    throw std::runtime_error(fmt::format("{}: list '{}' is missing", path.string(), key));
  return *found;
}

std::vector<Named> named_entries(const Json& document, const std::string& key, const fs::path& path,
                                 const std::string& description = {}) {
  std::vector<Named> result;
  for (const Json& entry : list_of(document, key, path))
    result.push_back({text_of(entry, "name", path, key), text_of(entry, "unit", path, key),
                      entry.contains("description") ? text_of(entry, "description", path, key) : description});
  return result;
}

// That the table beside a JSON file is the one it describes.
void expect_heads(const CsvTable& table, const std::vector<std::string>& expected, const std::string& file) {
  for (std::size_t i = 0; i < std::max(expected.size(), table.heads().size()); ++i) {
    const std::string is = i < table.heads().size() ? table.heads()[i] : "";
    const std::string wanted = i < expected.size() ? expected[i] : "";
    if (is != wanted)
      table.fail(
          fmt::format("column {} is '{}' where {} has '{}': they are of different studies", i + 1, is, file, wanted));
  }
}

void expect_size(std::size_t rows, std::size_t columns, const fs::path& path) {
  if (rows * columns <= kMostNumbers) return;
  throw TooLarge(
      fmt::format("{}: {} lines of {} columns are too much for a report, which holds {} numbers; choose "
                  "fewer with 'columns' in the study",
                  path.string(), rows, columns, kMostNumbers));
}

// As a shell reads it back.
std::string shell_word(const std::string& text) {
  const bool plain = !text.empty() && text.find_first_not_of(
                                          "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
                                          "0123456789_-./,+@%:=") == std::string::npos;
  if (plain) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

// ---- Sweeps ----

struct Axis {
  Named head;
  std::vector<double> values;       // of numbers; else:
  std::vector<std::string> labels;  // as many as values
  bool is_numeric = true;
  std::size_t size() const { return is_numeric ? values.size() : labels.size(); }
};

std::vector<Axis> read_axes(const Json& settings, const fs::path& path) {
  std::vector<Axis> axes;
  const std::vector<Named> heads = named_entries(settings, "axes", path);
  for (std::size_t a = 0; a < heads.size(); ++a) {
    Axis axis{heads[a], {}, {}, true};
    const Json& values = list_of(settings["axes"][a], "values", path);
    for (const Json& value : values) axis.is_numeric = axis.is_numeric && (value.is_number() || value.is_null());
    for (const Json& value : values) {
      if (axis.is_numeric)
        axis.values.push_back(value.is_number() ? value.get<double>() : NAN);
      else
        axis.labels.push_back(value.is_string() ? value.get<std::string>() : value.dump());
    }
    if (axis.size() == 0)
      throw std::runtime_error(fmt::format("{}: axis '{}' has no values", path.string(), heads[a].name));
    axes.push_back(std::move(axis));
  }
  return axes;
}

// Per axis, per point: the first axis varies slowest.
Json axis_values(const std::vector<Axis>& axes, std::size_t points) {
  Json all = Json::array();
  std::size_t repeat = points;
  for (const Axis& axis : axes) {
    repeat /= axis.size();
    Json values = Json::array();
    for (std::size_t point = 0; point < points; ++point) {
      const std::size_t at = point / repeat % axis.size();
      values.push_back(axis.is_numeric ? shown_number(axis.values[at]) : Json(at));
    }
    all.push_back(std::move(values));
  }
  return all;
}

Json axis_heads(const std::vector<Axis>& axes) {
  Json heads = Json::array();
  for (const Axis& axis : axes) {
    Json head = axis.head.column();
    if (!axis.is_numeric) head["labels"] = axis.labels;
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

std::size_t points_of(const Json& settings, const std::vector<Axis>& axes, const fs::path& path) {
  const auto found = settings.find("points");
  if (found == settings.end() || !found->is_number_unsigned())
    throw std::runtime_error(path.string() + ": number 'points' is missing");
  const std::size_t points = found->get<std::size_t>();
  double product = 1;
  for (const Axis& axis : axes) product *= static_cast<double>(axis.size());
  if (product != static_cast<double>(points))
    throw std::runtime_error(fmt::format("{}: {} points where the axes make {}", path.string(), points, product));
  return points;
}

}  // namespace

Json sweep_data(const fs::path& folder) {
  const fs::path path = folder / "study.json";
  Json settings = read_json_document(path, "grapnel-study-table/1");
  const std::vector<Axis> axes = read_axes(settings, path);
  const std::vector<Named> columns = named_entries(settings, "columns", path);
  const std::size_t points = points_of(settings, axes, path);
  expect_size(points, axes.size() + columns.size() + 1, folder / "table.csv");

  CsvTable table(folder / "table.csv");
  std::vector<std::string> expected{"point"};
  for (const Axis& axis : axes) expected.push_back(head_of(axis.head.name, axis.head.unit));
  expected.insert(expected.end(), {"status", "reason"});
  for (const Named& column : columns) expected.push_back(head_of(column.name, column.unit));
  expect_heads(table, expected, "study.json");

  const std::size_t status_at = 1 + axes.size(), first = status_at + 2;
  Json status = Json::array(), reason = Json::array(), heads = Json::array();
  std::vector<Json> values(columns.size(), Json::array());
  std::vector<std::string> fields;
  for (std::size_t row = 0; table.next(fields); ++row) {
    if (fields[0] != std::to_string(row)) table.fail(fmt::format("point '{}' where {} was expected", fields[0], row));
    if (row == points) table.fail(fmt::format("more points than the {} of study.json", points));
    status.push_back(fields[status_at]);
    reason.push_back(fields[status_at + 1]);
    for (std::size_t c = 0; c < columns.size(); ++c) values[c].push_back(shown_number(table.number(fields, first + c)));
  }
  if (status.size() != points) table.fail(fmt::format("{} points where study.json has {}", status.size(), points));
  for (const Named& column : columns) heads.push_back(column.column());
  const std::string command = point_command(settings);
  return {{"settings", std::move(settings)}, {"command", command},
          {"axes", axis_heads(axes)},        {"axis_values", axis_values(axes, points)},
          {"status", std::move(status)},     {"reason", std::move(reason)},
          {"columns", std::move(heads)},     {"values", std::move(values)}};
}

// ---- Optimizations ----

Json optimization_data(const fs::path& folder) {
  const fs::path path = folder / "comparison.json";
  Json comparison = read_json_document(path, "grapnel-optimization-result/1");
  const std::vector<Named> variables = named_entries(comparison, "variables", path, "variable of the search");
  const Json objective = comparison.value("objective", Json::object());
  const Named goal{"objective", text_of(objective, "unit", path, "objective"),
                   text_of(objective, "name", path, "objective")};

  // The columns of numbers, as the report shows them and as the table heads them; a limit's name has its unit.
  std::vector<Named> columns{{"point", "1", "in the order of the search"}};
  std::vector<std::string> expected{"point", "search"};
  const auto add = [&](const Named& column, const std::string& head) {
    columns.push_back(column);
    expected.push_back(head);
  };
  for (const Named& v : variables) add(v, head_of(v.name, v.unit));
  expected.insert(expected.end(), {"status", "reason"});
  add({"acceptable", "1", "1: within all limits"}, "acceptable");
  add(goal, head_of(goal.name, goal.unit));
  add({"violation", "1", "how far beyond limits, relative to these"}, "violation");
  for (const Named& limit : named_entries(comparison, "limits", path, "limited")) add(limit, limit.name);
  for (const Named& c : named_entries(comparison, "columns", path)) add(c, head_of(c.name, c.unit));

  CsvTable table(folder / "evaluations.csv");
  expect_heads(table, expected, "comparison.json");
  const std::size_t status_at = 2 + variables.size();
  Json search = Json::array(), status = Json::array(), reason = Json::array(), heads = Json::array();
  std::vector<Json> values(columns.size(), Json::array());
  std::vector<std::string> fields;
  while (table.next(fields)) {
    search.push_back(fields[1]);
    status.push_back(fields[status_at]);
    reason.push_back(fields[status_at + 1]);
    expect_size(status.size(), columns.size(), folder / "evaluations.csv");
    std::size_t column = 0;
    for (std::size_t f = 0; f < fields.size(); ++f) {
      if (f != 1 && f != status_at && f != status_at + 1)
        values[column++].push_back(shown_number(table.number(fields, f)));
    }
  }
  for (const Named& column : columns) heads.push_back(column.column());
  const fs::path best = folder / "best.yaml";
  const std::string command =
      fs::exists(best) ? "grapnel run " + shell_word(best.lexically_normal().generic_string()) : "";
  return {{"comparison", std::move(comparison)}, {"command", command},          {"columns", std::move(heads)},
          {"values", std::move(values)},         {"search", std::move(search)}, {"status", std::move(status)},
          {"reason", std::move(reason)}};
}

}  // namespace grapnel
