#include "grapnel/finite_elements/element_matrix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <string_view>

#include "grapnel/finite_elements/element_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {

std::string ElementDof::text() const {
  return component == 0 ? fmt::format("scalar point {}", node) : fmt::format("node {}, component {}", node, component);
}

namespace element_text {

std::optional<double> number_of(std::string_view text) {
  // 1.5D+03 and, as Nastran has it, 1.5+3 are Fortran's ways to write 1.5e3.
  std::string plain;
  plain.reserve(text.size() + 1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == 'D' || c == 'd') {
      plain += 'e';
    } else if ((c == '+' || c == '-') && i > 0 &&
               std::string_view("eEdD").find(text[i - 1]) == std::string_view::npos) {
      plain += 'e', plain += c;
    } else {
      plain += c;
    }
  }
  std::string_view rest(plain);
  if (rest.starts_with('+')) rest.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error != std::errc() || end != rest.data() + rest.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<long long> integer_of(std::string_view text) {
  long long value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && std::string_view(" \t\r").find(text.front()) != std::string_view::npos) text.remove_prefix(1);
  while (!text.empty() && std::string_view(" \t\r").find(text.back()) != std::string_view::npos) text.remove_suffix(1);
  return text;
}

Lines::Lines(const std::string& path, std::string_view text)
    : source_(std::make_shared<const std::string>(path)), rest_(text) {}

std::optional<std::string_view> Lines::next() {
  if (rest_.empty()) return std::nullopt;
  const std::size_t end = rest_.find('\n');
  line_ = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  ++number_;
  return line_;
}

Mark Lines::mark(std::string_view part) const {
  const bool inside = part.data() >= line_.data() && part.data() <= line_.data() + line_.size();
  return {source_, number_, inside ? static_cast<int>(part.data() - line_.data()) + 1 : 1};
}

std::vector<std::string_view> words_of(std::string_view line, std::string_view separators) {
  std::vector<std::string_view> words;
  for (std::size_t begin = line.find_first_not_of(separators); begin != std::string_view::npos;) {
    const std::size_t end = std::min(line.find_first_of(separators, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(separators, end);
  }
  return words;
}

Entries::Entries(int size) : size_(size) {}

void Entries::add(int row, int column, double value) {
  if (value != 0) triplets_.emplace_back(row, column, value);
}

std::optional<Eigen::SparseMatrix<double>> Entries::symmetric(Triangles triangles, const Mark& mark,
                                                              const std::function<std::string(int)>& row_name,
                                                              FaultList& faults) {
  Eigen::SparseMatrix<double> A(size_, size_);
  A.setFromTriplets(triplets_.begin(), triplets_.end());
  if (triangles == Triangles::one) {
    // Of a pair of which one is there, that is both: rows are in any order, so there need be no triangle.
    std::vector<Triplet> missing;
    for (int column = 0; column < size_; ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(A, column); it; ++it) {
        if (A.coeff(column, it.row()) == 0) missing.emplace_back(column, static_cast<int>(it.row()), it.value());
      }
    }
    Eigen::SparseMatrix<double> others(size_, size_);
    others.setFromTriplets(missing.begin(), missing.end());
    A += others;
  }
  triplets_.clear();
  const Eigen::SparseMatrix<double> T = A.transpose();
  const Eigen::VectorXd diagonal = A.diagonal();
  double worst = 0;
  int worst_row = 0, worst_column = 0;
  const Eigen::SparseMatrix<double> difference = A - T;
  for (int column = 0; column < size_; ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(difference, column); it; ++it) {
      const double scale =
          std::max({std::abs(diagonal[it.row()]), std::abs(diagonal[column]), std::abs(A.coeff(it.row(), column))});
      if (std::abs(it.value()) > worst * scale)
        worst = std::abs(it.value()) / scale, worst_row = static_cast<int>(it.row()), worst_column = column;
    }
  }
  if (worst > kAsymmetry) {
    faults.add(mark, fmt::format("the matrix is not symmetric: {:.9g} in row {} and column {}, {:.9g} the other way",
                                 A.coeff(worst_row, worst_column), row_name(worst_row), row_name(worst_column),
                                 A.coeff(worst_column, worst_row)));
    return std::nullopt;
  }
  return Eigen::SparseMatrix<double>(0.5 * (A + T));
}

}  // namespace element_text

namespace {

using namespace element_text;

std::string row_number(int row) { return std::to_string(row + 1); }

constexpr long long kMostRows = 2'000'000;
// Matrices of finite elements are sparse; those that are written in full are small.
constexpr long long kMostFullRows = 20'000;

// A size in the head of a file.
std::optional<int> size_of(std::string_view word, long long most, const Lines& lines, FaultList& faults) {
  const auto size = integer_of(word);
  if (!size || *size < 1 || *size > most) {
    faults.add(lines.mark(word), fmt::format("the number of rows must be from 1 to {}, not {}", most, in_quotes(word)));
    return std::nullopt;
  }
  return static_cast<int>(*size);
}

// A row or column, counted from 1 in files.
std::optional<int> index_of(std::string_view word, int size, const Lines& lines, FaultList& faults) {
  const auto index = integer_of(word);
  if (!index || *index < 1 || *index > size) {
    faults.add(lines.mark(word), fmt::format("a row or column must be from 1 to {}, not {}", size, in_quotes(word)));
    return std::nullopt;
  }
  return static_cast<int>(*index) - 1;
}

std::optional<double> value_of(std::string_view word, const Lines& lines, FaultList& faults) {
  const auto value = number_of(word);
  if (!value) faults.add(lines.mark(word), fmt::format("{} is no finite number", in_quotes(word)));
  return value;
}

// --- Matrix Market ---

std::optional<ElementMatrix> read_matrix_market(const std::string& path, std::string_view text, FaultList& faults) {
  Lines lines(path, text);
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
  const bool is_list = words[2] == "coordinate";
  if ((!is_list && words[2] != "array") || (words[3] != "real" && words[3] != "integer" && words[3] != "double") ||
      (words[4] != "symmetric" && words[4] != "general")) {
    faults.add(lines.mark({}),
               fmt::format("a mass or stiffness matrix is 'coordinate' or 'array', 'real', and 'symmetric' or "
                           "'general', not '{} {} {}'",
                           shortened(words[2]), shortened(words[3]), shortened(words[4])));
    return std::nullopt;
  }
  const bool is_symmetric = words[4] == "symmetric";
  std::optional<std::string_view> line;
  const auto next = [&] {
    do line = lines.next();
    while (line && (trimmed(*line).empty() || line->starts_with('%')));
    return line.has_value();
  };
  const std::size_t numbers = is_list ? 3 : 2;
  if (!next() || words_of(*line, " \t").size() != numbers) {
    faults.add(lines.mark({}), is_list ? "the line of sizes must be 'rows columns entries'"
                                       : "the line of sizes must be 'rows columns'");
    return std::nullopt;
  }
  const auto sizes = words_of(*line, " \t");
  const auto size = size_of(sizes[0], is_list ? kMostRows : kMostFullRows, lines, faults);
  if (!size) return std::nullopt;
  if (integer_of(sizes[1]) != *size) {
    faults.add(lines.mark(sizes[1]),
               fmt::format("the matrix must be square, not {} by {}", *size, shortened(sizes[1])));
    return std::nullopt;
  }
  Entries entries(*size);
  const Mark first = lines.mark({});
  long long count = 0;
  const long long n = *size;
  const long long expected = is_list ? integer_of(sizes[2]).value_or(-1) : (is_symmetric ? n * (n + 1) / 2 : n * n);
  int row = 0, column = 0;  // of an array, which goes down its columns
  while (count < expected && next()) {
    const auto parts = words_of(*line, " \t");
    for (std::size_t i = 0; i < parts.size(); i += is_list ? 3 : 1) {
      if (is_list) {
        if (parts.size() != 3) {
          faults.add(lines.mark({}), "an entry must be 'row column value'");
          return std::nullopt;
        }
        const auto r = index_of(parts[0], *size, lines, faults), c = index_of(parts[1], *size, lines, faults);
        if (!r || !c) return std::nullopt;
        row = *r, column = *c;
      }
      const auto value = value_of(parts[i + (is_list ? 2 : 0)], lines, faults);
      if (!value) return std::nullopt;
      entries.add(row, column, *value);
      ++count;
      if (!is_list && ++row == *size) ++column, row = is_symmetric ? column : 0;
      if (!is_list && count == expected) break;
    }
  }
  if (count != expected || next()) {
    faults.add(first, fmt::format("{} entries follow, {} are announced",
                                  count == expected ? "more" : std::to_string(count), expected));
    return std::nullopt;
  }
  auto A =
      entries.symmetric(is_symmetric ? Entries::Triangles::one : Entries::Triangles::both, first, row_number, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path, std::move(*A), {}};
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
    if (row.size() > static_cast<std::size_t>(kMostFullRows)) {
      faults.add(lines.mark({}), fmt::format("a table has at most {} columns; larger matrices are sparse, and fit into "
                                             "a Matrix Market file",
                                             kMostFullRows));
      return std::nullopt;
    }
    rows.push_back(std::move(row));
  }
  if (rows.empty() || rows.size() != rows[0].size()) {
    faults.add(Mark{std::make_shared<const std::string>(path), 0, 0},
               rows.empty() ? "the file has no numbers"
                            : fmt::format("the matrix must be square: it has {} and {}", counted(rows.size(), "row"),
                                          counted(rows[0].size(), "column")));
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

std::optional<std::vector<ElementDof>> read_calculix_dofs(const std::filesystem::path& path, FaultList& faults) {
  const Mark blame{std::make_shared<const std::string>(path.string()), 0, 0};
  const auto text = read_file(path, blame, faults, kLargestMatrixFile);
  if (!text) return std::nullopt;
  Lines lines(path.string(), *text);
  std::vector<ElementDof> dofs;
  while (const auto line = lines.next()) {
    const std::string_view word = trimmed(*line);
    if (word.empty()) continue;
    const std::size_t point = word.find('.');
    const auto node = integer_of(word.substr(0, point));
    const auto component = point == std::string_view::npos ? std::nullopt : integer_of(word.substr(point + 1));
    if (!node || !component || *component < 1 || *component > 6) {
      faults.add(lines.mark(word), fmt::format("must be NODE.COMPONENT, such as 12.3, not {}", in_quotes(word)));
      return std::nullopt;
    }
    dofs.push_back({*node, static_cast<int>(*component)});
  }
  return dofs;
}

std::optional<ElementMatrix> read_calculix(const std::filesystem::path& path, std::string_view text,
                                           FaultList& faults) {
  std::filesystem::path names = path;
  names.replace_extension(".dof");
  const auto dofs = read_calculix_dofs(names, faults);
  if (!dofs) return std::nullopt;
  Lines lines(path.string(), text);
  if (dofs->empty() || dofs->size() > static_cast<std::size_t>(kMostRows)) {
    faults.add(Mark{std::make_shared<const std::string>(names.string()), 0, 0},
               fmt::format("names {}, and must name from 1 to {}", counted(dofs->size(), "row"), kMostRows));
    return std::nullopt;
  }
  const int size = static_cast<int>(dofs->size());
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
      Entries::Triangles::one, Mark{std::make_shared<const std::string>(path.string()), 0, 0},
      [&](int row) { return (*dofs)[static_cast<std::size_t>(row)].text(); }, faults);
  if (!A) return std::nullopt;
  return ElementMatrix{path.string(), std::move(*A), *dofs};
}

}  // namespace

std::optional<ElementMatrix> read_element_matrix(const std::filesystem::path& path, const std::string& wanted,
                                                 char initial, FaultList& faults) {
  const Mark blame{std::make_shared<const std::string>(path.string()), 0, 0};
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::string_view kKnown[] = {".mtx", ".csv", ".mas", ".sti",  ".pch",
                                                ".bdf", ".dat", ".nas", ".dmig", ".op4"};
  if (std::find(std::begin(kKnown), std::end(kKnown), extension) == std::end(kKnown)) {
    faults.add(blame,
               fmt::format("the name of a matrix file ends in .mtx (Matrix Market), .csv (a table), .mas or .sti "
                           "(CalculiX), .pch, .bdf, .dat, .nas or .dmig (Nastran's DMIG) or .op4 (its OUTPUT4), "
                           "not in {}",
                           in_quotes(extension)));
    return std::nullopt;
  }
  const auto text = read_file(path, blame, faults, kLargestMatrixFile);
  if (!text) return std::nullopt;
  std::optional<ElementMatrix> matrix;
  if (extension == ".mtx") {
    matrix = read_matrix_market(path.string(), *text, faults);
  } else if (extension == ".csv") {
    matrix = read_table(path.string(), *text, faults);
  } else if (extension == ".mas" || extension == ".sti") {
    matrix = read_calculix(path, *text, faults);
  } else {
    matrix = extension == ".op4" ? read_output4(path.string(), *text, {wanted, initial}, faults)
                                 : read_dmig(path.string(), *text, {wanted, initial}, faults);
    return matrix;
  }
  if (matrix && !wanted.empty()) {
    faults.add(blame,
               fmt::format("matrices in {} files have no names; {} is not looked for", extension, in_quotes(wanted)));
    return std::nullopt;
  }
  return matrix;
}

bool align(ElementMatrix& mass, ElementMatrix& stiffness, FaultList& faults) {
  const auto blame = [](const ElementMatrix& m) { return Mark{std::make_shared<const std::string>(m.name), 0, 0}; };
  if (mass.dofs.empty() != stiffness.dofs.empty()) {
    const ElementMatrix& named = mass.dofs.empty() ? stiffness : mass;
    const ElementMatrix& other = mass.dofs.empty() ? mass : stiffness;
    faults.add(blame(other), fmt::format("the rows have no names, those of {} have; take both from files of one kind",
                                         in_quotes(named.name)));
    return false;
  }
  if (mass.dofs.empty()) {
    if (mass.size() == stiffness.size()) return true;
    faults.add(blame(mass), fmt::format("has {}, and {} has {}: they are not of the same model",
                                        counted(static_cast<std::size_t>(mass.size()), "row"),
                                        in_quotes(stiffness.name), stiffness.size()));
    return false;
  }
  std::map<ElementDof, int> row_of;
  for (const ElementMatrix* m : {&mass, &stiffness}) {
    for (const ElementDof& dof : m->dofs) row_of.emplace(dof, 0);
  }
  std::vector<ElementDof> dofs;
  for (auto& [dof, row] : row_of) row = static_cast<int>(dofs.size()), dofs.push_back(dof);
  for (ElementMatrix* m : {&mass, &stiffness}) {
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(static_cast<std::size_t>(m->A.nonZeros()));
    for (int column = 0; column < m->size(); ++column) {
      for (Eigen::SparseMatrix<double>::InnerIterator it(m->A, column); it; ++it)
        entries.emplace_back(row_of[m->dofs[static_cast<std::size_t>(it.row())]],
                             row_of[m->dofs[static_cast<std::size_t>(column)]], it.value());
    }
    m->A.resize(static_cast<int>(dofs.size()), static_cast<int>(dofs.size()));
    m->A.setFromTriplets(entries.begin(), entries.end());
    m->dofs = dofs;
  }
  return true;
}

std::vector<NodePlace> read_node_places(const std::filesystem::path& path, FaultList& faults) {
  const Mark blame{std::make_shared<const std::string>(path.string()), 0, 0};
  const auto text = read_file(path, blame, faults, kLargestMatrixFile);
  std::vector<NodePlace> places;
  if (!text) return places;
  Lines lines(path.string(), *text);
  std::map<long long, int> line_of;
  while (const auto line = lines.next()) {
    const std::string_view content = trimmed(line->substr(0, line->find('#')));
    if (content.empty()) continue;
    const auto words = words_of(content, ",; \t");
    const auto node = words.size() == 4 ? integer_of(words[0]) : std::nullopt;
    std::vector<double> p;
    for (std::size_t k = 1; node && k < 4; ++k) {
      if (const auto value = number_of(words[k])) p.push_back(*value);
    }
    if (p.size() != 3) {
      faults.add(lines.mark(content), fmt::format("must be NODE, X, Y, Z, not {}", in_quotes(content)));
      return {};
    }
    const auto [known, is_new] = line_of.emplace(*node, lines.mark({}).line);
    if (!is_new) faults.add(lines.mark(content), fmt::format("node {} is in line {} already", *node, known->second));
    places.push_back({*node, p[0], p[1], p[2], lines.mark(content)});
  }
  if (places.empty()) faults.add(blame, "names no nodes; its lines must be NODE, X, Y, Z");
  return places;
}

}  // namespace grapnel
