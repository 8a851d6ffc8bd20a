#pragma once

/// @file
/// How values stand in files: numbers, names and vectors as they are, others in forms of their own, such as a rotation
/// as a quaternion, an inertia as a list or a mapping, joint values by name. A form is one object with all that anyone
/// needs of it: its JSON Schema, its reading, the setting of its numbers in a problem, its writing. Fields name theirs
/// (Field::as()); a new one is an entry in the table of forms.cpp, or of joint_values.cpp for values of joints.

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

/// A value to be read. What is absent or of the wrong kind has been reported before.
struct ValueToRead {
  const Node& node;
  const Field& field;
  const Type& type;         // of what is at `place`
  const std::string& path;  // of the mapping that holds the key
  void* owner;              // the structure that this mapping is read into
  void* place;              // where the value goes; null for a key that is no one member
  const ReadScope& scope;

  std::string name() const { return below(path, field.key); }
  /// What is read into; of an optional what it holds from now on.
  template <class T>
  T& into() const {
    if (type.kind != Type::Kind::optional) return *static_cast<T*>(place);
    type.resize(place, 1);
    return *static_cast<T*>(type.item(place, 0));
  }
};

/// A value of which numbers are to be set in problems that are like the one that was read.
struct NumberPlace {
  const Field& field;
  const Node& form;                // what stands there
  const CaptureProblem& problem;   // as it was read
  std::span<const PathStep> rest;  // what of the path is left below the field
  const void* value;               // where it stands in that problem

  // Whether there is a number alone, or a list of so many, and all of it is meant.
  bool is_number() const { return rest.empty() && form.is_scalar(); }
  bool is_list(std::size_t count) const { return rest.empty() && form.is_sequence() && form.items.size() == count; }
};

/// Puts numbers, in their order in the file, at a place in a problem. False if the reader might refuse them.
using NumberWriter = std::function<bool(CaptureProblem&, void* place, std::span<const double>)>;

/// The schema of a structure, by reference.
using TypeReference = std::function<nlohmann::ordered_json(const Type&)>;

/// How values of a kind stand in files. What is null follows from the type, or nobody does it.
struct Form {
  std::string_view name;  ///< as fields give it; with a blank at the end: all that begin so
  nlohmann::ordered_json (*schema)(const Field&, const TypeReference&) = nullptr;
  void (*read)(const ValueToRead&) = nullptr;
  /// Null also for a place of which only reading can say what its numbers do.
  NumberWriter (*numbers)(const NumberPlace&) = nullptr;
  Node (*write)(const Type& type, const void* value) = nullptr;
};

/// The form of a field's value: the one that it names, else that of its type; null for lists and structures.
const Form* form_of(const Field& field);
const Form* form_of(const Type& type);

/// Forms of directions, orientations, inertias and shapes (body_forms.cpp), and of values that belong to joints
/// (joint_values.cpp).
std::span<const Form> body_forms();
std::span<const Form> joint_value_forms();

/// Whether a file may have these numbers at a field, by its range and its unit.
bool allows(const Field& field, std::span<const double> numbers);

// ---- What forms are made of ----

/// Of a number alone.
NumberWriter number_writer(const NumberPlace& at);
/// Of a number alone, by a function of its member; false: the reader may refuse it.
template <class T, class Set>
NumberWriter writer_of_one(const NumberPlace& at, Set set) {
  if (!at.is_number()) return nullptr;
  return [field = at.field, set](CaptureProblem&, void* place, std::span<const double> numbers) {
    return numbers.size() == 1 && allows(field, numbers) && set(*static_cast<T*>(place), numbers[0]);
  };
}
/// Of three numbers, or one of them, which the check then looks at together.
NumberWriter components_writer(const NumberPlace& at, bool (*check)(const Vector3d&));

/// The numbers of a list, if it is one, of so many if a count is given, and all are finite.
std::optional<std::vector<double>> finite_list(const Node& node, std::size_t count = 0);

// Without the sign of zero, which nobody means.
Node plain_number_node(double value);
Node numbers_node(std::span<const double> values);
Node vector_node(const Type& type, const void* value);

/// Rotation of a quaternion (w, x, y, z), normalised; empty unless its length is 1 within 1e-6. Not inline: whoever has
/// the same four numbers gets the same bits.
std::optional<Rotationd> rotation_from_wxyz(std::span<const double, 4> q);

// Schemas of plain values; inputs have whole numbers without a point.
nlohmann::ordered_json number_json(double x);
nlohmann::ordered_json number_schema(const Range& range, const char* type = "number");
nlohmann::ordered_json numbers_schema(std::size_t count, const Range& range);
nlohmann::ordered_json titled(nlohmann::ordered_json schema, std::string_view title);
const nlohmann::ordered_json& name_schema();

}  // namespace grapnel
