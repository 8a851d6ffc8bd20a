#include "grapnel/text/write_yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kLineLength = 120;

// Texts that the parser reads as null, so that they need quotes.
bool looks_empty(std::string_view text) {
  return text.empty() || text == "~" || text == "null" || text == "Null" || text == "NULL";
}

// Whether a text is safe without quotes at any place. Conservative: extra quotes are harmless.
bool is_simple(std::string_view text) {
  if (looks_empty(text) || text == "=" || text == "<<") return false;
  const auto plain = [](unsigned char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || c == '.' ||
           c == '+' || c == '-' || c == '/' || c == '(' || c == ')' || c == '^' || c == ' ' || c >= 0x80;
  };
  if (!std::all_of(text.begin(), text.end(), plain)) return false;
  if (text.front() == ' ' || text.back() == ' ') return false;
  // "- ", "--- " and "..." are YAML markers.
  return !(text.starts_with("-") && (text.size() == 1 || text[1] == ' ' || text[1] == '-')) && !text.starts_with("...");
}

std::string in_double_quotes(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      out += {'\\', c};
    else if (c == '\n')
      out += "\\n";
    else if (c == '\t')
      out += "\\t";
    else if (byte < 0x20 || byte == 0x7f)
      out += fmt::format("\\x{:02x}", byte);
    else
      out += c;
  }
  return out + "\"";
}

std::string scalar(const Node& node) {
  return node.plain && is_simple(node.text) ? node.text : in_double_quotes(node.text);
}
std::string key_text(const std::string& key) { return is_simple(key) ? key : in_double_quotes(key); }

std::string flow(const Node& node) {
  std::string out;
  switch (node.kind) {
    case Node::Kind::null:
      return "null";
    case Node::Kind::scalar:
      return scalar(node);
    case Node::Kind::sequence:
      for (const Node& item : node.items) out += (out.empty() ? "" : ", ") + flow(item);
      return "[" + out + "]";
    case Node::Kind::mapping:
      for (const NodeEntry& e : node.entries) out += (out.empty() ? "" : ", ") + key_text(e.key) + ": " + flow(e.value);
      break;
  }
  return "{" + out + "}";
}

bool is_leaf(const Node& node) { return node.items.empty() && node.entries.empty(); }

// "# " before each line; a character that ends a line elsewhere would end the comment.
std::string comment_lines(const std::string& comment, const std::string& indent) {
  std::string out;
  for (std::size_t at = 0; at < comment.size();) {
    const std::size_t end = std::min(comment.find('\n', at), comment.size());
    const std::string line = printable_lines(std::string_view(comment).substr(at, end - at));
    out += line.empty() ? "#\n" : "# " + line + "\n";
    at = end + 1;
    out += indent;
  }
  return out;
}

// Flow style cannot hold comments of its items.
bool has_comments(const Node& node) {
  const auto in = [](const Node& below) { return !below.comment.empty() || has_comments(below); };
  return std::any_of(node.items.begin(), node.items.end(), in) ||
         std::any_of(node.entries.begin(), node.entries.end(), [&](const NodeEntry& e) { return in(e.value); });
}

// Lists and mappings with more than scalars and short lists are written on separate lines.
bool is_flat(const Node& node) {
  const auto flat = [](const Node& below) {
    return is_leaf(below) || (below.is_sequence() && std::all_of(below.items.begin(), below.items.end(), is_leaf));
  };
  return std::all_of(node.items.begin(), node.items.end(), flat) &&
         std::all_of(node.entries.begin(), node.entries.end(), [&](const NodeEntry& e) { return flat(e.value); });
}

class Writer {
 public:
  std::string out;

  // A list or mapping with items on separate lines. The first item starts at the end of the text.
  void block(const Node& node, std::size_t indent) {
    bool first = true;
    const auto begin_line = [&](const Node& value) {
      const std::string blanks(indent, ' ');
      if (!first) out += blanks;
      first = false;
      out += comment_lines(value.comment, blanks);
    };
    for (const Node& item : node.items) {
      begin_line(item);
      out += "- ";
      if (fits(item, indent + 2))
        out += flow(item) + "\n";
      else
        block(item, indent + 2);
    }
    for (const NodeEntry& e : node.entries) {
      begin_line(e.value);
      const std::string key = key_text(e.key) + ":";
      out += key;
      if (fits(e.value, indent + key.size() + 1)) {
        out += " " + flow(e.value) + "\n";
        continue;
      }
      out += "\n";
      out.append(indent + 2, ' ');
      block(e.value, indent + 2);
    }
  }

 private:
  static bool fits(const Node& node, std::size_t column) {
    return is_leaf(node) || (is_flat(node) && !has_comments(node) && column + flow(node).size() <= kLineLength);
  }
};

std::string double_quotes_in_flow(const std::string& text) {
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

std::string scalar_in_flow(const std::string& text, bool plain) {
  const bool simple = plain && !text.empty() && text.find_first_of(",[]{}:#\"'&*!|>%@`\n\t") == std::string::npos;
  return simple ? text : double_quotes_in_flow(text);
}

}  // namespace

std::string yaml_text(const Node& tree, const std::string& comment) {
  Writer writer;
  writer.out += comment_lines(comment, "");
  if (is_leaf(tree))
    writer.out += flow(tree) + "\n";
  else
    writer.block(tree, 0);
  return writer.out;
}

std::string flow_text(const Node& node) {
  std::string out;
  switch (node.kind) {
    case Node::Kind::null:
      return "null";
    case Node::Kind::scalar:
      return scalar_in_flow(node.text, node.plain);
    case Node::Kind::sequence:
      for (const Node& item : node.items) out += (out.empty() ? "" : ", ") + flow_text(item);
      return "[" + out + "]";
    case Node::Kind::mapping:
      for (const NodeEntry& e : node.entries)
        out += (out.empty() ? "" : ", ") + scalar_in_flow(e.key, true) + ": " + flow_text(e.value);
      break;
  }
  return "{" + out + "}";
}

}  // namespace grapnel
