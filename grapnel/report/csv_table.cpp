#include "grapnel/report/csv_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

#include "grapnel/result/csv_text.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {

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
