// The manual page, its Markdown form and the bash completions contain every command and option of `--help`.
#include <gmock/gmock.h>

#include <filesystem>
#include <regex>
#include <set>
#include <sstream>

#include "program_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace manual_test {
namespace fs = std::filesystem;

class Manual : public ProgramRun {
 protected:
  // The matches of a pattern's first group in all lines of a text.
  static std::vector<std::string> found(const std::string& text, const std::string& pattern) {
    std::vector<std::string> words;
    const std::regex expression(pattern);
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      for (std::sregex_iterator at(line.begin(), line.end(), expression), end; at != end; ++at)
        words.push_back((*at)[1]);
    }
    return words;
  }
  std::vector<std::string> commands() const {
    const std::string help = run("--help").out;
    return found(help.substr(help.find("Subcommands:")), "^  ([a-z-]+)[ ,]");
  }
  std::vector<std::string> options(const std::string& command) const {
    const std::string help = run(command + " --help").out;
    return found(help.substr(0, help.find("Exit codes")), "^ .*?(--[a-z][a-z-]*)");
  }
  // The bash completions of the last word of a command line, in the test folder.
  std::set<std::string> completed(const std::vector<std::string>& words) const {
    std::string line;
    for (const std::string& word : words) line += "'" + word + "' ";
    const fs::path out = folder_ / "completed";
    const std::string script = "cd '" + folder_.string() +
                               "' && bash --norc -c '. ./grapnel.bash; COMP_WORDS=(\"$@\"); "
                               "COMP_CWORD=$(($# - 1)); _grapnel; printf \"%s\\n\" \"${COMPREPLY[@]}\"' - " +
                               line + "> '" + out.string() + "'";
    EXPECT_EQ(std::system(script.c_str()), 0) << script;
    std::istringstream lines(read_text(out));
    std::set<std::string> offered;
    for (std::string one; std::getline(lines, one);) {
      if (!one.empty()) offered.insert(one);
    }
    return offered;
  }
};

TEST_F(Manual, HasEveryCommandAndOption) {
  SKIP_UNDER_SANITIZERS();
  const Outcome page = run("manual"), markdown = run("manual --markdown");
  ASSERT_EQ(page.code, 0) << page.err;
  ASSERT_EQ(markdown.code, 0) << markdown.err;
  EXPECT_GE(commands().size(), 12u);
  int options_seen = 0;
  for (const std::string& command : commands()) {
    const std::string head = ".SS grapnel " + std::regex_replace(command, std::regex("-"), "\\-") + "\n";
    EXPECT_THAT(page.out, ::testing::HasSubstr("\n" + head));
    EXPECT_THAT(markdown.out, ::testing::HasSubstr("\n## grapnel " + command + "\n"));
    // Only the section of this command.
    const std::size_t begin = page.out.find(head), end = page.out.find("\n.S", begin + 1);
    const std::string part = page.out.substr(begin, end - begin);
    const std::size_t from = markdown.out.find("## grapnel " + command + "\n");
    const std::string of_markdown = markdown.out.substr(from, markdown.out.find("\n## ", from + 1) - from);
    for (const std::string& option : options(command)) {
      EXPECT_THAT(part, ::testing::HasSubstr("\\fB" + std::regex_replace(option, std::regex("-"), "\\-") + "\\fR"))
          << command;
      EXPECT_THAT(of_markdown, ::testing::HasSubstr("`" + option + "`")) << command;
      ++options_seen;
    }
  }
  EXPECT_GE(options_seen, 60);
  EXPECT_THAT(page.out, ::testing::HasSubstr("130 stopped by"));
}

TEST_F(Manual, ManReadsItWithoutWarnings) {
  if (std::system("command -v groff >/dev/null") != 0) GTEST_SKIP() << "groff is not installed";
  ASSERT_EQ(run("manual > page").code, 0);
  write("page", run("manual").out);
  const fs::path messages = folder_ / "said";
  ASSERT_EQ(
      std::system(
          ("groff -man -Tutf8 -ww -z '" + (folder_ / "page").string() + "' 2> '" + messages.string() + "'").c_str()),
      0);
  EXPECT_EQ(read_text(messages), "");
}

TEST_F(Manual, CompletesCommandsOptionsValuesAndFiles) {
  write("grapnel.bash", run("completion bash").out);
  for (const char* name : {"capture.yaml", "notes.txt", "robot one.yaml"}) write(name, "");
  fs::create_directory(folder_ / "results");
  const std::vector<std::string> all = commands();
  EXPECT_EQ(completed({"grapnel", ""}), std::set<std::string>(all.begin(), all.end()));
  EXPECT_THAT(completed({"grapnel", "swe"}), ::testing::ElementsAre("sweep"));
  for (const std::string& command : all) {
    const std::set<std::string> offered = completed({"grapnel", command, "--"});
    for (const std::string& option : options(command))
      EXPECT_TRUE(offered.contains(option)) << command << ' ' << option;
  }
  EXPECT_THAT(completed({"grapnel", "figure", "results", "--view", ""}), ::testing::ElementsAre("iso", "x", "y", "z"));
  EXPECT_THAT(completed({"grapnel", "envelope", "-o", ""}), ::testing::ElementsAre("results"));  // an alias
  EXPECT_THAT(completed({"grapnel", "run", ""}), ::testing::ElementsAre("capture.yaml", "results", "robot one.yaml"));
  EXPECT_THAT(completed({"grapnel", "export", ""}), ::testing::ElementsAre("results"));
  EXPECT_TRUE(completed({"grapnel", "schema", ""}).contains("robot"));
  EXPECT_THAT(completed({"grapnel", "run", "capture.yaml", "--set", ""}), ::testing::IsEmpty());
}

}  // namespace manual_test
}  // namespace grapnel::test
