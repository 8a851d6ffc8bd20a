#pragma once

/// @file
/// Conversion and validation of Python arrays, for one state or a batch, with error messages that name shapes.

#include <pybind11/numpy.h>

#include <string>
#include <vector>

#include "binding.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel::python {

/// One argument: `width` numbers, or a batch of such rows.
class Rows {
 public:
  /// @throws py::value_error naming the expected and the actual shape, or a number that is not finite; py::type_error
  /// if the elements are not numbers. `what`: "position and quaternion of the base, then the joints".
  Rows(const py::handle& value, const std::string& name, py::ssize_t width, const std::string& what);
  /// An omitted argument: zeros.
  Rows(const std::string& name, py::ssize_t width);

  bool is_batch() const { return is_batch_; }
  py::ssize_t count() const { return count_; }
  py::ssize_t width() const { return width_; }
  const std::string& name() const { return name_; }
  /// Row i; for a single state the same for every i.
  const double* row(std::int64_t i) const { return data_ + (is_batch_ ? i * width_ : 0); }
  std::string shape() const;

 private:
  py::array_t<double, py::array::c_style | py::array::forcecast> array_;
  std::vector<double> zeros_;
  std::string name_;
  const double* data_ = nullptr;
  py::ssize_t width_ = 0, count_ = 1;
  bool is_batch_ = false;
};

/// "(3, 13)".
std::string shape_text(const std::vector<py::ssize_t>& shape);
std::vector<py::ssize_t> shape_of(const py::array& array);

/// The number of cases of several arguments; single states match any batch. @throws py::value_error if batches differ.
struct Cases {
  bool is_batch = false;
  py::ssize_t count = 1;
};
Cases cases_of(const std::vector<const Rows*>& arguments);

/// An array of results: `shape` per case; for a batch, the first axis is that of the cases.
py::array_t<double> results(const Cases& cases, std::vector<py::ssize_t> shape);

/// Three numbers. @throws py::value_error, py::type_error
Vector3d vector_of(const py::handle& value, const std::string& name);

/// A NumPy array of any numbers as doubles. @throws py::type_error naming the argument
py::array_t<double, py::array::c_style | py::array::forcecast> doubles(const py::handle& value,
                                                                       const std::string& name);

/// @throws py::value_error naming the first number that is not finite.
void check_finite(const py::array_t<double>& array, const std::string& name);

}  // namespace grapnel::python
