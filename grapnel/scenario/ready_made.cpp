#include "grapnel/scenario/ready_made.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/parse_yaml.hpp"

namespace grapnel {
namespace {

std::string_view kind_name(ReadyMade::Kind kind) {
  switch (kind) {
    case ReadyMade::Kind::robots:
      return "robot";
    case ReadyMade::Kind::targets:
      return "target";
    case ReadyMade::Kind::templates:
      break;
  }
  return "template";
}

// The leading comment of a text, after the line with the schema for editors.
std::string first_sentence(std::string_view text) {
  std::string sentence;
  if (text.starts_with("# yaml-language-server: ")) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  while (text.starts_with("# ")) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    sentence += (sentence.empty() ? "" : " ") + std::string(text.substr(2, end - 2));
    text.remove_prefix(std::min(end + 1, text.size()));
    if (const std::size_t stop = sentence.find(". "); stop != std::string::npos) return sentence.substr(0, stop + 1);
  }
  return sentence;
}

}  // namespace

std::string ReadyMade::source() const { return fmt::format("ready-made {} {}", kind_name(kind), name); }

std::string ReadyMade::description() const {
  FaultList faults;
  const auto tree = parse_document(std::string(text), std::make_shared<const std::string>(source()), faults);
  const Node* found = tree ? tree->find("description") : nullptr;
  return found ? found->text : first_sentence(text);
}

std::vector<ReadyMade> ready_made(ReadyMade::Kind kind) {
  std::vector<ReadyMade> some;
  for (const ReadyMade& one : all_ready_made()) {
    if (one.kind == kind) some.push_back(one);
  }
  return some;
}

const ReadyMade* find_ready_made(ReadyMade::Kind kind, std::string_view name) {
  for (const ReadyMade& one : all_ready_made()) {
    if (one.kind == kind && one.name == name) return &one;
  }
  return nullptr;
}

bool is_ready_made_name(std::string_view text) {
  return !text.empty() && text.find_first_of("./\\") == std::string_view::npos;
}

std::string no_ready_made(ReadyMade::Kind kind, std::string_view name) {
  // A name that begins with the text ("envisat"), else the nearest spelling.
  std::vector<std::string> names, beginning;
  for (const ReadyMade& one : ready_made(kind)) {
    names.emplace_back(one.name);
    if (name.size() >= 3 && one.name.starts_with(name)) beginning.emplace_back(one.name);
  }
  const std::string near = beginning.size() == 1 ? beginning[0] : nearest(name, names);
  return fmt::format(
      "no ready-made {} {}; {}", kind_name(kind), in_quotes(name),
      near.empty() ? fmt::format("there are {}", some_of(names)) : fmt::format("did you mean '{}'?", near));
}

}  // namespace grapnel
