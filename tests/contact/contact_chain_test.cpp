// A sphere on a shape of a flexible link: forces of a straight link, balances of a bent one, continuity at cuts.

#include "grapnel/contact/contact_chain.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "contact/contact_cases.hpp"
#include "grapnel/contact/contact_set.hpp"

namespace grapnel::testing::contact_chain {
namespace {

using Shape = Geometry::Shape;

constexpr int kBall = 3;  // the bodies before it are the pieces
constexpr double kRadius = 0.1, kHalf = 0.05;

// Three pieces of a link of 1 m along x.
ContactChain chain() {
  return {
      {0, 0.02, 0}, {1, 0, 0}, {{0, {0, 0, 0}}, {1, {0.3, 0.02, 0}}, {2, {0.6, 0.02, 0}}}, {{0.3, 0.07}, {0.6, 0.07}}};
}

ContactShape link_shape(Shape shape) {
  Geometry g = primitive(shape, shape == Shape::box ? Vector3d{2 * kHalf, 2 * kHalf, 1} : Vector3d{kHalf, 1, 0});
  g.X_BG = {rotation_about({0, 1, 0}, 0.5 * M_PI), {0.5, 0.02, 0}};
  return ContactShape(g);
}

ContactLaw law_of(bool lossy) {
  ContactLaw law = elastic_law();
  if (lossy) {
    law.dissipation = 0.5;
    law.static_friction = 0.4, law.kinetic_friction = 0.3, law.rolling_length = 1e-3, law.torsional_length = 1e-3;
  }
  return law;
}

struct Scene {
  explicit Scene(Shape shape, bool as_chain, bool lossy, bool link_first = true)
      : set(surfaces(shape, as_chain),
            {link_first ? SurfacePair{0, 1, law_of(lossy)} : SurfacePair{1, 0, law_of(lossy)}}, 1) {}
  static std::vector<ContactSurface> surfaces(Shape shape, bool as_chain) {
    ContactSurface link{0, link_shape(shape)};
    if (as_chain) link.chain = std::make_shared<const ContactChain>(chain());
    return {link, {kBall, ContactShape(primitive(Shape::sphere, {kRadius, 0, 0}))}};
  }
  // Forces in a state => the group's sums.
  const GroupContact& at(const Kinematics& kinematics, const StickState& stick = {}) {
    set.begin(0, kinematics);
    const double numbers[] = {stick.slip[0], stick.slip[1], stick.slip[2], stick.spin};
    set.set_stick(numbers);
    wrenches.clear();
    set.evaluate(kinematics, wrenches);
    return set.group(0);
  }
  ContactSet set;
  std::vector<ExternalWrench> wrenches;
};

// A straight link with a twist at its origin, and the ball at a point of L.
Kinematics straight(const Posed& X_WL, const Twistd& V_WL, const Vector3d& p_LC, const Twistd& V_ball) {
  const ContactChain link = chain();
  Kinematics k;
  for (const ContactChain::Piece& piece : link.pieces) {
    k.X_WB.push_back({X_WL.R, X_WL * piece.p_LB});
    k.V_WB.push_back(shift(V_WL, X_WL.R * piece.p_LB));
  }
  k.X_WB.push_back({X_WL.R, X_WL * p_LC}), k.V_WB.push_back(V_ball);
  return k;
}

Wrenchd sum_about(const std::vector<ExternalWrench>& wrenches, bool ball, const Vector3d& p) {
  Wrenchd sum = Wrenchd::zero();
  for (const ExternalWrench& w : wrenches) {
    if ((w.body == kBall) == ball) sum += shift(w.F_W, p - w.p_WP);
  }
  return sum;
}

TEST(ContactChain, AStraightLinkActsAsARigidOne) {
  int touching = 0, at_cut = 0;
  for (const Shape shape : {Shape::capsule, Shape::cylinder, Shape::box}) {
    Random random(11);
    for (const bool link_first : {true, false}) {
      for (double x = -0.12; x < 1.13; x += 0.01) {
        const Posed X_WL{random.rotation(), random.vector(2)};
        const Twistd V_WL{random.vector(0.3), random.vector(0.3)}, V_ball{random.vector(0.3), random.vector(0.3)};
        const Kinematics k = straight(X_WL, V_WL, {x, 0.02, kHalf + kRadius - 1e-3 * random.uniform(0.5, 1)}, V_ball);
        const StickState stick{random.vector(0.4), 0.1};
        Scene flexible(shape, true, true, link_first), rigid(shape, false, true, link_first);
        const GroupContact a = flexible.at(k, stick), b = rigid.at(k, stick);
        EXPECT_EQ(a.touches, b.touches);
        if (!b.touches) continue;
        ++touching, at_cut += flexible.wrenches.size() == 4;
        const double size = b.normal_force;
        const Vector3d p = k.X_WB[kBall].p;
        for (const bool ball : {true, false}) {
          const Wrenchd f = sum_about(flexible.wrenches, ball, p), g = sum_about(rigid.wrenches, ball, p);
          EXPECT_LT(norm(f.linear - g.linear), 1e-10 * size);  // measured 3e-13
          EXPECT_LT(norm(f.angular - g.angular), 1e-10 * size);
        }
        EXPECT_NEAR(a.power, b.power, 1e-10 * size);
        EXPECT_NEAR(a.friction_power, b.friction_power, 1e-10 * size);
        EXPECT_NEAR(a.damping_power, b.damping_power, 1e-10 * size);
        EXPECT_NEAR(flexible.set.elastic_energy(0, k), rigid.set.elastic_energy(0, k), 1e-12 * size);
      }
    }
  }
  EXPECT_GT(touching, 500);
  EXPECT_GT(at_cut, 100);
}

// Pieces that move relative to each other: the power of the forces is that of the elastic energy and the losses.
TEST(ContactChain, ForcesOfABentLinkBalanceEnergyAndMomentum) {
  int at_cut = 0;
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(9000 + i);
    const Shape shape = i % 3 == 0 ? Shape::capsule : i % 3 == 1 ? Shape::cylinder : Shape::box;
    const double x = random.uniform(0.2, 0.7);
    Kinematics k = straight({random.rotation(), random.vector(2)}, Twistd::zero(),
                            {x, 0.02, kHalf + kRadius - random.uniform(4e-3, 6e-3)}, Twistd::zero());
    for (int body = 0; body <= kBall; ++body) {
      k.V_WB[body] = {random.vector(0.5), random.vector(0.5)};
      if (body < kBall) k.X_WB[body] = moved(k.X_WB[body], {random.vector(4e-3), random.vector(5e-4)}, 1);
    }
    Scene scene(shape, true, i % 2 == 1, i % 4 < 2);
    const GroupContact sums = scene.at(k, {random.vector(0.4), 0.1});
    ASSERT_TRUE(sums.touches);
    at_cut += scene.wrenches.size() == 4;
    const auto energy = [&](double t) {
      Kinematics later = k;
      for (int body = 0; body <= kBall; ++body) later.X_WB[body] = moved(k.X_WB[body], k.V_WB[body], t);
      return scene.set.elastic_energy(0, later);
    };
    constexpr double h = 1e-5;
    const double rate = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
    const double defect = std::abs(sums.power + rate + sums.damping_power + sums.friction_power) / sums.normal_force;
    EXPECT_LT(defect, 1e-7);
    worst = std::max(worst, defect);
    const Wrenchd on_ball = sum_about(scene.wrenches, true, {}), on_link = sum_about(scene.wrenches, false, {});
    EXPECT_LT(norm(on_ball.linear + on_link.linear), 1e-12 * sums.normal_force);
    EXPECT_LT(norm(on_ball.angular + on_link.angular), 1e-11 * sums.normal_force);
  }
  std::printf("[ measured ] %d at a cut, largest defect of power %.2g of the force times 1 m/s\n", at_cut, worst);
  EXPECT_GT(at_cut, 60);
}

// The ball passes both cuts of a bent link: between samples the force changes in proportion to their distance.
TEST(ContactChain, ForcesAreContinuousAtCuts) {
  for (const double bend : {-0.03, 0.03}) {
    const auto largest_step = [&](int samples) {
      Scene scene(Shape::capsule, true, false);
      Vector3d before = Vector3d::zero();
      double step = 0, touched = 0;
      for (int i = 0; i <= samples; ++i) {
        const double x = 0.15 + 0.6 * i / samples;
        Kinematics k = straight(Posed::identity(), Twistd::zero(), {x, 0.02, 0}, Twistd::zero());
        k.X_WB[1].R = rotation_about({0, 1, 0}, bend), k.X_WB[2].R = rotation_about({0, 1, 0}, 2 * bend);
        k.X_WB[2].p = k.X_WB[1] * Vector3d{0.3, 0, 0};
        // Along the arc of the axis, at a nearly constant depth.
        const double height = -0.5 * bend / 0.3 * (x - 0.15) * (x - 0.15);
        k.X_WB[kBall].p[2] = height + kHalf + kRadius - 6e-3;
        const GroupContact& sums = scene.at(k);
        touched += sums.touches;
        if (i > 0) step = std::max(step, norm(sums.force_on_b - before));
        before = sums.force_on_b;
      }
      EXPECT_EQ(touched, samples + 1);
      return step;
    };
    const double coarse = largest_step(2000), fine = largest_step(4000);
    std::printf("[ measured ] bend %.3g: steps of the force %.4g N and %.4g N\n", bend, coarse, fine);
    EXPECT_NEAR(fine / coarse, 0.5, 0.05);
  }
}

TEST(ContactChain, OnlySpheresMeetALink) {
  ContactSurface link{0, link_shape(Shape::box), std::make_shared<const ContactChain>(chain())};
  const ContactSurface block{kBall, ContactShape(primitive(Shape::box, {0.1, 0.1, 0.1}))};
  EXPECT_THROW(ContactSet({link, block}, {{0, 1, elastic_law()}}, 1), std::invalid_argument);
  EXPECT_THROW(ContactSet({link, link}, {{0, 1, elastic_law()}}, 1), std::invalid_argument);
}

}  // namespace
}  // namespace grapnel::testing::contact_chain
