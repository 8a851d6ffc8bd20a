#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>

#include "campaign/fake_campaign.hpp"
#include "grapnel/campaign/campaign_lock.hpp"

namespace grapnel {
namespace lock_test {

namespace fs = std::filesystem;
using test::bytes_of;
using test::TemporaryFolder;
using test::write_bytes;
using ::testing::HasSubstr;
using ::testing::MatchesRegex;

// The reason for a refused lock; empty if the lock is granted.
std::string refusal(const fs::path& folder, const std::string& writer = "") {
  try {
    const CampaignLock lock(folder, writer);
  } catch (const FolderInUse& error) {
    return error.what();
  }
  return {};
}

TEST(Lock, ExcludesOthersAndNamesTheHolder) {
  const TemporaryFolder folder;
  {
    const CampaignLock lock(folder.path());
    const std::string why = refusal(folder.path());
    EXPECT_THAT(why, HasSubstr("is in use: process " + std::to_string(getpid()) + " on "));
    EXPECT_THAT(why, MatchesRegex(".* writes to it since 20..-..-.. ..:..:.. UTC"));
    EXPECT_NE(refusal(folder.path(), "task-1"), "");
  }
  EXPECT_EQ(refusal(folder.path()), "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Lock, WritersWithNamesShareAFolder) {
  const TemporaryFolder folder;
  {
    const CampaignLock one(folder.path(), "rank-1"), two(folder.path(), "rank-2");
    EXPECT_THAT(refusal(folder.path(), "rank-2"), HasSubstr(" as rank-2"));
    EXPECT_THAT(refusal(folder.path()), HasSubstr("process " + std::to_string(getpid())));
    EXPECT_EQ(refusal(folder.path(), "rank-3"), "");
    const CampaignLock::Turn turn(one);
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

// A process that holds the lock until it is killed.
class Holder {
 public:
  // `orphan`: additional lifetime of a child process that shares the lock.
  explicit Holder(const fs::path& folder, const std::string& writer = "",
                  std::chrono::milliseconds orphan = std::chrono::milliseconds(0)) {
    int ready[2];
    EXPECT_EQ(pipe(ready), 0);
    pid_ = fork();
    if (pid_ == 0) {
      const CampaignLock lock(folder, writer);
      const pid_t parent = getpid();
      if (orphan.count() > 0 && fork() == 0) {
        while (getppid() == parent) usleep(1000);
        usleep(static_cast<useconds_t>(1000 * orphan.count()));
        _exit(0);
      }
      if (write(ready[1], "x", 1) != 1) _exit(1);
      for (;;) pause();
    }
    char byte = 0;
    EXPECT_EQ(read(ready[0], &byte, 1), 1);
    close(ready[0]);
    close(ready[1]);
  }
  ~Holder() { kill(); }
  void kill() {
    if (pid_ == 0) return;
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  int pid() const { return pid_; }

 private:
  pid_t pid_ = 0;
};

TEST(Lock, EndsWithItsProcess) {
  const TemporaryFolder folder;
  Holder holder(folder.path());
  EXPECT_THAT(refusal(folder.path()), HasSubstr("process " + std::to_string(holder.pid()) + " on "));
  holder.kill();
  EXPECT_NE(bytes_of(folder.path() / "lock"), "");  // the killed process could not remove it
  EXPECT_EQ(refusal(folder.path(), "task-1"), "");
  EXPECT_EQ(refusal(folder.path()), "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

// The child process of a killed holder still has the lock and ends a little later.
TEST(Lock, WaitsForTheChildOfAKilledHolder) {
  const TemporaryFolder folder;
  Holder holder(folder.path(), "", std::chrono::milliseconds(200));
  EXPECT_NE(refusal(folder.path()), "");
  holder.kill();
  EXPECT_EQ(refusal(folder.path()), "");
}

TEST(Lock, OfANamedWriterEndsWithItsProcess) {
  const TemporaryFolder folder;
  Holder holder(folder.path(), "rank-1");
  EXPECT_THAT(refusal(folder.path()), HasSubstr("process " + std::to_string(holder.pid()) + " on "));
  EXPECT_THAT(refusal(folder.path(), "rank-1"), HasSubstr(" as rank-1"));
  holder.kill();
  EXPECT_EQ(refusal(folder.path(), "rank-1"), "");
  EXPECT_EQ(refusal(folder.path()), "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

// A lock file of another machine, whose file lock is not visible here.
void write_foreign(const fs::path& file, int seconds_ago) {
  write_bytes(file, "host far-away\npid 4711\nsince 2026-01-02 03:04:05 UTC\nboot x\nspace y\nstart 1\n");
  fs::last_write_time(file, fs::file_time_type::clock::now() - std::chrono::seconds(seconds_ago));
}

TEST(Lock, OfAnotherMachineCountsUntilItsHeartbeatStops) {
  const TemporaryFolder folder;
  write_foreign(folder.path() / "lock", 20);
  const std::string why = refusal(folder.path());
  EXPECT_THAT(why,
              HasSubstr("process 4711 on far-away writes to it since 2026-01-02 03:04:05 UTC (its last heartbeat "));
  EXPECT_THAT(why, HasSubstr("after removing " + (folder.path() / "lock").string()));
  write_foreign(folder.path() / "lock", 1000);
  EXPECT_EQ(refusal(folder.path()), "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Lock, OfThisMachineBeforeItStartedAgainIsStale) {
  const TemporaryFolder folder;
  char host[256] = {};
  ASSERT_EQ(gethostname(host, sizeof host - 1), 0);
  write_bytes(folder.path() / "lock", std::string("host ") + host + "\npid 1\nboot long-ago\nspace y\nstart 1\n");
  EXPECT_EQ(refusal(folder.path()), "");
}

TEST(Lock, InvalidLockTextHasNoHolder) {
  const TemporaryFolder folder;
  for (const char* text : {"", "\n", "host", "pid 12\n", "\x01\x02 garbage"}) {
    write_bytes(folder.path() / "lock", text);
    EXPECT_EQ(refusal(folder.path()), "") << text;
  }
}

}  // namespace lock_test
}  // namespace grapnel
