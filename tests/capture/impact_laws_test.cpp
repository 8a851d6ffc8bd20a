/// Every instantaneous impact law in a whole capture: its defining equations, conservation, and the continuation of the
/// run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/impact_case.hpp"
#include "support/worst.hpp"

#include "grapnel/problem/capture_system.hpp"

namespace grapnel::testing {
namespace impact_laws_test {

using Law = ImpactSetup::Law;
using Joints = ImpactSetup::Joints;
using ::testing::HasSubstr;

double normal_speed(const CaptureProblem& p, const CaptureResult& r, std::size_t grasp, std::size_t sample) {
  const Rotationd R_WT = pose_at(r, "targets/" + p.grasps[grasp].target, sample).R;
  return dot(R_WT * *p.targets[grasp].grasp_points[0].normal, relative_twist_at(p, r, grasp, sample).linear);
}

// Largest relative change of the targets' linear momenta from sample `from` on: zero for free targets.
double targets_pushed(const CaptureProblem& p, const CaptureResult& r, std::size_t from) {
  double most = 0;
  for (const TargetSetup& t : p.targets) {
    const Vector3d before = vector_at(r, "targets/" + t.name + "/linear_momentum", from);
    for (std::size_t s = from; s < r.series.time.size(); ++s)
      most = std::max(most, norm(vector_at(r, "targets/" + t.name + "/linear_momentum", s) - before) / norm(before));
  }
  return most;
}

// --- Contacts ---

TEST(Restitution, NormalVelocityReboundsAndTargetIsFree) {
  Worst rebound("normal velocity"), momentum("momentum"), pushed("momentum of free targets");
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double e = 0.2 * i;
    CaptureProblem p = rebound_case(Law::restitution, e, 0, i);
    p.grasps.pop_back(), p.targets.pop_back();
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    const std::size_t s = first_sample(r, "contact"), after = first_sample(r, "post_impact");
    const double before = normal_speed(p, r, 0, s);
    ASSERT_LT(before, -1e-3);
    // Without friction and with one contact, all restitution hypotheses agree.
    EXPECT_LT(rebound.note(std::abs(normal_speed(p, r, 0, s + 1) + e * before) / -before, i), 1e-11);  // 2e-15
    EXPECT_LT(momentum.note(momentum_jump(r, s, s + 1), i), 1e-13);                                    // measured 4e-16
    EXPECT_LT(pushed.note(targets_pushed(p, r, after), i), 1e-12);                                     // measured 2e-15
    EXPECT_EQ(r.series.time.back(), 2);  // the run continues
    EXPECT_FALSE(r.grasps.at(0).captured);
    EXPECT_THAT(r.grasps[0].reason, HasSubstr("a contact that does not hold: relative speed "));
    const GraspImpulse& g = r.impact()->grasps.at(0);
    ASSERT_TRUE(g.rebound);
    EXPECT_EQ(r.impact()->law, "restitution");
    EXPECT_EQ(g.model, "contact");
    EXPECT_GT(g.rebound->normal_impulse, 0);
    EXPECT_EQ(norm(g.angular_impulse), 0);
    EXPECT_LT(norm(cross(g.impulse, g.rebound->normal)), 1e-13 * norm(g.impulse));
    EXPECT_LT(norm(g.relative_velocity_after - relative_twist_at(p, r, 0, s + 1).linear), 1e-13);
  }
}

TEST(Friction, ConeHoldsAndEnergyDecreases) {
  Worst cone("cone"), momentum("momentum");
  int sticking = 0, sliding = 0, both = 0;
  for (int i = 0; i < 12; ++i) {
    SCOPED_TRACE(seed_note(i));
    const double mu = 0.1 * (1 + i % 6);
    const CaptureProblem p = rebound_case(Law::friction, 0.5, mu, i);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    const std::size_t s = first_sample(r, "contact");
    EXPECT_LT(momentum.note(momentum_jump(r, s, s + 1), i), 1e-13);
    EXPECT_LT(r.impact()->kinetic_energy_after, r.impact()->kinetic_energy_before);
    EXPECT_FALSE(r.impact()->energy_created);
    EXPECT_TRUE(row(r, "friction_cone_residual").applies);
    double work = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const GraspImpulse& g = r.impact()->grasps.at(k);
      const ContactRebound& c = *g.rebound;
      EXPECT_GE(c.normal_impulse, 0);
      EXPECT_LE(cone.note(norm(c.tangential_impulse) - mu * c.normal_impulse, i), 1e-12 * c.normal_impulse);
      EXPECT_GE(dot(c.normal, g.relative_velocity_after), -1e-12);
      EXPECT_LE(c.friction_work, 0);
      work += c.normal_work + c.friction_work;
      const auto has = [&](const char* mode) {
        return std::find(c.modes.begin(), c.modes.end(), mode) != c.modes.end();
      };
      sticking += has("sticking"), sliding += has("sliding"), both += has("sticking") && has("sliding");
    }
    const double lost = r.impact()->kinetic_energy_before - r.impact()->kinetic_energy_after;
    EXPECT_NEAR(-work, lost, 1e-10 * r.impact()->kinetic_energy_before);
  }
  EXPECT_GT(sticking, 2);
  EXPECT_GT(sliding, 2);
  std::printf("[ measured ] sticking %d, sliding %d, both %d of 24\n", sticking, sliding, both);
}

TEST(Friction, ZeroFrictionEqualsRestitution) {
  const CaptureResult a = simulate_capture(rebound_case(Law::friction, 0.7, 0, 3));
  const CaptureResult b = simulate_capture(rebound_case(Law::restitution, 0.7, 0.4, 3));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_EQ(norm(a.impact()->grasps[i].impulse - b.impact()->grasps[i].impulse), 0);
}

// Two contacts with two free targets, coupled through the base.
TEST(SimultaneousContacts, ReportNonuniqueness) {
  const CaptureResult r = simulate_capture(rebound_case(Law::restitution, 0.5, 0, 1));
  expect_passes(r);
  EXPECT_EQ(r.impact()->unique, r.impact()->grasps[0].determined[5]);
  EXPECT_EQ(!r.impact()->unique, warns(r, "simultaneous contacts"));
  EXPECT_FALSE(r.impact()->unique);
}

TEST(NewtonsHypothesis, ReportsCreatedEnergy) {
  int created = 0;
  for (int i = 0; i < 40 && created == 0; ++i) {
    CaptureProblem p = rebound_case(Law::friction, 1, 0.8, i);
    p.impact->hypothesis = RestitutionHypothesis::newton;
    p.post_impact.reset();
    const CaptureResult r = simulate_capture(p);
    if (!r.impact() || !r.impact()->energy_created) continue;
    ++created;
    EXPECT_GT(r.impact()->kinetic_energy_after, r.impact()->kinetic_energy_before);
    EXPECT_TRUE(warns(r, "newton hypothesis")) << i;
  }
  EXPECT_EQ(created, 1);
}

// --- Bilateral restitution ---

TEST(BilateralRestitution, RelativeTwistReboundsAndGraspOpens) {
  Worst twist("twist"), energy("energy");
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    CaptureProblem p = contact_capture_case(i);
    p.impact->law = Law::bilateral_restitution;
    p.impact->restitution = 0.6, p.impact->angular_restitution = 0.25;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    const std::size_t s = first_sample(r, "contact");
    double expected = 0;
    for (std::size_t k = 0; k < 2; ++k) {
      const Twistd u = relative_twist_at(p, r, k, s), v = relative_twist_at(p, r, k, s + 1);
      ASSERT_GT(norm(u.linear), 1e-3);
      EXPECT_LT(twist.note(norm(v.linear + 0.6 * u.linear) / norm(u.linear), i), 1e-11);  // 4e-15
      EXPECT_LT(twist.note(norm(v.angular + 0.25 * u.angular) / norm(u.angular), i), 1e-11);
      const GraspImpulse& g = r.impact()->grasps[k];
      expected += 0.5 * (dot(g.impulse, u.linear + v.linear) + dot(g.angular_impulse, u.angular + v.angular));
      EXPECT_FALSE(r.grasps[k].captured);
      EXPECT_THAT(r.grasps[k].reason, HasSubstr("rebounded"));
    }
    EXPECT_LT(energy.note(std::abs(r.impact()->kinetic_energy_after - r.impact()->kinetic_energy_before - expected), i),
              1e-12);
    EXPECT_LT(targets_pushed(p, r, first_sample(r, "post_impact")), 1e-12);
  }
}

TEST(BilateralRestitution, ZeroEqualsPlasticExceptGrasp) {
  CaptureProblem p = contact_capture_case(2);
  const CaptureResult plastic = simulate_capture(p);
  p.impact->law = Law::bilateral_restitution;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_LT(norm(r.impact()->grasps[k].impulse - plastic.impact()->grasps[k].impulse), 1e-12);
  EXPECT_TRUE(plastic.grasps[0].captured);
  EXPECT_FALSE(r.grasps[0].captured);
}

// Two arms of few joints on one target: some rows are redundant.
TEST(BilateralRestitution, InfeasibleCoefficientsNameRows) {
  LoopOptions options;
  options.joints = 1;
  options.time = 0.5;
  CaptureProblem p = random_loops(options, 4);
  p.impact->law = Law::bilateral_restitution;
  p.impact->restitution = 0.9, p.impact->angular_restitution = 0.1;
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_LT(r.impact()->rank, r.impact()->rows);
  EXPECT_FALSE(r.impact()->inconsistent.empty());
  EXPECT_TRUE(warns(r, r.impact()->inconsistent));
  expect_passes(r);
}

// --- Several kinds and times ---

TEST(GraspsAndContacts, GraspsPrecedeSimultaneousContacts) {
  CaptureProblem p = rebound_case(Law::friction, 0.4, 0.3, 5);
  p.grasps[0].contact = false;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  EXPECT_EQ(r.impact()->law, "plastic");
  EXPECT_EQ(r.impact()->grasps.size(), 1u);
  EXPECT_EQ(r.impact()->time, r.impacts[1].time);
  const ImpactReport& rebound = r.impacts[1];
  EXPECT_EQ(rebound.law, "friction");
  ASSERT_EQ(rebound.grasps.size(), 2u);  // the grasp transmits the contact's impulse
  EXPECT_FALSE(rebound.grasps[0].rebound);
  ASSERT_TRUE(rebound.grasps[1].rebound);
  EXPECT_GT(norm(rebound.grasps[0].impulse), 1e-4);
  EXPECT_LT(norm(rebound.grasps[0].relative_velocity_after) + norm(rebound.grasps[0].relative_angular_velocity_after),
            1e-12);
  EXPECT_TRUE(r.grasps[0].captured);
  EXPECT_FALSE(r.grasps[1].captured);
  EXPECT_LT(opening(p, r, 0, first_sample(r, "contact_2"), r.series.time.size() - 1).position, 1e-11);
  EXPECT_EQ(value_at(r, "grasps/hand0/holds", r.series.time.size() - 1), 1);
  EXPECT_EQ(value_at(r, "grasps/hand1/holds", r.series.time.size() - 1), 0);
}

TEST(GraspsAndContacts, LaterContactWhileGraspHolds) {
  CaptureProblem p = rebound_case(Law::restitution, 0.8, 0, 5);
  p.grasps[0].contact = false;
  p.grasps[1].closes = GraspSetup::Closes::at_time;
  p.grasps[1].closes_at = 0.4;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  EXPECT_EQ(r.impacts[1].time, 0.4);
  const std::size_t s = first_sample(r, "contact_2");
  EXPECT_LT(momentum_jump(r, s, s + 1), 1e-13);
  EXPECT_LT(opening(p, r, 0, first_sample(r, "post_impact"), r.series.time.size() - 1).position, 1e-11);
  const GraspImpulse& g = r.impacts[1].grasps.at(1);
  const double before = dot(g.rebound->normal, g.relative_velocity_before);
  if (before < 0) {
    EXPECT_NEAR(dot(g.rebound->normal, g.relative_velocity_after), -0.8 * before, 1e-12);
  }
}

// One end-effector grasps the target, the other touches it.
TEST(GraspsAndContacts, OnOneTarget) {
  LoopOptions options;
  options.joints = 6;
  options.time = 1;
  CaptureProblem p = random_loops(options, 8);
  p.impact->law = Law::friction;
  p.impact->restitution = 0.5, p.impact->friction = 0.2;
  p.grasps[1].contact = true;
  p.grasps[1].closes = GraspSetup::Closes::at_time, p.grasps[1].closes_at = 0.3;
  p.targets[0].geometry = {{Geometry::Shape::sphere, {0.5, 0, 0}}};
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_EQ(r.impacts.size(), 2u);
  ASSERT_TRUE(r.impacts[1].grasps.at(1).rebound);
  EXPECT_TRUE(r.grasps[0].captured);
  EXPECT_LT(opening(p, r, 0, first_sample(r, "post_impact"), r.series.time.size() - 1).position, 1e-11);
}

// --- Joints during the impact ---

TEST(JointsDuring, BrakedAndDrivenRatesAndLedger) {
  for (Law law : {Law::plastic, Law::bilateral_restitution, Law::friction}) {
    for (Joints joints : {Joints::braked, Joints::driven}) {
      SCOPED_TRACE(static_cast<int>(law) * 10 + static_cast<int>(joints));
      CaptureProblem p = rebound_case(law, 0.5, 0.3, 7);
      for (GraspSetup& g : p.grasps) g.contact = law == Law::friction;
      p.impact->joints = joints;
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      const std::size_t s = first_sample(r, "contact");
      const std::size_t count = p.joint_position.size();
      ASSERT_EQ(r.impact()->held_joints.size(), count);
      EXPECT_EQ(r.impact()->joints_during, joints == Joints::braked ? "braked" : "driven");
      double work = 0;
      for (std::size_t j = 0; j < count; ++j) {
        const int k = static_cast<int>(j);
        const double before = value_at(r, "joints/velocity", s, k), after = value_at(r, "joints/velocity", s + 1, k);
        ASSERT_NE(before, 0);
        EXPECT_NEAR(after, joints == Joints::braked ? 0 : before, 1e-14);
        const HeldJoint& held = r.impact()->held_joints[j];
        // The report lists every joint: the impulse along its axis is that of the brake or drive.
        const auto joint = std::find_if(r.impact()->joints.begin(), r.impact()->joints.end(),
                                        [&](const JointImpulse& of) { return of.joint == held.joint; });
        ASSERT_NE(joint, r.impact()->joints.end());
        EXPECT_NEAR(joint->along_axis, held.impulse, 1e-11);
        EXPECT_NEAR(held.work, 0.5 * held.impulse * (before + after), 1e-13);
        work += held.work;
      }
      for (std::size_t k = 0; k < 2; ++k) {
        const GraspImpulse& g = r.impact()->grasps[k];
        const Twistd u = relative_twist_at(p, r, k, s), v = relative_twist_at(p, r, k, s + 1);
        if (law == Law::friction) {
          work += g.rebound->normal_work + g.rebound->friction_work;
        } else {
          work += 0.5 * (dot(g.impulse, u.linear + v.linear) + dot(g.angular_impulse, u.angular + v.angular));
        }
      }
      // Brakes stop the arms before the contacts are solved: neither work term includes the effect of braking on the
      // contact.
      if (law != Law::friction || joints == Joints::driven) {
        EXPECT_NEAR(r.impact()->kinetic_energy_after - r.impact()->kinetic_energy_before, work, 1e-11);
      }
      EXPECT_LT(momentum_jump(r, s, s + 1), 1e-13);
    }
  }
}

// Closed form: with all joints braked the servicer is one rigid body, and the plastic impact is that of two rigid
// bodies.
TEST(JointsDuring, BrakedEqualsRigidBodies) {
  CaptureProblem p = contact_capture_case(3);
  p.grasps.pop_back(), p.targets.pop_back();
  p.impact->joints = Joints::braked;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  const std::size_t s = first_sample(r, "contact");
  // Afterwards the system is one rigid body: its angular velocity follows from the total inertia and the angular
  // momentum before.
  const Vector3d w = vector_at(r, "base/angular_velocity", s + 1);
  EXPECT_LT(norm(w - vector_at(r, "targets/target0/angular_velocity", s + 1)), 1e-13);
  const CaptureSystem system = make_capture_system(p);
  const Kinematics k = forward_kinematics(system.model, [&] {
    State state = initial_servicer_state(p, system);
    const int body = system.model.frames()[system.target_frames[0]].body;
    set_root_pose(system.model, body, p.targets[0].X_WT, state);
    return state;
  }());
  const Vector3d com = vector_at(r, "system/center_of_mass", s), l = vector_at(r, "system/angular_momentum", s);
  Vector3d expected = Vector3d::zero();
  for (std::size_t i = 0; i < system.model.bodies().size(); ++i) {
    const BodyDescription& b = system.model.bodies()[i].description;
    const Vector3d arm = k.X_WB[i].p + k.X_WB[i].R * b.com - com;
    expected += k.X_WB[i].R * (b.inertia * (transpose(k.X_WB[i].R) * w)) + b.mass * cross(arm, cross(w, arm));
  }
  ASSERT_GT(norm(l), 0.1);
  EXPECT_LT(norm(expected - l), 1e-11 * norm(l));
}

// `driven` is the limit of infinitely heavy rotors, which keep the joints' rates.
TEST(JointsDuring, HeavyRotorsConvergeToDriven) {
  CaptureProblem p = contact_capture_case(4);
  for (double& rate : p.joint_rate) rate = 0;
  p.impact->joints = Joints::driven;
  const CaptureResult driven = simulate_impact_only(p);
  p.impact->joints = Joints::free;
  double previous = 0;
  for (double rotor : {0.0, 1e3, 1e4, 1e5}) {
    for (BodyDescription& b : p.robot.bodies) {
      if (b.joint.type != JointType::revolute) continue;
      b.joint.rotor_inertia = rotor, b.joint.gear_ratio = 1;
    }
    const CaptureResult r = simulate_impact_only(p);
    const double off = norm(r.impact()->grasps[0].impulse - driven.impact()->grasps[0].impulse);
    std::printf("[ measured ] rotor %g: off by %.3g of %.3g N s\n", rotor, off,
                norm(driven.impact()->grasps[0].impulse));
    if (rotor > 1e3) {
      EXPECT_NEAR(previous / off, 10, 0.6);  // of first order in 1 / inertia; measured 9.5, 9.9
    }
    previous = off;
  }
  EXPECT_LT(previous, 1e-3 * norm(driven.impact()->grasps[0].impulse));
}

TEST(JointsDuring, BrakedAfterwards) {
  CaptureProblem p = rebound_case(Law::friction, 0.5, 0.3, 6);
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_TRUE(r.impact()->brake);
  for (int j = 0; j < 8; ++j) EXPECT_EQ(value_at(r, "joints/velocity", r.series.time.size() - 1, j), 0);
  EXPECT_LT(targets_pushed(p, r, first_sample(r, "post_impact")), 1e-12);
}

TEST(FixedBase, GroundReceivesReboundImpulse) {
  for (Law law : {Law::bilateral_restitution, Law::friction}) {
    for (Joints joints : {Joints::free, Joints::braked, Joints::driven}) {
      CaptureProblem p = rebound_case(law, 0.5, 0.3, 2);
      for (GraspSetup& g : p.grasps) g.contact = law == Law::friction;
      p.robot.base_mode = RobotSetup::Base::fixed;
      p.V_WB.reset();
      p.impact->joints = joints;
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      EXPECT_EQ(norm(r.impact()->base_velocity_change), 0);
      EXPECT_GT(norm(r.impact()->base_impulse), 1e-3);
    }
  }
}

}  // namespace impact_laws_test
}  // namespace grapnel::testing
