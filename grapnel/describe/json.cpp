#include "grapnel/describe/json.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

Json list_of(const Type& type, const void* value) {
  Json list = Json::array();
  const std::size_t size = type.size(value);
  const auto add = [&](const void* item) { list.push_back(json_of(type.of(), item)); };
  for (std::size_t i = 0; i < size; ++i) type.show_item(value, i, visitor_of(add));
  return list;
}

void add_keyed(const Field& field, const void* items, Json& object) {
  const Type& list = field.type();
  const auto add = [&](const void* item) { object[std::string(field.key_of_item(item))] = json_of(list.of(), item); };
  for (std::size_t i = 0; i < list.size(items); ++i) list.show_item(items, i, visitor_of(add));
}

Json object_of(const Type& type, const void* owner) {
  Json object = Json::object();
  for (const Field& field : type.fields) {
    if (field.is_present && !field.is_present(owner)) continue;
    const auto add = [&](const void* value) {
      const Type& of = field.type();
      const bool is_empty = of.kind == Type::Kind::optional && of.size(value) == 0;
      if (field.key_of_item) {
        add_keyed(field, value, object);
      } else if (!is_empty || field.is_null_absent) {
        object[std::string(field.key)] = json_of(of, value);
      }
    };
    field.show(owner, visitor_of(add));
  }
  return object;
}

}  // namespace

Json json_of(const Type& type, const void* value) {
  switch (type.kind) {
    case Type::Kind::boolean:
      return type.whole(value) != 0;
    case Type::Kind::whole:
      return type.whole(value);
    case Type::Kind::real:
      return *static_cast<const double*>(value);
    case Type::Kind::text:
      return *static_cast<const std::string*>(value);
    case Type::Kind::choice:
      return std::string(name_of_choice(type, type.whole(value)));
    case Type::Kind::list:
      return list_of(type, value);
    case Type::Kind::optional: {
      Json json;
      const auto take = [&](const void* item) { json = json_of(type.of(), item); };
      if (type.size(value) == 1) type.show_item(value, 0, visitor_of(take));
      return json;
    }
    case Type::Kind::alternatives: {
      Json json;
      const auto take = [&](const void* held) { json = json_of(type.alternatives[type.size(value)](), held); };
      type.show_item(value, 0, visitor_of(take));
      return json;
    }
    case Type::Kind::structure:
      break;
  }
  return object_of(type, value);
}

}  // namespace grapnel
