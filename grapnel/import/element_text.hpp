#pragma once

/// @file
/// Common parts of the readers of matrix files: lines with their numbers, Fortran's number formats, the entries of a
/// matrix. Internal to this module.

#include <Eigen/SparseCore>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/import/element_matrix.hpp"

namespace grapnel::element_text {

inline constexpr std::size_t kLargestMatrixFile = std::size_t{1} << 30;  // [bytes]
inline constexpr long long kMaxRows = 2'000'000;

/// A finite number in C or Fortran notation: 1.5e3, 1.5D+03, 1.5+3.
std::optional<double> number_of(std::string_view text);
std::optional<long long> integer_of(std::string_view text);
std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words_of(std::string_view line, std::string_view separators);
std::string upper(std::string_view text);
Mark file_mark(const std::string& path);
/// "3" for row 2: rows are counted from 1 in files.
std::string row_number(int row);

/// A text line by line.
class Lines {
 public:
  Lines(const std::string& path, std::string_view text);

  /// The next line without its end; empty after the last.
  std::optional<std::string_view> next();
  /// The position of a part of the current line; for other text, the line's beginning.
  Mark mark(std::string_view part) const;

 private:
  std::shared_ptr<const std::string> source_;
  std::string_view rest_, line_;
  int number_ = 0;
};

/// A row or column in a line, counted from 1 in the file and from 0 in the result. Empty after an error.
std::optional<int> index_of(std::string_view word, long long size, const Lines& lines, FaultList& faults);
/// A finite number in a line. Empty after an error.
std::optional<double> value_of(std::string_view word, const Lines& lines, FaultList& faults);

/// The entries of a square matrix; entries with equal indices are added.
class Entries {
 public:
  /// Maximum difference of a pair of entries, relative to the larger diagonal element: files have limited digits.
  static constexpr double kAsymmetry = 1e-6;
  /// And relative to the largest entry of the matrix: rounding errors of the program that computed it, for example in a
  /// condensation. Pairs below it count as zero.
  static constexpr double kRounding = 1e-12, kSingleRounding = 1e-6;
  /// Whether an entry or its mirror image may be omitted.
  enum class Triangles { one, both };

  explicit Entries(int size, double rounding = kRounding);
  void add(int row, int column, double value);
  /// The matrix; call once. Adds an error and returns nothing if it is not symmetric.
  std::optional<Eigen::SparseMatrix<double>> symmetric(Triangles triangles, const Mark& mark,
                                                       const std::function<std::string(int)>& row_name,
                                                       FaultList& faults);

 private:
  using Triplet = Eigen::Triplet<double>;
  int size_;
  double rounding_;
  std::vector<Triplet> triplets_;
};

/// Selects one matrix of a file: by name, or, if that is empty, the only one, or the one with this initial.
struct Wanted {
  std::string name;
  char initial = 'M';
};

/// A matrix of a file with several matrices. Usable: real and square.
struct NamedMatrix {
  std::string name;
  bool is_usable = true;
};
/// The name of the selected matrix; of several with its initial the only usable one. Empty after an error. `kind` is
/// the format's name.
std::string chosen(const std::vector<NamedMatrix>& matrices, const Wanted& wanted, const std::string& path,
                   const char* kind, FaultList& faults);

/// Names of rows, one per line: NODE.COMPONENT, NODE COMPONENT or ROW NODE COMPONENT; components 0 to 6, or UX ...
/// ROTZ.
std::optional<std::vector<ElementDof>> read_dof_names(const std::filesystem::path& path, FaultList& faults);

std::optional<ElementMatrix> read_matrix_market(const std::string& path, std::string_view text, FaultList& faults);
bool is_matrix_market(std::string_view text);
/// Abaqus's *MATRIX OUTPUT: COORDINATE, without row names, and LABELS or MATRIX INPUT, with row names.
std::optional<ElementMatrix> read_abaqus(const std::string& path, std::string_view text, FaultList& faults);
std::optional<ElementMatrix> read_table(const std::string& path, std::string_view text, FaultList& faults);
/// CalculiX's .mas and .sti files, with row names from `dofs`.
std::optional<ElementMatrix> read_calculix(const std::string& path, std::string_view text, std::vector<ElementDof> dofs,
                                           FaultList& faults);
std::optional<ElementMatrix> read_dmig(const std::string& path, std::string_view text, const Wanted& wanted,
                                       FaultList& faults);
/// Text or binary.
std::optional<ElementMatrix> read_output4(const std::string& path, std::string_view bytes, const Wanted& wanted,
                                          FaultList& faults);

}  // namespace grapnel::element_text
