// Text files with a single matrix: Matrix Market, Abaqus's matrix output, a table, CalculiX's matrix storage.

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <map>

#include "grapnel/import/element_text.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::element_text {
namespace {

// Finite-element matrices are sparse; those written in full are small.
constexpr long long kMaxFullRows = 20'000;

// A size in the head of a file.
std::optional<int> size_of(std::string_view word, long long most, const Lines& lines, FaultList& faults) {
  const auto size = integer_of(word);
  if (!size || *size < 1 || *size > most) {
    faults.add(lines.mark(word), fmt::format("the number of rows must be from 1 to {}, not {}", most, in_quotes(word)));
    return std::nullopt;
  }
  return static_cast<int>(*size);
}

}  // namespace

// --- Matrix Market ---

bool is_matrix_market(std::string_view text) { return text.starts_with("%"); }

namespace {

// The head of a Matrix Market file.
struct MarketHead {
  bool is_list = false, is_symmetric = false;
  int size = 0;
  long long expected = 0;  // number of entries
};

// The next line with numbers; empty at the end.
std::optional<std::string_view> next_numbers(Lines& lines) {
  std::optional<std::string_view> line;
  do line = lines.next();
  while (line && (trimmed(*line).empty() || line->starts_with('%')));
  return line;
}

std::optional<MarketHead> read_market_head(Lines& lines, FaultList& faults) {
  const auto head = lines.next();
  std::vector<std::string> words;
  for (const std::string_view word : words_of(head.value_or(""), " \t")) {
    words.emplace_back(word);
    for (char& c : words.back()) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  if (words.size() != 5 || words[0] != "%%matrixmarket" || words[1] != "matrix") {
    faults.add(lines.mark({}), "a Matrix Market file begins with '%%MatrixMarket matrix coordinate real symmetric'");
    return std::nullopt;
  }
  const bool is_list = words[2] == "coordinate", is_symmetric = words[4] == "symmetric";
  if ((!is_list && words[2] != "array") || (words[3] != "real" && words[3] != "integer" && words[3] != "double") ||
      (!is_symmetric && words[4] != "general")) {
    faults.add(lines.mark({}),
               fmt::format("a mass or stiffness matrix must be 'coordinate' or 'array', 'real', and 'symmetric' or "
                           "'general', not '{} {} {}'",
                           shortened(words[2]), shortened(words[3]), shortened(words[4])));
    return std::nullopt;
  }
  const auto line = next_numbers(lines);
  if (!line || words_of(*line, " \t").size() != (is_list ? 3u : 2u)) {
    faults.add(lines.mark({}), is_list ? "the line of sizes must be 'rows columns entries'"
                                       : "the line of sizes must be 'rows columns'");
    return std::nullopt;
  }
  const auto sizes = words_of(*line, " \t");
  const auto size = size_of(sizes[0], is_list ? kMaxRows : kMaxFullRows, lines, faults);
  if (!size) return std::nullopt;
  if (integer_of(sizes[1]) != *size) {
    faults.add(lines.mark(sizes[1]),
               fmt::format("the matrix must be square, not {} by {}", *size, shortened(sizes[1])));
    return std::nullopt;
  }
  const long long n = *size;
  const long long expected = is_list ? integer_of(sizes[2]).value_or(-1) : (is_symmetric ? n * (n + 1) / 2 : n * n);
  return MarketHead{is_list, is_symmetric, *size, expected};
}

}  // namespace

std::optional<ElementMatrix> read_matrix_market(const std::string& path, std::string_view text, FaultList& faults) {
  Lines lines(path, text);
  const auto head = read_market_head(lines, faults);
  if (!head) return std::nullopt;
  const auto [is_list, is_symmetric, size, expected] = *head;
  Entries entries(size);
  const Mark first = lines.mark({});
  long long count = 0;
  int row = 0, column = 0;  // of an array, which is stored by columns
  while (count < expected) {
    const auto line = next_numbers(lines);
    if (!line) break;
    const auto parts = words_of(*line, " \t");
    for (std::size_t i = 0; i < parts.size(); i += is_list ? 3 : 1) {
      if (is_list) {
        if (parts.size() != 3) {
          faults.add(lines.mark({}), "an entry must be 'row column value'");
          return std::nullopt;
        }
        const auto r = index_of(parts[0], size, lines, faults), c = index_of(parts[1], size, lines, faults);
        if (!r || !c) return std::nullopt;
        row = *r, column = *c;
      }
      const auto value = value_of(parts[i + (is_list ? 2 : 0)], lines, faults);
      if (!value) return std::nullopt;
      entries.add(row, column, *value);
      ++count;
      if (!is_list && ++row == size) ++column, row = is_symmetric ? column : 0;
      if (!is_list && count == expected) break;
    }
  }
  if (count != expected || next_numbers(lines)) {
    faults.add(first, fmt::format("{} entries follow, but the head states {}",
                                  count == expected ? "more" : std::to_string(count), expected));
    return std::nullopt;
  }
  auto A =
      entries.symmetric(is_symmetric ? Entries::Triangles::one : Entries::Triangles::both, first, row_number, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path, std::move(*A), {}};
}

// --- Abaqus ---

namespace {

// Abaqus's value on the diagonal of a degree of freedom with a boundary condition.
constexpr double kAbaqusHeld = 1e35;

struct AbaqusEntry {
  ElementDof row, column;  // of COORDINATE: the indices as nodes
  double value = 0;
};

// NODE, COMPONENT, NODE, COMPONENT, VALUE, or ROW, COLUMN, VALUE.
std::optional<AbaqusEntry> abaqus_entry(const std::vector<std::string_view>& words, const Lines& lines,
                                        FaultList& faults) {
  AbaqusEntry entry;
  const bool is_labelled = words.size() == 5;
  const auto dof_at = [&](std::size_t i, ElementDof& dof) {
    const auto node = integer_of(words[i]);
    const auto component = integer_of(words[i + 1]);
    if (node && component && *component >= 1 && *component <= 6) {
      dof = {*node, static_cast<int>(*component)};
      return true;
    }
    faults.add(lines.mark(words[i]), fmt::format("must be a node and its degree of freedom from 1 to 6, not {} and {}",
                                                 in_quotes(words[i]), in_quotes(words[i + 1])));
    return false;
  };
  if (is_labelled) {
    if (!dof_at(0, entry.row) || !dof_at(2, entry.column)) return std::nullopt;
  } else {
    const auto row = index_of(words[0], kMaxRows, lines, faults);
    const auto column = row ? index_of(words[1], kMaxRows, lines, faults) : std::nullopt;
    if (!column) return std::nullopt;
    entry.row.node = *row, entry.column.node = *column;
  }
  const auto value = value_of(words.back(), lines, faults);
  if (!value) return std::nullopt;
  entry.value = *value;
  if (std::abs(entry.value) < kAbaqusHeld) return entry;
  faults.add(lines.mark(words.back()),
             fmt::format("{} is Abaqus's mark of a degree of freedom with a boundary condition: the matrices must "
                         "be those of the free model",
                         in_quotes(words.back())));
  return std::nullopt;
}

}  // namespace

std::optional<ElementMatrix> read_abaqus(const std::string& path, std::string_view text, FaultList& faults) {
  Lines lines(path, text);
  std::vector<AbaqusEntry> entries;
  std::size_t width = 0;  // words of a line
  while (const auto line = lines.next()) {
    const auto words = words_of(*line, ", \t");
    if (words.empty() || words[0].starts_with('*')) continue;
    if (width == 0 && (words.size() == 3 || words.size() == 5)) width = words.size();
    if (words.size() != width) {
      faults.add(lines.mark({}),
                 "a .mtx file is a Matrix Market file, which begins with '%%MatrixMarket matrix "
                 "coordinate real symmetric', or Abaqus' matrix output, with lines 'row column value' "
                 "or 'node, component, node, component, value'");
      return std::nullopt;
    }
    const auto entry = abaqus_entry(words, lines, faults);
    if (!entry) return std::nullopt;
    entries.push_back(*entry);
  }
  if (entries.empty()) {
    faults.add(file_mark(path), "the file has no entries");
    return std::nullopt;
  }
  std::vector<ElementDof> dofs;
  if (width == 5) {
    for (const AbaqusEntry& e : entries) dofs.push_back(e.row), dofs.push_back(e.column);
    std::sort(dofs.begin(), dofs.end());
    dofs.erase(std::unique(dofs.begin(), dofs.end()), dofs.end());
  }
  long long size = static_cast<long long>(dofs.size());
  for (const AbaqusEntry& e : entries) {
    if (width == 3) size = std::max({size, e.row.node + 1, e.column.node + 1});
  }
  const auto place = [&](const ElementDof& dof) {
    return static_cast<int>(width == 3 ? dof.node : std::lower_bound(dofs.begin(), dofs.end(), dof) - dofs.begin());
  };
  Entries matrix(static_cast<int>(size));
  for (const AbaqusEntry& e : entries) matrix.add(place(e.row), place(e.column), e.value);
  auto A = matrix.symmetric(
      Entries::Triangles::one, file_mark(path),
      [&](int row) { return dofs.empty() ? row_number(row) : dofs[static_cast<std::size_t>(row)].text(); }, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path, std::move(*A), std::move(dofs)};
}

// --- A table ---

std::optional<ElementMatrix> read_table(const std::string& path, std::string_view text, FaultList& faults) {
  Lines lines(path, text);
  std::vector<std::vector<double>> rows;
  Mark first;
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(line->substr(0, line->find('#')));
    if (content.empty()) continue;
    if (rows.empty()) first = lines.mark({});
    std::vector<double> row;
    for (const std::string_view word : words_of(content, ",; \t")) {
      const auto value = value_of(word, lines, faults);
      if (!value) return std::nullopt;
      row.push_back(*value);
    }
    if (!rows.empty() && row.size() != rows[0].size()) {
      faults.add(lines.mark({}),
                 fmt::format("this row has {}, the first has {}", counted(row.size(), "number"), rows[0].size()));
      return std::nullopt;
    }
    if (row.size() > static_cast<std::size_t>(kMaxFullRows)) {
      faults.add(lines.mark({}),
                 fmt::format("a table can have at most {} columns; write larger matrices, which are sparse, to "
                             "a Matrix Market file",
                             kMaxFullRows));
      return std::nullopt;
    }
    rows.push_back(std::move(row));
  }
  if (rows.empty() || rows.size() != rows[0].size()) {
    faults.add(file_mark(path), rows.empty()
                                    ? "the file has no numbers"
                                    : fmt::format("the matrix must be square: it has {} and {}",
                                                  counted(rows.size(), "row"), counted(rows[0].size(), "column")));
    return std::nullopt;
  }
  Entries entries(static_cast<int>(rows.size()));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t c = 0; c < rows.size(); ++c) entries.add(static_cast<int>(r), static_cast<int>(c), rows[r][c]);
  }
  auto A = entries.symmetric(Entries::Triangles::both, first, row_number, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path, std::move(*A), {}};
}

// --- CalculiX: *FREQUENCY, SOLVER=MATRIXSTORAGE ---

std::optional<ElementMatrix> read_calculix(const std::string& path, std::string_view text, std::vector<ElementDof> dofs,
                                           FaultList& faults) {
  Lines lines(path, text);
  const int size = static_cast<int>(dofs.size());
  Entries entries(size);
  while (const auto line = lines.next()) {
    const auto words = words_of(*line, " \t");
    if (words.empty()) continue;
    if (words.size() != 3) {
      faults.add(lines.mark({}), "an entry must be 'row column value'");
      return std::nullopt;
    }
    const auto r = index_of(words[0], size, lines, faults), c = index_of(words[1], size, lines, faults);
    const auto value = r && c ? value_of(words[2], lines, faults) : std::nullopt;
    if (!value) return std::nullopt;
    entries.add(*r, *c, *value);
  }
  auto A = entries.symmetric(
      Entries::Triangles::one, file_mark(path), [&](int row) { return dofs[static_cast<std::size_t>(row)].text(); },
      faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path, std::move(*A), std::move(dofs)};
}

}  // namespace grapnel::element_text
