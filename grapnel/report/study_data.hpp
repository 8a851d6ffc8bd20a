#pragma once

/// @file
/// Result folders of sweeps, campaigns and optimizations, as a report holds them and as figures need them. All throw
/// std::runtime_error naming path and fault; TooLarge where a page could not show so much.

#include <cstddef>
#include <filesystem>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "grapnel/result/time_series.hpp"

namespace grapnel {

// Our CSV files read back.

/// A file with a line of heads, read record by record (RFC 4180). Faults are std::runtime_error naming path and line.
class CsvTable {
 public:
  explicit CsvTable(const std::filesystem::path& path);

  const std::vector<std::string>& heads() const { return heads_; }
  /// The next record, with one field per head. False after the last.
  bool next(std::vector<std::string>& fields);
  /// A field of the record that next() gave, as a number; NaN and infinities are spelled "NaN", "Inf", "-Inf".
  double number(const std::vector<std::string>& fields, std::size_t column) const;
  /// Throws, naming the line of the last record.
  [[noreturn]] void fail(const std::string& fault) const;

 private:
  bool read(std::vector<std::string>& fields);
  std::string quoted_field();

  std::filesystem::path path_;
  std::string text_;
  std::size_t at_ = 0;
  std::size_t line_ = 1, record_line_ = 1;
  std::vector<std::string> heads_;
};

/// A file that results come from, as seen from their folder: by `file_folder` of a document there, else its name alone.
std::string seen_from_results(const std::filesystem::path& document, const std::string& name);

/// SweepData of web/src/data.ts from study.json and table.csv.
nlohmann::ordered_json sweep_data(const std::filesystem::path& folder);

/// CampaignData of web/src/data.ts from campaign.json, which must be sound, and table.h5, which a note says to be
/// missing or damaged.
nlohmann::ordered_json campaign_data(const std::filesystem::path& folder);

/// OptimizationData of web/src/data.ts from comparison.json and evaluations.csv.
nlohmann::ordered_json optimization_data(const std::filesystem::path& folder);

// The files of a sweep's or an optimization's result folder as reports and figures need them.
// Faults are std::runtime_error naming path and fault.

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

struct StudySource {
  std::filesystem::path folder;
  nlohmann::ordered_json settings;  // study.json
  TimeSeriesMetadata metadata;      // the study's name and hash
  std::vector<StudyColumn> axes, columns;
  std::size_t points = 0;
  std::vector<std::string> status, reason;  // per point
};

/// Reads study.json and table.csv, which must be of one study. @throws std::runtime_error naming file and fault,
/// TooLarge before more than `max_numbers` would be read.
StudySource read_study_source(const std::filesystem::path& folder,
                              std::size_t max_numbers = std::numeric_limits<std::size_t>::max());

/// "name [unit]" for readers: without a unit where it is 1.
std::string column_label(const StudyColumn& column);

}  // namespace grapnel
