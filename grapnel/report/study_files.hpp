#pragma once

/// @file
/// What a study's JSON file and the table beside it have in common, of sweeps and optimizations. Inside this module
/// only. Faults are std::runtime_error naming path and fault.

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/report/csv_table.hpp"

namespace grapnel {

/// A column of a study's table.
struct StudyColumn {
  std::string name, unit, description;
  std::vector<double> values = {};       // per point; NaN where there is nothing
  std::vector<std::string> labels = {};  // of an axis of labels: values count from 0 into them
};

/// The list at `key`, or a fault.
const nlohmann::ordered_json& list_of(const nlohmann::ordered_json& document, const std::string& key,
                                      const std::filesystem::path& path);

/// The text at `key` of an entry of the list `list`, or a fault.
std::string text_of(const nlohmann::ordered_json& entry, const char* key, const std::filesystem::path& path,
                    const std::string& list);

/// Entries with name, unit and description of the list at `key`, without values. `description`: of entries that have
/// none.
std::vector<StudyColumn> described_columns(const nlohmann::ordered_json& document, const std::string& key,
                                           const std::filesystem::path& path, const std::string& description = {});

/// How the table heads a column: "name [unit]".
std::string table_head(const StudyColumn& column);

/// That the table is the one which `file`, beside it, describes.
void expect_heads(const CsvTable& table, const std::vector<std::string>& expected, const std::string& file);

/// That a table has at most `most` numbers. @throws TooLarge
void expect_size(std::size_t rows, std::size_t columns, std::size_t most, const std::filesystem::path& path);

}  // namespace grapnel
