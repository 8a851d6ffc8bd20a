#include "grapnel/study/study_table.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/csv_text.hpp"
#include "grapnel/study/grid.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kBlock = 1 << 20;  // [bytes] handed to the file at once

std::string head_of(const std::string& name, const std::string& unit) {
  return csv_quoted(unit.empty() ? name : name + " [" + unit + "]");
}

std::vector<std::size_t> sizes_of(const StudyTable& table) {
  std::vector<std::size_t> sizes;
  for (const StudyAxis& axis : table.axes) sizes.push_back(axis.values.size());
  return sizes;
}

}  // namespace

std::size_t StudyTable::count(CaseStatus status) const {
  return static_cast<std::size_t>(
      std::count_if(rows.begin(), rows.end(), [&](const CaseRow& row) { return row.status == status; }));
}

const char* name_of(StudyMode mode) { return mode == StudyMode::impact ? "impact" : "run"; }

StudyTable empty_table(const Study& study) {
  StudyTable table{study.name, study.text, study.sha256, study.mode, study.axes, {}, {}, study.file};
  for (const Column& column : study.columns) table.columns.push_back({column.name, column.unit, column.description});
  return table;
}

std::string csv_head(const StudyTable& table) {
  std::string line = "point";
  for (const StudyAxis& axis : table.axes) line += "," + head_of(axis.name, axis.unit);
  line += ",status,reason";
  for (const StudyTable::Head& column : table.columns) line += "," + head_of(column.name, column.unit);
  return line + "\n";
}

std::string csv_line(const StudyTable& table, const CaseRow& row) {
  std::string line = std::to_string(row.index);
  const std::vector<std::size_t> position = grid_position(sizes_of(table), row.index);
  for (std::size_t a = 0; a < table.axes.size(); ++a) {
    const AxisValue& value = table.axes[a].values[position[a]];
    line += ",";
    if (table.axes[a].is_numeric)
      append_csv_number(value.number, line);
    else
      line += csv_quoted(value.label);
  }
  line += std::string(",") + name_of(row.status) + "," + csv_quoted(row.reason);
  for (const double value : row.values) {
    line += ",";
    append_csv_number(value, line);
  }
  return line + "\n";
}

void write_study_csv(const StudyTable& table, const std::filesystem::path& path) {
  AtomicFile file(path);
  std::string text = csv_head(table);
  for (const CaseRow& row : table.rows) {
    text += csv_line(table, row);
    if (text.size() < kBlock) continue;
    file.write(text);
    text.clear();
  }
  file.write(text);
  file.commit();
}

std::string study_settings_json(const StudyTable& table, const std::string& version) {
  using Json = nlohmann::ordered_json;
  Json json{{"schema", "grapnel-study-table/1"},
            {"version", version},
            {"study",
             {{"name", table.study_name},
              {"file", std::filesystem::path(table.study_file).filename().string()},
              {"sha256", table.sha256},
              {"simulate", name_of(table.mode)}}},
            {"points", table.rows.size()}};
  for (const CaseStatus status : {CaseStatus::ok, CaseStatus::failed, CaseStatus::unreachable})
    json[name_of(status)] = table.count(status);
  json["axes"] = Json::array();
  for (const StudyAxis& axis : table.axes) {
    Json values = Json::array();
    for (const AxisValue& value : axis.values)
      values.push_back(axis.is_numeric ? Json(value.number) : Json(value.label));
    json["axes"].push_back(
        {{"name", axis.name}, {"unit", axis.unit}, {"description", axis.description}, {"values", std::move(values)}});
  }
  json["columns"] = Json::array();
  for (const StudyTable::Head& column : table.columns)
    json["columns"].push_back({{"name", column.name}, {"unit", column.unit}, {"description", column.description}});
  json["text"] = table.study_text;
  // A study file is UTF-8 by its check; a program's own need not be.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace grapnel
