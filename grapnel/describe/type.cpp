#include "grapnel/describe/type.hpp"

#include <stdexcept>

namespace grapnel {

std::string_view name_of_choice(const Type& type, std::int64_t value) {
  for (const Choice& choice : type.choices) {
    if (choice.value == value) return choice.name;
  }
  throw std::logic_error("no name for a value of " + std::string(type.name));
}

std::optional<std::int64_t> choice_named(const Type& type, std::string_view name) {
  for (const Choice& choice : type.choices) {
    if (choice.name == name) return choice.value;
  }
  return {};
}

const Field* field_named(const Type& type, std::string_view key) {
  for (const Field& field : type.fields) {
    if (field.key == key) return &field;
  }
  return nullptr;
}

namespace detail {

Type quaternion_type() {
  Type type;
  type.kind = Type::Kind::list, type.fixed_size = 4;
  type.of = &type_of<double>;
  type.size = [](const void*) { return std::size_t{4}; };
  type.show_item = [](const void* value, std::size_t i, ValueVisitor visitor) {
    const auto& q = *static_cast<const Quaterniond*>(value);
    const double parts[] = {q.w, q.x, q.y, q.z};
    visitor(&parts[i]);
  };
  type.item = [](void* value, std::size_t i) -> void* {
    auto& q = *static_cast<Quaterniond*>(value);
    double* const parts[] = {&q.w, &q.x, &q.y, &q.z};
    return parts[i];
  };
  return type;
}

}  // namespace detail
}  // namespace grapnel
