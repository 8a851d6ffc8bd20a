#include "grapnel/result/atomic_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>

#include "result/sample_result.hpp"

namespace grapnel {
namespace atomic_file_test {

using test::bytes_of;
using test::message_of;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

TEST(AtomicFile, WritesAndReplaces) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", std::string("first\0second", 12));
  EXPECT_EQ(bytes_of(folder / "a"), std::string("first\0second", 12));
  write_file_atomically(folder / "a", "");
  EXPECT_EQ(bytes_of(folder / "a"), "");
  EXPECT_EQ(folder.files(), 1);
}

TEST(AtomicFile, TakesRelativeNamesAndTheUsersPermissions) {
  const TemporaryFolder folder;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(folder.path());
  const mode_t mask = ::umask(027);
  write_file_atomically("a", "x");
  ::umask(mask);
  std::filesystem::current_path(before);
  struct stat status;
  ASSERT_EQ(::stat((folder / "a").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0640);
}

TEST(AtomicFile, LeavesNothingWithoutACommit) {
  const TemporaryFolder folder;
  write_file_atomically(folder / "a", "old");
  { AtomicFile(folder / "a").write("new"); }
  EXPECT_EQ(bytes_of(folder / "a"), "old");
  EXPECT_EQ(folder.files(), 1);
}

TEST(AtomicFile, ManyWritersAtOnceDoNotMeet) {
  const TemporaryFolder folder;
  AtomicFile first(folder / "a"), second(folder / "a");
  first.write("first");
  second.write("second");
  second.commit();
  first.commit();
  EXPECT_EQ(bytes_of(folder / "a"), "first");
  EXPECT_EQ(folder.files(), 1);
}

TEST(AtomicFile, RemovesOnlyLeftoversOfKilledProcesses) {
  const TemporaryFolder folder;
  const std::string gone = ".summary.json.tmp-" + std::to_string(1 << 30) + "-0";  // no process has this number
  const std::string mine = ".summary.json.tmp-" + std::to_string(::getpid()) + "-0";
  for (const std::string& name : {gone, mine, std::string(".notes.tmp-old"), std::string(".tmp-1073741824-0"),
                                  std::string("a.tmp-1073741824-0"), std::string(".b.tmp-1073741824-0x")})
    test::put_bytes(folder / name, "x");
  std::filesystem::create_directory(folder / ".c.tmp-1073741824-0");
  std::filesystem::create_symlink(folder / "a.tmp-1073741824-0", folder / ".d.tmp-1073741824-0");
  remove_leftovers(folder.path(), 3600);  // all are new
  EXPECT_EQ(folder.files(), 8);
  for (const std::string& name : {gone, mine})
    std::filesystem::last_write_time(folder / name,
                                     std::filesystem::file_time_type::clock::now() - std::chrono::hours(2));
  remove_leftovers(folder.path(), 3600);
  EXPECT_EQ(folder.files(), 7);
  EXPECT_FALSE(std::filesystem::exists(folder / gone));
  EXPECT_TRUE(std::filesystem::exists(folder / mine));  // its process runs
  remove_leftovers(folder.path(), 0);                   // no other writer
  EXPECT_EQ(folder.files(), 6);
}

TEST(AtomicFile, ALinkIsReplacedAndNotFollowed) {
  const TemporaryFolder folder;
  test::put_bytes(folder / "precious", "x");
  std::filesystem::create_symlink(folder / "precious", folder / "a");
  write_file_atomically(folder / "a", "new");
  EXPECT_EQ(bytes_of(folder / "precious"), "x");
  EXPECT_FALSE(std::filesystem::is_symlink(folder / "a"));
  std::filesystem::create_symlink(folder / "precious", folder / "b");
  EXPECT_THAT(message_of([&] { refuse_link(folder / "b"); }), HasSubstr("b: it is a symbolic link"));
  EXPECT_EQ(message_of([&] { refuse_link(folder / "precious"); }), "");
}

TEST(AtomicFile, NamesThePathAndTheReason) {
  const TemporaryFolder folder;
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "none/a", "x"); }),
              AllOf(HasSubstr((folder / "none/a").string()), HasSubstr("No such file or directory")));
  std::filesystem::create_directory(folder / "d");
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "d", "x"); }),
              AllOf(HasSubstr((folder / "d").string()), HasSubstr("directory")));
  EXPECT_EQ(folder.files(), 1);  // no temporary stays
  EXPECT_THAT(message_of([&] { write_file_atomically(folder.path().string() + "/", "x"); }),
              HasSubstr("not the name of a file"));
}

TEST(AtomicFile, RefusesAFolderWithoutPermission) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  const TemporaryFolder folder;
  std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
  EXPECT_THAT(message_of([&] { write_file_atomically(folder / "a", "x"); }),
              AllOf(HasSubstr((folder / "a").string()), HasSubstr("Permission denied")));
}

}  // namespace atomic_file_test
}  // namespace grapnel
