/// Parts of the search of cages against independent checks: bounds of cells, rotations, inner balls, known answers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "contact/cage_cases.hpp"
#include "grapnel/contact/cage_poses.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace cage_proof_test {

using namespace cage_cases;
using test::repetitions;
using Verdict = CageAnswer::Verdict;

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine_); }
  Vector3d in_ball(double radius) {
    Vector3d p;
    do {
      for (int k = 0; k < 3; ++k) p[k] = uniform(-1, 1);
    } while (dot(p, p) > 1 || dot(p, p) == 0);
    return radius * p;
  }
  Rotationd turn(double largest) {
    const Vector3d v = in_ball(1);
    return rotation_about((1 / norm(v)) * v, uniform(0, largest));
  }

 private:
  std::mt19937 engine_;
};

// Smallest signed distance by the module's general distances, without any of the search's bounds.
double separation(const Cage& cage, const Posed& X_FM) {
  double least = std::numeric_limits<double>::infinity();
  for (const PlacedContactShape& one : cage.fixed) {
    for (const ContactShape& moving : cage.moving)
      least = std::min(least, PairContact(one.shape, moving, ContactLaw{}).separation(one.X_FB, X_FM).distance);
  }
  return least;
}

TEST(CagePoses, LabelsOfCellsHoldForAllTheirPoses) {
  Random random(3);
  int blocked = 0, free = 0;
  for (const CageCase& c : cage_cases_with_answers()) {
    if (c.cage.moving.size() > 3) continue;  // many pairs take long without bounds
    CagePoses poses(c.cage, 0);
    const double size = poses.body().radius;
    for (int i = 0; i < repetitions(60); ++i) {
      const Vector3d p = random.in_ball(1.5 * size);
      const Rotationd R = random.turn(std::numbers::pi);
      const CageMotion motion{random.uniform(0, 0.1) * size, random.uniform(0, 0.15)};
      const CageOverlap::Kind kind = poses.overlap(poses.pose(p, R), motion).kind;
      if (kind == CageOverlap::Kind::mixed) continue;
      ++(kind == CageOverlap::Kind::blocked ? blocked : free);
      for (int k = 0; k < 8; ++k) {
        const Posed X_FM = poses.pose(p + random.in_ball(motion.translation), R * random.turn(motion.angle));
        const double distance = separation(c.cage, X_FM) + poses.allowance();
        EXPECT_EQ(distance < 0, kind == CageOverlap::Kind::blocked) << c.name << " " << distance;
      }
    }
  }
  EXPECT_GT(blocked, repetitions(60));  // measured several hundred
  EXPECT_GT(free, repetitions(60));
}

TEST(CagePoses, FreeSharesOfMotionsDoNotOverlap) {
  Random random(4);
  const Cage cage{wire_cage(0.9, 0.02, 2), shapes({box({0.3, 0.2, 0.06})}), at(0, 0, 0)};
  const CagePoses poses(cage, 0);
  int moves = 0;
  for (int i = 0; i < repetitions(200); ++i) {
    const Vector3d p = random.in_ball(0.3), to = random.in_ball(0.5);
    const Rotationd R = random.turn(std::numbers::pi), turn = random.turn(2);
    const double angle = rotation_angle(turn);
    const double share = poses.free_share(poses.pose(p, R), {norm(to), angle});
    if (share <= 0) continue;
    ++moves;
    const Vector3d axis = (1 / angle) * rotation_vector(turn);
    for (const double part : {0.5, 1.0}) {
      const Posed X_FM = poses.pose(p + part * share * to, R * rotation_about(axis, part * share * angle));
      EXPECT_GT(separation(cage, X_FM) + poses.allowance(), -1e-12);
    }
  }
  EXPECT_GT(moves, repetitions(50));
}

// Bodies of revolution have two coordinates of rotation, perpendicular to their axis, and spheres about the centre
// none.
TEST(RotationSpace, HasTheRotationsThatChangeTheShapes) {
  const auto dims = [](const std::vector<Geometry>& body, const Vector3d& center = Vector3d::zero()) {
    return rotation_space(shapes(body), center).dims;
  };
  const Geometry sphere = shape_at(Shape::sphere, {1, 0, 0}), raised = shape_at(Shape::sphere, {1, 0, 0}, {0, 0, 2});
  EXPECT_EQ(dims({sphere}), 0);
  EXPECT_EQ(dims({sphere}, {0, 0, 0.1}), 3);
  EXPECT_EQ(dims({box({1, 1, 1})}), 3);
  EXPECT_EQ(dims({shape_at(Shape::cylinder, {1, 3, 0}), raised}), 2);
  EXPECT_EQ(dims({shape_at(Shape::cylinder, {1, 3, 0}), raised}, {0.1, 0, 0}), 3);
  EXPECT_EQ(dims({shape_at(Shape::cylinder, {1, 3, 0}), shape_in(Shape::capsule, {1, 3, 0}, at(0, 0, 0, about_x(1)))}),
            3);
  const RotationSpace tilted =
      rotation_space(shapes({shape_in(Shape::capsule, {1, 3, 0}, at(0, 0, 0, about_x(1)))}), Vector3d::zero());
  EXPECT_EQ(tilted.dims, 2);
  EXPECT_NEAR(norm(tilted.axes[2] - about_x(1).column(2)), 0, 1e-15);
}

// Every point of an inner ball is in a shape of the body.
TEST(InnerBalls, AreInsideOfTheBody) {
  Random random(5);
  for (const CageCase& c : cage_cases_with_answers()) {
    for (const ContactShape& ball : inner_balls(c.cage.moving)) {
      for (int i = 0; i < repetitions(20); ++i) {
        const Vector3d n = random.in_ball(1), p_M = ball.X_BC().p + (0.999 * ball.core().rounding / norm(n)) * n;
        EXPECT_TRUE(std::ranges::any_of(c.cage.moving, [&](const ContactShape& shape) {
          return shape.distance(inverse(shape.X_BC()) * p_M).distance < shape.core().rounding;
        })) << c.name;
      }
    }
  }
}

// The default search decides these; it may leave others undecided.
TEST(SearchCage, MeetsKnownAnswers) {
  SKIP_UNDER_SANITIZERS();
  int decided = 0;
  for (const CageCase& c : cage_cases_with_answers()) {
    const bool expected = c.name == "cube in a loose wire cage" || c.name == "ball in a tripod" ||
                          c.name == "cylinder in a tripod" || c.name == "cube in a wire cage with wide openings" ||
                          c.name == "ball with a handle in a hole";
    if (!expected) continue;
    EXPECT_EQ(search_cage(c.cage).verdict, c.verdict) << c.name;
    ++decided;
  }
  EXPECT_EQ(decided, 5);
}

TEST(SearchCage, DoesNotContradictKnownAnswers) {
  for (const CageCase& c : cage_cases_with_answers()) {
    const Verdict verdict = search_cage(c.cage, {.max_cells = 3000}).verdict;
    EXPECT_TRUE(verdict == c.verdict || verdict == Verdict::undecided) << c.name;
  }
}

// A thin ring on a large tank: the tank's radius alone would permit overlaps larger than the ring.
TEST(SearchCage, AllowsForOverlapsBelowTheThicknessOfAllShapes) {
  const CageAnswer answer = search_cage(ring_clamp(0.07, true), {.max_cells = 1000});
  EXPECT_DOUBLE_EQ(answer.resolution, 0.0005);  // a tenth of half a jaw plate of 10 mm
  EXPECT_LT(answer.allowance, 0.005);
  EXPECT_NE(answer.verdict, Verdict::can_leave);
}

}  // namespace cage_proof_test
}  // namespace grapnel::testing
