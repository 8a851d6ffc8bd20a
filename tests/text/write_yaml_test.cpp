// What is written reads back as the same tree.
#include "grapnel/text/write_yaml.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/text_file.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace write_yaml_test {

namespace fs = std::filesystem;

Node parsed(const std::string& text) {
  FaultList faults;
  const auto source = std::make_shared<const std::string>("test");
  const auto clean = checked_text(text, source, faults);
  auto tree = clean ? parse_document(*clean, source, faults) : std::nullopt;
  faults.throw_if_any();
  return std::move(*tree);
}

std::string read_bytes(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// Kinds, texts, keys and their order, and what a scalar is.
void expect_same(const Node& a, const Node& b, const std::string& where) {
  ASSERT_EQ(a.kind, b.kind) << where;
  EXPECT_EQ(a.text, b.text) << where;
  EXPECT_EQ(is_text(a), is_text(b)) << where;
  EXPECT_EQ(boolean_of(a), boolean_of(b)) << where;
  EXPECT_EQ(number_of(a).has_value(), number_of(b).has_value()) << where;
  ASSERT_EQ(a.items.size(), b.items.size()) << where;
  ASSERT_EQ(a.entries.size(), b.entries.size()) << where;
  for (std::size_t i = 0; i < a.items.size(); ++i)
    expect_same(a.items[i], b.items[i], where + "[" + std::to_string(i) + "]");
  for (std::size_t i = 0; i < a.entries.size(); ++i) {
    EXPECT_EQ(a.entries[i].key, b.entries[i].key) << where;
    expect_same(a.entries[i].value, b.entries[i].value, where + "." + a.entries[i].key);
  }
}

TEST(WriteYaml, EveryShippedFileReadsBack) {
  int files = 0;
  for (const char* folder : {"scenarios", "robots", "studies"}) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(GRAPNEL_SOURCE_DIR) / folder)) {
      if (entry.path().extension() != ".yaml") continue;
      ++files;
      const Node tree = parsed(read_bytes(entry.path()));
      const std::string text = yaml_text(tree, "from a file\n\nwith a note");
      expect_same(tree, parsed(text), entry.path().filename().string());
      EXPECT_EQ(yaml_text(parsed(text), "from a file\n\nwith a note"), text);
    }
  }
  EXPECT_GT(files, 30);
}

TEST(WriteYaml, AwkwardTextsReadBack) {
  const Node tree = parsed(
      "a: \"1\"\nb: 'true'\nc: \"\"\nd: null\ne: []\nf: {}\ng: \"null\"\nh: \"- x\"\ni: \"a: b # c\"\nj: '\"\\'\n"
      "k: \"two\\nlines\\tand \\x07\"\nl: \" blank \"\n\"m: n\": [[1, [2, {x: [3]}]], {y: {z: [ {w: 1} ]}}]\n"
      "n: \"...\"\no: ---x\np: Grüße\nq: -.inf\n\"1\": \"~\"\n\"\": 5\ns: \"0x10\"\n");
  const std::string text = yaml_text(tree);
  expect_same(tree, parsed(text), "");
}

TEST(WriteYaml, ReadsWell) {
  EXPECT_EQ(yaml_text(parsed("{name: x, joints: [1, 2.50], targets: [{name: t, state: {position: [1, 2, 3]}}]}"), "c"),
            "# c\n"
            "name: x\n"
            "joints: [1, 2.50]\n"
            "targets:\n"
            "  - name: t\n"
            "    state: {position: [1, 2, 3]}\n");
}

TEST(WriteYaml, CommentsPrecedeTheirValuesAndAreIgnoredOnReading) {
  const Node plain =
      parsed("base: {mass: 1, com: [0, 0, 1]}\nlinks:\n  - {name: a, joint: {name: j}}\n  - {name: b}\nn: 3\n");
  Node tree = plain;
  tree.find("base")->comment = "two\nlines";
  tree.find("links")->items[1].comment = "of b";
  tree.find("links")->items[0].find("joint")->comment = "of the joint\nand more: [1";
  tree.find("links")->items[0].find("name")->comment = "first of its item\x01";
  tree.find("n")->comment = "of a number";
  const std::string text = yaml_text(tree, "top");
  EXPECT_EQ(text,
            "# top\n"
            "# two\n"
            "# lines\n"
            "base: {mass: 1, com: [0, 0, 1]}\n"
            "links:\n"
            "  - # first of its item?\n"
            "    name: a\n"
            "    # of the joint\n"
            "    # and more: [1\n"
            "    joint: {name: j}\n"
            "  # of b\n"
            "  - {name: b}\n"
            "# of a number\n"
            "n: 3\n");
  expect_same(parsed(text), plain, "with comments");
}

}  // namespace write_yaml_test
}  // namespace grapnel
