#include "grapnel/text/parse_yaml.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string_view>

#include "grapnel/text/syntax_mistake.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Ends the parsing at the first error.
struct Refusal {
  YAML::Mark mark;
  std::string message;
  bool of_syntax = false;  // the cause may be elsewhere
};

// yaml-cpp counts columns in bytes from 0; editors count characters from 1.
class Places {
 public:
  Places(std::string_view text, std::shared_ptr<const std::string> source) : text_(text), source_(std::move(source)) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      if (text[i] != '\n') continue;
      line_starts_.push_back(i + 1);
      characters_before_line_.push_back(characters_until(i + 1));
    }
  }
  Mark at(const YAML::Mark& mark) const {
    const std::size_t line = static_cast<std::size_t>(std::max(mark.line, 0));
    const std::size_t column = static_cast<std::size_t>(std::max(mark.column, 0));
    if (line >= line_starts_.size()) return {source_, static_cast<int>(line) + 1, 1};
    return in_line(line, std::min(line_starts_[line] + column, text_.size()));
  }
  Mark at(std::size_t byte) const {
    const auto after = std::upper_bound(line_starts_.begin(), line_starts_.end(), byte);
    return in_line(static_cast<std::size_t>(after - line_starts_.begin()) - 1, byte);
  }
  /// Whether a quoted scalar ends. The parser accepts the end of the file in place of the missing quote.
  bool quote_is_closed(const YAML::Mark& mark) const {
    const std::size_t line = static_cast<std::size_t>(std::max(mark.line, 0));
    if (line >= line_starts_.size()) return true;
    std::size_t at = line_starts_[line] + static_cast<std::size_t>(std::max(mark.column, 0));
    // The location of a scalar with an anchor or a tag is that of the anchor or tag.
    while (at < text_.size() && (text_[at] == '&' || text_[at] == '!')) {
      at = text_.find_first_not_of(" \t\r\n", std::min(text_.find_first_of(" \t\r\n", at), text_.size()));
    }
    if (at >= text_.size() || (text_[at] != '"' && text_[at] != '\'')) return true;  // a block scalar
    const char quote = text_[at];
    for (++at; at < text_.size(); ++at) {
      // A backslash in double quotes, or a doubled single quote, also consumes the next character.
      const bool doubled = quote == '\'' && text_.substr(at, 2) == "''";
      if ((text_[at] == '\\' && quote == '"') || doubled)
        ++at;
      else if (text_[at] == quote)
        return true;
    }
    return false;
  }

 private:
  Mark in_line(std::size_t line, std::size_t byte) const {
    return {source_, static_cast<int>(line) + 1,
            static_cast<int>(characters_until(byte) - characters_before_line_[line]) + 1};
  }
  // Number of characters in the first bytes of the text, counted from the last result: locations come nearly in order,
  // and a file may be one long line.
  std::size_t characters_until(std::size_t bytes) const {
    const auto starts = [&](std::size_t from, std::size_t to) {
      return static_cast<std::size_t>(std::count_if(
          text_.begin() + static_cast<std::ptrdiff_t>(from), text_.begin() + static_cast<std::ptrdiff_t>(to),
          [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
    };
    if (bytes >= known_bytes_)
      known_characters_ += starts(known_bytes_, bytes);
    else
      known_characters_ -= starts(bytes, known_bytes_);
    known_bytes_ = bytes;
    return known_characters_;
  }

  std::string_view text_;
  std::shared_ptr<const std::string> source_;
  std::vector<std::size_t> line_starts_{0}, characters_before_line_{0};
  mutable std::size_t known_bytes_ = 0, known_characters_ = 0;
};

int height(const Node& node) {
  int below = 0;
  for (const Node& item : node.items) below = std::max(below, height(item));
  for (const NodeEntry& entry : node.entries) below = std::max(below, height(entry.value));
  return below + 1;
}

std::size_t value_count(const Node& node) {
  std::size_t count = 1;
  for (const Node& item : node.items) count += value_count(item);
  for (const NodeEntry& entry : node.entries) count += value_count(entry.value);
  return count;
}

// Builds the tree. Aliases are replaced by copies, so that an override changes one place only; depth and count are
// checked before anything grows.
class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const Places& places) : places_(places) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { put(mark, {}, anchor); }
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    if (tag != "?" && !places_.quote_is_closed(mark)) throw Refusal{mark, "this quote is not closed", true};
    Node node;
    node.kind = Node::Kind::scalar;
    node.text = value;
    // "!" means quotes, "?" no quotes; !!str makes any scalar a text, other tags have no effect.
    node.plain = tag != "!" && tag != "tag:yaml.org,2002:str";
    put(mark, std::move(node), anchor);
  }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto it = anchored_.find(anchor);
    if (it == anchored_.end()) throw Refusal{mark, "the alias is inside the value that it refers to"};
    count(mark, value_count(it->second));
    if (static_cast<int>(open_.size()) + height(it->second) > kDeepest) throw Refusal{mark, too_deep()};
    place(mark, it->second);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    open(mark, Node::Kind::sequence, anchor);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    open(mark, Node::Kind::mapping, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

  std::optional<Node> take_root() { return std::move(root_); }
  /// The start of the innermost open list or mapping.
  std::optional<YAML::Mark> innermost_open() const {
    return open_.empty() ? std::nullopt : std::optional(open_.back().mark);
  }

 private:
  struct Open {
    Node node;
    YAML::anchor_t anchor;
    YAML::Mark mark;
    std::optional<NodeEntry> waiting;  // a key whose value follows
  };

  static std::string too_deep() { return fmt::format("nested deeper than {} levels", kDeepest); }

  void count(const YAML::Mark& mark, std::size_t more) {
    count_ += more;
    if (count_ > kMostValues) throw Refusal{mark, fmt::format("more than {} values (aliases expanded)", kMostValues)};
  }
  void open(const YAML::Mark& mark, Node::Kind kind, YAML::anchor_t anchor) {
    if (static_cast<int>(open_.size()) >= kDeepest) throw Refusal{mark, too_deep()};
    if (expects_key()) {
      throw Refusal{mark, "a list or mapping in place of a key; is a bracket not closed?", true};
    }
    count(mark, 1);
    Node node;
    node.kind = kind;
    node.mark = places_.at(mark);
    open_.push_back({std::move(node), anchor, mark, {}});
  }
  void close() {
    Open done = std::move(open_.back());
    open_.pop_back();
    join_decimal_commas(done.node.entries);
    remember(done.mark, done.node, done.anchor);
    place(done.mark, std::move(done.node));
  }
  void put(const YAML::Mark& mark, Node node, YAML::anchor_t anchor) {
    count(mark, 1);
    node.mark = places_.at(mark);
    remember(mark, node, anchor);
    place(mark, std::move(node));
  }
  void remember(const YAML::Mark& mark, const Node& node, YAML::anchor_t anchor) {
    if (anchor == YAML::NullAnchor) return;
    count(mark, value_count(node));
    anchored_[anchor] = node;
  }
  // {a: 0,5} is a: 0 and a key 5 without a value, which is an error: the text "0,5" gives a specific message.
  static void join_decimal_commas(std::vector<NodeEntry>& entries) {
    for (std::size_t i = 1; i < entries.size(); ++i) {
      Node& whole = entries[i - 1].value;
      Node fraction;
      fraction.kind = Node::Kind::scalar;
      fraction.text = entries[i].key;
      if (entries[i].value.kind != Node::Kind::null || !is_decimal_comma(whole, fraction, entries[i].mark)) continue;
      whole.text += "," + fraction.text;
      entries.erase(entries.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
  bool expects_key() const {
    return !open_.empty() && open_.back().node.is_mapping() && !open_.back().waiting.has_value();
  }
  void place(const YAML::Mark& mark, Node node) {
    if (open_.empty()) {
      root_ = std::move(node);
      return;
    }
    Open& parent = open_.back();
    if (parent.node.is_sequence()) {
      parent.node.items.push_back(std::move(node));
    } else if (expects_key()) {
      if (!node.is_scalar()) throw Refusal{mark, "a key must be a name"};
      parent.waiting = NodeEntry{std::move(node.text), places_.at(mark), {}};
    } else {
      // The parser places an absent value at the next token.
      if (node.kind == Node::Kind::null) node.mark = parent.waiting->mark;
      parent.waiting->value = std::move(node);
      parent.node.entries.push_back(std::move(*parent.waiting));
      parent.waiting.reset();
    }
  }

  const Places& places_;
  std::vector<Open> open_;
  std::map<YAML::anchor_t, Node> anchored_;
  std::optional<Node> root_;
  std::size_t count_ = 0;
};

// Meets a second document.
class SecondDocument final : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark& mark) override { throw Refusal{mark, {}}; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {}
  void OnMapEnd() override {}
};

// Whether the second document that the parser found is announced by "---" or "...".
bool has_document_marker(std::string_view text, const YAML::Mark& mark) {
  std::istringstream lines{std::string(text)};
  std::string line;
  for (int i = 0; i <= mark.line && std::getline(lines, line); ++i) {
    if (i > 0 && (line.starts_with("---") || line.starts_with("..."))) return true;
  }
  return false;
}

std::string readable(const std::string& message) {
  if (message.find("flow not found") != std::string::npos) return "this bracket is not closed";
  return "not valid YAML: " + message;
}

}  // namespace

std::optional<Node> parse_document(const std::string& text, const std::shared_ptr<const std::string>& source,
                                   FaultList& faults) {
  const Places places(text, source);
  TreeBuilder builder(places);
  // The likely cause of a failure, else the parser's message.
  const auto blame = [&](const YAML::Mark& mark, const std::string& message, const YAML::Mark& noticed) {
    const std::size_t line = noticed.line < 0 ? text.size() : static_cast<std::size_t>(noticed.line);
    if (const auto slip = likely_slip(text, line))
      faults.add(places.at(slip->at), slip->message);
    else
      faults.add(places.at(mark), message);
  };
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder)) {
      faults.add({source, 1, 1}, "the file is empty");
      return {};
    }
    SecondDocument second;
    parser.HandleNextDocument(second);
    return builder.take_root();
  } catch (const Refusal& refusal) {
    const bool second = refusal.message.empty();
    if (second && has_document_marker(text, refusal.mark))
      faults.add(places.at(refusal.mark), "a second document in the file; only one is allowed");
    else if (second)
      blame(refusal.mark, "not valid YAML: text after the end of the document", refusal.mark);
    else if (refusal.of_syntax)
      blame(refusal.mark, refusal.message, refusal.mark);
    else
      faults.add(places.at(refusal.mark), refusal.message);
  } catch (const YAML::Exception& error) {
    const bool unclosed = error.msg.find("flow not found") != std::string::npos;
    blame(unclosed ? builder.innermost_open().value_or(error.mark) : error.mark, readable(error.msg), error.mark);
  } catch (const std::exception& error) {
    faults.add({source, 1, 1}, std::string("not valid YAML: ") + error.what());
  }
  return {};
}

namespace {
void mark_all(Node& node, const Mark& mark) {
  node.mark = mark;
  for (Node& item : node.items) mark_all(item, mark);
  for (NodeEntry& entry : node.entries) {
    entry.mark = mark;
    mark_all(entry.value, mark);
  }
}
}  // namespace

std::optional<Node> parse_value(const std::string& text, const Mark& mark, FaultList& faults) {
  FaultList in_value;
  std::optional<Node> node;
  if (text.find_first_not_of(" \t\r\n") == std::string::npos) {
    node = Node{};
  } else if (const auto clean = checked_text(text, mark.source, in_value)) {
    node = parse_document(*clean, mark.source, in_value);
  }
  for (const Fault& fault : in_value.all()) faults.add(mark, fault.message);
  if (node) mark_all(*node, mark);
  return node;
}

}  // namespace grapnel
