/// Closed loops with brakes, motors, gravity, loads and other bases, and the wrenches of their grasps.

#include <gtest/gtest.h>

#include <Eigen/LU>

#include "capture/loop_case.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace loop_modes_test {

using Joints = PostImpactSetup::Joints;
using enum GraspModel;

LoadSetup push(const BodyName& body, const Wrenchd& amplitude) {
  LoadSetup load;
  load.body = body;
  load.p_BP = {0.1, -0.2, 0.1};
  load.amplitude = amplitude;
  load.profile.shape = LoadProfile::Shape::half_sine;
  load.profile.start = 0.5, load.profile.end = 2;
  return load;
}

// Sample interval for the finite differences of wrench_errors().
CaptureProblem dense(CaptureProblem p) {
  p.post_impact->duration = 0.4;
  p.output_interval = 0.001;
  p.post_impact->kp.assign(p.joint_position.size(), 20);
  p.post_impact->kd.assign(p.joint_position.size(), 5);
  return p;
}

// --- Brakes

// The system moves as one rigid body: its angular momentum is that of the composite inertia at the base's rate.
TEST(BrakedLoops, MoveAsOneRigidBody) {
  for (int index = 70; index < 74; ++index) {
    SCOPED_TRACE(seed_note(index));
    CaptureProblem p = random_loops({{0, 0}, {}, 6, 0.3, 10}, index);
    p.post_impact->joints = Joints::braked;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    expect_finite(r);
    ASSERT_TRUE(r.impact()->brake);
    EXPECT_EQ(r.impact()->brake->joints.size(), 12u);
    EXPECT_LT(r.impact()->brake->kinetic_energy_after, r.impact()->brake->kinetic_energy_before);
    const std::size_t first = first_sample(r, "post_impact"), last = last_sample(r, "post_impact");
    const CaptureSystem robot = make_servicer(p);
    double turned = 0;
    for (std::size_t s = first; s <= last; s += 10) {
      EXPECT_EQ(joints_at(r, "joints/position", s), joints_at(r, "joints/position", first));
      for (double rate : joints_at(r, "joints/velocity", s)) EXPECT_EQ(rate, 0);
      const Vector3d c = vector_at(r, "system/center_of_mass", s);
      const Vector3d w = vector_at(r, "base/angular_velocity", s);
      EXPECT_LT(norm(vector_at(r, "targets/target0/angular_velocity", s) - w), 1e-12);
      Vector3d L = Vector3d::zero();
      const auto add = [&](double mass, const Vector3d& com, const Symmetric3d& I, const Posed& X) {
        const Vector3d arm = X * com - c;
        L = L + rotate(X.R, I) * w + mass * cross(arm, cross(w, arm));
      };
      for (const BodyDescription& b : p.robot.bodies)
        add(b.mass, b.com, b.inertia, pose_at(r, b.name == "base" ? b.name : "links/" + b.name, s));
      const TargetSetup& t = p.targets[0];
      add(t.mass, t.com, t.inertia, pose_at(r, "targets/target0", s));
      EXPECT_LT(norm(L - vector_at(r, "system/angular_momentum", s)), 1e-12 * r.ledger.scale.angular_momentum);
      EXPECT_GT(norm(L), 1);
      turned = std::max(turned, rotation_angle(transpose(pose_at(r, "base", first).R) * pose_at(r, "base", s).R));
    }
    EXPECT_GT(turned, 0.02);
    EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
  }
}

// Light wrists locked to a heavy target: the momentum of their relative velocity stays at rounding error. With brakes
// as rows beside those of the grasps it was 6e-11 of the scale.
TEST(BrakedLoops, ConserveMomentumOfHeavyTargets) {
  SKIP_UNDER_SANITIZERS();
  for (const double factor : {1e2, 1e3, 1e4}) {
    CaptureProblem p = scenario("dual-arm-satellite-handles.yaml");
    TargetSetup& target = p.targets[0];
    target.mass *= factor;
    for (double* x : {&target.inertia.xx, &target.inertia.yy, &target.inertia.zz, &target.inertia.xy,
                      &target.inertia.xz, &target.inertia.yz})
      *x *= factor;
    p.post_impact->joints = Joints::braked;
    p.clearance.enabled = false;
    const CaptureResult r = simulate_capture(p);
    ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
    ASSERT_TRUE(r.impact()->brake);
    EXPECT_TRUE(r.ledger.pass());
    EXPECT_LT(row(r, "linear_momentum_drift").value, 1e-12);   // measured 7e-14
    EXPECT_LT(row(r, "angular_momentum_drift").value, 1e-12);  // measured 1e-14
  }
}

// With all joints locked every pair of opposite grasp wrenches is a self-stress. The minimum norm shares the load
// equally: D_1 F_1 = D_2 F_2 for a given sum F_1 + F_2.
TEST(BrakedLoops, ShareTheLoadEqually) {
  for (const std::size_t arms : {2u, 3u}) {
    CaptureProblem p = random_loops({std::vector<int>(arms, 0), {}, 5, 0.4, 2}, 75);
    p.post_impact->joints = Joints::braked;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    for (std::size_t s = first_sample(r, "post_impact"); s <= last_sample(r, "post_impact"); s += 5) {
      std::vector<Wrenchd> about_origin;
      for (const GraspSetup& g : p.grasps) {
        const Vector3d F = vector_at(r, "grasps/" + g.end_effector + "/force", s);
        const Vector3d M = vector_at(r, "grasps/" + g.end_effector + "/moment", s);
        about_origin.push_back({M + cross(vector_at(r, "end_effectors/" + g.end_effector + "/position", s), F), F});
      }
      EXPECT_GT(norm(about_origin[0].linear), 1e-4);
      for (const Wrenchd& F : about_origin) {
        EXPECT_LT(norm(F.linear - about_origin[0].linear), 1e-9 * norm(about_origin[0].linear));
        EXPECT_LT(norm(F.angular - about_origin[0].angular), 1e-9 * norm(about_origin[0].angular));
      }
    }
    for (const GraspLoad& load : r.grasp_loads) EXPECT_EQ(load.determined, std::vector<bool>(6, false));
  }
}

// --- Grasp wrenches

struct Named {
  const char* name;
  std::vector<GraspModel> models;
  std::vector<int> targets;
  int joints;
  Joints control;
  bool gravity;
};
class GraspWrenches : public ::testing::TestWithParam<Named> {};
INSTANTIATE_TEST_SUITE_P(
    Loops, GraspWrenches,
    ::testing::Values(Named{"rigid_free", {rigid, rigid}, {0, 0}, 7, Joints::free, false},
                      Named{"rigid_held", {rigid, rigid}, {0, 0}, 6, Joints::pd, false},
                      Named{"mixed", {hinge, point, rigid}, {0, 0, 0}, 6, Joints::pd, false},
                      Named{"short_arms", {rigid, rigid}, {0, 0}, 2, Joints::pd, false},
                      Named{"two_targets", {point, rigid, hinge, point}, {0, 1, 0, 1}, 5, Joints::free, false},
                      Named{"open_and_closed", {rigid, rigid, point}, {0, 0, 1}, 5, Joints::free, true},
                      Named{"gravity", {rigid, rigid}, {0, 0}, 6, Joints::pd, true},
                      Named{"single", {rigid}, {0}, 5, Joints::pd, false},
                      Named{"braked", {rigid, rigid}, {0, 0}, 5, Joints::braked, false}),
    [](const auto& test) { return test.param.name; });

// The targets' momenta and the robot under its grasps' wrenches, by finite differences of the recorded series.
TEST_P(GraspWrenches, MatchMotionOfTargetAndRobot) {
  const Named& c = GetParam();
  CaptureProblem p = dense(random_loops({c.targets, c.models, c.joints, 0.3, 2}, 80));
  p.post_impact->joints = c.control;
  if (c.gravity) p.gravity = {0.3, -0.5, 1.6};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const WrenchErrors e = wrench_errors(p, r, "post_impact");
  EXPECT_LT(e.linear, 1e-8);   // maximum measured 3.2e-10
  EXPECT_LT(e.angular, 1e-8);  // measured 1.1e-9
  EXPECT_LT(e.base, 1e-8);     // measured 3.6e-10
  EXPECT_LT(e.joints, 1e-8);   // measured 1.6e-10
  EXPECT_GT(e.largest_force, 1e-3);
  std::printf("[ measured ] %.2g, %.2g; robot %.2g, %.2g; force %.3g N\n", e.linear, e.angular, e.base, e.joints,
              e.largest_force);
  // Components that the grasp does not transmit are zero: about a hinge, at a point.
  for (std::size_t s = first_sample(r, "post_impact"); s <= last_sample(r, "post_impact"); s += 20) {
    for (const GraspSetup& g : p.grasps) {
      const Vector3d M = vector_at(r, "grasps/" + g.end_effector + "/moment", s);
      const double size = norm(vector_at(r, "grasps/" + g.end_effector + "/force", s)) + norm(M);
      if (g.model == point) {
        EXPECT_LT(norm(M), 1e-9 * size);
      }
      if (g.model == hinge) {
        EXPECT_LT(std::abs(dot(pose_at(r, "end_effectors/" + g.end_effector, s).R * g.hinge_axis, M)), 1e-9 * size);
      }
    }
  }
  // The reported maxima slightly exceed those of the samples: the search also covers times between samples.
  for (const GraspLoad& load : r.grasp_loads) {
    double largest = 0;
    for (std::size_t s = first_sample(r, "post_impact"); s <= last_sample(r, "post_impact"); ++s)
      largest = std::max(largest, norm(vector_at(r, "grasps/" + load.end_effector + "/force", s)));
    EXPECT_GE(load.largest_force, largest * (1 - 1e-12));
    EXPECT_LT(load.largest_force, largest * (1 + 1e-5));  // measured 8e-8
  }
}

// Short arms leave self-stresses: the result is the minimum-norm wrench among those with the same effect. A pair of
// opposite wrenches without effect on the joints of both arms is a self-stress; the norm is stationary along all of
// them.
TEST(GraspWrenchesOfShortArms, MinimumNorm) {
  CaptureProblem p = dense(random_loops({{0, 0}, {}, 2, 0.3, 2}, 81));
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const CaptureSystem robot = make_servicer(p);
  const std::size_t s = first_sample(r, "post_impact") + 50;
  // Rows: effect of a wrench pair on each joint, from the recorded axes and positions.
  const Vector3d at[2] = {vector_at(r, "end_effectors/hand0/position", s),
                          vector_at(r, "end_effectors/hand1/position", s)};
  Eigen::Matrix<double, 4, 6> felt;
  int row_number = 0;
  for (const BodyDescription& b : p.robot.bodies) {
    if (b.name == "base") continue;
    const Posed X = pose_at(r, "links/" + b.name, s);
    const Vector3d axis = X.R * b.joint.axis, moment = cross(X.p, axis);  // about the origin
    const double side = b.name.starts_with("arm0") ? 1 : -1;
    for (int c = 0; c < 3; ++c) felt(row_number, c) = side * axis[c], felt(row_number, 3 + c) = side * moment[c];
    ++row_number;
  }
  const Eigen::MatrixXd null = felt.fullPivLu().kernel();  // wrenches [moment about the origin; force], end-effector 0
  ASSERT_EQ(null.cols(), 2);
  for (Eigen::Index k = 0; k < 2; ++k) {
    double slope = 0, value = 0, size = 0;
    for (int g = 0; g < 2; ++g) {
      const double sign = g == 0 ? 1 : -1;
      const std::string group = "grasps/hand" + std::to_string(g);
      const Vector3d F = vector_at(r, group + "/force", s), M = vector_at(r, group + "/moment", s);
      const Vector3d f = sign * Vector3d{null(3, k), null(4, k), null(5, k)};
      const Vector3d m = sign * Vector3d{null(0, k), null(1, k), null(2, k)} - cross(at[g], f);
      const Posed X_WT = pose_at(r, "targets/target0", s);
      const Twistd V = mobility(p.targets[0], X_WT, at[g], M, F), v = mobility(p.targets[0], X_WT, at[g], m, f);
      slope += dot(V.angular, m) + dot(V.linear, f);
      value += dot(V.angular, M) + dot(V.linear, F);
      size += dot(v.angular, m) + dot(v.linear, f);
    }
    EXPECT_LT(std::abs(slope), 1e-9 * std::sqrt(value * size));
    EXPECT_GT(value, 0);
  }
  for (const GraspLoad& load : r.grasp_loads)
    EXPECT_NE(load.determined, std::vector<bool>(6, true)) << load.end_effector;
}

// --- Bases, loads, control

TEST(LoopsOnAllBases, LedgerPasses) {
  for (const RobotSetup::Base base : {RobotSetup::Base::free, RobotSetup::Base::held, RobotSetup::Base::fixed}) {
    for (const Joints joints : {Joints::free, Joints::pd, Joints::braked}) {
      for (const bool loaded : {false, true}) {
        if (test::kSanitized && !loaded) continue;
        SCOPED_TRACE(std::to_string(static_cast<int>(base)) + " " + std::to_string(static_cast<int>(joints)) +
                     (loaded ? " loaded" : ""));
        CaptureProblem p = random_loops({{0, 0, 0}, {rigid, hinge, rigid}, 5, 0.3, 4}, 90);
        p.robot.base_mode = base;
        if (base != RobotSetup::Base::free) p.V_WB.reset();
        p.post_impact->joints = joints;
        if (loaded) {
          p.gravity = {0.1, 0.2, -0.3};
          p.loads = {push(BodyName::of_target(0), {{0.5, 1, -2}, {3, -4, 5}}),
                     push("arm1-link2", {{0, 0, 1}, {2, 2, 0}})};
        }
        const CaptureResult r = simulate_capture(p);
        expect_passes(r);
        expect_finite(r);
        EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
        EXPECT_LT(opening(p, r, "post_impact").angle, 2e-12);
        if (loaded && !(base == RobotSetup::Base::fixed && joints == Joints::braked)) {
          EXPECT_GT(std::abs(value_at(r, "system/external_work", r.series.time.size() - 1)), 0.01);
        }
      }
    }
  }
}

// With a fixed base and all joints braked the whole system stops.
TEST(LoopsOnAllBases, BrakesStopFixedBaseSystem) {
  CaptureProblem p = random_loops({{0, 0}, {}, 5, 0.3, 4}, 91);
  p.robot.base_mode = RobotSetup::Base::fixed;
  p.V_WB.reset();
  p.post_impact->joints = Joints::braked;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  EXPECT_LT(r.impact()->brake->kinetic_energy_after, 1e-20);
  EXPECT_LT(value_at(r, "system/kinetic_energy", r.series.time.size() - 1), 1e-20);
}

TEST(LoopsUnderControl, BaseReturnsToAttitude) {
  CaptureProblem p = random_loops({{0, 0}, {}, 7, 0.1, 60}, 92);
  p.post_impact->joints = Joints::pd;
  p.post_impact->base_control.emplace();
  p.post_impact->base_control->kp = {60, 60, 60};
  p.post_impact->base_control->kd = {300, 300, 300};
  p.output_interval = 1;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t first = first_sample(r, "post_impact"), last = last_sample(r, "post_impact");
  EXPECT_GT(norm(vector_at(r, "base/angular_velocity", first)), 0.01);
  EXPECT_LT(norm(vector_at(r, "base/angular_velocity", last)), 1e-3);
  EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
}

// PD control brings the joints of a closed loop to rest.
TEST(LoopsUnderControl, MotorsBringJointsToRest) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = random_loops({{0, 0}, {}, 7, 0.1, 120}, 93);
  p.post_impact->joints = Joints::pd;
  p.post_impact->kp.assign(14, 300);
  p.post_impact->kd.assign(14, 200);
  p.output_interval = 1;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  double fastest = 0;
  for (double rate : joints_at(r, "joints/velocity", last_sample(r, "post_impact")))
    fastest = std::max(fastest, std::abs(rate));
  EXPECT_LT(fastest, 2e-3);
  EXPECT_LT(value_at(r, "system/motor_work", last_sample(r, "post_impact")), -1e-3);
}

// rk4 also keeps loops closed, at a step with a small integration error.
TEST(LoopsByOtherIntegrators, FixedStepsStayClosedToo) {
  CaptureProblem p = random_loops({{0, 0}, {}, 6, 0.2, 2}, 94);
  const CaptureResult a = simulate_capture(p);
  p.integration.method = IntegrationSetup::Method::rk4;
  p.integration.step = 2e-3;
  const CaptureResult b = simulate_capture(p);
  ASSERT_EQ(b.status, CaptureStatus::completed) << b.failure;
  EXPECT_LT(opening(p, b, "post_impact").position, 2e-12);
  const std::size_t last = last_sample(a, "post_impact");
  EXPECT_LT(norm(vector_at(a, "base/position", last) - vector_at(b, "base/position", last)), 1e-9);
  // With integrated root velocities the integrator determines the momentum.
  p.integration.method = IntegrationSetup::Method::adaptive_8;
  p.integration.root_velocity = IntegrationSetup::RootVelocity::integrated;
  const CaptureResult c = simulate_capture(p);
  expect_passes(c);
  EXPECT_LT(norm(vector_at(a, "base/position", last) - vector_at(c, "base/position", last)), 1e-9);
}

// Comparison modes: Baumgarte's defects are bounded and larger, accelerations alone drift. The tolerances keep the
// integration error above rounding error; with tighter tolerances Baumgarte's defects also reach rounding error.
TEST(LoopsByOtherIntegrators, ComparisonModesAreWorse) {
  CaptureProblem p = random_loops({{0, 0}, {}, 6, 0.3, 20}, 95);
  p.integration.relative_tolerance = 1e-8;
  p.integration.absolute_tolerance = 1e-9;
  const CaptureResult projected = simulate_capture(p);
  p.integration.loops = IntegrationSetup::Loops::acceleration;
  const CaptureResult alone = simulate_capture(p);
  p.integration.loops = IntegrationSetup::Loops::baumgarte;
  const CaptureResult fed = simulate_capture(p);
  ASSERT_EQ(alone.status, CaptureStatus::completed) << alone.failure;
  ASSERT_EQ(fed.status, CaptureStatus::completed) << fed.failure;
  const auto open = [](const CaptureResult& r) { return row(r, "loop_closure_position").value; };
  EXPECT_LT(open(projected), 1e-14);
  EXPECT_GT(open(alone), 10 * open(fed));
  EXPECT_GT(open(fed), open(projected));  // measured ratio 1.1: tolerances scale with speed, down to rounding error
  EXPECT_LT(open(fed), 1e-9);
  std::printf("[ measured ] open: projected %.2g, Baumgarte %.2g, accelerations alone %.2g m\n", open(projected),
              open(fed), open(alone));
}

// Loops open after the impact: one grasp carries the target, and the motion is that of the tree. It equals a run from
// the state after the impact without the second grasp.
TEST(LoopsByOtherIntegrators, OpenModeEqualsOpenChain) {
  CaptureProblem p = random_loops({{0, 0}, {}, 5, 0.3, 5}, 98);
  p.integration.loops = IntegrationSetup::Loops::open;
  const CaptureResult cut = simulate_capture(p);
  ASSERT_EQ(cut.status, CaptureStatus::completed) << cut.failure;
  expect_finite(cut);
  EXPECT_GT(opening(p, cut, 1, first_sample(cut, "post_impact"), last_sample(cut, "post_impact")).position, 0.01);
  EXPECT_FALSE(row(cut, "loop_closure_position").pass());
  CaptureProblem q = p;
  q.integration.loops = IntegrationSetup::Loops::projection;
  q.grasps.pop_back();
  const std::size_t after = first_sample(cut, "post_impact");
  q.X_WB = pose_at(cut, "base", after);
  q.V_WB = twist_at(cut, "base", after);
  q.joint_position = joints_at(cut, "joints/position", after);
  q.joint_rate = joints_at(cut, "joints/velocity", after);
  q.targets[0].X_WT = pose_at(cut, "targets/target0", after);
  q.targets[0].V_WT = twist_at(cut, "targets/target0", after);
  const CaptureResult open = simulate_capture(q);
  expect_passes(open);
  const std::size_t a = last_sample(cut, "post_impact"), b = last_sample(open, "post_impact");
  EXPECT_LT(norm(vector_at(cut, "base/position", a) - vector_at(open, "base/position", b)), 1e-10);
  EXPECT_LT(norm(vector_at(cut, "targets/target0/velocity", a) - vector_at(open, "targets/target0/velocity", b)),
            1e-10);
  const std::vector<double> x = joints_at(cut, "joints/position", a), y = joints_at(open, "joints/position", b);
  for (std::size_t j = 0; j < x.size(); ++j) EXPECT_NEAR(x[j], y[j], 1e-10);
}

// --- Far away

// Loop closures are independent of the world's origin and of a common drift.
TEST(LoopsFarAway, StayClosed) {
  CaptureProblem p = random_loops({{0, 0}, {}, 6, 0.2, 20}, 99);
  const CaptureResult near = simulate_capture(p);
  const Vector3d away{4000, -3000, 2000}, drift{7, 3, -2};
  p.X_WB.p = p.X_WB.p + away;
  p.targets[0].X_WT.p = p.targets[0].X_WT.p + away;
  p.V_WB->linear = p.V_WB->linear + drift;
  p.targets[0].V_WT.linear = p.targets[0].V_WT.linear + drift;
  const CaptureResult far = simulate_capture(p);
  ASSERT_EQ(far.status, CaptureStatus::completed) << far.failure;
  for (const char* name : {"loop_closure_position", "loop_closure_angle", "unprojected_defect", "correction_total"})
    EXPECT_TRUE(row(far, name).pass()) << name << " " << row(far, name).value;
  const std::size_t last = last_sample(near, "post_impact");
  const std::vector<double> x = joints_at(near, "joints/position", last), y = joints_at(far, "joints/position", last);
  for (std::size_t j = 0; j < x.size(); ++j) EXPECT_NEAR(x[j], y[j], 1e-8);
  std::printf("[ measured ] closure %.2g m near, %.2g m at 5 km\n", row(near, "loop_closure_position").value,
              row(far, "loop_closure_position").value);
}

// --- Two end-effectors on one arm

// Both end-effectors on one arm or on arm and base. The loop is closed or reported as an error, without an exception to
// the caller.
TEST(TwoEndEffectorsOfOneArm, LoopOnOneOrSeveralLinks) {
  for (const char* link : {"arm0-link1", "arm0-link3", "base"}) {
    for (const GraspModel model : {rigid, hinge, point}) {
      SCOPED_TRACE(std::string(link) + " " + std::to_string(static_cast<int>(model)));
      CaptureProblem p = random_loops({{0, 0}, {rigid, model}, 4, 0.3, 3}, 96);
      p.robot.end_effectors[1].body = link;
      CaptureResult r;
      ASSERT_NO_THROW(r = simulate_capture(p));
      if (r.status == CaptureStatus::failed) {
        EXPECT_FALSE(r.failure.empty());
        continue;
      }
      expect_passes(r);
      expect_finite(r);
      EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
    }
  }
}
// Both end-effectors on one link: the second grasp closes a loop without joints on the link that carries the target.
TEST(TwoEndEffectorsOfOneArm, OnTheSameLink) {
  for (const GraspModel model : {rigid, hinge, point}) {
    for (const GraspModel first : {rigid, hinge, point}) {
      SCOPED_TRACE(std::to_string(static_cast<int>(first)) + std::to_string(static_cast<int>(model)));
      CaptureProblem p = random_loops({{0, 0}, {first, model}, 4, 0.3, 3}, 97);
      p.robot.end_effectors[1].body = p.robot.end_effectors[0].body;
      CaptureResult r;
      EXPECT_NO_THROW(r = simulate_capture(p));
      if (r.status != CaptureStatus::completed) {
        EXPECT_FALSE(r.failure.empty());
        continue;
      }
      expect_passes(r);
      expect_finite(r);
      EXPECT_LT(opening(p, r, "post_impact").position, 2e-12);
    }
  }
}

}  // namespace loop_modes_test
}  // namespace grapnel::testing
