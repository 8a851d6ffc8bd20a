#include "grapnel/campaign/grid.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace grapnel {
namespace grid_test {

using ::testing::ElementsAre;

TEST(Grid, TheFirstAxisVariesSlowest) {
  const std::vector<std::size_t> sizes{2, 3, 2};
  EXPECT_THAT(grid_position(sizes, 0), ElementsAre(0, 0, 0));
  EXPECT_THAT(grid_position(sizes, 1), ElementsAre(0, 0, 1));
  EXPECT_THAT(grid_position(sizes, 2), ElementsAre(0, 1, 0));
  EXPECT_THAT(grid_position(sizes, 6), ElementsAre(1, 0, 0));
  EXPECT_THAT(grid_position(sizes, 11), ElementsAre(1, 2, 1));
}

TEST(Grid, RangesHaveExactEnds) {
  EXPECT_THAT(spaced_values(0, 0.3, 4, false), ElementsAre(0, ::testing::DoubleEq(0.1), ::testing::DoubleEq(0.2), 0.3));
  EXPECT_EQ(spaced_values(0.1, 0.7, 7, false).back(), 0.7);
  EXPECT_THAT(spaced_values(0.01, 100, 5, true),
              ElementsAre(0.01, ::testing::DoubleEq(0.1), ::testing::DoubleEq(1), ::testing::DoubleEq(10), 100));
}

}  // namespace grid_test
}  // namespace grapnel
