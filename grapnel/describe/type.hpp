#pragma once

/// @file
/// Descriptions of plain structures as data: key, member, unit, range and meaning of each field. Functions over all
/// fields (readers, writers, schemas, tables of the documentation, setters by path, checks for finite numbers,
/// comparison by bytes) operate on a `Type` and an address, and are written once for all structures. A new field of a
/// structure needs one line of description.
///
///     struct Envelope { double position = 0; std::optional<double> angle; };
///
///     template <> struct Described<Envelope> {
///       static constexpr auto fields = std::to_array<Field>({
///         field<&Envelope::position>("position", "m", "Largest distance from the grasp point.").at_least(0),
///         field<&Envelope::angle>("angle", "rad", "Largest angle; absent: no limit."),
///         derived<[](const Envelope& e) { return 2 * e.position; }>("width", "m", "Width of the whole envelope."),
///       });
///       static constexpr Type type = structure<Envelope>("Envelope", "Capture envelope of an end-effector.", fields);
///     };
///
/// type_of<T>() is the description of bool, whole numbers, double, std::string, Vector3d, Quaterniond, std::vector,
/// std::optional, std::array and std::variant of described types, of enumerations and structures with a Described<T>.
/// Descriptions are constants without registration or code before main().

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

struct Type;
/// The description of T. Described<T> must be visible at the instantiation.
template <class T>
const Type& type_of();

/// A call for the value at an address, which is valid for the length of the call.
struct ValueVisitor {
  void (*call)(void* context, const void* value);
  void* context;
  void operator()(const void* value) const { call(context, value); }
};

/// Range of a field's numbers; for lists and vectors of each element.
struct Range {
  double least = -std::numeric_limits<double>::infinity();
  double most = std::numeric_limits<double>::infinity();
  bool least_excluded = false, most_excluded = false;

  constexpr bool contains(double x) const {
    return (least_excluded ? x > least : x >= least) && (most_excluded ? x < most : x <= most);
  }
};

/// One field of a structure.
struct Field {
  std::string_view key;   ///< its name in files, tables and pages
  std::string_view unit;  ///< of its numbers, such as "N s"; "1": without dimension; "": no numbers
  std::string_view text;  ///< meaning and frame, as sentences
  const Type& (*type)() = nullptr;
  /// Shows the value of a member, or a value computed from the structure.
  void (*show)(const void* owner, ValueVisitor visitor) = nullptr;
  void* (*place)(void* owner) = nullptr;            ///< the member's address; null: computed
  bool (*is_present)(const void* owner) = nullptr;  ///< whether it is written; null: always (an empty optional is not)
  Range range = {};
  bool is_required = false;     ///< in files that are read
  bool is_null_absent = false;  ///< an empty optional, or a number that is not finite, is written as null
  /// For a list of structures that are written into this one, each under a separate key: that key. Null: as a list.
  std::string_view (*key_of_item)(const void* item) = nullptr;
  // For input files:
  /// Form of the value in files, if it differs from its type: the name of a form of the reader ("quaternion").
  std::string_view form = {};
  std::string_view default_text = {};  ///< JSON; empty: the value in a default-constructed structure
  bool has_default = true;             ///< false: an absent value has no default, and the text states its meaning
  /// Limit on the magnitude of numbers, if it differs from the limit of the unit.
  double largest = std::numeric_limits<double>::quiet_NaN();
  /// Magnitude of numbers above which a warning is given. NaN: by the unit.
  double plausible = std::numeric_limits<double>::quiet_NaN();
  std::size_t least_items = 0, most_items = 0;  ///< of lists and mappings; 0: any number
  bool is_one_or_list = false;                  ///< for structures in scenarios and robots: a single one needs no list
  /// The unit of its numbers depends on other keys, such as a path; in input files.
  bool has_any_unit = false;
  /// Name of the value in messages, "a list of names"; for alternatives one each, separated by "; ". Empty: by the
  /// type.
  std::string_view title = {};

  constexpr Field at_least(double x) const {
    Field f = *this;
    f.range.least = x;
    return f;
  }
  constexpr Field above(double x) const {
    Field f = *this;
    f.range.least = x, f.range.least_excluded = true;
    return f;
  }
  constexpr Field at_most(double x) const {
    Field f = *this;
    f.range.most = x;
    return f;
  }
  constexpr Field required() const {
    Field f = *this;
    f.is_required = true;
    return f;
  }
  constexpr Field optional() const {
    Field f = *this;
    f.has_default = false;
    return f;
  }
  constexpr Field by_default(std::string_view json) const {
    Field f = *this;
    f.default_text = json;
    return f;
  }
  constexpr Field as(std::string_view form_name) const {
    Field f = *this;
    f.form = form_name;
    return f;
  }
  constexpr Field up_to(double magnitude) const {
    Field f = *this;
    f.largest = magnitude;
    return f;
  }
  constexpr Field items(std::size_t least, std::size_t most) const {
    Field f = *this;
    f.least_items = least, f.most_items = most;
    return f;
  }
  constexpr Field plausible_to(double magnitude) const {
    Field f = *this;
    f.plausible = magnitude;
    return f;
  }
  /// For a list of structures, named e.g. "a shape; a list of shapes".
  constexpr Field one_or_list(std::string_view titles) const {
    Field f = *this;
    f.is_one_or_list = true, f.title = titles;
    return f;
  }
  constexpr Field in_any_unit() const {
    Field f = *this;
    f.has_any_unit = true;
    return f;
  }
  constexpr Field called(std::string_view name) const {
    Field f = *this;
    f.title = name;
    return f;
  }
  constexpr Field or_null() const {
    Field f = *this;
    f.is_null_absent = true;
    return f;
  }
  /// Written only if the predicate, a lambda of the structure without captures, is true.
  template <auto Predicate>
  constexpr Field when() const;
  /// For a list of structures: each is written into this structure, under the key in this member.
  template <auto Name>
  constexpr Field keyed_by() const;
};

/// Rules between keys of one mapping in input files. A text may list several keys: "kp, kd".
struct Rule {
  enum class Kind {
    needs,     ///< `keys` needs `others`
    not_both,  ///< at most one of the two `keys`
    one_of,    ///< exactly one of `keys`
    any_of,    ///< at least one key
    when       ///< if `keys` is present, and has one of `values` if there are any: `others` are required,
               ///< `forbidden` ("limits.lower": below a key) have no meaning, for the reason `why`, of `choices`
               ///< exactly one is there, and the list `narrowed` holds `items` of at least `least`
  };
  Kind kind;
  std::string_view keys, values = {}, others = {}, forbidden = {}, why = {}, choices = {}, narrowed = {};
  const Type& (*items)() = nullptr;
  double least = -std::numeric_limits<double>::infinity();

  constexpr Rule require(std::string_view names) const {
    Rule r = *this;
    r.others = names;
    return r;
  }
  constexpr Rule forbid(std::string_view names, std::string_view reason = {}) const {
    Rule r = *this;
    r.forbidden = names, r.why = reason;
    return r;
  }
  constexpr Rule require_one_of(std::string_view names) const {
    Rule r = *this;
    r.choices = names;
    return r;
  }
  template <class Item>
  constexpr Rule narrow(std::string_view list, double least_item = -std::numeric_limits<double>::infinity()) const {
    Rule r = *this;
    r.narrowed = list, r.items = &type_of<Item>, r.least = least_item;
    return r;
  }
};
constexpr Rule needs(std::string_view key, std::string_view others) { return {Rule::Kind::needs, key, {}, others}; }
constexpr Rule not_both(std::string_view keys) { return {Rule::Kind::not_both, keys}; }
constexpr Rule not_empty() { return {Rule::Kind::any_of, {}}; }
constexpr Rule one_of(std::string_view keys) { return {Rule::Kind::one_of, keys}; }
constexpr Rule when(std::string_view key, std::string_view values = {}) { return {Rule::Kind::when, key, values}; }

/// Name of an enumeration's value in files.
struct Choice {
  std::int64_t value;
  std::string_view name;
  std::string_view text;  ///< meaning; may be empty
};

/// Type of a value, with access to its parts.
struct Type {
  enum class Kind { boolean, whole, real, text, choice, list, optional, alternatives, structure };
  Kind kind = Kind::structure;
  std::string_view name = {};  ///< of structures and enumerations, as in the sources
  std::string_view text = {};  ///< of structures: their meaning
  std::span<const Field> fields = {};
  std::span<const Choice> choices = {};
  std::span<const Rule> rules = {};              ///< of structures
  void (*show_default)(ValueVisitor) = nullptr;  ///< of structures: a default-constructed one
  std::size_t fixed_size = 0;                    ///< of lists with a fixed size (vectors: 3, quaternions: 4); 0: any
  const Type& (*of)() = nullptr;                 ///< of lists and optionals: type of their items
  std::span<const Type& (*const)()> alternatives = {};  ///< of alternatives: their types

  std::int64_t (*whole)(const void* value) = nullptr;  ///< of whole numbers, choices and booleans
  void (*set_whole)(void* value, std::int64_t number) = nullptr;
  /// Size of lists; 0 or 1 for optionals; index of the active alternative, which resize() changes.
  std::size_t (*size)(const void* value) = nullptr;
  void (*resize)(void* value, std::size_t size) = nullptr;  ///< as size(); null where the size is fixed
  void (*show_item)(const void* value, std::size_t i, ValueVisitor visitor) = nullptr;
  void* (*item)(void* value, std::size_t i) = nullptr;  ///< null where items have no address
};

/// Specialised for every structure and enumeration that is described.
template <class T>
struct Described;

/// Calls visit(const Value&) for the value shown by a ValueVisitor.
template <class Call>
ValueVisitor visitor_of(Call& call) {
  return {[](void* context, const void* value) { (*static_cast<Call*>(context))(value); },
          const_cast<void*>(static_cast<const void*>(&call))};
}

// ---- Writing descriptions ----

namespace detail {

template <class>
struct MemberOf;
template <class Owner, class Value>
struct MemberOf<Value Owner::*> {
  using owner = Owner;
  using value = Value;
};

template <class>
struct ArgumentOf;
template <class Result, class Function, class Owner>
struct ArgumentOf<Result (Function::*)(const Owner&) const> {
  using owner = Owner;
  using value = std::remove_cvref_t<Result>;
};

template <class>
struct FoundOf;
template <class Value, class Function, class Owner>
struct FoundOf<Value& (Function::*)(Owner&) const> {
  using owner = Owner;
  using value = Value;
};
template <class Value, class Function, class Owner>
struct FoundOf<Value* (Function::*)(Owner&) const> {
  using owner = Owner;
  using value = Value;
};

}  // namespace detail

/// A member, possibly one of the structure's first base class.
template <auto Member>
constexpr Field field(std::string_view key, std::string_view unit, std::string_view text) {
  using Owner = typename detail::MemberOf<decltype(Member)>::owner;
  using Value = typename detail::MemberOf<decltype(Member)>::value;
  Field f;
  f.key = key, f.unit = unit, f.text = text;
  f.type = &type_of<Value>;
  f.show = [](const void* owner, ValueVisitor visitor) { visitor(&(static_cast<const Owner*>(owner)->*Member)); };
  f.place = [](void* owner) -> void* { return &(static_cast<Owner*>(owner)->*Member); };
  return f;
}

/// A member with a separate description.
template <auto Member>
constexpr Field field(const Type& (*type)(), std::string_view key, std::string_view text) {
  using Owner = typename detail::MemberOf<decltype(Member)>::owner;
  Field f;
  f.key = key, f.text = text, f.type = type;
  f.show = [](const void* owner, ValueVisitor visitor) { visitor(&(static_cast<const Owner*>(owner)->*Member)); };
  f.place = [](void* owner) -> void* { return &(static_cast<Owner*>(owner)->*Member); };
  return f;
}

/// A member of a structure without numbers.
template <auto Member>
constexpr Field field(std::string_view key, std::string_view text) {
  return field<Member>(key, "", text);
}

/// A value that a lambda without captures returns from the structure, such as a member of a member: T& -> Value&.
template <auto Find>
constexpr Field found(std::string_view key, std::string_view unit, std::string_view text) {
  using Signature = detail::FoundOf<decltype(&decltype(Find)::operator())>;
  using Owner = typename Signature::owner;
  using Value = typename Signature::value;
  Field f;
  f.key = key, f.unit = unit, f.text = text;
  f.type = &type_of<Value>;
  f.show = [](const void* owner, ValueVisitor visitor) {
    visitor(&Find(*const_cast<Owner*>(static_cast<const Owner*>(owner))));
  };
  f.place = [](void* owner) -> void* { return &Find(*static_cast<Owner*>(owner)); };
  return f;
}

/// The same with a pointer, T& -> Value*, which is null if the structure has no such value.
template <auto Find>
constexpr Field found_if(std::string_view key, std::string_view unit, std::string_view text) {
  using Signature = detail::FoundOf<decltype(&decltype(Find)::operator())>;
  using Owner = typename Signature::owner;
  using Value = typename Signature::value;
  Field f;
  f.key = key, f.unit = unit, f.text = text;
  f.type = &type_of<Value>;
  f.show = [](const void* owner, ValueVisitor visitor) {
    const Value* value = Find(*const_cast<Owner*>(static_cast<const Owner*>(owner)));
    if (value) visitor(value);
  };
  f.place = [](void* owner) -> void* { return Find(*static_cast<Owner*>(owner)); };
  return f;
}

/// A key of files without a single member: only its reader interprets it.
template <class Value>
constexpr Field key(std::string_view name, std::string_view unit, std::string_view text) {
  Field f;
  f.key = name, f.unit = unit, f.text = text;
  f.type = &type_of<Value>;
  return f;
}

/// A separate mapping in files for some members of the structure; Keys has a Described whose fields are T's.
template <class T, class Keys>
constexpr Field group(std::string_view key, std::string_view text) {
  Field f;
  f.key = key, f.text = text;
  f.type = &type_of<Keys>;
  f.show = [](const void* owner, ValueVisitor visitor) { visitor(owner); };
  f.place = [](void* owner) { return owner; };
  return f;
}

/// A value that is computed from the structure by a lambda without captures when it is written.
template <auto Function>
constexpr Field derived(std::string_view key, std::string_view unit, std::string_view text) {
  using Signature = detail::ArgumentOf<decltype(&decltype(Function)::operator())>;
  using Owner = typename Signature::owner;
  using Value = typename Signature::value;
  Field f;
  f.key = key, f.unit = unit, f.text = text;
  f.type = &type_of<Value>;
  f.show = [](const void* owner, ValueVisitor visitor) {
    const Value& value = Function(*static_cast<const Owner*>(owner));  // extends the lifetime of a temporary
    visitor(&value);
  };
  return f;
}

namespace detail {
/// A member of a member, or of what a pointer member refers to.
template <auto Outer, auto Member>
const auto& part_of(const void* owner) {
  const auto& outer = static_cast<const typename MemberOf<decltype(Outer)>::owner*>(owner)->*Outer;
  if constexpr (std::is_pointer_v<typename MemberOf<decltype(Outer)>::value>)
    return outer->*Member;
  else
    return outer.*Member;
}
}  // namespace detail

/// A member of a member, or of the structure that a pointer member refers to, when it is written.
template <auto Outer, auto Member>
constexpr Field part(std::string_view key, std::string_view unit, std::string_view text) {
  Field f;
  f.key = key, f.unit = unit, f.text = text;
  f.type = &type_of<typename detail::MemberOf<decltype(Member)>::value>;
  f.show = [](const void* owner, ValueVisitor visitor) { visitor(&detail::part_of<Outer, Member>(owner)); };
  return f;
}

/// Such a list, which is absent if it is empty.
template <auto Outer, auto List>
constexpr Field list_part(std::string_view key, std::string_view unit, std::string_view text) {
  Field f = part<Outer, List>(key, unit, text);
  f.is_present = [](const void* owner) { return !detail::part_of<Outer, List>(owner).empty(); };
  return f;
}

template <auto Predicate>
constexpr Field Field::when() const {
  using Owner = typename detail::ArgumentOf<decltype(&decltype(Predicate)::operator())>::owner;
  Field f = *this;
  f.is_present = [](const void* owner) { return bool(Predicate(*static_cast<const Owner*>(owner))); };
  return f;
}

template <auto Name>
constexpr Field Field::keyed_by() const {
  using Item = typename detail::MemberOf<decltype(Name)>::owner;
  Field f = *this;
  f.key_of_item = [](const void* item) -> std::string_view { return static_cast<const Item*>(item)->*Name; };
  return f;
}

template <class T>
constexpr Type structure(std::string_view name, std::string_view text, std::span<const Field> fields) {
  Type type;
  type.kind = Type::Kind::structure, type.name = name, type.text = text, type.fields = fields;
  if constexpr (std::default_initializable<T>) {
    type.show_default = [](ValueVisitor visitor) {
      const T untouched{};
      visitor(&untouched);
    };
  }
  return type;
}
template <class T>
constexpr Type structure(std::string_view name, std::string_view text, std::span<const Field> fields,
                         std::span<const Rule> rules) {
  Type type = structure<T>(name, text, fields);
  type.rules = rules;
  return type;
}

template <class Enum>
requires std::is_enum_v<Enum>
constexpr Choice choice(Enum value, std::string_view name, std::string_view text = {}) {
  return {static_cast<std::int64_t>(value), name, text};
}

template <class Enum>
requires std::is_enum_v<Enum>
constexpr Type enumeration(std::string_view name, std::span<const Choice> choices) {
  Type type;
  type.kind = Type::Kind::choice, type.name = name, type.choices = choices;
  type.whole = [](const void* value) { return static_cast<std::int64_t>(*static_cast<const Enum*>(value)); };
  type.set_whole = [](void* value, std::int64_t number) { *static_cast<Enum*>(value) = static_cast<Enum>(number); };
  return type;
}

/// A text as a template argument.
template <std::size_t size>
struct Literal {
  char text[size] = {};
  constexpr Literal(const char (&literal)[size]) { std::copy_n(literal, size, text); }
};

/// The description of an enumeration whose values from 0 have these names in files and results; "": no name.
///
///     template <> struct Described<Colour> : Enumeration<Colour, "Colour", "red", "green"> {};
template <class Enum, Literal type_name, Literal... names>
struct Enumeration {
  static constexpr auto choices = [] {
    std::array<Choice, (std::size_t{sizeof(names.text) > 1} + ...)> named{};
    std::size_t n = 0;
    std::int64_t value = 0;
    ((sizeof(names.text) > 1 ? void(named[n++] = {value, names.text, {}}) : void(), ++value), ...);
    return named;
  }();
  static constexpr Type type = enumeration<Enum>(type_name.text, choices);
};

/// The name of a described enumeration's value. @throws std::logic_error if it has none.
std::string_view name_of_choice(const Type& type, std::int64_t value);
template <class Enum>
requires std::is_enum_v<Enum>
const char* name_of(Enum value) {
  return name_of_choice(type_of<Enum>(), static_cast<std::int64_t>(value)).data();  // of a literal
}
/// The value of a name; empty if there is none.
std::optional<std::int64_t> choice_named(const Type& type, std::string_view name);
template <class Enum>
std::optional<Enum> value_named(std::string_view name) {
  const std::optional<std::int64_t> value = choice_named(type_of<Enum>(), name);
  return value ? std::optional(static_cast<Enum>(*value)) : std::nullopt;
}
/// The field of a structure with the key; null if there is none.
const Field* field_named(const Type& type, std::string_view key);

// ---- Descriptions of values other than structures ----

namespace detail {

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};
template <class T>
struct IsArray : std::false_type {};
template <class T, std::size_t n>
struct IsArray<std::array<T, n>> : std::true_type {};
template <class T>
struct IsVariant : std::false_type {};
template <class... Ts>
struct IsVariant<std::variant<Ts...>> : std::true_type {
  static constexpr std::array<const Type& (*)(), sizeof...(Ts)> types{&type_of<Ts>...};
};
template <class T>
struct IsOptional : std::false_type {};
template <class T>
struct IsOptional<std::optional<T>> : std::true_type {};

template <class List>
constexpr Type vector_type() {
  using Item = typename List::value_type;
  Type type;
  type.kind = Type::Kind::list;
  type.of = &type_of<Item>;
  type.size = [](const void* value) { return static_cast<const List*>(value)->size(); };
  type.resize = [](void* value, std::size_t size) { static_cast<List*>(value)->resize(size); };
  type.show_item = [](const void* value, std::size_t i, ValueVisitor visitor) {
    const Item& item = (*static_cast<const List*>(value))[i];  // bool: a copy that lives as long as the reference
    visitor(&item);
  };
  if constexpr (!std::same_as<Item, bool>) {
    type.item = [](void* value, std::size_t i) -> void* { return &(*static_cast<List*>(value))[i]; };
  }
  return type;
}

// Three numbers, four, or any fixed number, by operator[].
template <class List, class Item, std::size_t n>
constexpr Type fixed_list_type() {
  Type type;
  type.kind = Type::Kind::list, type.fixed_size = n;
  type.of = &type_of<Item>;
  type.size = [](const void*) { return n; };
  type.show_item = [](const void* value, std::size_t i, ValueVisitor visitor) {
    const Item& item = (*static_cast<const List*>(value))[static_cast<int>(i)];
    visitor(&item);
  };
  type.item = [](void* value, std::size_t i) -> void* { return &(*static_cast<List*>(value))[static_cast<int>(i)]; };
  return type;
}

template <class T>
constexpr Type optional_type() {
  using Value = typename T::value_type;
  Type type;
  type.kind = Type::Kind::optional;
  type.of = &type_of<Value>;
  type.size = [](const void* value) { return std::size_t{static_cast<const T*>(value)->has_value()}; };
  type.resize = [](void* value, std::size_t size) {
    T& optional = *static_cast<T*>(value);
    if (size == 0) optional.reset();
    if (size == 1 && !optional) optional.emplace();
  };
  type.show_item = [](const void* value, std::size_t, ValueVisitor visitor) {
    visitor(&**static_cast<const T*>(value));
  };
  type.item = [](void* value, std::size_t) -> void* { return &**static_cast<T*>(value); };
  return type;
}

template <class T>
constexpr Type variant_type() {
  Type type;
  type.kind = Type::Kind::alternatives;
  type.alternatives = IsVariant<T>::types;
  type.size = [](const void* value) { return static_cast<const T*>(value)->index(); };
  type.resize = [](void* value, std::size_t which) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      ((i == which ? void(static_cast<T*>(value)->template emplace<i>()) : void()), ...);
    }
    (std::make_index_sequence<std::variant_size_v<T>>{});
  };
  type.show_item = [](const void* value, std::size_t, ValueVisitor visitor) {
    std::visit([&](const auto& held) { visitor(&held); }, *static_cast<const T*>(value));
  };
  type.item = [](void* value, std::size_t) -> void* {
    return std::visit([](auto& held) -> void* { return &held; }, *static_cast<T*>(value));
  };
  return type;
}

template <class T>
constexpr Type whole_type(Type::Kind kind) {
  Type type;
  type.kind = kind;
  type.whole = [](const void* value) { return static_cast<std::int64_t>(*static_cast<const T*>(value)); };
  type.set_whole = [](void* value, std::int64_t number) { *static_cast<T*>(value) = static_cast<T>(number); };
  return type;
}

// w, x, y, z in this order.
Type quaternion_type();

template <class T>
Type make_type() {
  if constexpr (std::same_as<T, bool>) {
    return whole_type<bool>(Type::Kind::boolean);
  } else if constexpr (std::integral<T>) {
    return whole_type<T>(Type::Kind::whole);
  } else if constexpr (std::same_as<T, double>) {
    return {.kind = Type::Kind::real};
  } else if constexpr (std::same_as<T, std::string>) {
    return {.kind = Type::Kind::text};
  } else if constexpr (std::same_as<T, Vector3d>) {
    return fixed_list_type<Vector3d, double, 3>();
  } else if constexpr (std::same_as<T, Quaterniond>) {
    return quaternion_type();
  } else if constexpr (IsVector<T>::value) {
    return vector_type<T>();
  } else if constexpr (IsArray<T>::value) {
    return fixed_list_type<T, typename T::value_type, std::tuple_size_v<T>>();
  } else if constexpr (IsOptional<T>::value) {
    return optional_type<T>();
  } else if constexpr (IsVariant<T>::value) {
    return variant_type<T>();
  } else {
    return Described<T>::type;
  }
}

}  // namespace detail

template <class T>
const Type& type_of() {
  static const Type type = detail::make_type<T>();
  return type;
}

}  // namespace grapnel
