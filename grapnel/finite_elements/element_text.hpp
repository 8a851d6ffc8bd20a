#pragma once

/// @file
/// What the readers of matrix files share: lines with their numbers, Fortran's numbers, the entries of a matrix.
/// Internal to this module.

#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/finite_elements/element_matrix.hpp"

namespace grapnel::element_text {

inline constexpr std::size_t kLargestMatrixFile = std::size_t{1} << 30;  // [bytes]

/// A finite number as C or Fortran write it: 1.5e3, 1.5D+03, 1.5+3.
std::optional<double> number_of(std::string_view text);
std::optional<long long> integer_of(std::string_view text);
std::string_view trimmed(std::string_view text);
std::vector<std::string_view> words_of(std::string_view line, std::string_view separators);

/// A text line by line.
class Lines {
 public:
  Lines(const std::string& path, std::string_view text);

  /// The next line without its end; empty behind the last.
  std::optional<std::string_view> next();
  /// Where a part of the present line is; of anything else, its beginning.
  Mark mark(std::string_view part) const;

 private:
  std::shared_ptr<const std::string> source_;
  std::string_view rest_, line_;
  int number_ = 0;
};

/// The entries of a square matrix, of which those of one place are added.
class Entries {
 public:
  /// Files print some digits: this is how much, of the largest diagonal element concerned, a pair may differ.
  static constexpr double kAsymmetry = 1e-6;
  /// Whether of an entry and its mirror image one may be left out.
  enum class Triangles { one, both };

  explicit Entries(int size);
  void add(int row, int column, double value);
  /// The matrix, once; a fault, and nothing, if it is not symmetric.
  std::optional<Eigen::SparseMatrix<double>> symmetric(Triangles triangles, const Mark& mark,
                                                       const std::function<std::string(int)>& row_name,
                                                       FaultList& faults);

 private:
  using Triplet = Eigen::Triplet<double>;
  int size_;
  std::vector<Triplet> triplets_;
};

/// Which of the matrices of a file: by name, or, where that is empty, the only one, or the one with this initial.
struct Wanted {
  std::string name;
  char initial = 'M';
};

std::optional<ElementMatrix> read_dmig(const std::string& path, std::string_view text, const Wanted& wanted,
                                       FaultList& faults);
std::optional<ElementMatrix> read_output4(const std::string& path, std::string_view text, const Wanted& wanted,
                                          FaultList& faults);

}  // namespace grapnel::element_text
