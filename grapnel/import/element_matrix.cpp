#include "grapnel/import/element_matrix.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <string_view>

#include "grapnel/import/element_text.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/text_file.hpp"

namespace grapnel {

std::string ElementDof::text() const {
  return component == 0 ? fmt::format("scalar point {}", node) : fmt::format("node {}, component {}", node, component);
}

namespace element_text {

std::optional<double> number_of(std::string_view text) {
  // Fortran notations of 1.5e3: 1.5D+03, and Nastran's 1.5+3.
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

std::string upper(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return result;
}

Mark file_mark(const std::string& path) { return {std::make_shared<const std::string>(path), 0, 0}; }

std::string row_number(int row) { return std::to_string(row + 1); }

std::optional<int> index_of(std::string_view word, long long size, const Lines& lines, FaultList& faults) {
  const auto index = integer_of(word);
  if (!index || *index < 1 || *index > size) {
    faults.add(lines.mark(word), fmt::format("a row or column must be from 1 to {}, not {}", size, in_quotes(word)));
    return std::nullopt;
  }
  return static_cast<int>(*index) - 1;
}

std::optional<double> value_of(std::string_view word, const Lines& lines, FaultList& faults) {
  const auto value = number_of(word);
  if (!value) faults.add(lines.mark(word), fmt::format("{} is not a finite number", in_quotes(word)));
  return value;
}

Entries::Entries(int size, double rounding) : size_(size), rounding_(rounding) {}

void Entries::add(int row, int column, double value) {
  if (value != 0) triplets_.emplace_back(row, column, value);
}

std::optional<Eigen::SparseMatrix<double>> Entries::symmetric(Triangles triangles, const Mark& mark,
                                                              const std::function<std::string(int)>& row_name,
                                                              FaultList& faults) {
  Eigen::SparseMatrix<double> A(size_, size_);
  A.setFromTriplets(triplets_.begin(), triplets_.end());
  if (triangles == Triangles::one) {
    // If only one entry of a pair is present, it is both: rows are in any order, so there need not be a triangle.
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
  const double noise = A.nonZeros() > 0 ? rounding_ * A.coeffs().abs().maxCoeff() : 0;
  double worst = 0;
  int worst_row = 0, worst_column = 0;
  const Eigen::SparseMatrix<double> difference = A - T;
  for (int column = 0; column < size_; ++column) {
    for (Eigen::SparseMatrix<double>::InnerIterator it(difference, column); it; ++it) {
      if (std::abs(it.value()) <= noise) continue;
      const double scale =
          std::max({std::abs(diagonal[it.row()]), std::abs(diagonal[column]), std::abs(A.coeff(it.row(), column))});
      if (std::abs(it.value()) > worst * scale)
        worst = std::abs(it.value()) / scale, worst_row = static_cast<int>(it.row()), worst_column = column;
    }
  }
  if (worst > kAsymmetry) {
    faults.add(mark, fmt::format(
                         "the matrix is not symmetric: {:.9g} in row {} and column {}, {:.9g} in the mirrored position",
                         A.coeff(worst_row, worst_column), row_name(worst_row), row_name(worst_column),
                         A.coeff(worst_column, worst_row)));
    return std::nullopt;
  }
  return Eigen::SparseMatrix<double>(0.5 * (A + T));
}

}  // namespace element_text

using namespace element_text;

namespace {

// The names of the rows of a matrix in a format without names: from `names`, or from the file beside the matrix if it
// exists. False after an error.
bool name_rows(ElementMatrix& matrix, const std::filesystem::path& path, std::filesystem::path names,
               FaultList& faults) {
  if (!matrix.dofs.empty()) {
    if (names.empty()) return true;
    faults.add(file_mark(path.string()),
               fmt::format("the file contains the names of its rows: the names of {} do not apply",
                           in_quotes(names.string())));
    return false;
  }
  if (names.empty()) {
    names = std::filesystem::path(path).replace_extension(".dof");
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(names, ignored)) return true;
  }
  auto dofs = read_dof_names(names, faults);
  if (!dofs) return false;
  if (dofs->size() == static_cast<std::size_t>(matrix.size())) {
    matrix.dofs = std::move(*dofs);
    return true;
  }
  faults.add(file_mark(names.string()), fmt::format("names {}, and {} has {}", counted(dofs->size(), "row"),
                                                    in_quotes(path.string()), matrix.size()));
  return false;
}

std::optional<ElementMatrix> read_calculix_files(const std::filesystem::path& path, std::string_view text,
                                                 std::filesystem::path names, FaultList& faults) {
  if (names.empty()) names = std::filesystem::path(path).replace_extension(".dof");
  auto dofs = read_dof_names(names, faults);
  if (!dofs) return std::nullopt;
  return read_calculix(path.string(), text, std::move(*dofs), faults);
}

}  // namespace

std::optional<ElementMatrix> read_element_matrix(const std::filesystem::path& path, const std::string& wanted,
                                                 char initial, FaultList& faults, const std::filesystem::path& names) {
  const Mark blame = file_mark(path.string());
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  static constexpr std::string_view kKnown[] = {".mtx", ".csv", ".mas", ".sti",  ".pch",
                                                ".bdf", ".dat", ".nas", ".dmig", ".op4"};
  if (std::find(std::begin(kKnown), std::end(kKnown), extension) == std::end(kKnown)) {
    faults.add(blame,
               fmt::format("the name of a matrix file ends in .mtx (Matrix Market, Abaqus), .csv (a table), .mas or "
                           ".sti (CalculiX), .pch, .bdf, .dat, .nas or .dmig (Nastran's DMIG) or .op4 (its OUTPUT4), "
                           "not in {}",
                           in_quotes(extension)));
    return std::nullopt;
  }
  const auto text = read_file(path, blame, faults, kLargestMatrixFile);
  if (!text) return std::nullopt;
  std::optional<ElementMatrix> matrix;
  bool has_matrix_names = false;
  if (extension == ".mtx") {
    matrix = is_matrix_market(*text) ? read_matrix_market(path.string(), *text, faults)
                                     : read_abaqus(path.string(), *text, faults);
  } else if (extension == ".csv") {
    matrix = read_table(path.string(), *text, faults);
  } else if (extension == ".mas" || extension == ".sti") {
    matrix = read_calculix_files(path, *text, names, faults);
  } else {
    has_matrix_names = true;
    matrix = extension == ".op4" ? read_output4(path.string(), *text, {wanted, initial}, faults)
                                 : read_dmig(path.string(), *text, {wanted, initial}, faults);
  }
  if (!matrix) return std::nullopt;
  if (!has_matrix_names && !wanted.empty()) {
    faults.add(blame,
               fmt::format("matrices in {} files have no names; {} cannot be selected", extension, in_quotes(wanted)));
    return std::nullopt;
  }
  const bool is_calculix = extension == ".mas" || extension == ".sti";
  if (!is_calculix && !name_rows(*matrix, path, names, faults)) return std::nullopt;
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
  bool has_repeated = false;
  for (const ElementMatrix* m : {&mass, &stiffness}) {
    std::set<ElementDof> own;
    for (const ElementDof& dof : m->dofs) row_of.emplace(dof, 0), has_repeated |= !own.insert(dof).second;
  }
  if (has_repeated) {
    if (mass.dofs == stiffness.dofs) return true;
    faults.add(blame(mass), fmt::format("names of rows repeat, as for expanded shells and beams, but {} has "
                                        "other names or another order: both matrices must come from one run",
                                        in_quotes(stiffness.name)));
    return false;
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
    if (!is_new) faults.add(lines.mark(content), fmt::format("node {} is already in line {}", *node, known->second));
    places.push_back({*node, p[0], p[1], p[2], lines.mark(content)});
  }
  if (places.empty()) faults.add(blame, "names no nodes; its lines must be NODE, X, Y, Z");
  return places;
}

}  // namespace grapnel
