// Every shipped YAML file begins with the schema line for editors, and schemas/ equals the output of `grapnel schema`.
#include <gmock/gmock.h>

#include <filesystem>
#include <regex>
#include <sstream>

#include "program_run.hpp"

namespace grapnel::test {
namespace editor_test {
namespace fs = std::filesystem;

class Editor : public ProgramRun {};

TEST_F(Editor, SchemasAreCurrent) {
  int schemas = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(GRAPNEL_SOURCE_DIR "/schemas")) {
    ASSERT_EQ(entry.path().extension(), ".json") << entry.path();
    const Outcome o = run("schema " + entry.path().stem().string());
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_TRUE(o.out == read_text(entry.path())) << entry.path() << " is not current: run scripts/tables";
    ++schemas;
  }
  EXPECT_GE(schemas, 5);
}

TEST_F(Editor, EveryShippedFileNamesItsSchema) {
  const std::regex line("# yaml-language-server: \\$schema=(\\S+)"), kind("(^|\n)schema: grapnel-([a-z]+)/[0-9]+\n");
  int files = 0;
  for (const char* folder : {"scenarios", "robots", "targets", "studies"}) {
    const fs::path root = fs::path(GRAPNEL_SOURCE_DIR) / folder;
    if (!fs::exists(root)) continue;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root)) {
      if (entry.path().extension() != ".yaml") continue;
      const std::string text = read_text(entry.path()), first = text.substr(0, text.find('\n'));
      std::smatch named, stated;
      ASSERT_TRUE(std::regex_search(text, stated, kind)) << entry.path() << " has no schema: line";
      ASSERT_TRUE(std::regex_match(first, named, line))
          << entry.path() << " begins with: " << first << "; run scripts/tables";
      const fs::path schema = entry.path().parent_path() / named[1].str();
      EXPECT_TRUE(fs::exists(schema)) << entry.path() << ": " << schema << "; run scripts/tables";
      EXPECT_EQ(schema.stem(), stated[2].str()) << entry.path();
      ++files;
    }
  }
  EXPECT_GE(files, 50);
}

}  // namespace editor_test
}  // namespace grapnel::test
