#include "grapnel/campaign/run_campaign.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>

#include "campaign/fake_campaign.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace run_campaign_test {

namespace fs = std::filesystem;
using test::bytes_of;
using test::fake_campaign;
using test::TemporaryFolder;
using ::testing::HasSubstr;

constexpr std::uint64_t kCases = 256 * 20 + 7;

StoreOptions options(const std::string& writer = "") { return {"1.2", writer, 0, 0}; }

CampaignOptions threads(int count) {
  CampaignOptions o;
  o.threads = count;
  return o;
}

TEST(RunCampaign, TheSameShardsForAnyNumberOfThreads) {
  SKIP_UNDER_SANITIZERS();  // 770 files; StopPreservesEveryCompleteCase has two threads
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  for (const int count : {1, 2, 4}) {
    ShardStore store(folder.path() / std::to_string(count), campaign, options());
    const CaseProgress done = run_campaign(test::fake_work(), store, threads(count));
    EXPECT_EQ(done.done, kCases);
    EXPECT_EQ(done.total, kCases);
    EXPECT_EQ(done.begun_with, 0u);
    EXPECT_FALSE(done.stopped);
    EXPECT_GT(done.successes, kCases / 4);
    EXPECT_GT(done.not_ok, kCases / 8);
  }
  test::expect_fake_rows(folder.path() / "1", campaign, kCases);
  for (const auto& entry : fs::directory_iterator(folder.path() / "1" / "shards")) {
    for (const char* other : {"2", "4"})
      EXPECT_EQ(bytes_of(entry.path()), bytes_of(folder.path() / other / "shards" / entry.path().filename()));
  }
}

TEST(RunCampaign, PartsOfAJobArrayShareTheWork) {
  SKIP_UNDER_SANITIZERS();  // 260 files
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  std::uint64_t computed = 0;
  for (std::uint64_t shard = 0; shard < 3; ++shard) {
    ShardStore store(folder.path(), campaign, options("task-" + std::to_string(shard)));
    CampaignOptions part;
    part.shard = shard;
    part.shards = 3;
    const CaseProgress done = run_campaign(test::fake_work(), store, part);
    EXPECT_EQ(done.done, done.total);
    EXPECT_EQ(done.begun_with, 0u);
    computed += done.done;
  }
  EXPECT_EQ(computed, kCases);
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

// Counts which cases were computed.
struct Counted {
  std::mutex mutex;
  std::multiset<std::uint64_t> cases;
  BlockWork work() {
    return [this](const Block& block, const std::stop_token& stop) {
      std::vector<CaseRow> rows = test::fake_work()(block, stop);
      const std::lock_guard lock(mutex);
      for (const CaseRow& row : rows) cases.insert(row.index);
      return rows;
    };
  }
};

TEST(RunCampaign, StopPreservesEveryCompleteCase) {
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  Counted counted;
  std::uint64_t last = 0;
  for (int round = 0; last < kCases; ++round) {
    ASSERT_LT(round, 1000);
    ShardStore store(folder.path(), campaign, options());
    std::stop_source stop;
    std::atomic<int> left = 150;
    const BlockWork inner = counted.work();
    CampaignOptions o = threads(2);
    o.stop = stop.get_token();
    o.progress = [&](const CaseProgress&) {
      if (left <= 0) stop.request_stop();
    };
    // Slow enough for a stop before the end.
    const BlockWork slow = [&](const Block& block, const std::stop_token& token) {
      if (round < 3 && (left -= static_cast<int>(block.end - block.begin)) < 0)
        while (!token.stop_requested()) std::this_thread::yield();
      return inner(block, token);
    };
    const CaseProgress done = run_campaign(slow, store, o);
    EXPECT_EQ(done.begun_with, last);
    EXPECT_EQ(done.stopped, done.done < kCases);
    last = done.done;
  }
  EXPECT_EQ(counted.cases.size(), kCases);  // each case once
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

TEST(RunCampaign, LongBlocksAreWrittenInParts) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(1000);  // blocks of 8
  ShardStore store(folder.path(), campaign, options());
  CampaignOptions o;
  o.write_interval = 0;
  std::uint64_t seen = 0;
  const BlockWork slow_work = [&](const Block& block, const std::stop_token& stop) {
    if (block.number > 0 || block.begin == 0) return test::fake_work()(block, stop);
    for (int i = 0; i < 20000 && seen < block.begin; ++i) {  // until the earlier rows are written
      seen = store.rows({0, 0, 8}).size();
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return test::fake_work()(block, stop);
  };
  run_campaign(slow_work, store, o);
  EXPECT_EQ(seen, 7u);  // after parts of 1, 2 and 4
  test::expect_fake_rows(folder.path(), campaign, 1000);
}

TEST(RunCampaign, ExceptionEndsTheRunAndPreservesExistingRows) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  const BlockWork failing = [](const Block& block, const std::stop_token& stop) {
    if (block.number == 100) throw std::runtime_error("out of luck");
    return test::fake_work()(block, stop);
  };
  ShardStore store(folder.path(), campaign, options());
  EXPECT_THROW(run_campaign(failing, store, threads(2)), std::runtime_error);
  EXPECT_LT(store.missing().size(), 200u);
  run_campaign(test::fake_work(), store, threads(2));
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

// A file size limit for this process simulates a full disk.
TEST(RunCampaign, FullDiskIsAnErrorAndPreservesExistingRows) {
  SKIP_UNDER_SANITIZERS();
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    ShardStore store(folder.path(), campaign, options());
    const BlockWork work = [](const Block& block, const std::stop_token& stop) {
      if (block.number == 50) {
        const rlimit limit{1000, 1000};  // [bytes]
        setrlimit(RLIMIT_FSIZE, &limit);
      }
      return test::fake_work()(block, stop);
    };
    try {
      run_campaign(work, store, threads(2));
    } catch (const std::exception& error) {
      const std::string what = error.what();
      const bool named = what.find("cannot write " + (folder.path() / "shards").string()) != std::string::npos &&
                         what.find("File too large") != std::string::npos;
      _exit(named ? 17 : 18);
    }
    _exit(19);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 17);
  for (const auto& entry : fs::directory_iterator(folder.path() / "shards"))
    EXPECT_FALSE(entry.path().filename().string().starts_with('.')) << entry.path();
  ShardStore store(folder.path(), campaign, options());
  const std::size_t missing = store.missing().size();
  EXPECT_LT(missing, 257u);
  EXPECT_GT(missing, 150u);
  run_campaign(test::fake_work(), store, threads(2));
  test::expect_fake_rows(folder.path(), campaign, kCases);
}

TEST(RunCampaign, MemoryIsBoundedByAFewBlocks) {
  SKIP_UNDER_SANITIZERS();  // 260 files
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kCases);
  ShardStore store(folder.path(), campaign, options());
  std::atomic<std::int64_t> begun = 0, most = 0;
  CampaignOptions o = threads(2);
  std::atomic<std::uint64_t> written = 0;
  // Workers run ahead of the writer by at most the queue length.
  const BlockWork work = [&](const Block& block, const std::stop_token& stop) {
    if (block.begin % 20 == 0) ++begun;
    const std::int64_t ahead = begun - static_cast<std::int64_t>(written);
    std::int64_t old = most;
    while (ahead > old && !most.compare_exchange_weak(old, ahead)) {
    }
    return test::fake_work()(block, stop);
  };
  o.progress = [&](const CaseProgress& at) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    written = at.done / 20;
  };
  run_campaign(work, store, o);
  EXPECT_LE(most, 12);
  EXPECT_GE(most, 3);
}

// --- Killed at any moment ---

// Runs the campaign and kills it after the time `after`; returns whether it was complete before.
bool run_and_kill(const fs::path& folder, const Campaign& campaign, std::chrono::microseconds after) {
  const pid_t child = fork();
  if (child == 0) {
    {
      ShardStore store(folder, campaign, options());
      CampaignOptions o = threads(2);
      o.write_interval = 0.002;
      const BlockWork slow = [](const Block& block, const std::stop_token& stop) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return test::fake_work()(block, stop);
      };
      run_campaign(slow, store, o);
    }
    _exit(0);
  }
  std::this_thread::sleep_for(after);
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

// Few long blocks, so that kills also occur between the parts of a block.
void begin_with_long_blocks(const fs::path& folder, const Campaign& campaign) {
  fs::create_directories(folder);
  Manifest manifest = new_manifest(campaign, "1.2");
  manifest.block_size = 40;
  write_manifest(folder, manifest);
}

TEST(RunCampaign, ContinuesAfterAKillAtAnyTime) {
  constexpr std::uint64_t kFew = 607;
  constexpr int kKills = test::kSanitized ? 3 : 60;
  const TemporaryFolder folder;
  const Campaign campaign = fake_campaign(kFew);
  const fs::path calm = folder.path() / "calm";
  begin_with_long_blocks(calm, campaign);
  {
    ShardStore store(calm, campaign, options());
    run_campaign(test::fake_work(), store, threads(1));
  }
  unsigned random = 12345;
  int kills = 0, in_the_middle = 0;
  for (int round = 0; kills < kKills; ++round) {
    const fs::path killed = folder.path() / std::to_string(round);
    begin_with_long_blocks(killed, campaign);
    double longest = 4000;  // [us]; grows until the campaign completes on slow machines
    for (bool complete = false; !complete; longest *= 1.03) {
      random = random * 1664525u + 1013904223u;
      const double part = static_cast<double>(random >> 8) * 0x1p-24;
      complete = run_and_kill(killed, campaign, std::chrono::microseconds(static_cast<int>(part * longest)));
      if (complete) break;
      ++kills;
      const std::size_t rows = test::rows_in(killed, campaign).size();
      if (rows > 0 && rows < kFew) ++in_the_middle;
    }
    test::expect_fake_rows(killed, campaign, kFew);
    for (const auto& entry : fs::recursive_directory_iterator(killed)) {
      if (entry.is_directory()) continue;
      EXPECT_EQ(bytes_of(entry.path()), bytes_of(calm / fs::relative(entry.path(), killed))) << entry.path();
    }
  }
  EXPECT_GE(kills, kKills);
  EXPECT_GE(in_the_middle, kKills / 8);
  std::printf("%d kills, %d of them with some rows on disk\n", kills, in_the_middle);
}

// The work advances the clock: 5 ms in total for fewer than 4 cases, 1 ms per case in larger parts.
TEST(CampaignEstimate, IsThatOfLargerParts) {
  double now = 100;
  std::vector<std::uint64_t> sizes;
  const BlockWork work = [&](const Block& block, const std::stop_token&) {
    const std::uint64_t size = block.end - block.begin;
    sizes.push_back(size);
    now += size < 4 ? 5e-3 : 1e-3 * static_cast<double>(size);
    return std::vector<CaseRow>(size);
  };
  std::vector<ShardStore::Missing> missing;
  for (std::uint64_t b = 0; b < 256; ++b) missing.push_back({{b, 500 * b, 500 * (b + 1)}, b == 0 ? 100u : 0u});
  const auto clock = [&] { return now; };
  const auto estimate = estimate_campaign(work, missing, 4, 0, clock);
  ASSERT_TRUE(estimate);
  EXPECT_EQ(sizes, (std::vector<std::uint64_t>{1, 4, 16, 64, 256}));
  EXPECT_EQ(estimate->cases, 256u * 500 - 100);
  EXPECT_NEAR(estimate->seconds, 1e-3 * (256 * 500 - 100) / 4, 1e-6);
  EXPECT_EQ(estimate_text(*estimate), "about 32 s for 127900 cases on 4 threads");
  EXPECT_EQ(estimate_text({400, 10, 1}), "about 7 min for 10 cases on 1 thread");
  EXPECT_EQ(estimate_text({1e5, 10, 2}), "about 28 h for 10 cases on 2 threads");
  sizes.clear();
  EXPECT_LT(estimate_campaign(work, missing, 4, 200, clock)->seconds, 200);
  EXPECT_EQ(sizes, (std::vector<std::uint64_t>{1})) << "a quick campaign begins immediately";
  missing.resize(1);
  EXPECT_EQ(estimate_campaign(work, missing, 8, 0, clock)->threads, 1) << "one block is one thread's";
  missing.clear();
  EXPECT_FALSE(estimate_campaign(work, missing, 4, 0, clock));
}

}  // namespace run_campaign_test
}  // namespace grapnel
