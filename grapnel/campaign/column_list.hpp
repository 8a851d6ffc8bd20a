#pragma once

/// @file
/// A growing list of columns of one problem.

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "grapnel/campaign/column.hpp"

namespace grapnel {

/// The described structure of type T in a result; null if it is absent.
template <class T>
using FindIn = std::function<const T*(const CaptureResult&)>;

/// The item of a list with the name; null if there is none.
template <class T>
const T* find_item(const std::vector<T>& all, const std::string& name, std::string T::*key) {
  const auto at = std::ranges::find(all, name, key);
  return at == all.end() ? nullptr : &*at;
}

/// Columns in the order in which they are added.
class ColumnList {
 public:
  using Getter = std::function<double(const StudyCase&, const CaptureResult&)>;

  void add(std::string name, std::string unit, std::string description, Getter value) {
    columns_.push_back({std::move(name), std::move(unit), std::move(description), std::move(value)});
  }

  /// Adds a described field of a structure, a number, a boolean, or the components of a vector, with the unit and text
  /// of its description.
  template <class T>
  void field(const std::string& name, std::string_view key, const FindIn<T>& find) {
    constexpr const char* kComponents[3] = {"x", "y", "z"};
    const Field& described = *field_named(type_of<T>(), key);
    const bool is_vector = described.type().kind == Type::Kind::list;
    for (std::size_t k = 0; k < (is_vector ? 3 : 1); ++k) {
      add(is_vector ? name + "/" + kComponents[k] : name, std::string(described.unit.empty() ? "1" : described.unit),
          std::string(described.text), [find, &described, k](const StudyCase&, const CaptureResult& r) {
            const T* owner = find(r);
            return owner ? number_in(described, owner, k) : NAN;
          });
    }
  }

  /// Adds the columns of another list that are stored by default.
  void add_defaults(std::vector<Column> columns) {
    for (Column& column : columns) {
      if (column.by_default) columns_.push_back(std::move(column));
    }
  }

  std::vector<Column> take() { return std::move(columns_); }

 private:
  std::vector<Column> columns_;
};

/// The columns of the grasps of a problem: how they closed, what they hold and their impulses.
void add_grasp_columns(const CaptureProblem& problem, ColumnList& list);

/// The speeds that the ratings permit at each grasp.
void add_speed_limits(const CaptureProblem& problem, ColumnList& list);

/// The columns of the motion after the capture, or of a motion without one.
void add_motion_columns(const CaptureProblem& problem, ColumnList& list);

}  // namespace grapnel
