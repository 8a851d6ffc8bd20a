#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "campaign/fake_campaign.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace store_test {

namespace fs = std::filesystem;
using test::bytes_of;
using test::fake_campaign;
using test::fake_row;
using test::TemporaryFolder;
using test::write_bytes;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr Block kFirst{0, 0, 20};

std::vector<CaseRow> fake_rows(std::uint64_t begin, std::uint64_t end) {
  std::vector<CaseRow> rows;
  for (std::uint64_t k = begin; k < end; ++k) rows.push_back(fake_row(k));
  return rows;
}

// Folders of a campaign whose blocks have 20 cases.
constexpr std::uint64_t kCases = 256 * 20 + 7;

StoreOptions options(const std::string& writer = "", std::uint64_t extend = 0) { return {"1.2", writer, extend, 0}; }

void fill(ShardStore& store) { run_campaign(test::fake_work(), store, {}); }

TEST(Shard, StoresRowsBitForBit) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  fs::create_directories(folder.path() / "shards");
  write_bytes(shard_path(folder.path(), 0), shard_bytes(campaign, fake_rows(0, 20), "fma"));
  const auto rows = read_shard(folder.path(), campaign, kFirst, "fma");
  ASSERT_TRUE(rows);
  ASSERT_EQ(rows->size(), 20u);
  int with_reason = 0;
  for (std::uint64_t k = 0; k < 20; ++k) {
    EXPECT_TRUE(test::same_row((*rows)[k], fake_row(k))) << k;
    if (!(*rows)[k].reason.empty()) ++with_reason;
  }
  EXPECT_GT(with_reason, 3);
  EXPECT_EQ(shard_bytes(campaign, fake_rows(0, 20), "fma"), shard_bytes(campaign, fake_rows(0, 20), "fma"));
}

TEST(Shard, DamagedOrTruncatedFilesCountAsAbsent) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  fs::create_directories(folder.path() / "shards");
  const std::string sound = shard_bytes(campaign, fake_rows(0, 20), "fma");
  const fs::path path = shard_path(folder.path(), 0);
  // Every third byte of the first and last 400, where the structure is, and every 41st between them.
  const std::size_t often = test::kSanitized ? 11 : 3, seldom = test::kSanitized ? 130 : 41;
  for (std::size_t at = 0; at<sound.size(); at += at> 400 && at + 400 < sound.size() ? seldom : often) {
    std::string damaged = sound;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    write_bytes(path, damaged);
    ASSERT_FALSE(read_shard(folder.path(), campaign, kFirst, "fma")) << "byte " << at << " of " << sound.size();
    write_bytes(path, sound.substr(0, at));
    ASSERT_FALSE(read_shard(folder.path(), campaign, kFirst, "fma")) << "cut at " << at;
  }
  fs::remove(path);
  fs::create_directory(path);
  EXPECT_FALSE(read_shard(folder.path(), campaign, kFirst, "fma"));
}

TEST(Shard, FilesOfOtherCampaignsOrCasesCountAsAbsent) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  fs::create_directories(folder.path() / "shards");
  write_bytes(shard_path(folder.path(), 0), shard_bytes(campaign, fake_rows(0, 20), "fma"));
  fs::copy(shard_path(folder.path(), 0), shard_path(folder.path(), 1));
  EXPECT_TRUE(read_shard(folder.path(), campaign, kFirst, "fma"));
  EXPECT_FALSE(read_shard(folder.path(), campaign, {1, 20, 40}, "fma"));
  EXPECT_FALSE(read_shard(folder.path(), campaign, {0, 0, 19}, "fma"));  // longer than the block
  Campaign other = campaign;
  other.seed = 8;
  EXPECT_FALSE(read_shard(folder.path(), other, kFirst, "fma"));
  other = campaign;
  other.sha256[0] = 'f';
  EXPECT_FALSE(read_shard(folder.path(), other, kFirst, "fma"));
  other = campaign;
  other.columns.pop_back();
  EXPECT_FALSE(read_shard(folder.path(), other, kFirst, "fma"));
  EXPECT_FALSE(read_shard(folder.path(), campaign, kFirst, "double")) << "of another arithmetic";
}

TEST(Manifest, IsReadAsItWasWritten) {
  const TemporaryFolder folder;
  Campaign campaign = fake_campaign(1000);
  campaign.design = {{"speed", "m/s", "of approach", true, {{0.1, ""}, {0.2, ""}}},
                     {"law", "", "of impact", false, {{NAN, "plastic"}, {NAN, "elastic"}}}};
  campaign.sampling = Sampling::sobol;
  Manifest written = new_manifest(campaign, "1.2");
  written.total = 5000;
  written.added = {1000};
  write_manifest(folder.path(), written);
  const auto read = read_manifest(folder.path());
  ASSERT_TRUE(read);
  EXPECT_THAT(differences(*read, campaign, "1.2"), IsEmpty());
  EXPECT_EQ(read->total, 5000u);
  EXPECT_THAT(read->added, ElementsAre(1000));
  EXPECT_EQ(read->campaign.success.at(0).text(), "a < 0.5");
  EXPECT_TRUE(read->campaign.success.at(0).holds(std::vector<double>{0.4, 0, 0, 0, 0}));
  EXPECT_EQ(read->campaign.design.at(0).values.at(1).number, 0.2);
  EXPECT_EQ(read->campaign.design.at(1).values.at(0).label, "plastic");
  EXPECT_EQ(read->campaign.columns.at(1).name, "b/x");
  EXPECT_EQ(read->campaign.series.worst_by, "a");
  write_manifest(folder.path() / ".", *read);
  EXPECT_EQ(read_manifest(folder.path())->campaign.text, campaign.text);
}

TEST(Manifest, ReportsDifferencesOfCampaigns) {
  const Campaign campaign = fake_campaign(1000);
  const Manifest manifest = new_manifest(campaign, "1.2");
  Campaign other = campaign;
  other.seed = 8;
  other.text = "name: fake\ncases: more\n";
  other.sha256[0] = 'f';
  EXPECT_THAT(differences(manifest, other, "1.3"),
              ElementsAre("it was created by grapnel 1.2, and this is 1.3: their rows may differ",
                          "its seed is 7, not 8", "line 2 of its file is 'cases: some', not 'cases: more'"));
  other = campaign;
  other.sha256[0] = 'f';
  EXPECT_THAT(differences(manifest, other, "1.2"),
              ElementsAre("its scenario, or a file that the scenario names, has changed"));
}

// Rows with fused products and rows without must not be mixed in one table.
TEST(Manifest, OfAnotherArithmeticIsAnother) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(1000);
  Manifest manifest = new_manifest(campaign, "1");
  EXPECT_EQ(manifest.arithmetic, arithmetic_here());
  manifest.arithmetic = "abacus";
  write_manifest(folder.path(), manifest);
  EXPECT_THAT(differences(*read_manifest(folder.path()), campaign, "1"),
              ElementsAre("its rows have the arithmetic 'abacus', not '" + arithmetic_here() +
                          "': they differ in the last bits"));
  EXPECT_THAT(differences(*read_manifest(folder.path()), campaign, "1", "abacus"), IsEmpty());
  StoreOptions options;
  options.version = "1";
  EXPECT_THROW(ShardStore(folder.path(), campaign, options), ForeignFolder);
  options.arithmetic = "abacus";  // merge uses the arithmetic of its folders
  { EXPECT_EQ(ShardStore(folder.path(), campaign, options).arithmetic(), "abacus"); }
  options.arithmetic = "fingers";
  EXPECT_THROW(ShardStore(folder.path(), campaign, options), ForeignFolder);
}

// Without a manifest, rows of another arithmetic must not receive the local label.
TEST(Store, RowsOfAnotherArithmeticAreAbsent) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  StoreOptions abacus = options();
  abacus.arithmetic = "abacus";
  {
    ShardStore store(folder.path(), campaign, abacus);
    store.write({0, 0, 20}, fake_rows(0, 20));
    EXPECT_EQ(store.rows({0, 0, 20}).size(), 20u);
  }
  fs::remove(folder.path() / "manifest.json");
  ShardStore store(folder.path(), campaign, options());
  EXPECT_EQ(store.missing().size(), 257u);
}

TEST(Manifest, ThatHasTooManyCasesIsDamaged) {
  const TemporaryFolder folder;
  Manifest manifest = new_manifest(fake_campaign(10), "1");
  manifest.total = kMostCases + 1;
  write_manifest(folder.path(), manifest);
  EXPECT_THROW(read_manifest(folder.path()), DamagedManifest);
}

TEST(Manifest, ThatIsDamagedIsNamed) {
  const TemporaryFolder folder;
  write_manifest(folder.path(), new_manifest(fake_campaign(10), "1"));
  const std::string text = bytes_of(folder.path() / "manifest.json");
  const auto fault = [&](const std::string& bytes) {
    write_bytes(folder.path() / "manifest.json", bytes);
    try {
      read_manifest(folder.path());
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(fault(text.substr(0, text.size() / 2)), HasSubstr("manifest.json: not JSON"));
  // The checksum covers every number and word: an edited total would silently add a case.
  for (const auto& [from, to] : {std::pair{"\"total\": 10", "\"total\": 11"},
                                 {"\"seed\": 7", "\"seed\": 8"},
                                 {"\"total\"", "\"sum\""},
                                 {"\"arithmetic\": \"", "\"arithmetic\": \"x"},
                                 {"\"checksum\"", "\"other\""}}) {
    std::string edited = text;
    ASSERT_NE(edited.find(from), std::string::npos) << from;
    edited.replace(edited.find(from), std::string(from).size(), to);
    EXPECT_THAT(fault(edited), HasSubstr("manifest.json: damaged: it")) << from;
    EXPECT_THAT(fault(edited), HasSubstr("\nmove this file to another folder: the command that created ")) << from;
  }
  std::string spaced = text;  // the same words
  spaced.insert(spaced.find("\"total\""), "\n ");
  EXPECT_EQ(fault(spaced), "");
}

TEST(Store, ContinuesAfterADamagedManifestWasMoved) {
  SKIP_UNDER_SANITIZERS();  // 260 files
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  {
    ShardStore store(folder.path(), campaign, options());
    fill(store);
  }
  write_bytes(folder.path() / "manifest.json", "{");
  EXPECT_THROW(ShardStore(folder.path(), campaign, options()), DamagedManifest);
  fs::remove(folder.path() / "manifest.json");
  const ShardStore store(folder.path(), campaign, options());
  EXPECT_TRUE(store.missing().empty());
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

TEST(Manifest, ShardsAreFewButEnoughForManyProcessors) {
  EXPECT_EQ(block_size_for(1), 1u);
  EXPECT_EQ(block_size_for(100), 1u);
  EXPECT_EQ(block_size_for(256), 4u);
  EXPECT_EQ(block_size_for(1'000), 8u);
  EXPECT_EQ(block_size_for(10'000), 39u);
  EXPECT_EQ(block_size_for(100'000), 390u);
  EXPECT_EQ(block_size_for(10'000'000), 500u);
}

TEST(Store, ListsMissingBlocks) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  {
    ShardStore store(folder.path() / "new" / "er", campaign, options());
    EXPECT_FALSE(store.was_there());
    EXPECT_EQ(store.block_size(), 20u);
    EXPECT_EQ(store.missing().size(), 257u);
    store.write({3, 60, 80}, fake_rows(60, 80));
    store.write({5, 100, 120}, fake_rows(100, 107));
    store.write({256, 5120, 5127}, fake_rows(5120, 5127));
  }
  ShardStore store(folder.path() / "new" / "er", campaign, options());
  EXPECT_TRUE(store.was_there());
  StoreCounts there;
  const auto missing = store.missing(0, 1, &there);
  ASSERT_EQ(missing.size(), 255u);
  EXPECT_EQ(missing[4].block.number, 5u);
  EXPECT_EQ(missing[4].rows, 7u);
  EXPECT_EQ(there.rows, 34u);
  EXPECT_EQ(there.complete, 2u);
  EXPECT_EQ(there.blocks, 257u);
  EXPECT_EQ(store.missing(1, 2).size(), 127u);  // 3 is one of them, 5 is not complete
}

TEST(Store, RewritesADamagedShard) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  {
    ShardStore store(folder.path(), campaign, options());
    fill(store);
  }
  const fs::path path = shard_path(folder.path(), 9);
  const std::string sound = bytes_of(path);
  std::string damaged = sound;
  damaged[damaged.size() / 2] ^= 1;
  write_bytes(path, damaged);
  ShardStore store(folder.path(), campaign, options());
  ASSERT_EQ(store.missing().size(), 1u);
  fill(store);
  EXPECT_EQ(bytes_of(path), sound);
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

TEST(Store, RemovesOnlyLeftoversOfKilledWriters) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  fs::create_directories(folder.path() / "shards");
  for (const char* name : {".table.h5.tmp-12-0", "shards/.000003.h5.tmp-99-4", "notes.txt", "lock.rank-3"})
    write_bytes(folder.path() / name, "half");
  { const ShardStore store(folder.path(), campaign, options("a")); }
  EXPECT_TRUE(fs::exists(folder.path() / "shards/.000003.h5.tmp-99-4"));  // may belong to another writer
  { const ShardStore store(folder.path(), campaign, options()); }
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder.path())) names.push_back(entry.path().filename().string());
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("shards", "manifest.json", "notes.txt"));
  EXPECT_TRUE(fs::is_empty(folder.path() / "shards"));
}

TEST(Store, RefusesAFolderOfAnotherCampaign) {
  const TemporaryFolder folder;
  { const ShardStore store(folder.path(), fake_campaign(kCases), options()); }
  Campaign other = fake_campaign(kCases);
  other.seed = 8;
  try {
    const ShardStore store(folder.path(), other, options());
    FAIL() << "not refused";
  } catch (const ForeignFolder& error) {
    EXPECT_THAT(error.what(), HasSubstr("holds another campaign:\n  its seed is 7, not 8\n"));
    EXPECT_THAT(error.what(), HasSubstr("--extend"));
  }
  const ShardStore again(folder.path(), fake_campaign(kCases), options());  // the rejected store left no lock
}

TEST(Store, AnExtensionAddsCasesOnceUntilTheyAreThere) {
  SKIP_UNDER_SANITIZERS();  // 770 files: half a minute
  const TemporaryFolder folder, at_once;
  const Campaign campaign = fake_campaign(kCases);
  for (int i = 0; i < 2; ++i) {
    ShardStore store(folder.path(), campaign, options("", 100));  // the second time continues
    EXPECT_EQ(store.total(), kCases + 100);
  }
  for (int i = 0; i < 2; ++i) {
    ShardStore store(folder.path(), campaign, options("", i == 0 ? 100 : 50));
    fill(store);
    EXPECT_EQ(store.total(), kCases + 100 + (i == 0 ? 0 : 50));
  }
  test::expect_fake_rows(folder.path(), campaign, kCases + 150);
  ShardStore store(at_once.path(), campaign, options("", 150));
  fill(store);
  for (const auto& entry : fs::directory_iterator(at_once.path() / "shards"))
    EXPECT_EQ(bytes_of(entry.path()), bytes_of(folder.path() / "shards" / entry.path().filename())) << entry.path();
  EXPECT_EQ(read_manifest(folder.path())->added, (std::vector<std::uint64_t>{100, 50}));
}

TEST(Store, AnExtensionOfADesignIsRefused) {
  const TemporaryFolder folder;
  Campaign campaign = fake_campaign(10);
  campaign.design = {{"speed", "m/s", "", true, {{0.1, ""}, {0.2, ""}}}};
  EXPECT_THROW(ShardStore(folder.path(), campaign, options("", 5)), ForeignFolder);
}

TEST(Store, ReportsUnusableFolders) {
  const TemporaryFolder folder;
  write_bytes(folder.path() / "file", "");
  try {
    const ShardStore store(folder.path() / "file" / "sub", fake_campaign(1), options());
    FAIL() << "not refused";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), HasSubstr("file/sub: Not a directory"));
  }
}

}  // namespace store_test
}  // namespace grapnel
