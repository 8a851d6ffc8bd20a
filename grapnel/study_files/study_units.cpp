#include "grapnel/study_files/study_units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <initializer_list>

#include "grapnel/scenario/schema.hpp"
#include "grapnel/study/quantity.hpp"
#include "grapnel/text/units.hpp"

namespace grapnel {
namespace {

// Numbers, also those in lists and mappings.
void take_all(Node& value, const std::string& stated, const std::string& name, FaultList& faults) {
  if (value.is_scalar()) take_unit(value, stated, name, faults);
  for (std::size_t i = 0; i < value.items.size(); ++i) take_all(value.items[i], stated, item(name, i), faults);
  for (NodeEntry& entry : value.entries) take_all(entry.value, stated, below(name, entry.key), faults);
}

void take_keys(Node* mapping, std::initializer_list<const char*> keys, const std::string& stated,
               const std::string& name, FaultList& faults) {
  if (!mapping || stated.empty()) return;
  for (const char* key : keys) {
    if (Node* value = mapping->find(key)) take_all(*value, stated, below(name, key), faults);
  }
}

std::string text_of(const Node& mapping, std::string_view key) {
  const Node* node = mapping.find(key);
  return node && node->is_scalar() ? node->text : std::string();
}

// Unit of an axis or a variable: of the value at a path, or of a quantity. Empty if it is unknown, or has none.
std::string unit_of(const Node& entry) {
  if (const std::string path = text_of(entry, "path"); !path.empty()) return place_rule(path).unit;
  const auto quantity = value_named<QuantityKind>(text_of(entry, "quantity"));
  if (!quantity) return entry.find("posture") ? "rad" : "";
  std::string unit = info(*quantity).unit;
  if (info(*quantity).is_angular && text_of(entry, "unit") == "deg") unit.replace(0, 3, "deg");
  return unit;
}

void take_axes(Node* list, const std::string& key, FaultList& faults) {
  for (std::size_t i = 0; list && i < list->items.size(); ++i) {
    Node& axis = list->items[i];
    take_keys(&axis, {"values", "from", "to"}, unit_of(axis), item(key, i), faults);
  }
}

// The unit of all numbers at an uncertain value's path or paths; empty if they differ, or if they are factors.
std::string unit_of_uncertain(const Node& entry) {
  if (text_of(entry, "as") == "factor") return {};
  std::vector<std::string> paths{text_of(entry, "path")};
  if (const Node* several = entry.find("paths"); several && several->is_sequence()) {
    paths.clear();
    for (const Node& path : several->items) paths.push_back(path.text);
  }
  std::string common;
  for (const std::string& path : paths) {
    const std::string unit = place_rule(path).unit;
    if (unit.empty() || (!common.empty() && common != unit)) return {};
    common = unit;
  }
  return common;
}

// "rad^2" as a product: "rad rad", "m m/s/s". Empty for a place that has one of several units.
std::string squared(const std::string& unit) {
  if (units_of_place(unit).size() != 1) return {};
  const std::size_t slash = unit.find('/');
  const std::string over = unit.substr(0, slash), under = slash == std::string::npos ? "" : unit.substr(slash);
  return over + " " + over + under + under;
}

void take_length(Node* length, const std::string& unit, const std::string& name, FaultList& faults) {
  if (!length || unit.empty()) return;
  if (length->is_scalar()) take_all(*length, unit, name, faults);
  take_keys(length->find("normal"), {"mean", "deviation", "from", "to"}, unit, name + ".normal", faults);
  take_keys(length->find("log_normal"), {"median", "from", "to"}, unit, name + ".log_normal", faults);
  take_keys(length->find("uniform"), {"from", "to"}, unit, name + ".uniform", faults);
}

void take_uncertain(Node& entry, const std::string& name, FaultList& faults) {
  const std::string unit = unit_of_uncertain(entry);
  Node* const normal = entry.find("normal");
  take_keys(normal, {"mean", "deviation", "from", "to"}, unit, name + ".normal", faults);
  take_keys(normal, {"covariance"}, squared(unit), name + ".normal", faults);
  take_keys(entry.find("log_normal"), {"median", "from", "to"}, unit, name + ".log_normal", faults);
  take_keys(entry.find("uniform"), {"from", "to"}, unit, name + ".uniform", faults);
  take_keys(entry.find("discrete"), {"values"}, unit, name + ".discrete", faults);
  if (Node* sphere = entry.find("sphere")) take_length(sphere->find("length"), unit, name + ".sphere.length", faults);
}

// A limit's bound has the unit of its column, which depends on the scenario: limits_of() compares the dimensions.
void take_bounds(Node& limit, const std::string& name, FaultList& faults) {
  for (const char* key : {"at_most", "at_least"}) {
    Node* const bound = limit.find(key);
    if (!bound || !bound->is_scalar()) continue;
    const auto parts = number_and_unit(bound->text);
    if (parts && unit_named(parts->unit)) take_unit(*bound, std::string(parts->unit), below(name, key), faults);
  }
}

}  // namespace

void take_study_units(Node& root, FaultList& faults) {
  for (const char* key : {"axes", "design"}) take_axes(root.find(key), key, faults);
  if (Node* list = root.find("variables")) {
    for (std::size_t i = 0; i < list->items.size(); ++i)
      take_keys(&list->items[i], {"from", "to"}, unit_of(list->items[i]), item("variables", i), faults);
  }
  if (Node* list = root.find("limits")) {
    for (std::size_t i = 0; i < list->items.size(); ++i) take_bounds(list->items[i], item("limits", i), faults);
  }
  if (Node* list = root.find("uncertain")) {
    for (std::size_t i = 0; i < list->items.size(); ++i) take_uncertain(list->items[i], item("uncertain", i), faults);
  }
}

void check_joint_units(const Node& value, const std::string& stated, const std::vector<std::string>& units,
                       const std::string& name, FaultList& faults) {
  const std::vector<std::string_view> possible = units_of_place(stated);
  if (possible.size() < 2) return;
  const auto check = [&](const Node& number, const std::string& unit, const std::string& what) {
    if (number.unit == 0 || number.unit > possible.size()) return true;
    const std::string_view given = possible[number.unit - 1u];
    if (unit == given || std::find(possible.begin(), possible.end(), unit) == possible.end()) return true;
    faults.add(number.mark, fmt::format("{} is in {}; expected {}", what, given, expected_of(unit)));
    return false;
  };
  if (value.is_scalar()) {
    // One unit for all numbers: one error is enough.
    std::all_of(units.begin(), units.end(), [&](const std::string& unit) { return check(value, unit, name); });
  }
  for (std::size_t i = 0; i < value.items.size() && i < units.size(); ++i)
    check(value.items[i], units[i], item(name, i));
}

}  // namespace grapnel
