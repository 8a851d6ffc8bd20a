#include "grapnel/scenario/number_nodes.hpp"

#include <fmt/format.h>

#include <cmath>

#include "grapnel/scenario/plain_scalar.hpp"

namespace grapnel {

Node number_node(double value, const Mark& mark) {
  Node node;
  node.kind = Node::Kind::scalar;
  node.mark = mark;
  node.text = fmt::format("{}", value);  // the shortest that reads back to the same double
  return node;
}

Node list_node(std::span<const double> values, const Mark& mark) {
  Node node;
  node.kind = Node::Kind::sequence;
  node.mark = mark;
  for (const double value : values) node.items.push_back(number_node(value, mark));
  return node;
}

std::optional<std::vector<double>> numbers_in(const Node& value) {
  std::vector<double> numbers;
  const auto take = [&](const Node& node) {
    const auto number = number_of(node);
    if (!number || !std::isfinite(*number)) return false;
    numbers.push_back(*number);
    return true;
  };
  if (value.is_scalar()) {
    if (!take(value)) return {};
  } else {
    for (const Node& item : value.items) {
      if (!take(item)) return {};
    }
    for (const NodeEntry& entry : value.entries) {
      if (!take(entry.value)) return {};
    }
  }
  if (numbers.empty()) return {};
  return numbers;
}

Node with_numbers(Node form, std::span<const double> numbers, const Mark& mark) {
  form.mark = mark;
  if (form.is_scalar()) return number_node(numbers[0], mark);
  std::size_t at = 0;
  for (Node& item : form.items) item = number_node(numbers[at++], mark);
  for (NodeEntry& entry : form.entries) entry.value = number_node(numbers[at++], mark), entry.mark = mark;
  return form;
}

std::string number_name(const Node& form, std::size_t index) {
  if (form.is_scalar()) return {};
  if (form.is_mapping()) return form.entries[index].key;
  if (form.items.size() == 3) return std::string(1, "xyz"[index]);
  return fmt::format("{}", index);
}

}  // namespace grapnel
