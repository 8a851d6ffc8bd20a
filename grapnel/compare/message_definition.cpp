#include "grapnel/compare/message_definition.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <utility>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using FieldKind = MessageDefinition::Kind;
using Shape = MessageDefinition::Shape;

constexpr int kDeepestMessage = 32;
constexpr std::size_t kMostMessageTypes = 2000, kMostMessageFields = 20000;

struct PrimitiveName {
  std::string_view name;
  FieldKind kind;
};
constexpr std::array<PrimitiveName, 20> kPrimitives{
    {{"bool", FieldKind::boolean},      {"boolean", FieldKind::boolean},   {"int8", FieldKind::int8},
     {"uint8", FieldKind::uint8},       {"byte", FieldKind::byte},         {"char", FieldKind::uint8},
     {"octet", FieldKind::uint8},       {"int16", FieldKind::int16},       {"uint16", FieldKind::uint16},
     {"int32", FieldKind::int32},       {"uint32", FieldKind::uint32},     {"int64", FieldKind::int64},
     {"uint64", FieldKind::uint64},     {"float32", FieldKind::float32},   {"float64", FieldKind::float64},
     {"string", FieldKind::text},       {"wstring", FieldKind::wide_text}, {"time", FieldKind::time},
     {"duration", FieldKind::duration}, {"double", FieldKind::float64}}};

// Bytes of a number; 0 for texts, times and structures.
std::size_t size_of(FieldKind kind) {
  switch (kind) {
    case FieldKind::boolean:
    case FieldKind::int8:
    case FieldKind::uint8:
    case FieldKind::byte:
      return 1;
    case FieldKind::int16:
    case FieldKind::uint16:
      return 2;
    case FieldKind::int32:
    case FieldKind::uint32:
    case FieldKind::float32:
      return 4;
    case FieldKind::int64:
    case FieldKind::uint64:
    case FieldKind::float64:
      return 8;
    default:
      return 0;
  }
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kSpace = " \t\r";
  const std::size_t begin = text.find_first_not_of(kSpace);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kSpace) + 1 - begin);
}

std::string_view first_word(std::string_view& text) {
  text = trimmed(text);
  const std::size_t end = std::min(text.find_first_of(" \t"), text.size());
  const std::string_view word = text.substr(0, end);
  text = trimmed(text.substr(end));
  return word;
}

// ROS 2 writes "std_msgs/msg/Header" too.
std::string short_type_name(std::string_view name) {
  std::string text(name);
  if (const std::size_t at = text.find("/msg/"); at != std::string::npos) text.erase(at, 4);
  return text;
}

// Reads the bytes of one message.
class Wire {
 public:
  Wire(std::string_view bytes, bool is_cdr) : bytes_(bytes), is_cdr_(is_cdr) {
    if (!is_cdr) return;
    if (bytes.size() < 4) throw std::runtime_error("it has no CDR header");
    const auto kind = static_cast<unsigned char>(bytes[1]);
    if (bytes[0] != 0 || kind > 1)
      throw std::runtime_error(fmt::format("unknown kind of CDR {}, must be 0 or 1", static_cast<int>(kind)));
    is_big_ = kind == 0, at_ = begin_ = 4;
  }

  bool is_cdr() const { return is_cdr_; }
  std::size_t left() const { return bytes_.size() - at_; }
  void align(std::size_t size) {
    if (is_cdr_ && size > 1) skip((size - (at_ - begin_) % size) % size);
  }
  void skip(std::size_t size) {
    if (size > left()) throw std::runtime_error("it ends too early");
    at_ += size;
  }
  std::uint64_t raw(std::size_t size) {
    align(size);
    if (size > left()) throw std::runtime_error("it ends too early");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i) {
      const std::uint64_t byte = static_cast<unsigned char>(bytes_[at_ + i]);
      value |= byte << (8 * (is_big_ ? size - 1 - i : i));
    }
    at_ += size;
    return value;
  }
  // A text; its length in CDR includes a zero at the end.
  std::string_view text() {
    const auto length = static_cast<std::size_t>(raw(4));
    if (length > left()) throw std::runtime_error(fmt::format("a text of {} bytes exceeds it", length));
    std::string_view text = bytes_.substr(at_, length);
    at_ += length;
    if (is_cdr_ && text.ends_with('\0')) text.remove_suffix(1);
    return text;
  }

 private:
  std::string_view bytes_;
  bool is_cdr_, is_big_ = false;
  std::size_t at_ = 0, begin_ = 0;
};

template <class T>
T as_number(std::uint64_t raw) {
  using Raw = std::conditional_t<sizeof(T) == 8, std::uint64_t, std::uint32_t>;
  return std::bit_cast<T>(static_cast<Raw>(raw));
}

double number_of(FieldKind kind, std::uint64_t raw) {
  switch (kind) {
    case FieldKind::int8:
      return static_cast<std::int8_t>(raw);
    case FieldKind::int16:
      return static_cast<std::int16_t>(raw);
    case FieldKind::int32:
      return static_cast<std::int32_t>(raw);
    case FieldKind::int64:
      return static_cast<double>(static_cast<std::int64_t>(raw));
    case FieldKind::float32:
      return static_cast<double>(as_number<float>(raw));
    case FieldKind::float64:
      return as_number<double>(raw);
    default:
      return static_cast<double>(raw);
  }
}

class MessageDecoder {
 public:
  using Paths = std::vector<std::string_view>;

  MessageDecoder(const std::vector<MessageDefinition::Type>& types, Wire& wire, bool texts)
      : types_(types), wire_(wire), texts_(texts), budget_(100000 + 4 * wire.left()) {}

  // Of the paths, which begin with '.', the part of this structure.
  MessageValue structure(std::size_t type, const Paths& paths, int depth) {
    if (depth > kDeepestMessage) throw std::runtime_error("structures are nested too deeply");
    MessageValue value = MessageValue::object();
    const auto& fields = types_[type].fields;
    if (fields.empty() && wire_.is_cdr()) wire_.skip(1);
    for (const MessageDefinition::Field& field : fields) {
      spend();
      Paths inside;
      for (const std::string_view path : paths) {
        if (path.empty())
          inside.push_back(path);
        else if (const auto behind = path_behind(path.substr(path[0] == '.' ? 1 : 0), field.name))
          inside.push_back(*behind);
      }
      const bool is_text = texts_ && !paths.empty() && field.kind == FieldKind::text;
      if (inside.empty() && !is_text)
        pass(field, depth);
      else
        value[field.name] = read(field, inside, depth);
    }
    return value;
  }

 private:
  void spend() {
    if (budget_-- == 0) throw std::runtime_error("its definition contains too many fields");
  }

  // The number of elements, each of at least `least` bytes.
  std::size_t count_of(const MessageDefinition::Field& field) {
    if (field.shape == Shape::single) return 1;
    const std::size_t least = std::max<std::size_t>(size_of(field.kind), 1);
    const std::size_t count = field.shape == Shape::fixed ? field.count : static_cast<std::size_t>(wire_.raw(4));
    if (count > wire_.left() / least && !(field.kind == FieldKind::structure && count <= budget_))
      throw std::runtime_error(fmt::format("{} elements of {} exceed it", count, in_quotes(field.name)));
    return count;
  }

  void pass(const MessageDefinition::Field& field, int depth) {
    const std::size_t count = count_of(field), size = size_of(field.kind);
    if (count == 0) return;
    if (size > 0) {
      wire_.align(size), wire_.skip(count * size);
      return;
    }
    for (std::size_t i = 0; i < count; ++i) {
      spend();
      if (field.kind == FieldKind::structure)
        structure(field.type, {}, depth + 1);
      else
        single(field, {}, depth);
    }
  }

  MessageValue read(const MessageDefinition::Field& field, const Paths& paths, int depth) {
    if (field.shape == Shape::single) return single(field, paths, depth);
    const std::size_t count = count_of(field);
    Paths inside;
    for (const std::string_view path : paths) {
      const std::size_t end = path.starts_with('[') ? path.find(']') : std::string_view::npos;
      inside.push_back(end == std::string_view::npos ? path : path.substr(end + 1));
    }
    MessageValue values = MessageValue::array();
    for (std::size_t i = 0; i < count; ++i) {
      spend();
      values.push_back(single(field, inside, depth));
    }
    return values;
  }

  MessageValue single(const MessageDefinition::Field& field, const Paths& paths, int depth) {
    switch (field.kind) {
      case FieldKind::structure:
        return structure(field.type, paths, depth + 1);
      case FieldKind::text:
        return std::string(wire_.text());
      case FieldKind::wide_text:
        throw std::runtime_error(fmt::format("field {} is a wstring, which is not supported", in_quotes(field.name)));
      case FieldKind::time:
      case FieldKind::duration: {  // in ROS 1, times are unsigned
        const bool has_sign = wire_.is_cdr() || field.kind == FieldKind::duration;
        const double seconds = number_of(has_sign ? FieldKind::int32 : FieldKind::uint32, wire_.raw(4));
        const double part =
            number_of(field.kind == FieldKind::duration ? FieldKind::int32 : FieldKind::uint32, wire_.raw(4));
        return {{"sec", seconds}, {"nsec", part}};
      }
      case FieldKind::byte:
        return number_of(wire_.is_cdr() ? FieldKind::uint8 : FieldKind::int8, wire_.raw(1));
      default:
        return number_of(field.kind, wire_.raw(size_of(field.kind)));
    }
  }

  const std::vector<MessageDefinition::Type>& types_;
  Wire& wire_;
  bool texts_;
  std::size_t budget_;  // fields and elements, so that structures without bytes end too
};

// ---- Lists of paths ----

class PathList {
 public:
  explicit PathList(std::size_t most) : most_(most) {}

  // Adds a part of known or unknown width whose own parts are added in between.
  template <class Parts>
  std::optional<std::size_t> add(const std::string& path, Parts parts) {
    const std::size_t at = list_.size();
    const bool is_named = !path.empty() && at < most_;
    if (is_named) list_.push_back({path, {}});
    const std::optional<std::size_t> width = at < most_ ? parts() : std::nullopt;
    if (is_named) list_[at].width = width;
    return width;
  }
  void leave_out_last(const std::string& path) {
    if (!list_.empty() && list_.back().path == path) list_.pop_back();
  }
  std::vector<MessagePath> take() { return std::move(list_); }

 private:
  std::size_t most_;
  std::vector<MessagePath> list_;
};

std::string joined(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

bool is_time(const MessageValue& value) {
  return value.is_object() && value.size() == 2 && value.contains("sec") &&
         (value.contains("nsec") || value.contains("nanosec"));
}

std::optional<std::size_t> add_definition(const std::vector<MessageDefinition::Type>& types, std::size_t type,
                                          const std::string& path, int depth, PathList& list) {
  if (depth > kDeepestMessage) return std::nullopt;
  std::optional<std::size_t> all = 0;
  for (const MessageDefinition::Field& field : types[type].fields) {
    const std::string name = joined(path, field.name);
    if (field.kind == FieldKind::text || field.kind == FieldKind::wide_text) {
      all.reset();
      continue;
    }
    const bool is_structure = field.kind == FieldKind::structure, is_array = field.shape != Shape::single;
    const auto width = list.add(name, [&]() -> std::optional<std::size_t> {
      std::optional<std::size_t> one = 1;
      if (is_structure) one = add_definition(types, field.type, is_array ? name + "[]" : name, depth + 1, list);
      if (is_structure && types[field.type].name.starts_with("builtin_interfaces/")) one = 1;
      if (field.shape == Shape::varying || !one) return std::nullopt;
      return is_array ? field.count * *one : *one;
    });
    all = all && width ? std::optional(*all + *width) : std::nullopt;
  }
  return all;
}

std::optional<std::size_t> add_example(const MessageValue& value, const std::string& path, int depth, PathList& list) {
  return list.add(path, [&]() -> std::optional<std::size_t> {
    if (value.is_number() || value.is_boolean() || value.is_null() || is_time(value)) return 1;
    if (depth > kDeepestMessage || value.is_string()) return std::nullopt;
    if (value.is_array()) {
      if (!value.empty() && value[0].is_object()) add_example(value[0], path + "[]", depth + 1, list);
      return std::nullopt;
    }
    std::optional<std::size_t> all = 0;
    for (const auto& [key, part] : value.items()) {
      const auto width = add_example(part, joined(path, key), depth + 1, list);
      all = all && width ? std::optional(*all + *width) : std::nullopt;
    }
    return all;
  });
}

bool has_schema_type(const MessageValue& schema, std::string_view name) {
  if (!schema.is_object() || !schema.contains("type")) return false;
  const MessageValue& type = schema["type"];
  if (type.is_string()) return type.get_ref<const std::string&>() == name;
  return type.is_array() && std::any_of(type.begin(), type.end(), [&](const MessageValue& one) {
           return one.is_string() && one.get_ref<const std::string&>() == name;
         });
}

std::optional<std::size_t> add_schema(const MessageValue& schema, const std::string& path, int depth, PathList& list) {
  if (depth > kDeepestMessage || !schema.is_object()) return std::nullopt;
  for (const char* number : {"number", "integer", "boolean"}) {
    if (has_schema_type(schema, number)) return list.add(path, [] { return std::optional<std::size_t>(1); });
  }
  if (has_schema_type(schema, "array")) {
    return list.add(path, [&]() -> std::optional<std::size_t> {
      if (schema.contains("items")) add_schema(schema["items"], path + "[]", depth + 1, list);
      list.leave_out_last(path + "[]");  // of numbers
      return std::nullopt;
    });
  }
  const bool has_parts = schema.contains("properties") && schema["properties"].is_object();
  if (!has_parts) return std::nullopt;
  return list.add(path, [&]() -> std::optional<std::size_t> {
    std::optional<std::size_t> all = 0;
    for (const auto& [key, part] : schema["properties"].items()) {
      const auto width = add_schema(part, joined(path, key), depth + 1, list);
      all = all && width ? std::optional(*all + *width) : std::nullopt;
    }
    if (is_time(schema["properties"])) return 1;
    return all;
  });
}

// ---- Parts of messages ----

bool flatten(const MessageValue& value, std::vector<double>& numbers, int depth) {
  if (value.is_null()) {
    numbers.push_back(std::numeric_limits<double>::quiet_NaN());
  } else if (value.is_boolean()) {
    numbers.push_back(value.get<bool>() ? 1 : 0);
  } else if (value.is_number()) {
    numbers.push_back(value.get<double>());
  } else if (is_time(value)) {
    const MessageValue& sec = value["sec"];
    const MessageValue& nsec = value.contains("nsec") ? value["nsec"] : value["nanosec"];
    if (!sec.is_number() || !nsec.is_number()) return false;
    numbers.push_back(sec.get<double>() + 1e-9 * nsec.get<double>());
  } else {
    if (!value.is_structured() || depth > kDeepestMessage) return false;
    for (const MessageValue& part : value) {
      if (!flatten(part, numbers, depth + 1)) return false;
    }
  }
  return true;
}

std::optional<std::size_t> whole_number(std::string_view text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_text(const MessageValue& value, std::string_view text) {
  return value.is_string() && value.get_ref<const std::string&>() == text;
}

// The index of an element by its name: that of the element's own texts, else that in a list of names beside it.
std::optional<std::size_t> index_of(std::string_view name, const MessageValue& array,
                                    const std::vector<const MessageValue*>& around) {
  if (const auto index = whole_number(name)) return index;
  for (std::size_t i = 0; i < array.size(); ++i) {
    if (!array[i].is_object()) continue;
    for (const char* key : {"name", "child_frame_id", "id"}) {
      if (array[i].contains(key) && is_text(array[i][key], name)) return i;
    }
  }
  for (auto object = around.rbegin(); object != around.rend(); ++object) {
    for (const MessageValue& names : **object) {
      if (!names.is_array()) continue;
      const auto at = std::find_if(names.begin(), names.end(), [&](const auto& one) { return is_text(one, name); });
      if (at != names.end()) return static_cast<std::size_t>(at - names.begin());
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string_view> path_behind(std::string_view path, std::string_view key) {
  if (!path.starts_with(key)) return std::nullopt;
  const std::string_view rest = path.substr(key.size());
  return rest.empty() || rest[0] == '.' || rest[0] == '[' ? std::optional(rest) : std::nullopt;
}

bool append_numbers(const MessageValue& message, std::string_view path, std::vector<double>& numbers) {
  const MessageValue* value = &message;
  std::vector<const MessageValue*> around;
  while (!path.empty()) {
    if (value->is_object()) {
      if (path[0] == '.') path.remove_prefix(1);
      const MessageValue* part = nullptr;
      std::string_view rest;
      std::size_t longest = 0;
      for (const auto& [key, one] : value->items()) {
        const auto behind = path_behind(path, key);
        if (behind && (!part || key.size() > longest)) part = &one, rest = *behind, longest = key.size();
      }
      if (!part) return false;
      around.push_back(value);
      value = part, path = rest;
    } else if (value->is_array() && path[0] == '[' && path.find(']') != std::string_view::npos) {
      const std::size_t end = path.find(']');
      const auto index = index_of(path.substr(1, end - 1), *value, around);
      if (!index || *index >= value->size()) return false;
      value = &(*value)[*index], path = path.substr(end + 1);
    } else {
      return false;
    }
  }
  const std::size_t before = numbers.size();
  if (flatten(*value, numbers, 0)) return true;
  numbers.resize(before);
  return false;
}

MessageDefinition::MessageDefinition(const std::string& name, std::string_view text) {
  types_.push_back({short_type_name(name), {}});
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    add_line(trimmed(text.substr(0, end)));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  resolve();
}

void MessageDefinition::add_line(std::string_view line) {
  if (line.starts_with("====")) return;
  if (line.starts_with("MSG:")) {
    if (types_.size() >= kMostMessageTypes) throw std::runtime_error("the definition has too many types");
    types_.push_back({short_type_name(trimmed(line.substr(4))), {}});
    return;
  }
  line = trimmed(line.substr(0, line.find('#')));
  if (line.empty()) return;
  std::string_view type = first_word(line);
  std::string_view name = first_word(line);
  if (name.find('=') != std::string_view::npos || line.starts_with('=')) return;  // a constant
  if (name.empty()) throw std::runtime_error(fmt::format("a field of the definition has no name: {}", type));
  Field field;
  field.name = name;
  if (const std::size_t open = type.rfind('['); open != std::string_view::npos && type.ends_with(']')) {
    const std::string_view count = type.substr(open + 1, type.size() - open - 2);
    field.shape = count.empty() || count.starts_with("<=") ? Shape::varying : Shape::fixed;
    if (field.shape == Shape::fixed) {
      const auto number = whole_number(count);
      if (!number || *number > 1'000'000)
        throw std::runtime_error(fmt::format("the array {} of the definition has an implausible length", name));
      field.count = *number;
    }
    type = type.substr(0, open);
  }
  type = type.substr(0, type.find("<="));  // a bound of a text
  const auto primitive =
      std::find_if(kPrimitives.begin(), kPrimitives.end(), [&](const PrimitiveName& one) { return one.name == type; });
  if (primitive != kPrimitives.end())
    field.kind = primitive->kind;
  else
    field.type_name = short_type_name(type);
  types_.back().fields.push_back(std::move(field));
}

void MessageDefinition::resolve() {
  for (const char* name : {"builtin_interfaces/Time", "builtin_interfaces/Duration"}) {
    types_.push_back({name, {}});
    for (const auto& [part, kind] : {std::pair{"sec", FieldKind::int32}, {"nanosec", FieldKind::uint32}})
      types_.back().fields.push_back({part, kind, 0, {}, Shape::single, 0});
  }
  std::size_t fields = 0;
  for (Type& type : types_) {
    const std::string package = type.name.substr(0, type.name.find('/') + 1);
    for (Field& field : type.fields) {
      if (++fields > kMostMessageFields) throw std::runtime_error("the definition has too many fields");
      if (field.kind != FieldKind::structure) continue;
      const std::string& name = field.type_name;
      const bool is_full = name.find('/') != std::string::npos;
      const std::string header = name == "Header" ? "std_msgs/Header" : name;
      const auto is_it = [&](const Type& one) {
        return one.name == name || one.name == header || (!is_full && one.name == package + name);
      };
      const auto at = std::find_if(types_.begin(), types_.end(), is_it);
      if (at == types_.end())
        throw std::runtime_error(fmt::format("the definition does not contain the type {}", in_quotes(name)));
      field.type = static_cast<std::size_t>(at - types_.begin());
    }
  }
}

std::vector<MessagePath> MessageDefinition::paths(std::size_t most) const {
  PathList list(most);
  add_definition(types_, 0, "", 0, list);
  return list.take();
}

MessageValue MessageDefinition::decode(std::string_view bytes, MessageEncoding encoding,
                                       const std::vector<std::string_view>& paths, bool texts) const {
  Wire wire(bytes, encoding == MessageEncoding::cdr);
  return MessageDecoder(types_, wire, texts).structure(0, paths, 0);
}

std::vector<MessagePath> paths_of(const MessageValue& message, std::size_t most) {
  PathList list(most);
  add_example(message, "", 0, list);
  return list.take();
}

std::vector<MessagePath> paths_of_schema(const MessageValue& schema, std::size_t most) {
  PathList list(most);
  add_schema(schema, "", 0, list);
  return list.take();
}

}  // namespace grapnel
