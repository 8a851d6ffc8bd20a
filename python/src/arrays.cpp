#include "arrays.hpp"

#include <cmath>

namespace grapnel::python {

std::string shape_text(const std::vector<py::ssize_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i) text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

std::vector<py::ssize_t> shape_of(const py::array& array) { return {array.shape(), array.shape() + array.ndim()}; }

py::array_t<double, py::array::c_style | py::array::forcecast> doubles(const py::handle& value,
                                                                       const std::string& name) {
  const py::array any = py::array::ensure(value);
  if (!any) {
    PyErr_Clear();
    throw py::value_error(name + " is not an array of numbers, or its rows differ in length");
  }
  const char kind = any.dtype().kind();
  const bool is_empty = any.size() == 0;
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b' && !is_empty)
    throw py::type_error(name + " has elements of type " + std::string(py::str(any.dtype())) +
                         "; expected real numbers");
  auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(any);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(name + " is not an array of real numbers");
  }
  return array;
}

void check_finite(const py::array_t<double>& array, const std::string& name) {
  const double* data = array.data();
  for (py::ssize_t i = 0; i < array.size(); ++i) {
    if (std::isfinite(data[i])) continue;
    std::string place;
    py::ssize_t rest = i;
    for (py::ssize_t d = array.ndim(); d-- > 0; rest /= array.shape(d))
      place = std::to_string(rest % array.shape(d)) + (place.empty() ? "" : ", " + place);
    throw py::value_error(name + "[" + place + "] is " + std::string(py::str(py::float_(data[i]))) +
                          "; expected finite numbers");
  }
}

Rows::Rows(const py::handle& value, const std::string& name, py::ssize_t width, const std::string& what)
    : array_(doubles(value, name)), name_(name), width_(width) {
  const bool fits = (array_.ndim() == 1 || array_.ndim() == 2) && array_.shape(array_.ndim() - 1) == width;
  if (!fits)
    throw py::value_error(name + " has shape " + shape_text(shape_of(array_)) + ", expected " + shape_text({width}) +
                          ", or (n, " + std::to_string(width) + ") for n cases: " + what);
  check_finite(array_, name);
  is_batch_ = array_.ndim() == 2;
  count_ = is_batch_ ? array_.shape(0) : 1;
  data_ = array_.data();
}

Rows::Rows(const std::string& name, py::ssize_t width)
    : zeros_(static_cast<std::size_t>(width)), name_(name), data_(zeros_.data()), width_(width) {}

std::string Rows::shape() const {
  return shape_text(is_batch_ ? std::vector<py::ssize_t>{count_, width_} : std::vector<py::ssize_t>{width_});
}

Cases cases_of(const std::vector<const Rows*>& arguments) {
  Cases cases;
  const Rows* first = nullptr;
  for (const Rows* rows : arguments) {
    if (!rows->is_batch()) continue;
    if (first && rows->count() != first->count())
      throw py::value_error(first->name() + " has shape " + first->shape() + " and " + rows->name() + " has shape " +
                            rows->shape() + "; expected batches of equal size, or single states");
    if (!first) first = rows, cases = {true, rows->count()};
  }
  return cases;
}

py::array_t<double> results(const Cases& cases, std::vector<py::ssize_t> shape) {
  if (cases.is_batch) shape.insert(shape.begin(), cases.count);
  return py::array_t<double>(std::move(shape));
}

Vector3d vector_of(const py::handle& value, const std::string& name) {
  const Rows rows(value, name, 3, "a vector");
  if (rows.is_batch()) throw py::value_error(name + " has shape " + rows.shape() + ", expected (3,)");
  return {rows.row(0)[0], rows.row(0)[1], rows.row(0)[2]};
}

}  // namespace grapnel::python
