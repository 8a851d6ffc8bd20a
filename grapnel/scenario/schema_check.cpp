#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "grapnel/scenario/plausibility.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/syntax_mistake.hpp"
#include "grapnel/text/units.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

const Json& resolve(const Json& root, const std::string& reference) {
  return root.at(Json::json_pointer(reference.substr(1)));  // "#/definitions/x"
}

// The keyword of the schema, else of the referenced definition.
const Json* keyword(const Json& root, const Json& schema, const char* name) {
  if (!schema.is_object()) return nullptr;
  if (const auto it = schema.find(name); it != schema.end()) return &*it;
  if (const auto it = schema.find("$ref"); it != schema.end()) return keyword(root, resolve(root, *it), name);
  if (const auto it = schema.find("allOf"); it != schema.end()) {
    for (const Json& part : *it) {
      if (const Json* found = keyword(root, part, name)) return found;
    }
  }
  return nullptr;
}

bool fits_type(const Node& node, const std::string& type) {
  if (type == "object") return node.is_mapping();
  if (type == "array") return node.is_sequence();
  if (type == "string") return is_text(node);
  if (type == "number") return number_of(node).has_value();
  if (type == "integer") return number_of(node) && *number_of(node) == std::floor(*number_of(node));
  if (type == "boolean") return boolean_of(node).has_value();
  return false;
}

// Whether a node may represent a value of the type: numbers may have units, which are converted later.
bool may_be_of_type(const Node& node, const std::string& type) {
  const bool has_unit = node.is_scalar() && (node.unit != 0 || number_and_unit(node.text));
  return fits_type(node, type) || (type == "number" && has_unit);
}

// Whether both are lists of lists, judged by the first item.
bool fits_depth(const Json& root, const Node& node, const Json& array) {
  const auto items = array.find("items");
  if (node.items.empty() || items == array.end()) return true;
  const Json* type = keyword(root, *items, "type");
  return node.items[0].is_sequence() == (type && *type == "array");
}

bool fits_length(const Node& node, const Json& array) {
  const std::size_t size = node.items.size();
  return size >= array.value("minItems", std::size_t{0}) && size <= array.value("maxItems", size);
}

// Whether a mapping has the keys that mark this alternative.
bool fits_keys(const Node& node, const Json& object) {
  for (const Json& key : object.value("required", Json::array())) {
    if (!node.entry(key.get<std::string>())) return false;
  }
  return true;
}

// The alternative that matches the node: by type, then by length or keys; null if there is none.
const Json* chosen_alternative(const Json& root, const Json& alternatives, const Node& node) {
  const Json* of_type = nullptr;
  std::size_t count = 0;
  for (const Json& alternative : alternatives) {
    if (!may_be_of_type(node, *keyword(root, alternative, "type"))) continue;
    const bool fits = node.is_sequence() ? fits_length(node, alternative) && fits_depth(root, node, alternative)
                                         : !node.is_mapping() || fits_keys(node, alternative);
    if (fits) return &alternative;
    of_type = &alternative, ++count;
  }
  // A single match by type is unambiguous; among several lists the length decides.
  return count == 1 || node.is_mapping() ? of_type : nullptr;
}

std::string scalar_text(const Json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); }

std::vector<std::string> texts(const Json& list) {
  std::vector<std::string> result;
  for (const Json& value : list) result.push_back(scalar_text(value));
  return result;
}

const Json& properties_of(const Json& schema) {
  static const Json kNone = Json::object();
  const auto properties = schema.find("properties");
  return properties != schema.end() ? *properties : kNone;
}

std::vector<std::string> names_in(const Json& properties) {
  std::vector<std::string> names;
  for (const auto& [name, unused] : properties.items()) names.push_back(name);
  return names;
}

// false, or {"not": {}} with the reason as description.
bool is_forbidden(const Json& property) {
  if (property.is_boolean()) return true;
  const auto negated = property.find("not");
  return negated != property.end() && negated->empty();
}

std::string unit_text(const std::string& unit) { return unit.empty() ? "" : " [" + unit + "]"; }

std::string joined_path(const std::string& path, const std::string& key) {
  return path.empty() ? shortened(key) : path + "." + shortened(key);
}

// "; is '0,5' a decimal comma?" if a list is too long and exactly the excess number of its commas has no blank after
// them, while others have.
std::string decimal_comma_advice(const Node& list, std::size_t most) {
  if (most == 0 || list.items.size() <= most) return {};
  std::size_t tight = 0;
  std::string first;
  for (std::size_t i = 1; i < list.items.size(); ++i) {
    const Node &left = list.items[i - 1], &right = list.items[i];
    if (!is_decimal_comma(left, right, right.mark)) continue;
    if (++tight == 1) first = left.text + "," + right.text;
  }
  if (tight != list.items.size() - most || tight + 1 == list.items.size()) return {};
  return "; is " + in_quotes(first) + " one number? It needs a point";
}

// The state of a check at one place.
struct Where {
  std::string path;        // as in --set; empty: the whole document
  std::string unit;        // of the numbers below
  double largest = NAN;    // in magnitude, of the numbers below; NaN: by the unit
  double plausible = NAN;  // likewise, without a warning
  std::string condition;   // "with type: continuous" inside a conditional part
  std::string written;     // original text of a number with a unit
};

class Checker {
 public:
  Checker(const Json& root, const std::string& document, FaultList& faults)
      : root_(root), document_(document), faults_(faults) {}

  // False if the node has another type, so that no further check applies.
  bool check(Node& node, const Json& schema, Where where) {
    if (schema.contains("x-unit")) where.unit = schema["x-unit"];
    if (schema.contains("x-largest")) where.largest = schema["x-largest"];
    if (schema.contains("x-plausible")) where.plausible = schema["x-plausible"];
    if (schema.contains("type")) {
      if (is_number_type(schema["type"]) && !take_unit(node, where)) return false;
      if (!check_type(node, schema["type"], schema, where)) return false;
    }
    if (node.is_mapping()) correct_keys(node, schema, where);
    if (schema.contains("$ref") && !check(node, resolve(root_, schema["$ref"]), where)) return false;
    for (const Json& part : schema.value("allOf", Json::array())) {
      if (!check(node, part, where)) return false;
    }
    if (schema.contains("anyOf")) return check_alternatives(node, schema["anyOf"], where);
    if (schema.contains("enum") || schema.contains("const")) check_choice(node, schema, where);
    if (number_of(node)) check_number(node, schema, where);
    if (node.is_scalar() && schema.contains("minLength") && node.text.empty()) {
      faults_.add(node.mark, name_of(where) + " must not be empty");
    }
    if (is_text(node)) check_text(node, where);
    if (node.is_sequence()) check_list(node, schema, where);
    if (node.is_mapping()) check_mapping(node, schema, where);
    return true;
  }

 private:
  std::string name_of(const Where& where) const { return where.path.empty() ? document_ : where.path; }

  static bool is_number_type(const Json& type) { return type == "number" || type == "integer"; }

  // False if the node has a unit that is not allowed here, which has been reported.
  bool take_unit(Node& node, Where& where) {
    if (!node.is_scalar() || (node.unit == 0 && number_of(node))) return true;
    std::string written = node.text;
    const UnitReading reading = grapnel::take_unit(node, where.unit, name_of(where), faults_);
    if (reading == UnitReading::taken) where.written = std::move(written);
    return reading != UnitReading::refused;
  }

  // A number in a message: "5 km (5000)".
  static std::string shown(const Node& node, const Where& where) {
    if (where.written.empty()) return shortened(node.text);
    return fmt::format("{} ({})", shortened(where.written), shortened(node.text));
  }

  bool check_type(const Node& node, const std::string& type, const Json& schema, const Where& where) {
    if (fits_type(node, type)) return true;
    const std::string subject = name_of(where) + (node.kind == Node::Kind::null ? " is empty, must be " : " must be ");
    const bool say_what = node.kind != Node::Kind::null;
    if (type == "number" || type == "integer") {
      const std::string what = type == "number" ? "a number" : "a whole number";
      const std::string why = !say_what ? "" : number_of(node) ? ", not " + shown(node, where) : why_no_number(node);
      faults_.add(node.mark, subject + what + unit_text(where.unit) + why);
      return false;
    }
    std::string what = type == "object"    ? "a mapping"
                       : type == "array"   ? schema.value("title", "a list")
                       : type == "boolean" ? "true or false"
                                           : "text";
    if (type == "array") what += unit_text(where.unit);
    std::string why = say_what ? ", not " + described(node) : "";
    const std::string advice = type == "object" && node.is_scalar() && node.plain ? key_advice(node.text) : "";
    if (!advice.empty()) why += "; " + advice;
    if (type == "string" && node.is_scalar()) why += "; put it in quotes: " + in_quotes(node.text);
    if (type == "array" && node.is_scalar()) why += list_advice(node.text);
    faults_.add(node.mark, subject + what + why);
    return false;
  }

  bool check_alternatives(Node& node, const Json& alternatives, const Where& where) {
    if (node.is_mapping()) mend_only_key(node, alternatives, where);
    if (const Json* chosen = chosen_alternative(root_, alternatives, node)) return check(node, *chosen, where);
    std::string titles;
    bool number_possible = false, list_possible = false;
    for (std::size_t i = 0; i < alternatives.size(); ++i) {
      titles += (i == 0 ? "" : i + 1 == alternatives.size() ? " or " : ", ") + alternatives[i].value("title", "?");
      const std::string type = *keyword(root_, alternatives[i], "type");
      number_possible = number_possible || type == "number";
      list_possible = list_possible || type == "array";
    }
    const std::string must = "must be " + titles + unit_text(where.unit);
    if (node.kind == Node::Kind::null) {
      faults_.add(node.mark, fmt::format("{} is empty, {}", name_of(where), must));
    } else if (node.is_sequence() && list_possible) {
      faults_.add(node.mark, fmt::format("{} has {}, {}", name_of(where), counted(node.items.size(), "item"), must));
    } else {
      std::string why = number_possible ? why_no_number(node) : ", not " + described(node);
      if (list_possible && node.is_scalar()) why += list_advice(node.text);
      faults_.add(node.mark, fmt::format("{} {}{}", name_of(where), must, why));
    }
    return false;
  }

  void check_choice(const Node& node, const Json& schema, const Where& where) {
    const bool constant = schema.contains("const");
    const std::vector<std::string> allowed = constant ? texts(Json::array({schema["const"]})) : texts(schema["enum"]);
    if (!node.is_scalar()) {
      faults_.add(node.mark, fmt::format("{} is {}, must be {}{}", name_of(where), described(node),
                                         constant ? "" : "one of ", fmt::join(allowed, ", ")));
      return;
    }
    if (is_text(node) && std::find(allowed.begin(), allowed.end(), node.text) != allowed.end()) return;
    if (constant) {
      faults_.add(node.mark, fmt::format("{} is {}, must be '{}'", name_of(where), in_quotes(node.text), allowed[0]));
    } else {
      faults_.add(node.mark, fmt::format("unknown value {} for {}{}", in_quotes(node.text), name_of(where),
                                         suggestion(node.text, allowed)));
    }
  }

  void check_number(const Node& node, const Json& schema, const Where& where) {
    const double value = *number_of(node);
    if (!schema.contains("type") || !is_number_type(schema["type"])) return;
    const auto fault = [&](const std::string& must) {
      faults_.add(node.mark, fmt::format("{} is {}, must be {}{}", name_of(where), shown(node, where), must,
                                         unit_text(where.unit)));
    };
    const bool may_be_infinite = schema.value("x-infinity", false);
    if (std::isnan(value) && may_be_infinite) return fault("a number");
    if (!std::isfinite(value) && !may_be_infinite) return fault("a finite number");
    const auto bound = [&](const char* name) { return schema.contains(name) ? schema[name].get<double>() : NAN; };
    const double above = bound("exclusiveMinimum"), from = bound("minimum"), to = bound("maximum");
    const bool within = !(value <= above) && !(value < from) && !(value > to);
    if (within && std::isfinite(value)) {
      const Magnitudes limits = magnitudes_of(where.unit);
      const double largest = std::isnan(where.largest) ? limits.largest : where.largest;
      if (std::abs(value) > largest)
        return fault(fmt::format("at most {:g} in magnitude{}", largest, may_be_infinite ? " or .inf" : ""));
      if (above == 0 && value < limits.smallest) return fault(fmt::format("at least {:g}", limits.smallest));
    }
    if (within) {
      if (node.unit != 0) return;  // numbers with explicit units need no warning
      if (where.unit == "rad") doubt_angle(value, node.mark, name_of(where), faults_);
      if (where.unit == "rad/s" && std::isnan(where.plausible))
        doubt_angular_rate(value, node.mark, name_of(where), faults_);
      if (where.unit == "rad/s" && std::abs(value) > where.plausible)
        doubt_rotor_rate(value, node.mark, name_of(where), faults_);
      return;
    }
    if (!std::isnan(above) && !std::isnan(to)) return fault(fmt::format("greater than {} and at most {}", above, to));
    if (!std::isnan(above)) return fault(fmt::format("greater than {}", above));
    if (!std::isnan(to)) return fault(fmt::format("between {} and {}", from, to));
    fault(fmt::format("at least {}", from));
  }

  // Forbidden characters of texts, which appear on terminals and pages and in file names.
  void check_text(const Node& node, const Where& where) {
    for (std::size_t i = 0; i < node.text.size();) {
      const std::size_t length = std::max<std::size_t>(utf8_length(node.text, i), 1);
      const char c = node.text[i];
      if (c != '\n' && c != '\t' && is_control(node.text, i, length)) {
        faults_.add(node.mark,
                    fmt::format("{} must not hold control characters: {}", name_of(where), in_quotes(node.text)));
        return;
      }
      i += length;
    }
  }

  void check_list(Node& node, const Json& schema, const Where& where) {
    if (!fits_length(node, schema)) {
      const std::size_t least = schema.value("minItems", std::size_t{0}),
                        most = schema.value("maxItems", std::size_t{0});
      const std::string must = least == most               ? fmt::format("exactly {}", least)
                               : node.items.size() < least ? fmt::format("at least {}", least)
                                                           : fmt::format("at most {}", most);
      faults_.add(node.mark, fmt::format("{} has {}, must have {}{}", name_of(where),
                                         counted(node.items.size(), "item"), must, decimal_comma_advice(node, most)));
    }
    if (!schema.contains("items")) return;
    for (std::size_t i = 0; i < node.items.size() && !faults_.full(); ++i) {
      Where below = where;
      below.path += fmt::format("[{}]", i);
      check(node.items[i], schema["items"], below);
    }
  }

  void check_mapping(Node& node, const Json& schema, const Where& where) {
    if (schema.contains("required")) check_required(node, schema["required"], where);
    if (schema.contains("minProperties")) check_not_empty(node, schema, where);
    if (schema.contains("oneOf")) check_one_key(node, schema["oneOf"], where);
    if (schema.contains("not")) check_exclusive(node, schema["not"], where);
    if (schema.contains("dependencies")) check_dependencies(node, schema["dependencies"], where);
    if (schema.contains("if")) check_condition(node, schema, where);
    check_entries(node, schema, where);
  }

  void check_required(const Node& node, const Json& keys, const Where& where) {
    for (const Json& key : keys) {
      if (node.entry(key.get<std::string>())) continue;
      const std::string condition = where.condition.empty() ? "" : ", needed " + where.condition;
      faults_.add(node.mark,
                  fmt::format("missing key '{}' in {}{}", key.get<std::string>(), name_of(where), condition));
    }
  }

  // {"minProperties": 1}
  void check_not_empty(const Node& node, const Json& schema, const Where& where) {
    if (!node.entries.empty()) return;
    std::string names;
    for (const auto& [name, unused] : properties_of(schema).items()) names += (names.empty() ? " of " : ", ") + name;
    faults_.add(node.mark,
                fmt::format("{} is empty, must have at least one{}", name_of(where), names.empty() ? " entry" : names));
  }

  // {"oneOf": [{"required": [a]}, {"required": [b]}]}: exactly one of these keys.
  void check_one_key(const Node& node, const Json& alternatives, const Where& where) {
    std::vector<std::string> keys;
    for (const Json& alternative : alternatives) keys.push_back(alternative["required"][0]);
    const NodeEntry* first = nullptr;
    for (const NodeEntry& entry : node.entries) {
      // A duplicate of the same key has been reported as such.
      if (std::find(keys.begin(), keys.end(), entry.key) == keys.end() || (first && first->key == entry.key)) continue;
      if (first) {
        faults_.add(entry.mark, fmt::format("{} has both '{}' and '{}', only one is allowed", name_of(where),
                                            first->key, entry.key));
      } else {
        first = &entry;
      }
    }
    if (first) return;
    std::string names;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      names += (i == 0 ? "'" : i + 1 == keys.size() ? " or '" : ", '") + keys[i] + "'";
    }
    faults_.add(node.mark, fmt::format("missing key in {}: give {}", name_of(where), names));
  }

  // {"not": {"required": [a, b]}}: not both.
  void check_exclusive(const Node& node, const Json& negated, const Where& where) {
    const std::vector<std::string> keys = texts(negated.value("required", Json::array()));
    if (keys.size() != 2 || !node.entry(keys[0]) || !node.entry(keys[1])) return;
    const bool ordered = node.entry(keys[0]) < node.entry(keys[1]);
    faults_.add(node.entry(keys[ordered ? 1 : 0])->mark,
                fmt::format("{} has both '{}' and '{}', only one is allowed", name_of(where), keys[0], keys[1]));
  }

  void check_dependencies(const Node& node, const Json& dependencies, const Where& where) {
    for (const auto& [key, needed] : dependencies.items()) {
      const NodeEntry* entry = node.entry(key);
      if (!entry) continue;
      for (const Json& other : needed) {
        if (node.entry(other.get<std::string>())) continue;
        faults_.add(entry->mark, fmt::format("'{}' needs '{}' in {}", key, other.get<std::string>(), name_of(where)));
      }
    }
  }

  // {"if": {"properties": {key: {const or enum}}, "required": [key]}, "then": ...}, or without "properties": the key is
  // there.
  void check_condition(Node& node, const Json& schema, Where where) {
    const Json& condition = schema["if"];
    if (!fits_keys(node, condition)) return;
    if (!condition.contains("properties")) where.condition = "with " + scalar_text(condition["required"][0]);
    for (const auto& [key, choice] : properties_of(condition).items()) {
      const Node* value = node.find(key);
      const std::vector<std::string> values =
          choice.contains("const") ? texts(Json::array({choice["const"]})) : texts(choice["enum"]);
      if (!value || !is_text(*value) || std::find(values.begin(), values.end(), value->text) == values.end()) return;
      where.condition = fmt::format("with {}: {}", key, value->text);
    }
    check(node, schema["then"], where);
  }

  void check_entries(Node& node, const Json& schema, const Where& where) {
    const Json& known = properties_of(schema);
    const auto other = schema.find("additionalProperties");
    for (NodeEntry& entry : node.entries) {
      if (faults_.full()) return;
      Where below = where;
      below.path = joined_path(where.path, entry.key);
      if (const auto it = known.find(entry.key); it != known.end()) {
        if (is_forbidden(*it)) {
          const std::string why = it->is_object() ? it->value("description", "") : "";
          faults_.add(entry.mark, fmt::format("'{}' in {} has no meaning {}{}", entry.key, name_of(where),
                                              where.condition, why.empty() ? "" : ": " + why));
        } else {
          check(entry.value, *it, below);
        }
      } else if (other != schema.end() && other->is_boolean()) {
        report_unknown_key(entry, known, where);
      } else if (other != schema.end()) {
        below.path = joined_path(where.path, entry.key);
        check(entry.value, *other, below);
      }
    }
  }

  void report_unknown_key(const NodeEntry& entry, const Json& known, const Where& where) {
    faults_.add(entry.mark, fmt::format("unknown key {} in {}{}", in_quotes(entry.key), name_of(where),
                                        suggestion(entry.key, names_in(known))));
  }

  // An unknown key that is similar to an absent key: its value is checked as that of the absent key if the type fits.
  void correct_keys(Node& node, const Json& schema, const Where& where) {
    const auto other = schema.find("additionalProperties");
    if (other == schema.end() || !other->is_boolean()) return;
    const Json& known = properties_of(schema);
    for (NodeEntry& entry : node.entries) {
      if (faults_.full()) return;
      if (known.contains(entry.key)) continue;
      const std::string meant = nearest(entry.key, names_in(known));
      if (meant.empty() || node.entry(meant) || is_forbidden(known[meant])) continue;
      const Json* type = keyword(root_, known[meant], "type");
      const bool is_scalar = type && *type != "object" && *type != "array";
      if (type && !(is_scalar ? entry.value.is_scalar() : fits_type(entry.value, *type))) continue;
      report_unknown_key(entry, known, where);
      entry.key = meant;
    }
  }

  // {mach: twist} if an alternative is {match: ...}; other alternatives have free keys.
  void mend_only_key(Node& node, const Json& alternatives, const Where& where) {
    if (node.entries.size() != 1 || !is_text(node.entries[0].value)) return;
    for (const Json& alternative : alternatives) {
      const Json& known = properties_of(alternative);
      if (known.size() == 1 && !known.contains(node.entries[0].key)) correct_keys(node, alternative, where);
    }
  }

  const Json& root_;
  const std::string& document_;
  FaultList& faults_;
};

// {duration:20}: YAML reads a key without a value. It is reported and split into key and value.
void insert_missing_blanks(Node& node, FaultList& faults) {
  for (Node& item : node.items) insert_missing_blanks(item, faults);
  for (NodeEntry& entry : node.entries) {
    insert_missing_blanks(entry.value, faults);
    const auto meant = entry.value.kind == Node::Kind::null ? key_without_blank(entry.key) : std::nullopt;
    if (!meant) continue;
    faults.add(entry.mark, key_advice(entry.key));
    entry.value.kind = Node::Kind::scalar;
    entry.value.text = std::string(meant->value);
    entry.key = std::string(meant->key);
  }
}

// Duplicates at every level, also below unknown keys. YAML parsers silently keep one of them.
void check_duplicates(const Node& node, const std::string& path, const std::string& document, FaultList& faults) {
  std::map<std::string_view, const NodeEntry*> first;
  for (const NodeEntry& entry : node.entries) {
    const auto [it, fresh] = first.emplace(entry.key, &entry);
    if (!fresh) {
      const int line = it->second->mark.line;
      const std::string earlier = line > 0 ? fmt::format("; first given in line {}", line) : "";
      faults.add(entry.mark, fmt::format("duplicate key {} in {}{}", in_quotes(entry.key),
                                         path.empty() ? document : path, earlier));
    }
    check_duplicates(entry.value, joined_path(path, entry.key), document, faults);
  }
  for (std::size_t i = 0; i < node.items.size(); ++i) {
    check_duplicates(node.items[i], fmt::format("{}[{}]", path, i), document, faults);
  }
}

Node node_from(const Json& value, const Mark& mark) {
  Node node;
  node.mark = mark;
  if (value.is_object()) {
    node.kind = Node::Kind::mapping;
    for (const auto& [key, below] : value.items()) node.entries.push_back({key, mark, node_from(below, mark)});
  } else if (value.is_array()) {
    node.kind = Node::Kind::sequence;
    for (const Json& below : value) node.items.push_back(node_from(below, mark));
  } else {
    node.kind = Node::Kind::scalar;
    node.text = scalar_text(value);
    node.plain = !value.is_string();
  }
  return node;
}

void fill(Node& node, const Json& root, const Json& schema) {
  if (!schema.is_object()) return;
  if (schema.contains("$ref")) fill(node, root, resolve(root, schema["$ref"]));
  for (const Json& part : schema.value("allOf", Json::array())) fill(node, root, part);
  if (schema.contains("anyOf")) {
    if (const Json* chosen = chosen_alternative(root, schema["anyOf"], node)) fill(node, root, *chosen);
  }
  if (node.is_sequence() && schema.contains("items")) {
    for (Node& item : node.items) fill(item, root, schema["items"]);
  }
  if (!node.is_mapping() || !schema.contains("properties")) return;
  for (const auto& [key, property] : schema["properties"].items()) {
    const Json* value = keyword(root, property, "default");
    if (value && !node.entry(key)) node.entries.push_back({key, node.mark, node_from(*value, node.mark)});
    if (Node* below = node.find(key)) fill(*below, root, property);
  }
}

}  // namespace

void check_structure(Node& node, const Json& schema, const std::string& document, FaultList& faults,
                     const std::string& path) {
  insert_missing_blanks(node, faults);
  check_duplicates(node, path, document, faults);
  Where whole;
  whole.path = path;
  Checker(schema, document, faults).check(node, schema, whole);
}

void fill_defaults(Node& node, const Json& schema) { fill(node, schema, schema); }

}  // namespace grapnel
