#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>

#include "grapnel/compare/measured_log.hpp"
#include "grapnel/text/csv_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

// A number, or NaN for a missing value: nothing, "NaN", "NA", "inf". Empty for other texts.
std::optional<double> number_in(std::string_view text) {
  static constexpr std::array<std::string_view, 8> kNone = {"", "nan", "NaN", "NAN", "NA", "N/A", "null", "-"};
  if (std::find(kNone.begin(), kNone.end(), text) != kNone.end()) return kMissing;
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (end != digits.data() + digits.size() || error == std::errc::invalid_argument) return std::nullopt;
  return error == std::errc() && std::isfinite(value) ? value : kMissing;
}

class CsvLog {
 public:
  CsvLog(const std::string& text, const std::vector<std::string>& requested, MeasuredLog& log, FaultList& faults)
      : csv_(text, csv_separator(text), CsvQuotes::enclose), requested_(requested), log_(log), faults_(faults) {}

  bool read() {
    const CsvLine* line = csv_.next();
    if (!line || !read_names(*line)) return false;
    if (header_is_comment_) read_sample(*line);
    while (!faults_.full() && (line = csv_.next()) != nullptr) read_sample(*line);
    for (const Wrong& wrong : wrong_) report(wrong);
    for (LogDataset& one : log_.datasets) one.rows = log_.lines.size();
    return true;
  }

 private:
  // The first text that is no number, of a column.
  struct Wrong {
    std::size_t column;
    Mark mark;
    std::string text;
    std::size_t count;
  };

  bool read_names(const CsvLine& first) {
    const CsvLine* header = &first;
    if (number_in(first.cells[0].text)) {  // numpy.savetxt writes the header as a comment
      for (const CsvLine& comment : csv_.comments()) {
        if (comment.cells.size() == first.cells.size()) header = &comment;
      }
      header_is_comment_ = header != &first;
      if (!header_is_comment_) {
        faults_.add({log_.source, first.number, 1}, "the log has no line with the names of its columns");
        return false;
      }
    }
    for (const CsvCell& cell : header->cells) {
      const std::string name(cell.text);
      const auto same = [&](const LogDataset& one) { return one.name == name; };
      if (!name.empty() && std::any_of(log_.datasets.begin(), log_.datasets.end(), same))
        faults_.add(mark_in(*header, cell.begin, log_.source), fmt::format("duplicate column {}", in_quotes(name)));
      log_.datasets.push_back({name, {}, {}, 0, 1, {}});
    }
    columns_ = requested_datasets(log_.datasets, requested_);
    return true;
  }

  void read_sample(const CsvLine& line) {
    const std::size_t expected = log_.datasets.size();
    // A separator at the end of each line, but not of the header, is harmless.
    const bool has_end = line.cells.size() == expected + 1 && line.cells.back().text.empty();
    if (line.cells.size() != expected && !has_end) {
      faults_.add(mark_in(line, line.cells[0].begin, log_.source),
                  fmt::format("the line has {}, must have {}", counted(line.cells.size(), "field"), expected));
      return;
    }
    log_.lines.push_back(line.number);
    for (const std::size_t column : columns_) {
      const CsvCell& cell = line.cells[column];
      const auto value = number_in(cell.text);
      log_.datasets[column].values.push_back(value.value_or(kMissing));
      if (value) continue;
      const auto known = std::find_if(wrong_.begin(), wrong_.end(), [&](const Wrong& w) { return w.column == column; });
      if (known != wrong_.end())
        ++known->count;
      else
        wrong_.push_back({column, mark_in(line, cell.begin, log_.source), std::string(cell.text), 1});
    }
  }

  void report(const Wrong& wrong) {
    Node node;
    node.kind = Node::Kind::scalar;
    node.text = wrong.text;
    faults_.add(wrong.mark,
                fmt::format("{} must be a number{}{}", in_quotes(log_.datasets[wrong.column].name), why_no_number(node),
                            wrong.count > 1 ? fmt::format(" (the first of {} such values)", wrong.count) : ""));
  }

  CsvText csv_;
  const std::vector<std::string>& requested_;
  MeasuredLog& log_;
  FaultList& faults_;
  std::vector<std::size_t> columns_;  // requested
  std::vector<Wrong> wrong_;
  bool header_is_comment_ = false;
};

}  // namespace

bool read_csv_log(const std::string& text, const std::vector<std::string>& requested, MeasuredLog& log,
                  FaultList& faults) {
  if (CsvText(text, ',').next() == nullptr) {
    faults.add({log.source, 1, 1}, "the log is empty");
    return false;
  }
  return CsvLog(text, requested, log, faults).read();
}

}  // namespace grapnel
