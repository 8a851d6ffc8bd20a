#include "grapnel/scenario/read_study_axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/study/grid.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Values one by one, or those of a range, as nodes.
std::vector<Node> value_nodes(const Node& node, const std::string& place, FaultList& faults) {
  if (const Node* values = node.find("values")) return values->items;
  const double from = number_at(node, "from").value_or(0), to = number_at(node, "to").value_or(1);
  // What the check of the structure refuses must only be safe to count.
  const double count = std::clamp(number_at(node, "count").value_or(2), 2.0, 1e6);
  const bool logarithmic = text_at(node, "spacing") == "logarithmic";
  if (logarithmic && !(from * to > 0)) {
    faults.add(part(node, "spacing").mark,
               fmt::format("{}: logarithmic spacing needs 'from' and 'to' of one sign, neither zero", place));
    return {};
  }
  std::vector<Node> nodes;
  for (const double value : spaced_values(from, to, static_cast<std::size_t>(count), logarithmic))
    nodes.push_back(number_node(value, part(node, "from").mark));
  return nodes;
}

void read_path_axis(const Node& node, ReadAxis& axis, const std::vector<Node>& values) {
  const std::string path = text_at(node, "path");
  axis.shown.name = path;
  axis.shown.description = "value of the scenario";
  axis.shown.is_numeric =
      std::all_of(values.begin(), values.end(), [](const Node& value) { return number_of(value).has_value(); });
  for (const Node& value : values) {
    const std::string text = flow_text(value);
    axis.shown.values.push_back({number_of(value).value_or(NAN), text});
    // What is wrong with the path is said at the path, what is wrong with the value at the value.
    axis.values.push_back({value.mark, {{path, part(node, "path").mark, value, text}}, {}, {}, 0});
  }
}

void read_quantity_axis(const Node& node, ReadAxis& axis, const std::vector<Node>& values, FaultList& faults) {
  const QuantityInfo* kind = quantity_named(text_at(node, "quantity"));
  if (!kind) return;
  Quantity quantity;
  quantity.kind = kind->kind;
  const char* of_key = kind->of_grasp ? "grasp" : "target";
  quantity.of = text_at(node, of_key);
  axis.of_mark = part(node, of_key).mark;
  if (node.find("axis")) quantity.axis = unit_vector_at(node, "axis", axis.place, faults);
  if (node.find("direction")) quantity.direction = unit_vector_at(node, "direction", axis.place, faults);
  const bool degrees = kind->is_angular && text_at(node, "unit") == "deg";
  axis.shown.name = (quantity.of.empty() ? "" : quantity.of + ".") + kind->name;
  axis.shown.unit = kind->unit;
  if (degrees) axis.shown.unit.replace(0, 3, "deg");
  axis.shown.description = kind->description;
  axis.shown.is_numeric = true;
  for (const Node& value : values) {
    const double number = number_of(value).value_or(NAN);
    axis.shown.values.push_back({number, flow_text(value)});
    axis.values.push_back({value.mark, {}, {}, {}, degrees ? number * std::numbers::pi / 180 : number});
  }
  axis.quantity = std::move(quantity);
}

void read_labelled_axis(const Node& node, ReadAxis& axis, const std::vector<Node>& values, FaultList& faults) {
  axis.shown.name = text_at(node, "name");
  check_name(axis.shown.name, part(node, "name").mark, below(axis.place, "name"), faults);
  axis.shown.description = "labelled sets of values";
  for (const Node& value : values) {
    const std::string label = text_at(value, "label");
    const auto same = [&](const AxisValue& other) { return other.label == label; };
    if (!label.empty() && std::any_of(axis.shown.values.begin(), axis.shown.values.end(), same))
      faults.add(part(value, "label").mark, fmt::format("duplicate label {} in {}", in_quotes(label), axis.place));
    axis.shown.values.push_back({NAN, label});
    axis.values.push_back(
        {value.mark, read_changes(part(value, "set")), text_at(value, "scenario"), part(value, "scenario").mark, 0});
  }
}

}  // namespace

std::vector<Change> read_changes(const Node& mapping) {
  std::vector<Change> changes;
  for (const NodeEntry& e : mapping.entries) changes.push_back({e.key, e.mark, e.value, flow_text(e.value)});
  return changes;
}

ReadAxis read_study_axis(const Node& node, const std::string& place, FaultList& faults) {
  ReadAxis axis;
  axis.mark = node.mark;
  axis.place = place;
  axis.is_range = node.find("from") != nullptr;
  const std::vector<Node> values = value_nodes(node, place, faults);
  if (node.find("path"))
    read_path_axis(node, axis, values);
  else if (node.find("quantity"))
    read_quantity_axis(node, axis, values, faults);
  else
    read_labelled_axis(node, axis, values, faults);
  return axis;
}

}  // namespace grapnel
