#include "grapnel/text/yaml_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"

namespace grapnel {
namespace {

// What identifies an item of a list: its name, or for a grasp the end-effector.
std::string label_of(const Node& item) {
  for (const char* key : {"name", "end_effector"}) {
    const Node* name = item.find(key);
    if (name && name->is_scalar()) return name->text;
  }
  return {};
}

bool ends_segment(std::string_view rest, std::size_t length) {
  return length == rest.size() || rest[length] == '.' || rest[length] == '[';
}

// Follows a path. Names may contain dots: the longest existing name is used.
class Walker {
 public:
  Walker(std::string_view path, const Mark& mark, FaultList& faults)
      : rest_(path), path_(path), mark_(mark), faults_(faults) {}

  // The node that the path names, created where mappings lack it; null after a fault.
  Node* walk(Node& root) {
    if (rest_.empty()) return fail("the path before '=' is empty");
    Node* node = &root;
    for (int depth = 0; !rest_.empty(); ++depth) {
      if (depth >= kDeepest) return fail(fmt::format("the path is deeper than {} levels", kDeepest));
      node = rest_[0] == '[' ? by_index(*node) : by_name(*node, depth == 0);
      if (!node) return nullptr;
    }
    return node;
  }

  std::vector<PathStep> steps() && { return std::move(steps_); }

 private:
  std::nullptr_t fail(const std::string& message) {
    faults_.add(mark_, message);
    return nullptr;
  }
  std::string walked() const {
    const std::string_view done = path_.substr(0, path_.size() - rest_.size());
    return done.empty() ? "the scenario" : shortened(done);
  }

  Node* by_index(Node& node) {
    const std::size_t close = rest_.find(']');
    const std::string_view digits = rest_.substr(1, close == std::string_view::npos ? close : close - 1);
    std::size_t index = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    const bool number = error == std::errc() && end == digits.data() + digits.size() && close != std::string_view::npos;
    if (!number || !ends_segment(rest_, close + 1))
      return fail(fmt::format("{} is not an index such as [0]", in_quotes(rest_)));
    if (!node.is_sequence()) return fail(fmt::format("{} is not a list", walked()));
    if (index >= node.items.size()) {
      return fail(fmt::format("{} has {}, so there is no [{}]", walked(), counted(node.items.size(), "item"), index));
    }
    rest_.remove_prefix(close + 1);
    steps_.push_back({{}, index, true});
    return &node.items[index];
  }

  Node* by_name(Node& node, bool first) {
    const std::string here = walked();
    if (!first && rest_[0] == '.')
      rest_.remove_prefix(1);
    else if (!first)
      return fail(fmt::format("{} must follow a '.'", in_quotes(rest_)));
    if (node.is_sequence()) return item_of(node, here);
    // An absent or empty value becomes a mapping; an existing value is never replaced by a mapping.
    if (node.kind == Node::Kind::null) node.kind = Node::Kind::mapping;
    if (!node.is_mapping()) return fail(fmt::format("{} is a value without keys", here));
    std::size_t longest = 0;
    for (const NodeEntry& entry : node.entries) {
      if (matches(entry.key)) longest = std::max(longest, entry.key.size());
    }
    if (longest == 0) longest = std::min(rest_.find_first_of(".["), rest_.size());
    if (longest == 0) return fail("the path has an empty name");
    const std::string key(rest_.substr(0, longest));
    rest_.remove_prefix(longest);
    steps_.push_back({key, 0, false});
    if (Node* found = node.find(key)) return found;
    node.entries.push_back({key, mark_, Node{}});
    node.entries.back().value.mark = mark_;
    return &node.entries.back().value;
  }

  Node* item_of(Node& list, const std::string& here) {
    Node* best = nullptr;
    std::size_t longest = 0;
    std::vector<std::string> labels;
    for (Node& item : list.items) {
      labels.push_back(label_of(item));
      if (matches(labels.back()) && labels.back().size() > longest) best = &item, longest = labels.back().size();
    }
    if (best) {
      rest_.remove_prefix(longest);
      steps_.push_back({{}, static_cast<std::size_t>(best - list.items.data()), true});
      return best;
    }
    const std::string_view wanted = rest_.substr(0, rest_.find_first_of(".["));
    std::erase(labels, "");
    if (labels.empty() && !list.items.empty())
      return fail(fmt::format("no item {} in {}, a list whose items have no names: they are [0]{}", in_quotes(wanted),
                              here, list.items.size() > 1 ? fmt::format(" to [{}]", list.items.size() - 1) : ""));
    return fail(fmt::format("no item {} in {}{}", in_quotes(wanted), here, suggestion(wanted, labels, "items")));
  }

  bool matches(std::string_view name) const {
    return !name.empty() && rest_.starts_with(name) && ends_segment(rest_, name.size());
  }

  std::string_view rest_;
  std::string_view path_;
  const Mark& mark_;
  FaultList& faults_;
  std::vector<PathStep> steps_;
};

}  // namespace

Override parse_override(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw InputError({{"--set " + argument, 0, 0, "must be path=value, such as approach.duration=10"}});
  }
  return {argument.substr(0, equals), argument.substr(equals + 1)};
}

std::string override_text(const Override& change) { return "--set " + change.path + "=" + change.value; }

void apply_change(Node& root, const Change& change, FaultList& faults) {
  if (Node* place = Walker(change.path, change.mark, faults).walk(root)) *place = change.value;
}

std::optional<Node> value_at(Node root, const std::string& path) {
  FaultList absent;
  const Mark nowhere;
  const Node* place = Walker(path, nowhere, absent).walk(root);
  if (!place || place->kind == Node::Kind::null) return {};
  return *place;
}

std::vector<PathStep> path_steps(Node root, const std::string& path, const Mark& mark, FaultList& faults) {
  Walker walker(path, mark, faults);
  if (!walker.walk(root)) return {};
  return std::move(walker).steps();
}

}  // namespace grapnel
