/// The linkages' closed forms against finite differences and energy, and the maximal-coordinate model against them.

#include <gtest/gtest.h>

#include "oracle/linkage_case.hpp"
#include "oracle/maximal_system.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::oracle {
namespace linkage_test {

using namespace grapnel::testing;

constexpr LinkageCut kCuts[] = {LinkageCut::pin_hinge, LinkageCut::pin_point, LinkageCut::cut};

// Five-point stencil.
template <class F>
auto slope(F&& f, double x, double h = 1e-3) {
  return ((8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h));
}

TEST(FourBar, ClosesAndItsDerivativesAreThoseOfItsAngles) {
  const FourBar bars = crank_rocker();
  Worst worst("slopes");  // measured 3e-12
  for (int i = 0; i < 24; ++i) {
    const double f = 0.1 + i * M_PI / 12;
    const FourBar::Angles g = bars.angles(f);
    const Vector2 gap = bars.crank.length * along(f) + bars.coupler.length * along(g.coupler) -
                        Vector2(bars.ground, 0) - bars.rocker.length * along(g.rocker);
    EXPECT_LT(gap.norm(), 1e-14);
    const auto at = [&](auto member) { return [&bars, member](double x) { return bars.angles(x).*member; }; };
    EXPECT_LT(worst.note(std::abs(slope(at(&FourBar::Angles::coupler), f) - g.coupler1), i), 1e-9);
    EXPECT_LT(worst.note(std::abs(slope(at(&FourBar::Angles::rocker), f) - g.rocker1), i), 1e-9);
    EXPECT_LT(worst.note(std::abs(slope(at(&FourBar::Angles::coupler1), f) - g.coupler2), i), 1e-9);
    EXPECT_LT(worst.note(std::abs(slope(at(&FourBar::Angles::rocker1), f) - g.rocker2), i), 1e-9);
    const GroundedFourBar grounded{bars};
    EXPECT_NEAR(slope([&](double x) { return grounded.inertia(x)[0]; }, f), grounded.inertia(f)[1], 1e-9);
    const FloatingFourBar floating{bars};
    EXPECT_NEAR(
        slope([&](double x) { return floating.energy(x, 1.3, 2.0); }, f),
        floating.sums(f).reduced1() * 1.3 * 1.3 / 2 - 2 * floating.sums(f).tt1 / std::pow(floating.sums(f).tt, 2),
        1e-9);
  }
}

TEST(FourBar, TimeByQuadratureHasTheRateAndTheAccelerationOfItsInverse) {
  const GroundedFourBar g{crank_rocker(), {0.1, -0.3}};
  const auto angle = [&](double t) { return g.angle_at(t, 0.5, 2.5); };
  for (double t : {0.3, 0.9, 2.0}) {
    const double f = angle(t), rate = g.rate_at(f, 0.5, 2.5);
    EXPECT_NEAR(slope(angle, t), rate, 1e-9);
    EXPECT_NEAR(slope([&](double s) { return g.rate_at(angle(s), 0.5, 2.5); }, t), g.acceleration(f, rate), 1e-8);
  }
  const FloatingFourBar free{crank_rocker()};
  const double h = 1.1, E = free.energy(0.5, 2.5, h);
  const auto free_angle = [&](double t) { return free.angle_at(t, 0.5, E, h); };
  for (double t : {0.3, 0.9, 2.0}) {
    const double f = free_angle(t), rate = free.rate_at(f, E, h);
    EXPECT_NEAR(slope(free_angle, t), rate, 1e-9);
    EXPECT_NEAR(slope([&](double s) { return free.rate_at(free_angle(s), E, h); }, t), free.acceleration(f, rate, h),
                1e-8);
  }
}

TEST(FiveBar, ClosesAndConservesEnergy) {
  FiveBar bars = five_bar();
  const Vector2 x(2.2, 0.7), rate(0.8, -0.5);
  const Vector2 y = bars.coupler_angles(x);
  const Vector2 gap = bars.crank_end(x, 0) + bars.coupler[0].length * along(y[0]) - bars.crank_end(x, 1) -
                      bars.coupler[1].length * along(y[1]);
  EXPECT_LT(gap.norm(), 1e-14);
  const auto angles = [&](double t) { return bars.coupler_angles(x + t * rate); };
  const auto rates = [&](double t) {
    const Vector2 z = x + t * rate;
    return Vector2(bars.coupler_slopes(z, bars.coupler_angles(z)) * rate);
  };
  const auto difference = [&](auto&& f) {
    const double h = 1e-3;
    return Vector2((8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h));
  };
  EXPECT_LT((difference(angles) - rates(0)).norm(), 1e-10);
  EXPECT_LT((difference(rates) - bars.coupler_bias(x, y, rate, rates(0))).norm(), 1e-10);
  bars.gravity.setZero();
  Vector2 z = x, w = rate;
  bars.integrate(z, w, 1, 1000);
  EXPECT_GT((z - x).norm(), 0.3);
  EXPECT_NEAR(bars.kinetic_energy(z, w), bars.kinetic_energy(x, rate), 1e-11);
}

// --- The maximal-coordinate model against the closed forms. ---------------------------------------------------------

MaximalLoads loads(const Model& model, const Vector2& gravity, double torque) {
  MaximalLoads l;
  l.gravity = tilted().R * Vector3d{gravity[0], gravity[1], -0.6};  // what is normal to the plane must not matter
  l.tau.assign(model.velocities(), 0);
  l.tau[model.bodies()[model.body_index("crank")].v] = torque;
  return l;
}

TEST(MaximalSystem, AcceleratesTheFourBarOnTheGround) {
  Worst acceleration("four-bar acceleration"), force("force at the last pivot");  // measured 6e-14, 1e-14
  const GroundedFourBar g{crank_rocker(), {0.1, -0.3}};
  for (LinkageCut cut : kCuts) {
    const Linkage l = four_bar_model(g.bars, cut, false, tilted(), 0.07);
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const double f = 0.2 + i * M_PI / 6, rate = 2.5 - 0.3 * i;
      set_four_bar(g.bars, l.model, f, rate, state);
      const MaximalSolution s = MaximalSystem(l.model, l.closures)
                                    .accelerations(maximal_state(l.model, state), loads(l.model, g.gravity, 1.7));
      EXPECT_LT(acceleration.note(std::abs(joint_value(l.model, s.joints, "crank") - g.acceleration(f, rate, 1.7)), i),
                1e-11);
      if (cut != LinkageCut::pin_point) continue;
      // In the coupler's axes.
      const double p = g.bars.angles(f).coupler;
      const Vector2 F = g.force_at_C(f, rate, 1.7);
      EXPECT_LT(force.note(std::hypot(s.closures[0][3] - F.dot(along(p)), s.closures[0][4] - F.dot(across(p))), i),
                1e-10);
    }
  }
}

TEST(MaximalSystem, AcceleratesTheFloatingFourBar) {
  Worst worst("floating four-bar acceleration");  // measured 2e-14
  const FloatingFourBar g{crank_rocker()};
  for (LinkageCut cut : kCuts) {
    const Linkage l = four_bar_model(g.bars, cut, true, {});
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const double f = 0.2 + i * M_PI / 6, rate = 2.5 - 0.3 * i, h = 1.4 - 0.5 * i;
      set_four_bar(g.bars, l.model, f, rate, state);
      const Vector3d z = tilted().R.column(2), w = g.base_rate(f, rate, h) * z;
      set_root_pose(l.model, 0, tilted(), state);
      set_root_twist(l.model, 0, {w, {0.2, -0.4, 0.1}}, state);
      const MaximalSolution s = MaximalSystem(l.model, l.closures).accelerations(maximal_state(l.model, state), {});
      EXPECT_LT(worst.note(std::abs(joint_value(l.model, s.joints, "crank") - g.acceleration(f, rate, h)), i), 1e-11);
    }
  }
}

TEST(MaximalSystem, AcceleratesTheFiveBar) {
  Worst worst("five-bar acceleration");  // measured 2e-14
  const FiveBar bars = five_bar();
  for (LinkageCut cut : kCuts) {
    const Linkage l = five_bar_model(bars, cut, tilted(), 0.07);
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const Vector2 x(2.2 - 0.05 * i, 0.7 + 0.04 * i), rate(0.8 - 0.2 * i, -0.5 + 0.3 * i), torque(0.4, -0.9);
      set_five_bar(bars, l.model, x, rate, state);
      MaximalLoads applied;
      applied.gravity = tilted().R * Vector3d{bars.gravity[0], bars.gravity[1], 0.4};
      applied.tau.assign(l.model.velocities(), 0);
      applied.tau[l.model.bodies()[l.model.body_index("crank0")].v] = torque[0];
      applied.tau[l.model.bodies()[l.model.body_index("crank1")].v] = torque[1];
      const MaximalSolution s =
          MaximalSystem(l.model, l.closures).accelerations(maximal_state(l.model, state), applied);
      const Vector2 found(joint_value(l.model, s.joints, "crank0"), joint_value(l.model, s.joints, "crank1"));
      EXPECT_LT(worst.note((found - bars.acceleration(x, rate, torque)).norm(), i), 1e-11);
    }
  }
}

TEST(MaximalSystem, FourBarAgreesWithQuadrature) {
  const GroundedFourBar g{crank_rocker(), {0.1, -0.3}};
  const Linkage l = four_bar_model(g.bars, LinkageCut::pin_hinge, false, tilted(), 0.07);
  State state = zero_state(l.model);
  set_four_bar(g.bars, l.model, 0.5, 2.5, state);
  const MaximalState end = MaximalSystem(l.model, l.closures)
                               .integrate(maximal_state(l.model, state), loads(l.model, g.gravity, 0), 1, 1000);
  const double f = g.angle_at(1, 0.5, 2.5);
  ASSERT_GT(f, 1.5);
  set_four_bar(g.bars, l.model, f, g.rate_at(f, 0.5, 2.5), state);
  const MaximalState expected = maximal_state(l.model, state);
  Worst worst("four-bar after 1 s");  // measured 2e-11
  for (int i = 0; i < static_cast<int>(end.com.size()); ++i) {
    EXPECT_LT(worst.note((end.com[i] - expected.com[i]).norm(), i), 1e-9);
    EXPECT_LT(worst.note(end.R[i].angularDistance(expected.R[i]), i), 1e-9);
  }
  EXPECT_LT(worst.note((end.V - expected.V).norm(), -1), 1e-8);
}

}  // namespace linkage_test
}  // namespace grapnel::oracle
