#include "grapnel/scenario/flow_text.hpp"

#include "grapnel/scenario/plain_scalar.hpp"

namespace grapnel {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else
      out += c;
  }
  return out + "\"";
}

std::string scalar_text(const std::string& text, bool plain) {
  const bool simple = plain && !text.empty() && text.find_first_of(",[]{}:#\"'&*!|>%@`\n\t") == std::string::npos;
  return simple ? text : quoted(text);
}

}  // namespace

std::string flow_text(const Node& node) {
  std::string out;
  switch (node.kind) {
    case Node::Kind::null:
      return "null";
    case Node::Kind::scalar:
      return scalar_text(node.text, node.plain);
    case Node::Kind::sequence:
      for (const Node& item : node.items) out += (out.empty() ? "" : ", ") + flow_text(item);
      return "[" + out + "]";
    case Node::Kind::mapping:
      for (const NodeEntry& e : node.entries)
        out += (out.empty() ? "" : ", ") + scalar_text(e.key, true) + ": " + flow_text(e.value);
      break;
  }
  return "{" + out + "}";
}

}  // namespace grapnel
