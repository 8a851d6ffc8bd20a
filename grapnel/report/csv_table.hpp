#pragma once

/// @file
/// Our CSV files read back. Inside this module only.

#include <filesystem>
#include <string>
#include <vector>

namespace grapnel {

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

}  // namespace grapnel
