/// @file
/// timeseries.h5 written by other programs, without a checksum: reading always ends without a crash, for any content.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "grapnel/result/hdf5_reader.hpp"
#include "grapnel/result/hdf5_writer.hpp"
#include "result/sample_result.hpp"

namespace grapnel {
namespace hdf5_foreign_test {

// Without the checksum, damaged data reach HDF5, which crashes or loops endlessly on some of them. The result must
// still be an error, or consistent numbers.
TEST(ForeignHdf5, IsAnErrorOrReadNeverACrash) {
  const test::TemporaryFolder folder;
  const std::filesystem::path path = folder / "timeseries.h5";
  write_timeseries_hdf5(test::sample_series(701), test::sample_metadata(), path);
  const std::string bytes = test::bytes_of(path);
  std::mt19937 random(3);
  const std::string plain = bytes.substr(0, bytes.size() - 16);
  int errors = 0;
  for (int i = 0; i < 160; ++i) {
    std::string damaged = plain;
    // Every second byte in the first kilobytes, which contain HDF5's metadata.
    const std::size_t reach = i % 2 == 0 ? damaged.size() : std::size_t{4096};
    for (std::size_t hits = 1 + random() % 6; hits > 0; --hits) damaged[random() % reach] = static_cast<char>(random());
    test::put_bytes(path, damaged);
    const std::string message = test::message_of([&] { read_timeseries(path); });
    if (message.empty()) continue;
    ++errors;
    ASSERT_THAT(message, testing::HasSubstr("cannot read " + path.string())) << i;
  }
  EXPECT_GT(errors, 60);  // measured 116
}

}  // namespace hdf5_foreign_test
}  // namespace grapnel
