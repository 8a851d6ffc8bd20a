#include "grapnel/report/study_data.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <stdexcept>

#include "grapnel/report/report_data.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::size_t kMostNumbers = 5'000'000;  // about 50 MB

// Nine digits are sufficient for plots; the table beside the report has all. JSON has no NaN.
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

// The command for a single point, in the result folder, if the settings name the study file.
std::string point_command(const Json& settings, const fs::path& folder) {
  const Json::json_pointer file("/study/file");
  if (!settings.contains(file) || !settings.at(file).is_string()) return {};
  const std::string study = settings.at(file).get<std::string>();
  const std::string stem = fs::path(study).stem().string();
  return fmt::format("grapnel sweep {} --only {{K}} -o {}",
                     shell_word(seen_from_results(folder / "source.json", study)),
                     shell_word("out/" + stem + "-point-") + "{K}");
}

}  // namespace

std::string seen_from_results(const fs::path& document, const std::string& name) {
  const std::string folder = folder_of_input(document);
  return folder.empty() ? name : (fs::path(folder) / name).lexically_normal().generic_string();
}

Json sweep_data(const fs::path& folder) {
  StudySource study = read_study_source(folder, kMostNumbers);
  Json values = Json::array();
  for (const StudyColumn& column : study.columns) values.push_back(shown_numbers(column.values));
  const std::string command = point_command(study.settings, folder);
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

  // The columns of numbers, with names in the report and in the table; a limit's name includes its unit.
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
  add({"violation", "1", "relative violation of limits"}, "violation");
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
  const std::string command = fs::exists(best) ? "grapnel run best.yaml" : "";
  return {{"comparison", std::move(comparison)}, {"command", command},          {"columns", heads_of(columns)},
          {"values", std::move(values)},         {"search", std::move(search)}, {"status", std::move(status)},
          {"reason", std::move(reason)}};
}

using Json = nlohmann::ordered_json;

const Json& list_of(const Json& document, const std::string& key, const std::filesystem::path& path) {
  const auto found = document.find(key);
  if (found == document.end() || !found->is_array())
    throw std::runtime_error(fmt::format("{}: list '{}' is missing", path.string(), key));
  return *found;
}

std::string text_of(const Json& entry, const char* key, const std::filesystem::path& path, const std::string& list) {
  if (entry.is_object()) {
    const auto found = entry.find(key);
    if (found != entry.end() && found->is_string()) return found->get<std::string>();
  }
  throw std::runtime_error(fmt::format("{}: an entry of '{}' lacks the text '{}'", path.string(), list, key));
}

std::vector<StudyColumn> described_columns(const Json& document, const std::string& key,
                                           const std::filesystem::path& path, const std::string& description) {
  std::vector<StudyColumn> columns;
  for (const Json& entry : list_of(document, key, path))
    columns.push_back({text_of(entry, "name", path, key), text_of(entry, "unit", path, key),
                       entry.contains("description") ? text_of(entry, "description", path, key) : description});
  return columns;
}

std::string table_head(const StudyColumn& column) {
  return column.unit.empty() ? column.name : column.name + " [" + column.unit + "]";
}

void expect_heads(const CsvTable& table, const std::vector<std::string>& expected, const std::string& file) {
  for (std::size_t i = 0; i < std::max(expected.size(), table.heads().size()); ++i) {
    const std::string is = i < table.heads().size() ? table.heads()[i] : "";
    const std::string wanted = i < expected.size() ? expected[i] : "";
    if (is != wanted)
      table.fail(
          fmt::format("column {} is '{}' where {} has '{}': they are of different studies", i + 1, is, file, wanted));
  }
}

void expect_size(std::size_t rows, std::size_t columns, std::size_t most, const std::filesystem::path& path) {
  if (rows <= most / std::max<std::size_t>(columns, 1)) return;
  throw TooLarge(
      fmt::format("{}: {} lines of {} columns are too much for a report, which holds {} numbers; choose "
                  "fewer with 'columns' in the study",
                  path.string(), rows, columns, most));
}

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

// Gives an axis its labels, if its values are not numbers (which JSON has as null where they are infinite). Returns how
// many values it has.
std::size_t read_axis(const Json& entry, const fs::path& path, StudyColumn& axis) {
  const Json& values = list_of(entry, "values", path);
  if (values.empty()) throw std::runtime_error(fmt::format("{}: axis '{}' has no values", path.string(), axis.name));
  const bool is_numeric =
      std::all_of(values.begin(), values.end(), [](const Json& value) { return value.is_number() || value.is_null(); });
  for (const Json& value : values) {
    if (!is_numeric) axis.labels.push_back(value.is_string() ? value.get<std::string>() : value.dump());
  }
  return values.size();
}

std::size_t points_of(const Json& settings, double expected, const fs::path& path) {
  const auto found = settings.find("points");
  if (found == settings.end() || !found->is_number_unsigned())
    throw std::runtime_error(path.string() + ": number 'points' is missing");
  const std::size_t points = found->get<std::size_t>();
  if (static_cast<double>(points) != expected)
    throw std::runtime_error(fmt::format("{}: {} points where the axes make {}", path.string(), points, expected));
  return points;
}

std::vector<std::string> heads_of(const StudySource& study) {
  std::vector<std::string> heads{"point"};
  for (const StudyColumn& axis : study.axes) heads.push_back(table_head(axis));
  heads.insert(heads.end(), {"status", "reason"});
  for (const StudyColumn& column : study.columns) heads.push_back(table_head(column));
  return heads;
}

// What the table says of an axis in a row; `label`: which one is there in a grid.
double axis_value(const StudyColumn& axis, std::size_t label, const CsvTable& table,
                  const std::vector<std::string>& fields, std::size_t column) {
  if (axis.labels.empty()) return table.number(fields, column);
  if (fields[column] != axis.labels[label])
    table.fail(
        fmt::format("axis '{}' is '{}' where study.json has '{}'", axis.name, fields[column], axis.labels[label]));
  return static_cast<double>(label);
}

// `sizes`: how many values each axis has. The first axis varies slowest.
void read_table(StudySource& study, const std::vector<std::size_t>& sizes) {
  CsvTable table(study.folder / "table.csv");
  expect_heads(table, heads_of(study), "study.json");
  const std::size_t status_at = 1 + study.axes.size(), first = status_at + 2;
  std::vector<std::string> fields;
  for (std::size_t row = 0; table.next(fields); ++row) {
    if (fields[0] != std::to_string(row)) table.fail(fmt::format("point '{}' where {} was expected", fields[0], row));
    if (row == study.points) table.fail(fmt::format("more points than the {} of study.json", study.points));
    for (std::size_t a = study.axes.size(), rest = row; a-- > 0; rest /= sizes[a])
      study.axes[a].values.push_back(axis_value(study.axes[a], rest % sizes[a], table, fields, a + 1));
    study.status.push_back(fields[status_at]);
    study.reason.push_back(fields[status_at + 1]);
    for (std::size_t c = 0; c < study.columns.size(); ++c)
      study.columns[c].values.push_back(table.number(fields, first + c));
  }
  if (study.status.size() != study.points)
    table.fail(fmt::format("{} points where study.json has {}", study.status.size(), study.points));
}

}  // namespace

StudySource read_study_source(const fs::path& folder, std::size_t most_numbers) {
  const fs::path path = folder / "study.json";
  StudySource study;
  study.folder = folder;
  study.settings = read_json_document(path, "grapnel-study-table/1");
  const Json& settings = study.settings;
  study.metadata = {required_text(settings, "/version", path), required_text(settings, "/study/name", path),
                    required_text(settings, "/study/sha256", path)};
  study.axes = described_columns(settings, "axes", path);
  std::vector<std::size_t> sizes;
  double points = 1;
  for (std::size_t a = 0; a < study.axes.size(); ++a) {
    sizes.push_back(read_axis(settings["axes"][a], path, study.axes[a]));
    points *= static_cast<double>(sizes.back());
  }
  study.columns = described_columns(settings, "columns", path);
  study.points = points_of(settings, points, path);
  expect_size(study.points, study.axes.size() + study.columns.size() + 1, most_numbers, folder / "table.csv");
  read_table(study, sizes);
  return study;
}

std::string column_label(const StudyColumn& column) { return column.unit == "1" ? column.name : table_head(column); }

CsvTable::CsvTable(const std::filesystem::path& path) : path_(path), text_(file_bytes(path)) {
  if (!read(heads_)) throw std::runtime_error(path.string() + ": empty");
}

void CsvTable::fail(const std::string& fault) const {
  throw std::runtime_error(fmt::format("{}: line {}: {}", path_.string(), record_line_, fault));
}

bool CsvTable::next(std::vector<std::string>& fields) {
  if (!read(fields)) return false;
  if (fields.size() != heads_.size())
    fail(fmt::format("{} fields where the first line has {}", fields.size(), heads_.size()));
  return true;
}

double CsvTable::number(const std::vector<std::string>& fields, std::size_t column) const {
  const std::string& text = fields[column];
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size())
    fail(fmt::format("'{}' is no number, in column '{}'", text.substr(0, 40), heads_[column]));
  return value;
}

// Between quotes; at_ is behind the first.
std::string CsvTable::quoted_field() {
  std::string field;
  for (;;) {
    const std::size_t quote = text_.find('"', at_);
    if (quote == std::string::npos) fail("a quote is not closed");
    line_ += static_cast<std::size_t>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(at_),
                                                 text_.begin() + static_cast<std::ptrdiff_t>(quote), '\n'));
    field.append(text_, at_, quote - at_);
    at_ = quote + 1;
    if (at_ == text_.size() || text_[at_] != '"') return field;
    field += '"';
    ++at_;
  }
}

bool CsvTable::read(std::vector<std::string>& fields) {
  fields.clear();
  if (at_ == text_.size()) return false;
  record_line_ = line_;
  for (;;) {
    if (at_ < text_.size() && text_[at_] == '"') {
      ++at_;
      fields.push_back(csv_text_of(quoted_field()));
    } else {
      const std::size_t end = std::min(text_.find_first_of(",\n", at_), text_.size());
      fields.push_back(csv_text_of(std::string_view(text_).substr(at_, end - at_)));
      at_ = end;
    }
    if (at_ == text_.size()) fail("the file ends within a line");
    const char separator = text_[at_++];
    if (separator == ',') continue;
    if (separator != '\n') fail("text behind a closing quote");
    ++line_;
    return true;
  }
}

}  // namespace grapnel
