/// Linkages with known solutions, and the motion of random closed loops: a plain Runge-Kutta loop over accelerations()
/// with project() after every step.

#include <gtest/gtest.h>

#include "constraint/closed_case.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "oracle/linkage_case.hpp"
#include "support/eigen_values.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace linkage_motion_test {

using oracle::crank_rocker;
using oracle::FloatingFourBar;
using oracle::GroundedFourBar;
using oracle::joint_value;
using oracle::Linkage;
using oracle::LinkageCut;
using oracle::tilted;
using oracle::Vector2;

constexpr LinkageCut kCuts[] = {LinkageCut::pin_hinge, LinkageCut::pin_point, LinkageCut::cut};

// Gravity in the base's plane as a vector of W, with a part along the normal, which must not matter on the ground.
Vector3d in_plane(const Vector2& g, double normal) { return tilted().R * Vector3d{g[0], g[1], normal}; }

class Motion {
 public:
  Motion(const Model& model, std::span<const LoopClosure> closures, oracle::MaximalLoads loads)
      : model_(model), solver_(model, closures), workspace_(model), loads_(std::move(loads)) {
    if (loads_.tau.empty()) loads_.tau.assign(model.velocities(), 0);
  }
  std::vector<double> accelerations(const State& state) {
    std::vector<double> vdot(model_.velocities()), force(model_.velocities());
    solver_.accelerations(dynamics_input(model_, state, loads_, workspace_), 0, workspace_, vdot, force);
    return vdot;
  }
  /// Classical Runge-Kutta; notes the largest defect before a projection, and after.
  State run(State state, double duration, int steps) {
    const double h = duration / steps;
    const auto rate = [&](const State& s) {
      std::vector<double> qdot(model_.coordinates());
      coordinate_rates(model_, s.q, s.v, qdot);
      return State{qdot, accelerations(s)};
    };
    const auto ahead = [&](const State& s, const State& k, double step) {
      return State{values(eigen(s.q) + step * eigen(k.q)), values(eigen(s.v) + step * eigen(k.v))};
    };
    for (int i = 0; i < steps; ++i) {
      const State k1 = rate(state), k2 = rate(ahead(state, k1, h / 2)), k3 = rate(ahead(state, k2, h / 2)),
                  k4 = rate(ahead(state, k3, h));
      state = ahead(ahead(ahead(ahead(state, k1, h / 6), k2, h / 3), k3, h / 3), k4, h / 6);
      for (int offset : model_.quaternions()) Eigen::Map<Eigen::Vector4d>(&state.q[offset]).normalize();
      const ProjectionResult r = solver_.project({}, workspace_, state.q, state.v);
      EXPECT_TRUE(r.converged);
      defect_ = std::max({defect_, r.before.position, r.before.angle});
      left_ = std::max({left_, r.after.position, r.after.angle});
      least_pivot_ = std::min(least_pivot_, solver_.least_pivot());
    }
    return state;
  }
  LoopSolver& solver() { return solver_; }
  double defect() const { return defect_; }
  double left() const { return left_; }
  double least_pivot() const { return least_pivot_; }

 private:
  const Model& model_;
  LoopSolver solver_;
  Workspace workspace_;
  oracle::MaximalLoads loads_;
  double defect_ = 0, left_ = 0, least_pivot_ = INFINITY;
};

TEST(LinkageDynamics, FixedFourBar) {
  Worst worst("acceleration"), force("force at the last pivot");  // measured 1e-14, 4e-15
  const GroundedFourBar g{crank_rocker(), {0.4, -1.2}};
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::four_bar_model(g.bars, cut, false, tilted(), 0.07);
    oracle::MaximalLoads loads;
    loads.gravity = in_plane(g.gravity, -0.6);
    loads.tau.assign(l.model.velocities(), 0);
    loads.tau[l.model.bodies()[l.model.body_index("crank")].v] = 1.7;
    Motion motion(l.model, l.closures, loads);
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const double f = 0.2 + i * M_PI / 6, rate = 2.5 - 0.3 * i;
      oracle::set_four_bar(g.bars, l.model, f, rate, state);
      const std::vector<double> vdot = motion.accelerations(state);
      EXPECT_LT(worst.note(std::abs(joint_value(l.model, vdot, "crank") - g.acceleration(f, rate, 1.7)), i), 1e-11);
      EXPECT_EQ(motion.solver().rank(), cut == LinkageCut::cut ? 3 : 2);
      EXPECT_LT(motion.solver().contradiction(), 1e-12);
      if (cut != LinkageCut::pin_point) continue;
      const Vector2 F = g.force_at_C(f, rate, 1.7);
      const double p = g.bars.angles(f).coupler;
      const std::span<const double> rows = motion.solver().multipliers();
      EXPECT_LT(force.note(std::hypot(rows[0] - F.dot(oracle::along(p)), rows[1] - F.dot(oracle::across(p))), i),
                1e-10);
    }
  }
}

TEST(LinkageDynamics, FloatingFourBar) {
  Worst worst("acceleration");
  const FloatingFourBar g{crank_rocker()};
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::four_bar_model(g.bars, cut, true, {});
    Motion motion(l.model, l.closures, {});
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const double f = 0.2 + i * M_PI / 6, rate = 2.5 - 0.3 * i, h = 1.4 - 0.5 * i;
      oracle::set_four_bar(g.bars, l.model, f, rate, state);
      set_root_pose(l.model, 0, tilted(), state);
      set_root_twist(l.model, 0, {g.base_rate(f, rate, h) * tilted().R.column(2), {0.2, -0.4, 0.1}}, state);
      const std::vector<double> vdot = motion.accelerations(state);
      EXPECT_LT(worst.note(std::abs(joint_value(l.model, vdot, "crank") - g.acceleration(f, rate, h)), i), 1e-11);
      EXPECT_EQ(motion.solver().rank(), cut == LinkageCut::cut ? 3 : 2);
    }
  }
}

TEST(LinkageDynamics, FiveBar) {
  Worst worst("acceleration");
  const oracle::FiveBar bars = oracle::five_bar();
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::five_bar_model(bars, cut, tilted(), 0.07);
    oracle::MaximalLoads loads;
    loads.gravity = in_plane(bars.gravity, 0.4);
    Motion motion(l.model, l.closures, loads);
    for (int i = 0; i < 12; ++i) {
      State state = zero_state(l.model);
      const Vector2 x(2.2 - 0.05 * i, 0.7 + 0.04 * i), rate(0.8 - 0.2 * i, -0.5 + 0.3 * i);
      oracle::set_five_bar(bars, l.model, x, rate, state);
      const std::vector<double> vdot = motion.accelerations(state);
      const Vector2 found(joint_value(l.model, vdot, "crank0"), joint_value(l.model, vdot, "crank1"));
      EXPECT_LT(worst.note((found - bars.acceleration(x, rate)).norm(), i), 1e-11);
    }
  }
}

TEST(LinkageMotion, FourBarAgreesWithQuadrature) {
  const GroundedFourBar g{crank_rocker(), {0.1, -0.3}};
  constexpr double kStart = 0.5, kRate = 2.5, kTime = 4;
  const double expected = g.angle_at(kTime, kStart, kRate);
  ASSERT_GT(expected - kStart, 2 * M_PI);  // more than once round
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::four_bar_model(g.bars, cut, false, tilted(), 0.07);
    State start = zero_state(l.model);
    oracle::set_four_bar(g.bars, l.model, kStart, kRate, start);
    const auto error = [&](int steps, double& left) {
      Motion motion(l.model, l.closures, {{}, {}, in_plane(g.gravity, -0.6), {}, {}});
      const State end = motion.run(start, kTime, steps);
      left = motion.left();
      return std::hypot(oracle::joint_angle(l.model, end, "crank") - expected,
                        joint_value(l.model, end.v, "crank") - g.rate_at(expected, kStart, kRate));
    };
    double left = 0;
    const double coarse = error(500, left), half = error(1000, left), fine = error(4000, left);
    std::printf("[ measured ] four-bar, cut %d: error %.3g, %.3g, %.3g with 500, 1000, 4000 steps; left open %.3g\n",
                static_cast<int>(cut), coarse, half, fine, left);
    EXPECT_NEAR(std::log2(coarse / half), 4, 0.7);
    EXPECT_LT(fine, 1e-9);   // measured 3e-10
    EXPECT_LT(left, 1e-14);  // measured 1e-15
  }
}

TEST(LinkageMotion, FloatingFourBarAgreesWithQuadrature) {
  const FloatingFourBar g{crank_rocker()};
  constexpr double kStart = 0.5, kRate = 2.5, kTime = 3, kMomentum = 1.4;
  const double E = g.energy(kStart, kRate, kMomentum), expected = g.angle_at(kTime, kStart, E, kMomentum);
  const double turn = g.base_turn(expected, kStart, E, kMomentum);
  ASSERT_GT(std::abs(turn), 0.1);
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::four_bar_model(g.bars, cut, true, {});
    State start = zero_state(l.model);
    oracle::set_four_bar(g.bars, l.model, kStart, kRate, start);
    const Posed X = tilted();
    const Vector3d z = X.R.column(2), w = g.base_rate(kStart, kRate, kMomentum) * z;
    set_root_pose(l.model, 0, X, start);
    set_root_twist(l.model, 0, {w, {0.2, -0.4, 0.1}}, start);
    Motion motion(l.model, l.closures, {});
    const State end = motion.run(start, kTime, 3000);
    const Kinematics before = forward_kinematics(l.model, start), after = forward_kinematics(l.model, end);
    const Rotationd expected_R = X.R * rotation_about({0, 0, 1}, turn);
    // Measured 1e-11, 3e-12, 2e-12, 5e-13.
    Worst angle("crank angle"), base("base angle"), center("centre of mass"), energy("energy");
    EXPECT_LT(angle.note(std::abs(oracle::joint_angle(l.model, end, "crank") - expected), 0), 1e-9);
    EXPECT_LT(base.note(rotation_angle(transpose(expected_R) * after.X_WB[0].R), 0), 1e-9);
    const Vector3d p = {0, 0, 0}, v = (1 / l.model.mass()) * momentum_about(l.model, before, p).linear;
    const Vector3d com = center_of_mass(l.model, before) + kTime * v;
    EXPECT_LT(center.note(norm(center_of_mass(l.model, after) - com), 0), 1e-10);
    EXPECT_LT(
        energy.note(std::abs(kinetic_energy(l.model, after, end) / kinetic_energy(l.model, before, start) - 1), 0),
        1e-9);
  }
}

TEST(LinkageMotion, FiveBarAgreesWithLagrangesEquations) {
  const oracle::FiveBar bars = oracle::five_bar();
  Vector2 x(2.2, 0.7), rate(0.8, -0.5);
  const Vector2 x0 = x, rate0 = rate;
  bars.integrate(x, rate, 1, 2000);
  ASSERT_GT((x - x0).norm(), 0.2);
  for (LinkageCut cut : kCuts) {
    const Linkage l = oracle::five_bar_model(bars, cut, tilted(), 0.07);
    State start = zero_state(l.model);
    oracle::set_five_bar(bars, l.model, x0, rate0, start);
    Motion motion(l.model, l.closures, {{}, {}, in_plane(bars.gravity, 0.4), {}, {}});
    const State end = motion.run(start, 1, 2000);
    const Vector2 found(oracle::joint_angle(l.model, end, "crank0"), oracle::joint_angle(l.model, end, "crank1"));
    const Vector2 speed(joint_value(l.model, end.v, "crank0"), joint_value(l.model, end.v, "crank1"));
    Worst worst("five-bar after 1 s");  // measured 1e-11
    EXPECT_LT(worst.note((found - x).norm(), 0), 1e-9);
    EXPECT_LT(worst.note((speed - rate).norm(), 1), 1e-9);
  }
}

// Two integrations of the same loops: tree coordinates with projection, and maximal coordinates without.
TEST(LoopMotion, AgreesWithMaximalCoordinates) {
  SKIP_UNDER_SANITIZERS();
  constexpr double kTime = 0.25;
  Worst place("places"), turn("orientations"), defect("defect of a step before its projection");
  int compared = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    for (double& v : c.state.v) v *= 0.5;  // still on the closures
    for (double& t : c.loads.tau) t *= 0.05;
    c.loads.external.clear();
    Motion motion(c.model, c.closures, c.loads);
    const oracle::MaximalState end = oracle::maximal_state(c.model, motion.run(c.state, kTime, 250));
    if (motion.least_pivot() < 1e-3) continue;  // near a singular configuration small errors grow
    ++compared;
    const oracle::MaximalState expected = oracle::MaximalSystem(c.model, c.closures)
                                              .integrate(oracle::maximal_state(c.model, c.state), c.loads, kTime, 120);
    for (std::size_t b = 0; b < end.com.size(); ++b) {
      EXPECT_LT(place.note((end.com[b] - expected.com[b]).norm(), i), 1e-7);   // measured 1e-9
      EXPECT_LT(turn.note(end.R[b].angularDistance(expected.R[b]), i), 1e-7);  // measured 2e-9
    }
    defect.note(motion.defect(), i);
    EXPECT_LT(motion.left(), 1e-13);
  }
  EXPECT_GT(compared, 6);
}

}  // namespace linkage_motion_test
}  // namespace grapnel::testing
