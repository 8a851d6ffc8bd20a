// Selection of pairs, and exclusion of pairs by bounds without effect on the result.
#include "grapnel/contact/clearance_model.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "contact/random_shape.hpp"
#include "contact/small_models.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace clearance_model_test {

using namespace testing;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::ThrowsMessage;
using ::testing::UnorderedElementsAre;

const Geometry kBall{Shape::sphere, {0.1, 0, 0}, Posed::identity()};

// The checked pairs as "name-name", names in the order of the model.
std::vector<std::string> pair_names(const Model& model, const std::vector<std::string>& with_shape,
                                    const std::vector<std::pair<int, int>>& ignored = {}) {
  std::vector<BodyShape> shapes;
  for (const std::string& name : with_shape) shapes.push_back({model.body_index(name), kBall});
  const ClearanceModel clearance(model, shapes, ignored);
  std::vector<std::string> names;
  for (const ClearancePair& p : clearance.pairs()) {
    names.push_back(model.bodies()[p.body_a].description.name + "-" + model.bodies()[p.body_b].description.name);
  }
  return names;
}

// base - l1 - l2 - l3 - hand (fixed on l3), a camera fixed on the base, a free target.
Model arm() {
  return ModelBuilder()
      .add(body_on("base", "", JointType::free))
      .add(body_on("camera", "base", JointType::fixed))
      .add(body_on("l1", "base", JointType::revolute))
      .add(body_on("l2", "l1", JointType::revolute))
      .add(body_on("l3", "l2", JointType::revolute))
      .add(body_on("hand", "l3", JointType::fixed))
      .add(body_on("target", "", JointType::free))
      .build();
}

TEST(ClearancePairs, ExcludeAdjacentAndRigidlyConnectedBodies) {
  EXPECT_THAT(
      pair_names(arm(), {"base", "camera", "l1", "l2", "l3", "hand", "target"}),
      UnorderedElementsAre("base-l2", "base-l3", "base-hand", "base-target", "camera-l2", "camera-l3", "camera-hand",
                           "camera-target", "l1-l3", "l1-hand", "l1-target", "l2-target", "l3-target", "hand-target"));
}

TEST(ClearancePairs, SkipBodiesWithoutShapes) {
  // l2 and l1 have no shape: l3 is then adjacent to the base; the target is adjacent to no body.
  EXPECT_THAT(pair_names(arm(), {"base", "l3", "target"}), UnorderedElementsAre("base-target", "l3-target"));
  // A shape on a rigidly attached body counts for the body without a shape.
  EXPECT_THAT(pair_names(arm(), {"l2", "hand"}), IsEmpty());
  EXPECT_THAT(pair_names(arm(), {"l1", "hand"}), IsEmpty());
  EXPECT_THAT(pair_names(arm(), {"camera", "l2", "hand"}), UnorderedElementsAre("camera-hand"));
}

TEST(ClearancePairs, IncludeSiblingsOfAParentWithoutShape) {
  const Model model = ModelBuilder()
                          .add(body_on("base", "", JointType::free))
                          .add(body_on("left", "base", JointType::revolute))
                          .add(body_on("right", "base", JointType::revolute))
                          .build();
  EXPECT_THAT(pair_names(model, {"left", "right"}), UnorderedElementsAre("left-right"));
  EXPECT_THAT(pair_names(model, {"base", "left", "right"}), UnorderedElementsAre("left-right"));
}

TEST(ClearancePairs, IncludeEveryShapeOfABody) {
  const Model model = free_bodies(3);
  const ClearanceModel clearance(model, {{0, kBall}, {0, kBall}, {1, kBall}, {2, kBall}, {1, kBall}});
  EXPECT_EQ(clearance.pairs().size(), 2u * 2 + 2 + 2);
  for (const ClearancePair& p : clearance.pairs()) EXPECT_NE(p.body_a, p.body_b);
}

TEST(ClearancePairs, ExcludeBodiesFixedToTheWorld) {
  const Model model = ModelBuilder()
                          .add(body_on("wall", "", JointType::fixed))
                          .add(body_on("stand", "", JointType::fixed))
                          .add(body_on("arm", "stand", JointType::revolute))
                          .build();
  EXPECT_THAT(pair_names(model, {"wall", "stand", "arm"}), IsEmpty());
}

TEST(ClearancePairs, HeldTargetBelongsToTheEndEffector) {
  const Model held = ModelBuilder(arm())
                         .attach("target", "hand", Posed::identity(), body_on("grasp", "", JointType::fixed).joint)
                         .build();
  EXPECT_THAT(pair_names(held, {"l2", "l3", "hand", "target"}), IsEmpty());
  EXPECT_THAT(pair_names(held, {"l1", "l3", "hand", "target"}), IsEmpty());
  EXPECT_THAT(pair_names(held, {"base", "l1", "l2", "target"}),
              UnorderedElementsAre("base-l2", "base-target", "l1-target"));
  // Held at a point, it is adjacent to the hand.
  const Model hinged =
      ModelBuilder(arm())
          .attach("target", "hand", Posed::identity(), body_on("grasp", "", JointType::spherical).joint)
          .build();
  EXPECT_THAT(pair_names(hinged, {"l2", "hand", "target"}), UnorderedElementsAre("l2-target"));
}

TEST(ClearancePairs, IgnoredPairsInEitherOrder) {
  const Model model = arm();
  const int base = model.body_index("base"), l3 = model.body_index("l3"), target = model.body_index("target");
  EXPECT_THAT(pair_names(model, {"base", "l1", "l3", "target"}, {{l3, base}, {base, target}}),
              UnorderedElementsAre("l1-target", "l3-target"));
}

TEST(ClearanceModel, RejectsInvalidArguments) {
  const Model model = arm();
  const auto build = [&](int body, const Geometry& g) {
    return [&model, body, g] { ClearanceModel(model, {{body, g}}); };
  };
  EXPECT_THAT(build(7, kBall), ThrowsMessage<std::invalid_argument>(HasSubstr("body 7")));
  const int l2 = model.body_index("l2");
  for (const Geometry& g : {Geometry{Shape::sphere, {0, 0, 0}, {}}, Geometry{Shape::box, {1, 1, -1}, {}},
                            Geometry{Shape::cylinder, {1, NAN, 0}, {}}, Geometry{Shape::capsule, {1, -1, 0}, {}}}) {
    EXPECT_THAT(build(l2, g), ThrowsMessage<std::invalid_argument>(HasSubstr("'l2'")));
  }
  EXPECT_NO_THROW(build(l2, {Shape::capsule, {1, 0, 0}, {}})());
  const std::pair<int, int> ignored[] = {{0, 9}};
  EXPECT_THROW(ClearanceModel(model, {}, ignored), std::invalid_argument);
}

TEST(ClearanceModel, WithoutPairsTheDistanceIsInfinite) {
  const Model model = arm();
  const ClearanceModel clearance(model, {{0, {}}, {1, kBall}});
  EXPECT_EQ(clearance.shapes().size(), 1U);
  const Clearance minimum = clearance.minimum(forward_kinematics(model, zero_state(model)));
  EXPECT_EQ(minimum.distance, INFINITY);
  EXPECT_EQ(minimum.pair, -1);
}

struct Case {
  Model model;
  ClearanceModel clearance;
  State state;
};
Case random_case(int index, int max_bodies, double max_size) {
  Random random(index);
  RobotOptions options;
  options.max_bodies = max_bodies;
  options.targets = 3;
  Case c{random_model(options, random), {}, {}};
  std::vector<BodyShape> shapes;
  for (int i = 0; i < static_cast<int>(c.model.bodies().size()); ++i) {
    Geometry g = random_shape(kShapes[random.integer(0, 3)], 0.02, max_size, random);
    g.X_BG = random_pose(0.2, random);
    shapes.push_back({i, g});
  }
  c.clearance = ClearanceModel(c.model, shapes);
  c.state = random_state(c.model, random);
  return c;
}

TEST(ClearanceModel, BoundsExcludeOnlyMoreDistantPairs) {
  int overlapping = 0, apart = 0;
  for (int i = 0; i < 400; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i, 30, i % 2 == 0 ? 1 : 0.1);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    double smallest = INFINITY;
    for (int p = 0; p < static_cast<int>(c.clearance.pairs().size()); ++p) {
      const double d = c.clearance.distance(p, kinematics).distance;
      if (d > 0) {
        ASSERT_LE(c.clearance.lower_bound(p, kinematics), d + 1e-12);
      }
      smallest = std::min(smallest, d);
    }
    const Clearance found = c.clearance.minimum(kinematics);
    ASSERT_EQ(found.distance, smallest);
    if (found.pair < 0) continue;
    ++(smallest < 0 ? overlapping : apart);
    const ClearancePair& pair = c.clearance.pairs()[found.pair];
    EXPECT_EQ(pair.body_a, found.body_a);
    EXPECT_EQ(pair.body_b, found.body_b);
    EXPECT_NEAR(norm(found.point_b - found.point_a), std::abs(smallest), 1e-9);
  }
  EXPECT_GT(overlapping, 50);
  EXPECT_GT(apart, 50);
}

// The rate of the distance is within the speed bound, along exact motions.
TEST(ClearanceModel, SpeedBoundHolds) {
  Worst ratio("rate of distance over its bound");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i, 12, 0.3);
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    const double h = 1e-6;
    State later = c.state;
    std::vector<double> rates(c.state.q.size());
    coordinate_rates(c.model, c.state.q, c.state.v, rates);
    for (std::size_t k = 0; k < rates.size(); ++k) later.q[k] += h * rates[k];
    const Kinematics moved = forward_kinematics(c.model, later);
    for (int p = 0; p < static_cast<int>(c.clearance.pairs().size()); ++p) {
      const double d = c.clearance.distance(p, kinematics).distance;
      if (d < 1e-3) continue;
      const double rate = (c.clearance.distance(p, moved).distance - d) / h;
      // 1 where the motion is along the normal.
      ASSERT_LT(ratio.note(std::abs(rate) / c.clearance.speed_bound(p, kinematics), i), 1 + 1e-3);
    }
  }
  EXPECT_GT(ratio.value(), 0.5);
}

}  // namespace clearance_model_test
}  // namespace grapnel
