#include "grapnel/result/campaign_table.hpp"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <bit>
#include <cmath>
#include <fstream>
#include <numeric>

#include "campaign/fake_campaign.hpp"
#include "grapnel/campaign/campaign_table_writer.hpp"
#include "grapnel/campaign/grid.hpp"
#include "grapnel/campaign/shard_store.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace table_test {

namespace fs = std::filesystem;
using test::bytes_of;
using test::fake_campaign;
using test::fake_row;
using test::TemporaryFolder;

std::function<void(const TakeRow&)> fake_rows(std::uint64_t count) {
  return [count](const TakeRow& take) {
    for (std::uint64_t k = 0; k < count; ++k) take(fake_row(k));
  };
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

std::string message_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::exception& error) {
    return error.what();
  }
  return "no fault";
}

TEST(CampaignTable, ReturnsEveryRow) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kRows = 20001;  // three chunks, the last one short
  const Campaign campaign = fake_campaign(kRows);
  write_campaign_tables(folder.path(), campaign, "1.2.3", true, fake_rows(kRows));
  const CampaignTable table(folder.path() / "table.h5");
  ASSERT_EQ(table.rows(), kRows);
  ASSERT_EQ(table.inputs().size(), 2u);
  ASSERT_EQ(table.columns().size(), 3u);
  EXPECT_EQ(table.inputs()[1].name, "spin/x");
  EXPECT_EQ(table.inputs()[1].unit, "rad/s");
  EXPECT_EQ(table.columns()[2].name, "b/y");
  EXPECT_EQ(table.columns()[0].description, "first");
  std::vector<std::vector<double>> numbers{table.numbers(table.inputs()[0]), table.numbers(table.inputs()[1]),
                                           table.numbers(table.columns()[0]), table.numbers(table.columns()[1]),
                                           table.numbers(table.columns()[2])};
  const auto index = table.indices();
  const auto status = table.status(), success = table.success();
  const auto reasons = table.reasons();
  for (std::uint64_t k = 0; k < kRows; ++k) {
    const CaseRow row = fake_row(k);
    ASSERT_EQ(index[k], k);
    ASSERT_EQ(status[k], static_cast<int>(row.status));
    ASSERT_EQ(success[k] != 0, row.success);
    ASSERT_EQ(reasons[k] == 0, row.reason.empty());
    if (k < 200) {
      ASSERT_EQ(table.reason_texts({reasons[k]})[0], row.reason);
    }
    for (std::size_t i = 0; i < 2; ++i) ASSERT_TRUE(same_bits(numbers[i][k], row.inputs[i])) << k;
    for (std::size_t i = 0; i < 3; ++i) ASSERT_TRUE(same_bits(numbers[i + 2][k], row.values[i])) << k;
  }
  std::vector<double> part(100);
  table.read(table.columns()[2], 8150, part);
  for (std::size_t i = 0; i < part.size(); ++i) ASSERT_TRUE(same_bits(part[i], numbers[4][8150 + i]));
  table.read(table.inputs()[1], 20000, std::span(part).first(1));
  EXPECT_EQ(part[0], numbers[1][20000]);
}

TEST(CampaignTable, HasTheSameBytesForTheSameRows) {
  const TemporaryFolder a, b;
  const Campaign campaign = fake_campaign(9000);
  write_campaign_tables(a.path(), campaign, "1", true, fake_rows(9000));
  write_campaign_tables(b.path(), campaign, "1", true, fake_rows(9000));
  EXPECT_EQ(bytes_of(a.path() / "table.h5"), bytes_of(b.path() / "table.h5"));
  EXPECT_EQ(bytes_of(a.path() / "table.csv"), bytes_of(b.path() / "table.csv"));
  write_campaign_tables(a.path(), campaign, "1", true, fake_rows(9000));  // replaces the earlier tables
  EXPECT_EQ(bytes_of(a.path() / "table.h5"), bytes_of(b.path() / "table.h5"));
}

TEST(CampaignTable, IsMadeFromAllShards) {
  const TemporaryFolder folder;
  constexpr std::uint64_t kAll = test::kSanitized ? 300 : 1234;
  const Campaign campaign = fake_campaign(kAll);
  {
    ShardStore store(folder.path(), campaign, {});
    for (const ShardStore::Missing& missing : store.missing()) {
      std::vector<CaseRow> rows;
      for (std::uint64_t k = missing.block.begin; k < missing.block.end; ++k) rows.push_back(fake_row(k));
      store.write(missing.block, rows);
    }
  }
  write_campaign_table(folder.path(), campaign, "1");
  write_campaign_csv(folder.path(), campaign);
  std::vector<std::uint64_t> expected(kAll);
  std::iota(expected.begin(), expected.end(), 0);
  EXPECT_EQ(CampaignTable(folder.path() / "table.h5").indices(), expected);
  // If a shard becomes unreadable later, the existing table remains unchanged.
  fs::remove(shard_path(folder.path(), 1));
  const std::string table = bytes_of(folder.path() / "table.h5"), csv = bytes_of(folder.path() / "table.csv");
  const std::string all = "of " + std::to_string(kAll) + " cases can be read";
  EXPECT_NE(message_of([&] { write_campaign_table(folder.path(), campaign, "1"); }).find(all), std::string::npos);
  EXPECT_NE(message_of([&] { write_campaign_csv(folder.path(), campaign); }).find(all), std::string::npos);
  EXPECT_EQ(bytes_of(folder.path() / "table.h5"), table);
  EXPECT_EQ(bytes_of(folder.path() / "table.csv"), csv);
}

TEST(CampaignTable, TextIsLikeTheTable) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(30);
  write_campaign_tables(folder.path(), campaign, "1", true, fake_rows(30));
  std::ifstream file(folder.path() / "table.csv");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "k,status,success,reason,mass [kg],spin/x [rad/s],a [N s],b/x [1],b/y");
  for (std::uint64_t k = 0; k < 30; ++k) {
    ASSERT_TRUE(std::getline(file, line));
    const CaseRow row = fake_row(k);
    EXPECT_TRUE(line.starts_with(std::to_string(k) + "," + name_of(row.status) + (row.success ? ",1," : ",0,") +
                                 row.reason + ","));
    if (row.status != CaseStatus::ok) {
      EXPECT_TRUE(line.ends_with(",NaN,NaN,NaN"));
    }
  }
  EXPECT_FALSE(std::getline(file, line));
  write_campaign_tables(folder.path(), campaign, "1", false, fake_rows(30));
}

TEST(CampaignTable, HasTheDesign) {
  const TemporaryFolder folder;
  Campaign campaign = fake_campaign(5);
  campaign.design = {{"speed", "m/s", "of approach", true, {{0.1, ""}, {0.2, ""}}},
                     {"law", "", "of impact", false, {{NAN, "rigid, or so"}, {NAN, "soft"}}}};
  ASSERT_EQ(campaign.total(), 20u);
  write_campaign_tables(folder.path(), campaign, "1", true, fake_rows(20));
  const hid_t file = H5Fopen((folder.path() / "table.h5").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  std::vector<double> speed(20), law(20);
  for (const auto& [path, numbers] : {std::pair("design/speed", &speed), std::pair("design/law", &law)}) {
    const hid_t dataset = H5Dopen2(file, path, H5P_DEFAULT);
    ASSERT_GE(dataset, 0);
    H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, numbers->data());
    H5Dclose(dataset);
  }
  H5Fclose(file);
  for (std::uint64_t k = 0; k < 20; ++k) {
    EXPECT_EQ(speed[k], k < 10 ? 0.1 : 0.2);
    EXPECT_EQ(law[k], k / 5 % 2 == 0 ? 0 : 1);
  }
  const std::string text = bytes_of(folder.path() / "table.csv");
  EXPECT_TRUE(text.starts_with("k,speed [m/s],law,status"));
  EXPECT_NE(text.find("\n5,0.1,soft,"), std::string::npos);
  EXPECT_NE(text.find("\n10,0.2,\"rigid, or so\","), std::string::npos);
}

// "a" cannot be a number and a group of numbers in HDF5.
TEST(CampaignTable, AcceptsNamesThatArePrefixesOfOthers) {
  const TemporaryFolder folder;
  Campaign campaign = fake_campaign(3);
  campaign.columns[0].name = "b";
  campaign.columns[1].name = "b/x";
  campaign.columns[2].name = "b/x/z";
  write_campaign_tables(folder.path(), campaign, "1", false, fake_rows(3));
  const CampaignTable table(folder.path() / "table.h5");
  ASSERT_EQ(table.columns().size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(table.columns()[i].name, campaign.columns[i].name);
    EXPECT_TRUE(same_bits(table.numbers(table.columns()[i])[1], fake_row(1).values[i]));
  }
}

TEST(CampaignTable, MayBeEmpty) {
  const TemporaryFolder folder;
  write_campaign_tables(folder.path(), fake_campaign(3), "1", true, fake_rows(0));
  const CampaignTable table(folder.path() / "table.h5");
  EXPECT_EQ(table.rows(), 0u);
  EXPECT_TRUE(table.numbers(table.columns()[0]).empty());
  EXPECT_TRUE(table.reasons().empty());
}

TEST(CampaignTable, FaultsNameTheFile) {
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "table.h5";
  EXPECT_NE(message_of([&] { CampaignTable table(path); }).find(path.string() + ": no such file"), std::string::npos);
  test::write_bytes(path, "not HDF5");
  EXPECT_NE(message_of([&] { CampaignTable table(path); }).find("not an HDF5 file"), std::string::npos);
  write_campaign_tables(folder.path(), fake_campaign(9000), "1", false, fake_rows(9000));
  const std::string bytes = bytes_of(path);
  for (const std::size_t size : {bytes.size() - 17, bytes.size() / 2, std::size_t{600}}) {
    test::write_bytes(path, bytes.substr(0, size));
    EXPECT_NE(message_of([&] { CampaignTable table(path); }).find("cannot read " + path.string()), std::string::npos)
        << size;
  }
}

TEST(CampaignTable, AChangedByteIsFound) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const fs::path path = folder.path() / "table.h5";
  write_campaign_tables(folder.path(), fake_campaign(500), "1", false, fake_rows(500));
  const std::string bytes = bytes_of(path);
  // Starts after the HDF5 signature.
  for (std::size_t at = 8; at < bytes.size() - 16; at += bytes.size() / 50) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 16);
    test::write_bytes(path, damaged);
    EXPECT_NE(message_of([&] { CampaignTable table(path); }).find("checksum does not match"), std::string::npos) << at;
  }
}

TEST(CampaignTable, IsTheOldOneUntilItIsComplete) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(10000);
  write_campaign_tables(folder.path(), campaign, "1", true, fake_rows(10));
  const std::string before = bytes_of(folder.path() / "table.h5"), text = bytes_of(folder.path() / "table.csv");
  const auto broken = [](const TakeRow& take) {
    for (std::uint64_t k = 0; k < 9000; ++k) take(fake_row(k));
    throw std::runtime_error("the disk is gone");
  };
  EXPECT_NE(
      message_of([&] { write_campaign_tables(folder.path(), campaign, "1", true, broken); }).find("the disk is gone"),
      std::string::npos);
  const auto short_row = [](const TakeRow& take) {
    CaseRow row = fake_row(7);
    row.values.pop_back();
    take(row);
  };
  EXPECT_NE(message_of([&] {
              write_campaign_tables(folder.path(), campaign, "1", true, short_row);
            }).find("case 7 has 2 inputs and 2 columns"),
            std::string::npos);
  EXPECT_EQ(bytes_of(folder.path() / "table.h5"), before);
  EXPECT_EQ(bytes_of(folder.path() / "table.csv"), text);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), fs::directory_iterator()), 2)
      << "nothing is left behind";
}

TEST(CampaignTable, HoldsManyReasons) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(20000);
  const auto rows = [](const TakeRow& take) {
    for (std::uint64_t k = 0; k < 20000; ++k) {
      CaseRow row = fake_row(3);
      row.index = k;
      row.reason = "reason " + std::to_string(k % 9001);
      take(row);
    }
  };
  write_campaign_tables(folder.path(), campaign, "1", false, rows);
  const CampaignTable table(folder.path() / "table.h5");
  const std::vector<std::int32_t> reasons = table.reasons();
  for (const std::size_t k : {0, 8999, 9000, 9001, 19999})
    EXPECT_EQ(table.reason_texts({reasons[k]})[0], "reason " + std::to_string(k % 9001));
  EXPECT_EQ(reasons[9001], reasons[0]) << "a text is stored once";
}

}  // namespace table_test
}  // namespace grapnel
