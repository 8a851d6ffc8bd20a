#pragma once

/// @file
/// Tables of described structures for the terminal: heads, units and values follow from the descriptions.
///
/// The columns are a text: keys, separated by semicolons, each with its head unless that is the words of the key:
/// "name = reaction wheel; rate_before; share%". `~` behind a key: three digits instead of five; `%`: a share, times
/// 100. Absent values are "-", infinite ones "none". "= head" without a key: the text of the row.

#include <string>
#include <string_view>
#include <vector>

#include "grapnel/describe/type.hpp"
#include "grapnel/result/text_table.hpp"

namespace grapnel {

/// The components, in the printed precision. Those at the level of rounding error relative to the others are printed as
/// zero; summary.json has all digits.
std::string short_vector(const Vector3d& v);

/// Three digits, for residuals.
std::string small_number(double value);

/// A row of a table: a structure, and a text: the cell of a column without a key, or else behind the first cell.
struct DescribedRow {
  const void* owner;
  std::string text;
};
/// Heads, units, and one row per structure. Empty without rows. @throws std::logic_error for an unknown key.
std::string described_table(const Type& type, const std::vector<DescribedRow>& rows, std::string_view columns);

/// `text_of`: of a structure, the text of its row.
template <class T, class Text>
std::string described_table(const std::vector<T>& list, std::string_view columns, Text text_of) {
  std::vector<DescribedRow> rows;
  for (const T& one : list) rows.push_back({&one, text_of(one)});
  return described_table(type_of<T>(), rows, columns);
}
template <class T>
std::string described_table(const std::vector<T>& list, std::string_view columns) {
  return described_table(list, columns, [](const T&) { return ""; });
}

/// A row for each of these keys that the structure has: words, unit, value. @throws as described_table().
std::string described_pairs(const Type& type, const void* owner, std::string_view keys);

}  // namespace grapnel
