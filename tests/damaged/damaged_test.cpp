// Damaged files and what the program says about them, word by word. README.md describes the folder.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

namespace damaged_test {

namespace fs = std::filesystem;

const fs::path kFolder = fs::path(GRAPNEL_SOURCE_DIR) / "tests" / "damaged";
const std::string kPrompt = "$ grapnel ";

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

// A command of a transcript and the lines that follow it.
struct Entry {
  std::string arguments;
  std::string expected;
};

std::vector<Entry> entries_of(const fs::path& transcript) {
  std::vector<Entry> entries;
  std::ifstream file(transcript);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    if (line.starts_with(kPrompt)) {
      entries.push_back({line.substr(kPrompt.size()), ""});
    } else if (!entries.empty()) {
      entries.back().expected += line + "\n";
    }
  }
  return entries;
}

struct Outcome {
  int code;
  std::string out, err;
};

// As a user would type it, in the folder of the damaged files.
Outcome run(const std::string& arguments) {
  static const fs::path base = fs::temp_directory_path() / ("grapnel-damaged-" + std::to_string(getpid()));
  const std::string out = base.string() + ".out", err = base.string() + ".err";
  const std::string command = "cd '" + kFolder.string() + "' && '" GRAPNEL_PROGRAM "' " + arguments + " >'" + out +
                              "' 2>'" + err + "' </dev/null";
  const int status = std::system(command.c_str());
  const Outcome outcome{WIFEXITED(status) ? WEXITSTATUS(status) : -1, read(out), read(err)};
  fs::remove(out), fs::remove(err);
  return outcome;
}

std::vector<std::string> transcripts() {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    if (entry.path().extension() == ".transcript") names.push_back(entry.path().stem().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

class Damaged : public testing::TestWithParam<std::string> {};

TEST_P(Damaged, MatchesTheTranscript) {
  const auto entries = entries_of(kFolder / (GetParam() + ".transcript"));
  ASSERT_FALSE(entries.empty());
  for (const Entry& entry : entries) {
    SCOPED_TRACE("in tests/damaged: " + kPrompt.substr(2) + entry.arguments);
    const Outcome outcome = run(entry.arguments);
    EXPECT_EQ(outcome.err, entry.expected);
    EXPECT_EQ(outcome.out, "");
    EXPECT_EQ(outcome.code, 2);
    // A transcript that expects nothing would pass with a program that says nothing.
    EXPECT_NE(entry.expected.find(": error: "), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(Files, Damaged, testing::ValuesIn(transcripts()), [](const auto& file) { return file.param; });

TEST(DamagedFiles, EachIsInATranscriptOrWithoutError) {
  std::string all;
  for (const std::string& name : transcripts()) all += read(kFolder / (name + ".transcript"));
  for (const auto& entry : fs::recursive_directory_iterator(kFolder)) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = fs::relative(entry.path(), kFolder).string();
    const std::string text = read(entry.path());
    if (text.substr(0, text.find('\n')).find("without fault") != std::string::npos) continue;
    EXPECT_NE(all.find(name), std::string::npos) << name;
  }
}

TEST(DamagedFiles, TheOriginalsAreAccepted) {
  const Outcome outcome = run("check good/capture.yaml");
  EXPECT_EQ(outcome.code, 0);
  EXPECT_EQ(outcome.err, "");
}

}  // namespace damaged_test
