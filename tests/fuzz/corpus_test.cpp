// The fuzzer's kept inputs, the damaged files and the shipped scenarios, each once, without a fuzzer: what it found
// stays found, with any compiler.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

#include "fuzz/fuzz_scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::fuzz {
namespace corpus_test {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

std::vector<fs::path> files_below(const char* folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(fs::path(GRAPNEL_SOURCE_DIR) / folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

// How many of a folder's files end in the outcome.
std::ptrdiff_t count(const std::vector<fs::path>& files, Outcome outcome) {
  return std::count_if(files.begin(), files.end(), [&](const fs::path& file) {
    SCOPED_TRACE(file.string());
    Outcome found = Outcome::refused;
    EXPECT_NO_THROW(found = try_input(bytes_of(file)));
    return found == outcome;
  });
}

TEST(FuzzCorpus, StoredInputsGiveErrorsOrASystem) {
  const auto files = files_below("tests/fuzz/corpus");
  ASSERT_FALSE(files.empty());
  EXPECT_GE(count(files, Outcome::built), 3);
}

TEST(FuzzCorpus, DamagedFilesAreRefused) {
  const auto files = files_below("tests/damaged");
  ASSERT_GT(files.size(), 60u);
  count(files, Outcome::refused);
}

TEST(FuzzCorpus, ShippedScenariosWithTheirRobotsMakeASystem) {
  SKIP_UNDER_SANITIZERS();
  for (const fs::path& file : files_below("scenarios")) {
    if (file.extension() != ".yaml") continue;  // what scenarios name
    SCOPED_TRACE(file.string());
    std::string scenario = bytes_of(file);
    std::string robot = "\n=== robot.yaml\n";
    if (const std::size_t key = scenario.find("\nrobot: ");
        key != std::string::npos) {  // otherwise it is in the scenario
      const std::size_t at = key + 8, end = scenario.find('\n', at);
      robot += bytes_of(file.parent_path() / scenario.substr(at, end - at));
      scenario.replace(at, end - at, "robot.yaml");
    }
    std::string mesh;
    if (const std::size_t file_at = scenario.find(", file: "); file_at != std::string::npos) {
      const std::size_t from = file_at + 8, to = scenario.find_first_of("},\n", from);
      mesh = "\n=== mesh.obj\n" + bytes_of(file.parent_path() / scenario.substr(from, to - from));
      scenario.replace(from, to - from, "mesh.obj");
    }
    std::string log;
    if (const std::size_t file_at = scenario.find("torques: "); file_at != std::string::npos) {
      const std::size_t from = file_at + 9, to = scenario.find_first_of(" },\n", from);
      log = "\n=== motion.csv\n" + bytes_of(file.parent_path() / scenario.substr(from, to - from));
      scenario.replace(from, to - from, "motion.csv");
    }
    EXPECT_EQ(try_input(scenario + robot + mesh + log), Outcome::built);
  }
}

}  // namespace corpus_test
}  // namespace grapnel::fuzz
