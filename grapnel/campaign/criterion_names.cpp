#include "grapnel/campaign/criterion_names.hpp"

#include <algorithm>
#include <cctype>

namespace grapnel {
namespace {

constexpr std::size_t kLongestCompared = 120;  // bytes; the comparison of two words takes their product

bool is_name_character(char c) {
  const auto byte = static_cast<unsigned char>(c);
  return std::isalnum(byte) || byte >= 0x80 || c == '_' || c == '.' || c == '-' || c == '/';
}

std::vector<std::string_view> parts_of(std::string_view text) {
  std::vector<std::string_view> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('/', begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// Edits that make one word of the other (Levenshtein), whatever the case of the letters; at most `most` + 1.
std::size_t edits(std::string_view a, std::string_view b, std::size_t most) {
  if (std::max(a.size(), b.size()) - std::min(a.size(), b.size()) > most) return most + 1;
  const auto lower = [](char c) { return std::tolower(static_cast<unsigned char>(c)); };
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t kept = diagonal + (lower(a[i - 1]) == lower(b[j - 1]) ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, kept});
    }
  }
  return std::min(row.back(), most + 1);
}

}  // namespace

std::vector<NameMatch> matching_names(std::string_view pattern, std::span<const std::string> names) {
  std::vector<NameMatch> matches;
  if (pattern.find('*') == std::string_view::npos) {
    const auto found = std::find(names.begin(), names.end(), pattern);
    if (found != names.end()) matches.push_back({{}, static_cast<std::size_t>(found - names.begin())});
    return matches;
  }
  const std::vector<std::string_view> wanted = parts_of(pattern);
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::vector<std::string_view> parts = parts_of(names[n]);
    if (parts.size() != wanted.size()) continue;
    NameMatch match{{}, n};
    bool same = true;
    for (std::size_t i = 0; same && i < parts.size(); ++i) {
      if (wanted[i] == "*")
        match.stars.emplace_back(parts[i]);
      else
        same = wanted[i] == parts[i];
    }
    if (same) matches.push_back(std::move(match));
  }
  std::stable_sort(matches.begin(), matches.end(),
                   [](const NameMatch& a, const NameMatch& b) { return a.stars < b.stars; });
  const auto last = std::unique(matches.begin(), matches.end(),
                                [](const NameMatch& a, const NameMatch& b) { return a.stars == b.stars; });
  matches.erase(last, matches.end());
  return matches;
}

std::size_t longest_name(std::string_view text) {
  std::size_t length = 0;
  for (; length < text.size(); ++length) {
    if (is_name_character(text[length])) continue;
    // A star only as a whole part; elsewhere it multiplies.
    const bool begins = length == 0 || text[length - 1] == '/';
    const bool ends = length + 1 == text.size() || text[length + 1] == '/' || !is_name_character(text[length + 1]);
    if (text[length] != '*' || !begins || !ends) break;
  }
  return length;
}

std::optional<LeadingName> leading_name(std::string_view text, std::span<const std::string> names) {
  const std::size_t longest = longest_name(text);
  // No name is longer than the longest of them; stars may stand for much and are short themselves.
  std::size_t most = 0;
  for (const std::string& name : names) most = std::max(most, name.size());
  for (std::size_t length = std::min(longest, most); length > 0; --length) {
    const bool may_end = length == longest || text[length] == '/' || text[length] == '-';
    if (!may_end) continue;
    std::vector<NameMatch> matches = matching_names(text.substr(0, length), names);
    if (!matches.empty()) return LeadingName{length, std::move(matches)};
  }
  return std::nullopt;
}

std::string near_name(std::string_view word, std::span<const std::string> names) {
  if (word.empty() || word.size() > kLongestCompared) return "";
  // The end of a long name is what people remember of it.
  for (const std::string& name : names) {
    if (name.size() > word.size() && name.ends_with(word) && name[name.size() - word.size() - 1] == '/')
      return "; did you mean '" + name + "'?";
  }
  const std::string* best = nullptr;
  std::size_t fewest = std::min(std::max<std::size_t>(1, word.size() / 3), word.size() - 1);
  for (const std::string& name : names) {
    if (name.size() > kLongestCompared) continue;
    const std::size_t count = edits(word, name, fewest);
    if (count > fewest || (best && count == fewest)) continue;
    best = &name;
    fewest = count;
  }
  return best ? "; did you mean '" + *best + "'?" : "";
}

}  // namespace grapnel
