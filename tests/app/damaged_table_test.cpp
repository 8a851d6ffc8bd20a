// Damaged HDF5 files of a campaign with valid checksums: the program reports them and continues.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

#include "grapnel/result/campaign_table.hpp"
#include "grapnel/result/file_seal.hpp"
#include "program_run.hpp"

namespace grapnel {
namespace damaged_table_test {

namespace fs = std::filesystem;
using test::Outcome;
using test::read_text;
using testing::HasSubstr;

class DamagedTable : public test::ProgramRun {
 protected:
  void SetUp() override {
    ProgramRun::SetUp();
    std::string text = read_text(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-at-contact.yaml");
    text.replace(text.find("../../robots"), 12, GRAPNEL_SOURCE_DIR "/robots");
    write("quick.yaml", text);
    write("c.yaml",
          "schema: grapnel-campaign/1\nname: a\nscenario: quick.yaml\nsimulate: impact\ncases: 4\nseed: 1\n"
          "uncertain: [{path: \"targets[0].mass\", as: factor, uniform: {from: 0.9, to: 1.1}}]\n");
    ASSERT_EQ(run("campaign c.yaml -o r --quiet --no-report").code, 0);
  }
  // The file with some of its bytes that are not zero changed, and a checksum that fits.
  static std::string damaged(std::string bytes, unsigned seed) {
    unseal(bytes);
    std::mt19937 random(seed);
    std::vector<std::size_t> places;
    for (std::size_t i = 0; i < bytes.size(); ++i)
      if (bytes[i] != 0) places.push_back(i);
    for (int k = 0; k < 6; ++k) bytes[places[random() % places.size()]] = static_cast<char>(random());
    seal(bytes);
    return bytes;
  }
  static void put(const fs::path& file, const std::string& bytes) { std::ofstream(file, std::ios::binary) << bytes; }
};

TEST_F(DamagedTable, ReadsOrRejectsTable) {
  const std::string sound = read_text(folder_ / "r" / "table.h5");
  int refused = 0;
  for (unsigned seed = 0; seed < 60; ++seed) {
    put(folder_ / "r" / "table.h5", damaged(sound, seed));
    try {
      const CampaignTable table(folder_ / "r" / "table.h5");
      for (const CampaignTable::Head& head : table.columns()) table.numbers(head);
      table.reason_texts(table.reasons());
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr("table.h5: ")) << seed;
      ++refused;
    }
    if (seed % 6 == 0) {
      EXPECT_GE(run("report r -o x.html").code, 0) << seed;
    }
  }
  EXPECT_GT(refused, 5);
}

TEST_F(DamagedTable, RecomputesDamagedShard) {
  const fs::path shard = folder_ / "r" / "shards" / "000001.h5";
  const std::string sound = read_text(shard), table = read_text(folder_ / "r" / "table.csv");
  for (unsigned seed = 0; seed < 12; ++seed) {
    put(shard, damaged(sound, seed));
    const Outcome merged = run("merge r -o m --quiet --no-report");
    EXPECT_TRUE(merged.code == 0 || merged.code == 1) << seed << merged.err;
    const Outcome o = run("campaign c.yaml -o r --quiet --no-report");
    EXPECT_EQ(o.code, 0) << seed << o.err;
    fs::remove_all(folder_ / "m");
    if (read_text(shard) != sound) continue;  // what was changed cannot be seen by HDF5
    EXPECT_EQ(read_text(folder_ / "r" / "table.csv"), table) << seed;
  }
}

}  // namespace damaged_table_test
}  // namespace grapnel
