#include "grapnel/report/study_source.hpp"

#include <algorithm>
#include <stdexcept>

#include "grapnel/report/csv_table.hpp"
#include "grapnel/report/json_document.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

std::vector<StudyColumn> columns_of(const Json& document, const char* key, const std::filesystem::path& path) {
  std::vector<StudyColumn> columns;
  if (!document.contains(key) || !document[key].is_array())
    throw std::runtime_error(path.string() + ": key '" + key + "' is missing");
  for (std::size_t i = 0; i < document[key].size(); ++i) {
    const std::string at = "/" + std::string(key) + "/" + std::to_string(i);
    StudyColumn column{required_text(document, at + "/name", path),
                       required_text(document, at + "/unit", path),
                       required_text(document, at + "/description", path),
                       {},
                       {}};
    const Json& entry = document[key][i];
    if (entry.contains("values") && entry["values"].is_array()) {
      for (const Json& value : entry["values"]) {
        if (value.is_string()) column.labels.push_back(value.get<std::string>());
      }
    }
    columns.push_back(std::move(column));
  }
  return columns;
}

}  // namespace

StudySource read_study_source(const std::filesystem::path& folder) {
  StudySource study;
  study.folder = folder;
  const std::filesystem::path settings = folder / "study.json";
  const Json document = read_json_document(settings, "grapnel-study-table/1");
  study.metadata = {required_text(document, "/version", settings), required_text(document, "/study/name", settings),
                    required_text(document, "/study/sha256", settings)};
  study.axes = columns_of(document, "axes", settings);
  study.columns = columns_of(document, "columns", settings);

  CsvTable table(folder / "table.csv");
  // point, the axes, status, reason, the columns
  const std::size_t first = study.axes.size() + 3;
  if (table.heads().size() != first + study.columns.size()) table.fail("the columns are not those of study.json");
  for (std::vector<std::string> fields; table.next(fields); ++study.points) {
    for (std::size_t a = 0; a < study.axes.size(); ++a) {
      StudyColumn& axis = study.axes[a];
      if (axis.labels.empty()) {
        axis.values.push_back(table.number(fields, a + 1));
        continue;
      }
      const auto found = std::find(axis.labels.begin(), axis.labels.end(), fields[a + 1]);
      if (found == axis.labels.end()) table.fail("'" + fields[a + 1] + "' is no value of axis '" + axis.name + "'");
      axis.values.push_back(static_cast<double>(found - axis.labels.begin()));
    }
    for (std::size_t c = 0; c < study.columns.size(); ++c)
      study.columns[c].values.push_back(table.number(fields, first + c));
  }
  return study;
}

std::string column_label(const StudyColumn& column) {
  return column.unit.empty() || column.unit == "1" ? column.name : column.name + " [" + column.unit + "]";
}

}  // namespace grapnel
