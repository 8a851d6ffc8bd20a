#include "grapnel/study_files/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "grapnel/scenario/reader.hpp"
#include "grapnel/study/grid.hpp"
#include "grapnel/study_files/study_document.hpp"
#include "grapnel/text/message_text.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Values one by one, or those of a range, as nodes.
std::vector<Node> value_nodes(const AxisFile& file, const Node& node, const std::string& place, FaultList& faults) {
  if (const Node* values = node.find("values")) return values->items;
  // Values rejected by the structure check must only be safe to count.
  const double from = file.from.value_or(0), to = file.to.value_or(1);
  const bool logarithmic = file.spacing == AxisFile::Spacing::logarithmic;
  if (logarithmic && !(from * to > 0)) {
    faults.add(part(node, "spacing").mark,
               fmt::format("{}: logarithmic spacing needs 'from' and 'to' of one sign, neither zero", place));
    return {};
  }
  std::vector<Node> nodes;
  const Node &first = part(node, "from"), &last = part(node, "to");
  for (const double value : spaced_values(from, to, file.count, logarithmic)) {
    nodes.push_back(number_node(value, first.mark));
    nodes.back().unit = first.unit != 0 ? first.unit : last.unit;
  }
  return nodes;
}

void read_path_axis(const AxisFile& file, const Node& node, ReadAxis& axis, const std::vector<Node>& values) {
  axis.shown.name = file.path;
  axis.shown.description = "value of the scenario";
  axis.shown.is_numeric =
      std::all_of(values.begin(), values.end(), [](const Node& value) { return number_of(value).has_value(); });
  for (const Node& value : values) {
    const std::string text = flow_text(value);
    axis.shown.values.push_back({number_of(value).value_or(NAN), text});
    // Errors of the path are reported at the path, errors of the value at the value.
    axis.values.push_back({value.mark, {{file.path, part(node, "path").mark, value, text}}, {}, {}, 0});
  }
}

void read_quantity_axis(const AxisFile& file, const Node& node, ReadAxis& axis, const std::vector<Node>& values,
                        FaultList& faults) {
  ReadQuantity read = read_quantity(file, node, axis.place, faults);
  axis.shown.name = read.name;
  axis.shown.unit = read.unit;
  axis.shown.description = info(read.quantity.kind).description;
  axis.shown.is_numeric = true;
  for (const Node& value : values) {
    const double number = number_of(value).value_or(NAN);
    axis.shown.values.push_back({number, flow_text(value)});
    axis.values.push_back({value.mark, {}, {}, {}, read.in_degrees ? number * std::numbers::pi / 180 : number});
  }
  axis.of_mark = read.of_mark;
  axis.quantity = std::move(read.quantity);
}

void read_labelled_axis(const AxisFile& file, const Node& node, ReadAxis& axis, const std::vector<Node>& values,
                        FaultList& faults) {
  axis.shown.name = file.name;
  check_name(axis.shown.name, part(node, "name").mark, below(axis.place, "name"), faults);
  axis.shown.description = "labelled sets of values";
  for (const Node& value : values) {
    LabelledFile read;
    read_structure(value, labelled_value_description(), &read);
    const std::string& label = read.label;
    const auto same = [&](const AxisValue& other) { return other.label == label; };
    if (!label.empty() && std::any_of(axis.shown.values.begin(), axis.shown.values.end(), same))
      faults.add(part(value, "label").mark, fmt::format("duplicate label {} in {}", in_quotes(label), axis.place));
    axis.shown.values.push_back({NAN, label});
    axis.values.push_back(
        {value.mark, read_changes(part(value, "set")), read.scenario, part(value, "scenario").mark, 0});
  }
}

ReadAxis read_axis(const AxisFile& file, const Node& node, const std::string& place, FaultList& faults) {
  ReadAxis axis;
  axis.mark = node.mark;
  axis.place = place;
  axis.is_range = node.find("from") != nullptr;
  const std::vector<Node> values = value_nodes(file, node, place, faults);
  if (node.find("path"))
    read_path_axis(file, node, axis, values);
  else if (file.quantity)
    read_quantity_axis(file, node, axis, values, faults);
  else if (!node.find("quantity"))
    read_labelled_axis(file, node, axis, values, faults);
  return axis;
}

}  // namespace

ReadQuantity read_quantity(const QuantityFile& file, const Node& node, const std::string& place, FaultList& faults) {
  const QuantityInfo& kind = info(*file.quantity);
  ReadQuantity read;
  read.quantity.kind = kind.kind;
  read.quantity.of = kind.of_grasp ? file.grasp : file.target;
  read.of_mark = part(node, kind.of_grasp ? "grasp" : "target").mark;
  if (node.find("axis")) read.quantity.axis = unit_vector_at(node, "axis", place, faults);
  if (node.find("direction")) read.quantity.direction = unit_vector_at(node, "direction", place, faults);
  read.in_degrees = kind.is_angular && file.unit == AngleUnit::deg;
  read.name = (read.quantity.of.empty() ? "" : read.quantity.of + ".") + name_of(kind.kind);
  read.unit = kind.unit;
  if (read.in_degrees) read.unit.replace(0, 3, "deg");
  return read;
}

std::vector<ReadAxis> read_axes(const std::vector<AxisFile>& files, const Node& list, const std::string& key,
                                FaultList& faults) {
  std::vector<ReadAxis> axes;
  for (std::size_t i = 0; i < files.size(); ++i) {
    ReadAxis axis = read_axis(files[i], list.items[i], item(key, i), faults);
    for (const ReadAxis& other : axes) {
      if (other.shown.name == axis.shown.name && !axis.shown.name.empty())
        faults.add(axis.mark,
                   fmt::format("{} varies {}, as {} does", axis.place, in_quotes(axis.shown.name), other.place));
    }
    axes.push_back(std::move(axis));
  }
  return axes;
}

std::vector<Change> changes_at(const std::vector<Change>& set, const std::vector<ReadAxis>& axes,
                               std::span<const std::size_t> at) {
  std::vector<Change> all = set;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    const std::vector<Change>& changes = axes[a].values[at[a]].changes;
    all.insert(all.end(), changes.begin(), changes.end());
  }
  return all;
}

std::vector<QuantityValue> quantities_at(const std::vector<ReadAxis>& axes, std::span<const std::size_t> at) {
  std::vector<QuantityValue> quantities;
  for (std::size_t a = 0; a < axes.size(); ++a) {
    if (axes[a].quantity) quantities.push_back({*axes[a].quantity, axes[a].values[at[a]].quantity});
  }
  return quantities;
}

}  // namespace grapnel
