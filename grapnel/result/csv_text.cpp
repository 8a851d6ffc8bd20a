#include "grapnel/result/csv_text.hpp"

#include <charconv>
#include <cmath>
#include <string_view>

namespace grapnel {

namespace {

// A text that a spreadsheet would compute, or one that looks as if it had been kept from it.
bool csv_is_formula(std::string_view text) {
  const std::size_t begin = text.find_first_not_of('\'');
  return begin != std::string_view::npos && std::string_view("=+-@\t\r").find(text[begin]) != std::string_view::npos;
}

}  // namespace

std::string csv_text_of(std::string_view field) {
  if (field.starts_with('\'') && csv_is_formula(field)) field.remove_prefix(1);
  return std::string(field);
}

std::string csv_quoted(const std::string& plain) {
  const std::string text = csv_is_formula(plain) ? "'" + plain : plain;
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) {
    if (c == '"') field += '"';
    field += c;
  }
  return field + "\"";
}

void append_csv_number(double value, std::string& out) {
  if (!std::isfinite(value)) {
    out += std::isnan(value) ? "NaN" : value > 0 ? "Inf" : "-Inf";
    return;
  }
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  out.append(buffer, end);
}

}  // namespace grapnel
