#pragma once

/// @file
/// Representations of values in files: numbers, names and vectors directly, other values in special forms, such as a
/// rotation as a quaternion, an inertia as a list or a mapping, joint values by name. A form is one object with its
/// JSON Schema, reader, setter of numbers in a problem, and writer. Fields name their form (Field::as()). To add a
/// form, add an entry to the table in forms.cpp, or in joint_values.cpp for joint values.

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// A value to read. Absent values and values of the wrong kind have been reported before.
struct ValueToRead {
  const Node& node;
  const Field& field;
  const Type& type;         // of what is at `place`
  const std::string& path;  // of the mapping that holds the key
  void* owner;              // the structure that this mapping is read into
  void* place;              // destination of the value; null for a key without a single member
  const ReadScope& scope;

  std::string name() const { return below(path, field.key); }
  /// The destination; for an optional its new value.
  template <class T>
  T& into() const {
    if (type.kind != Type::Kind::optional) return *static_cast<T*>(place);
    type.resize(place, 1);
    return *static_cast<T*>(type.item(place, 0));
  }
};

/// A value whose numbers are set in copies of the problem that was read.
struct NumberPlace {
  const Field& field;
  const Node& form;                // node in the file
  const CaptureProblem& problem;   // as it was read
  std::span<const PathStep> rest;  // remaining path below the field
  const void* value;               // its address in that problem

  // Whether the path refers to a single number, or to a whole list of this length.
  bool is_number() const { return rest.empty() && form.is_scalar(); }
  bool is_list(std::size_t count) const { return rest.empty() && form.is_sequence() && form.items.size() == count; }
};

/// Sets numbers, in their order in the file, at a place in a problem. False if the reader might reject them.
using NumberWriter = std::function<bool(CaptureProblem&, void* place, std::span<const double>)>;

/// The schema of a structure, by reference.
using TypeReference = std::function<nlohmann::ordered_json(const Type&)>;

/// Representation of values of one kind in files. Null members use the default of the type, or are not supported.
struct Form {
  std::string_view name;  ///< as in fields; with a trailing blank: a prefix
  nlohmann::ordered_json (*schema)(const Field&, const TypeReference&) = nullptr;
  void (*read)(const ValueToRead&) = nullptr;
  /// Null also for a place whose numbers have an effect that only the reader can determine.
  NumberWriter (*numbers)(const NumberPlace&) = nullptr;
  Node (*write)(const Type& type, const void* value) = nullptr;
};

/// The form of a field's value: the named form, else that of its type; null for lists and structures.
const Form* form_of(const Field& field);
const Form* form_of(const Type& type);

/// Forms of directions, orientations, inertias and shapes (body_forms.cpp), and of joint values (joint_values.cpp).
std::span<const Form> body_forms();
std::span<const Form> joint_value_forms();

/// Whether a file may have these numbers at a field, by its range and its unit.
bool allows(const Field& field, std::span<const double> numbers);

// ---- Building blocks of forms ----

/// For a single number.
NumberWriter number_writer(const NumberPlace& at);
/// For a single number, by a function of its member; false: the reader may reject it.
template <class T, class Set>
NumberWriter writer_of_one(const NumberPlace& at, Set set) {
  if (!at.is_number()) return nullptr;
  return [field = at.field, set](CaptureProblem&, void* place, std::span<const double> numbers) {
    return numbers.size() == 1 && allows(field, numbers) && set(*static_cast<T*>(place), numbers[0]);
  };
}
/// For three numbers, or one of them; the check covers all three.
NumberWriter components_writer(const NumberPlace& at, bool (*check)(const Vector3d&));

/// The numbers of a list of `count` (0: any number of) finite numbers, else empty.
std::optional<std::vector<double>> finite_list(const Node& node, std::size_t count = 0);

// Without the sign of zero.
Node plain_number_node(double value);
Node numbers_node(std::span<const double> values);
Node vector_node(const Type& type, const void* value);

/// Rotation of a quaternion (w, x, y, z), normalised; empty unless its length is 1 within 1e-6. Not inline, so that all
/// callers get the same bits.
std::optional<Rotationd> rotation_from_wxyz(std::span<const double, 4> q);

// Schemas of plain values; inputs have whole numbers without a point.
nlohmann::ordered_json number_json(double x);
nlohmann::ordered_json number_schema(const Range& range, const char* type = "number");
nlohmann::ordered_json numbers_schema(std::size_t count, const Range& range);
nlohmann::ordered_json titled(nlohmann::ordered_json schema, std::string_view title);
const nlohmann::ordered_json& name_schema();

}  // namespace grapnel
