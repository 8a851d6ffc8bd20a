/// The momentum integral of a segment: against a simulation of the equations of motion, and its sensitivities against
/// finite differences.

#include <gtest/gtest.h>

#include <limits>

#include "grapnel/plan/path_segment.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "plan/plan_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace path_segment_test {

struct SegmentCase {
  Servicer servicer;
  SegmentStart start;
  Vector3d gravity;
  std::vector<double> position, rate;  // final
};

SegmentCase random_case(int i) {
  SegmentCase f{random_servicer(i), {}, {}, {}, {}};
  Random random(1000 + i);
  const JointProfile profile = i % 2 == 0 ? JointProfile::quintic : JointProfile::cycloidal;
  f.start = {1.0, 4.0, profile, f.servicer.theta(), f.servicer.rates(), f.servicer.X_WB()};
  if (i % 3 == 1) f.gravity = random.vector(0.3);
  for (double x : f.start.position) {
    f.position.push_back(x + random.uniform(-1, 1));
    f.rate.push_back(random.uniform(-0.4, 0.4));
  }
  return f;
}

// The same motion by forward dynamics with prescribed joints.
PhaseSetup followed(const SegmentCase& f) {
  PhaseSetup setup;
  setup.gravity = f.gravity;
  for (std::size_t j = 0; j < f.position.size(); ++j) {
    JointDrive drive;
    drive.control = JointControl::prescribed;
    drive.trajectory = {f.start.begin, JointPath{f.start.profile, f.start.end - f.start.begin, f.start.position[j],
                                                 f.position[j], f.start.rate[j], f.rate[j]}};
    setup.drives.push_back(drive);
  }
  setup.recover_roots = false;
  return setup;
}

Posed simulated_end(const SegmentCase& f, const PhaseSetup& setup) {
  PhaseDynamics dynamics(f.servicer.model, setup);
  const PhaseOutcome outcome = simulate_phase(dynamics, {f.servicer.state, f.start.begin, f.start.end});
  EXPECT_TRUE(outcome.finished) << outcome.failure;
  return root_pose(f.servicer.model, outcome.end_state, 0);
}

TEST(PathSegment, AgreesWithForwardDynamics) {
  Worst position("end of a segment against the simulation [m]"), angle("the same [rad]");
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(seed_note(i));
    const SegmentCase f = random_case(i);
    FloatingBase base(f.servicer.model, true);
    PathSegment segment(base, f.start, free_motion(f.servicer.model, f.servicer.state, f.start.begin, f.gravity));
    const SegmentEnd end = segment.integrate(f.position, f.rate, false);
    ASSERT_TRUE(end.finished) << end.failure;
    const Posed expected = simulated_end(f, followed(f));
    EXPECT_GT(rotation_angle(transpose(f.start.X_WB.R) * end.X_WB.R), 1e-3);             // the base has rotated
    EXPECT_LT(position.note(norm(end.X_WB.p - expected.p), i), 1e-9);                    // measured 4e-11
    EXPECT_LT(angle.note(rotation_angle(transpose(end.X_WB.R) * expected.R), i), 1e-9);  // measured 1e-11
  }
}

// Attitude control with feedforward of the joints' reaction holds a base exactly if it is initially at rest.
TEST(PathSegment, AttitudeControlledBaseAgreesWithSimulation) {
  Worst position("end of a segment with the attitude kept against the simulation [m]");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    SegmentCase f = random_case(i);
    Twistd V = root_twist(f.servicer.model, f.servicer.state, 0);
    V.angular = Vector3d::zero();
    set_root_twist(f.servicer.model, 0, V, f.servicer.state);
    FloatingBase base(f.servicer.model, true);
    base.hold_attitude();
    const FreeMotion motion = free_motion(f.servicer.model, f.servicer.state, f.start.begin, f.gravity);
    EXPECT_GT(norm(motion.h.angular), 1e-3);  // angular momentum has no effect
    PathSegment segment(base, f.start, motion);
    const SegmentEnd end = segment.integrate(f.position, f.rate, true);
    ASSERT_TRUE(end.finished) << end.failure;
    PhaseSetup setup = followed(f);
    setup.attitude = AttitudeControl{0, f.start.X_WB.R, {10, 10, 10}, {10, 10, 10}};
    setup.actuators.feedforward = true;
    const Posed expected = simulated_end(f, setup);
    EXPECT_LT(rotation_angle(transpose(f.start.X_WB.R) * expected.R), 1e-9);
    EXPECT_LT(rotation_angle(transpose(f.start.X_WB.R) * end.X_WB.R), 1e-14);
    EXPECT_GT(norm(f.start.X_WB.p - end.X_WB.p), 1e-3);  // the base has moved
    EXPECT_LT(position.note(norm(end.X_WB.p - expected.p), i), 1e-9);
    const double h = 1e-4;
    for (std::size_t j = 0; j < f.position.size(); ++j) {
      std::vector<double> up = f.position, down = f.position;
      up[j] += h, down[j] -= h;
      const Vector3d moved =
          segment.integrate(up, f.rate, false).X_WB.p - segment.integrate(down, f.rate, false).X_WB.p;
      const Eigen::Vector3d difference = column((0.5 / h) * transposed_times(f.start.X_WB.R, moved));
      EXPECT_LT((end.per_position.col(static_cast<Eigen::Index>(j)).tail<3>() - difference).norm(), 1e-6);
      EXPECT_EQ(end.per_position.col(static_cast<Eigen::Index>(j)).head<3>().norm(), 0);
    }
  }
}

TEST(PathSegment, SensitivitiesAgreeWithFiniteDifferences) {
  Worst worst("sensitivities of the base's end");
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const SegmentCase f = random_case(i);
    FloatingBase base(f.servicer.model, true);
    PathSegment segment(base, f.start, free_motion(f.servicer.model, f.servicer.state, f.start.begin, f.gravity));
    const SegmentEnd end = segment.integrate(f.position, f.rate, true);
    ASSERT_TRUE(end.finished) << end.failure;
    const double h = 1e-4;
    // Displacement of the base in B between two integrations.
    const auto difference = [&](const std::vector<double>& x1, const std::vector<double>& r1,
                                const std::vector<double>& x0, const std::vector<double>& r0) {
      const Posed X1 = segment.integrate(x1, r1, false).X_WB, X0 = segment.integrate(x0, r0, false).X_WB;
      const Vector3d w = rotation_vector(transpose(X0.R) * X1.R), p = transposed_times(end.X_WB.R, X1.p - X0.p);
      return Vector6d((Vector6d() << w[0], w[1], w[2], p[0], p[1], p[2]).finished() / (2 * h));
    };
    for (int j = 0; j < base.joints(); ++j) {
      std::vector<double> up = f.position, down = f.position;
      up[j] += h, down[j] -= h;
      EXPECT_LT(worst.note((difference(up, f.rate, down, f.rate) - end.per_position.col(j)).norm(), i), 1e-6);
      up = down = f.rate;
      up[j] += h, down[j] -= h;
      EXPECT_LT(worst.note((difference(f.position, up, f.position, down) - end.per_rate.col(j)).norm(), i), 1e-6);
      // measured 3e-7
    }
  }
}

// Search accuracy is sufficient for a search, and costs less.
TEST(PathSegment, SearchAccuracyReducesTheCost) {
  Worst angle("end of a segment as a search sees it [rad]");
  for (int i = 0; i < 24; ++i) {
    SCOPED_TRACE(seed_note(i));
    SegmentCase f = random_case(i);
    for (double& rate : f.rate) rate *= 10;  // joints that overshoot
    FloatingBase base(f.servicer.model, true);
    const FreeMotion motion = free_motion(f.servicer.model, f.servicer.state, f.start.begin, f.gravity);
    PathSegment full(base, f.start, motion), search(base, f.start, motion);
    const SegmentEnd exact = full.integrate(f.position, f.rate, false);
    const SegmentEnd rough = search.integrate(f.position, f.rate, false, SegmentAccuracy::search);
    ASSERT_TRUE(exact.finished && rough.finished);
    EXPECT_LT(angle.note(rotation_angle(transpose(exact.X_WB.R) * rough.X_WB.R), i), 1e-8);
    EXPECT_LE(search.rhs_evaluations(), full.rhs_evaluations());
  }
}

TEST(PathSegment, ReportsUnresolvedMotion) {
  SegmentCase f = random_case(0);
  for (double& rate : f.rate) rate *= 1e6;
  FloatingBase base(f.servicer.model, true);
  PathSegment segment(base, f.start, free_motion(f.servicer.model, f.servicer.state, f.start.begin, f.gravity));
  const SegmentEnd end = segment.integrate(f.position, f.rate, true);
  EXPECT_FALSE(end.finished);
  EXPECT_EQ(end.failure, "the base's rotation is not resolved by 8192 nodes on a segment of 3 s");
  f.rate[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(segment.integrate(f.position, f.rate, true).finished);
}

}  // namespace path_segment_test
}  // namespace grapnel::testing
