/// @file
/// Damaged timeseries.h5: a clear error, never a crash.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace hdf5_damage_test {

using test::message_of;
using test::put_bytes;
using test::TemporaryFolder;
using testing::AllOf;
using testing::HasSubstr;

class DamagedHdf5 : public testing::Test {
 protected:
  DamagedHdf5() {
    write_timeseries_hdf5(test::sample_series(701), test::sample_metadata(), path_);
    bytes_ = test::bytes_of(path_);
  }
  std::string message() const {
    return message_of([&] { read_timeseries(path_); });
  }

  TemporaryFolder folder_;
  std::filesystem::path path_ = folder_ / "timeseries.h5";
  std::string bytes_;
};

TEST_F(DamagedHdf5, CutAtAnyLengthIsAnError) {
  const std::size_t step = bytes_.size() / static_cast<std::size_t>(test::repetitions(test::repetitions(320))) + 1;
  for (std::size_t length = 0; length < bytes_.size(); length += length < 200 ? (test::kSanitized ? 17 : 3) : step) {
    if (length == bytes_.size() - 16) continue;  // all but the checksum: below
    put_bytes(path_, bytes_.substr(0, length));
    ASSERT_THAT(message(), HasSubstr("cannot read " + path_.string())) << length;
  }
  for (std::size_t lost = 1; lost <= 17; ++lost) {
    if (lost == 16) continue;
    put_bytes(path_, bytes_.substr(0, bytes_.size() - lost));
    EXPECT_THAT(message(), HasSubstr(lost > 16 ? "truncated" : "data after the end")) << lost;
  }
}

TEST_F(DamagedHdf5, GarbageIsAnError) {
  std::mt19937 random(1);
  for (const std::size_t length : {std::size_t{1}, std::size_t{100}, bytes_.size()}) {
    std::string garbage;
    while (garbage.size() < length) garbage += static_cast<char>(random());
    put_bytes(path_, garbage);
    EXPECT_THAT(message(), HasSubstr("not an HDF5 file"));
    put_bytes(path_, bytes_.substr(0, 8) + garbage);
    EXPECT_THAT(message(), HasSubstr("cannot read"));
  }
}

TEST_F(DamagedHdf5, ZeroedBlocksAreNoticed) {
  // Effects of a lost page. Without the checksum HDF5 1.10 loops endlessly on some of these.
  constexpr std::size_t kBlock = test::kSanitized ? 4096 : 512;
  for (std::size_t begin = 0; begin < bytes_.size(); begin += kBlock) {
    const std::size_t size = std::min(kBlock, bytes_.size() - begin);
    std::string damaged = bytes_;
    damaged.replace(begin, size, std::string(size, '\0'));
    if (damaged == bytes_) continue;
    put_bytes(path_, damaged);
    ASSERT_THAT(message(), HasSubstr(begin == 0 ? "not an HDF5 file" : "damaged")) << begin;
  }
}

TEST_F(DamagedHdf5, ChangedBytesAreNoticed) {
  std::mt19937 random(2);
  for (int i = 0; i < test::repetitions(250); ++i) {
    std::string damaged = bytes_;
    damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    put_bytes(path_, damaged);
    ASSERT_THAT(message(), HasSubstr("cannot read")) << i;
  }
}

TEST_F(DamagedHdf5, LosingOnlyTheChecksumIsNoDamage) {
  // Changes by other programs that modify the file.
  put_bytes(path_, bytes_.substr(0, bytes_.size() - 16));
  EXPECT_EQ(message(), "");
}

TEST_F(DamagedHdf5, ErrorsIdentifyMissingAndForeignFiles) {
  EXPECT_THAT(message_of([&] { read_timeseries(folder_ / "none.h5"); }),
              AllOf(HasSubstr("none.h5"), HasSubstr("No such file")));
  EXPECT_THAT(message_of([&] { read_timeseries(folder_.path()); }), HasSubstr("cannot read"));
  const std::size_t schema = bytes_.find("grapnel-timeseries/1");
  ASSERT_NE(schema, std::string::npos);
  std::string newer = bytes_;
  newer[schema + 19] = '2';
  put_bytes(path_, newer.substr(0, newer.size() - 16));  // without its checksum
  EXPECT_THAT(message(), HasSubstr("schema is 'grapnel-timeseries/2', not grapnel-timeseries/1"));
}

TEST_F(DamagedHdf5, PrintsNothing) {
  put_bytes(path_, bytes_.substr(0, 3000));
  testing::internal::CaptureStderr();
  testing::internal::CaptureStdout();
  EXPECT_NE(message(), "");
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

}  // namespace hdf5_damage_test
}  // namespace grapnel
