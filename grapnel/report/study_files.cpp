#include "grapnel/report/study_files.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "grapnel/report/report_data.hpp"

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

}  // namespace grapnel
