#include "grapnel/result/mat_names.hpp"

#include <algorithm>
#include <array>
#include <string_view>

namespace grapnel {
namespace {

constexpr std::size_t kLongest = 63;  // MATLAB's namelengthmax

constexpr std::array<std::string_view, 20> kKeywords{
    "break",  "case", "catch",     "classdef", "continue",   "else",   "elseif", "end",    "for", "function",
    "global", "if",   "otherwise", "parfor",   "persistent", "return", "spmd",   "switch", "try", "while"};

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string matlab_name(const std::string& name) {
  std::string valid;
  for (const char c : name) valid += is_letter(c) || is_digit(c) ? c : '_';
  const bool keyword = std::find(kKeywords.begin(), kKeywords.end(), valid) != kKeywords.end();
  if (valid.empty() || !is_letter(valid.front()) || keyword) valid.insert(0, 1, 'x');
  return valid.substr(0, kLongest);
}

std::string unique_matlab_name(const std::string& name, std::set<std::string>& taken) {
  const std::string valid = matlab_name(name);
  std::string candidate = valid;
  for (int n = 2; !taken.insert(candidate).second; ++n) {
    const std::string suffix = "_" + std::to_string(n);
    candidate = valid.substr(0, kLongest - suffix.size()) + suffix;
  }
  return candidate;
}

}  // namespace grapnel
