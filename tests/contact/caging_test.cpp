#include "grapnel/contact/caging.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace grapnel {
namespace {

using Verdict = CageAnswer::Verdict;

Geometry shape_of(Geometry::Shape shape, Vector3d size, Posed X_BG = Posed::identity()) {
  return {shape, size, X_BG, nullptr};
}

Geometry box(Vector3d size, Vector3d at) { return shape_of(Geometry::Shape::box, size, {Rotationd::identity(), at}); }

PlacedContactShape fixed(const Geometry& geometry) { return {Posed::identity(), ContactShape(geometry)}; }

// Walls of a room with inner edges of this length [m]; the lid (z > 0) is two boards with a slit between them.
std::vector<PlacedContactShape> room(double slit, double inner = 1) {
  const double outer = inner + 0.4, at = 0.5 * inner + 0.1;
  std::vector<PlacedContactShape> walls;
  for (const double side : {-1.0, 1.0}) {
    walls.push_back(fixed(box({0.2, outer, outer}, {at * side, 0, 0})));
    walls.push_back(fixed(box({outer, 0.2, outer}, {0, at * side, 0})));
    const double width = 0.5 * (outer - slit);
    walls.push_back(fixed(box({width, outer, 0.2}, {side * 0.5 * (slit + width), 0, at})));
  }
  walls.push_back(fixed(box({outer, outer, 0.2}, {0, 0, -at})));
  return walls;
}

Cage ball_in_room(double slit, double radius) {
  return {room(slit), {ContactShape(shape_of(Geometry::Shape::sphere, {radius, 0, 0}))}, Posed::identity()};
}

TEST(SearchCage, LetsABallLeaveThroughASlitThatIsWideEnough) {
  // A ball of diameter 0.2 passes a slit of 0.22, and none of 0.12, with an allowance of 0.02 on each side.
  const CageSearch search{.resolution = 0.01};
  EXPECT_EQ(search_cage(ball_in_room(0.22, 0.1), search).verdict, Verdict::can_leave);
  const CageAnswer kept = search_cage(ball_in_room(0.12, 0.1), search);
  EXPECT_EQ(kept.verdict, Verdict::caged);
  EXPECT_DOUBLE_EQ(kept.allowance, 0.02);
}

TEST(SearchCage, LeavesNarrowPassagesUndecidedAtACoarseResolution) {
  // Passage depends on less than the resolution; the ball is caged at half of it.
  const CageAnswer answer = search_cage(ball_in_room(0.15, 0.1), {.resolution = 0.02});
  EXPECT_NE(answer.verdict, Verdict::caged);
  EXPECT_FALSE(answer.out_of_cells);
  EXPECT_EQ(search_cage(ball_in_room(0.15, 0.1), {.resolution = 0.006, .max_cells = 200'000}).verdict, Verdict::caged);
}

TEST(SearchCage, ReportsWhenItRunsOutOfCells) {
  const CageAnswer answer = search_cage(ball_in_room(0.17, 0.1), {.resolution = 0.005, .max_cells = 100});
  EXPECT_EQ(answer.verdict, Verdict::undecided);
  EXPECT_TRUE(answer.out_of_cells);
  EXPECT_LE(answer.cells, 200);
}

TEST(SearchCage, LetsAFreeBodyLeave) {
  const Cage alone{{}, {ContactShape(box({1, 1, 1}, {0, 0, 0}))}, Posed::identity()};
  EXPECT_EQ(search_cage(alone).verdict, Verdict::can_leave);
  const Cage beside{{fixed(box({1, 1, 1}, {1.2, 0, 0}))}, alone.moving, Posed::identity()};
  EXPECT_EQ(search_cage(beside).verdict, Verdict::can_leave);
  EXPECT_THROW(search_cage({beside.fixed, {}, Posed::identity()}), std::invalid_argument);
}

TEST(SearchCage, ShowsByAnInnerBallThatABoxIsCaged) {
  // A cube of 0.3 m in a room of 0.5 m; the slit lets its corner in, but not the ball inside of it.
  const Cage kept{room(0.2, 0.5), {ContactShape(box({0.3, 0.3, 0.3}, {0, 0, 0}))}, Posed::identity()};
  EXPECT_EQ(search_cage(kept, {.resolution = 0.01}).verdict, Verdict::caged);
  const Cage free{room(0.45, 0.5), kept.moving, Posed::identity()};
  EXPECT_EQ(search_cage(free, {.resolution = 0.02, .max_cells = 200'000}).verdict, Verdict::can_leave);
}

TEST(SearchCage, FindsTheOpenDirectionOfARing) {
  Cage cage{{}, {ContactShape(box({0.4, 0.4, 0.1}, {0, 0, 0}))}, Posed::identity()};
  for (const double side : {-1.0, 1.0}) {
    cage.fixed.push_back(fixed(box({0.1, 0.8, 0.1}, {0.27 * side, 0, 0})));
    cage.fixed.push_back(fixed(box({0.8, 0.1, 0.1}, {0, 0.27 * side, 0})));
  }
  EXPECT_EQ(search_cage(cage, {.resolution = 0.01}).verdict, Verdict::can_leave);
}

TEST(SearchCage, TurnsARodTowardsAnOpening) {
  // Across the slit, longer than it is wide: it has to turn.
  const Posed across{rotation_about({0, 1, 0}, 0.5 * std::numbers::pi), Vector3d::zero()};
  const ContactShape rod(shape_of(Geometry::Shape::capsule, {0.05, 0.5, 0}));
  EXPECT_EQ(search_cage({room(0.3), {rod}, across}, {.resolution = 0.02}).verdict, Verdict::can_leave);
  const ContactShape short_rod(shape_of(Geometry::Shape::capsule, {0.1, 0.1, 0}));
  EXPECT_EQ(search_cage({room(0.05, 0.35), {short_rod}, across}, {.resolution = 0.005}).verdict, Verdict::caged);
}

TEST(SearchCage, TurnsAPlateParallelToASlit) {
  // A lying plate of 60 mm leaves through a slit of 120 mm only upright and parallel to it.
  const ContactShape plate(box({0.5, 0.5, 0.06}, {0, 0, 0}));
  const CageSearch search{.resolution = 0.005, .max_cells = 20'000};
  EXPECT_EQ(search_cage({room(0.12, 0.7), {plate}, Posed::identity()}, search).verdict, Verdict::can_leave);
  // A plate that is thicker than the slit remains.
  const ContactShape thick(box({0.3, 0.3, 0.2}, {0, 0, 0}));
  EXPECT_EQ(search_cage({room(0.12, 0.7), {thick}, Posed::identity()}, {.resolution = 0.01}).verdict, Verdict::caged);
}

TEST(SearchCage, DoesNotDependOnTheFrame) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vector3d axis{uniform(random), uniform(random), uniform(random)};
  const Posed X_WF{rotation_about((1 / norm(axis)) * axis, 3 * uniform(random)), {uniform(random), 5, -3}};
  Cage cage = ball_in_room(0.12, 0.1);
  for (PlacedContactShape& wall : cage.fixed) wall.X_FB = X_WF * wall.X_FB;
  cage.X_FM = X_WF * cage.X_FM;
  EXPECT_EQ(search_cage(cage, {.resolution = 0.01}).verdict, Verdict::caged);
}

TEST(SearchCage, AllowsForPresentOverlaps) {
  Cage cage = ball_in_room(0.12, 0.1);
  cage.X_FM.p = {0.403, 0, 0};  // 3 mm into a wall
  const CageAnswer answer = search_cage(cage, {.resolution = 0.01});
  EXPECT_NEAR(answer.allowance, 0.023, 1e-12);
  EXPECT_EQ(answer.verdict, Verdict::caged);
}

}  // namespace
}  // namespace grapnel
