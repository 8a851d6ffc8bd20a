#include "grapnel/report/study_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "grapnel/report/report_data.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {

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

}  // namespace grapnel
