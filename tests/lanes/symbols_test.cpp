// Functions that the linker may take from any object file must not be compiled for an instruction set that the machine
// may lack. All linkable symbols of a set's translation unit must contain the set in their name.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

namespace grapnel::lanes {
namespace symbols_test {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

struct SetName {
  std::string file;  // suffix of its object files' names
  std::string tag;   // in mangled names
};
const std::vector<SetName> kSets = {
    {"_one_lane", "OneLane"}, {"_sse2", "Sse2"}, {"_avx2", "Avx2"}, {"_avx512", "Avx512"}};

// Names of linkable functions in `nm --defined-only`'s output that contain neither the set's tag nor, as the tables do,
// its name.
std::vector<std::string> untagged(const std::string& symbols, const SetName& set) {
  std::vector<std::string> found;
  std::istringstream lines(symbols);
  for (std::string address, type, name; lines >> address >> type >> name;) {
    // T: strong, W: weak, i: chosen at run time. Data (V, D, R, B, u) holds no instructions.
    if (type != "T" && type != "W" && type != "i") continue;
    if (name.find(set.tag) == std::string::npos && name.find(set.file.substr(1)) == std::string::npos) {
      found.push_back(name);
    }
  }
  return found;
}

std::string run(const std::string& command) {
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command.c_str(), "r"), pclose);
  std::string output;
  if (!pipe) return output;
  std::array<char, 4096> buffer;
  for (std::size_t n; (n = fread(buffer.data(), 1, buffer.size(), pipe.get())) > 0;) output.append(buffer.data(), n);
  return output;
}

TEST(Symbols, CarryTheirSet) {
  std::istringstream objects(GRAPNEL_LANE_OBJECTS);
  int checked = 0;
  for (std::string object; std::getline(objects, object, '|');) {
    for (const SetName& set : kSets) {
      if (object.find(set.file + ".cpp") == std::string::npos) continue;
      SCOPED_TRACE(object);
      const std::string symbols = run(std::string(GRAPNEL_NM) + " --defined-only '" + object + "'");
      // The set's own symbols exist, so nm could read the file.
      EXPECT_NE(symbols.find(set.tag), std::string::npos);
      EXPECT_THAT(untagged(symbols, set), IsEmpty());
      ++checked;
    }
  }
  EXPECT_GT(checked, 0);
}

TEST(Symbols, UntaggedSymbolsAreFound) {
  const std::string symbols =
      "0000000000000000 W _ZNSt6vectorIdSaIdEE9push_backERKd\n"
      "0000000000000000 W _ZN7grapnel5lanes4sumsINS0_4Avx2EEEvv\n"
      "0000000000000000 D _ZN7grapnel5lanes12kernels_avx2E\n"
      "0000000000000000 t _ZN7grapnel5localEv\n"
      "0000000000000000 T _ZN7grapnel5outerEv\n";
  EXPECT_THAT(untagged(symbols, kSets[2]), ElementsAre("_ZNSt6vectorIdSaIdEE9push_backERKd", "_ZN7grapnel5outerEv"));
}

}  // namespace symbols_test
}  // namespace grapnel::lanes
