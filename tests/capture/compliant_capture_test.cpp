/// Compliant impacts in whole captures: forces in the time series, conservation checks, and the rigid law as their
/// limit.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/impact_case.hpp"
#include "capture/loop_case.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_capture_test {

using Law = ImpactSetup::Law;
using Joints = ImpactSetup::Joints;
using ::testing::HasSubstr;

// Contacts with a surface that is stiff enough to separate after several milliseconds.
CaptureProblem soft_rebound(int index) {
  CaptureProblem p = rebound_case(Law::compliant, 0, 0.3, index);
  p.impact->contact.stiffness = 1e5;
  p.impact->contact.damping = 200;
  return p;
}

// Integral of the recorded force over the samples of a phase, by the trapezoidal rule.
Vector3d impulse_of(const CaptureResult& r, const std::string& end_effector, const std::string& phase) {
  Vector3d sum = Vector3d::zero();
  const std::string path = "grasps/" + end_effector + "/force";
  const std::size_t last = last_sample(r, phase);
  for (std::size_t s = first_sample(r, phase); s < last; ++s) {
    const double h = r.series.time[s + 1] - r.series.time[s];
    sum += 0.5 * h * (vector_at(r, path, s) + vector_at(r, path, s + 1));
  }
  return sum;
}

double largest_force(const CaptureResult& r, const std::string& end_effector) {
  double most = 0;
  for (std::size_t s = 0; s < r.series.time.size(); ++s)
    most = std::max(most, norm(vector_at(r, "grasps/" + end_effector + "/force", s)));
  return most;
}

TEST(CompliantGrasps, RecordedInTimeAndHoldAfterwards) {
  SKIP_UNDER_SANITIZERS();
  Worst integral("integral of the force"), peak("peak");
  for (int i = 0; i < 3; ++i) {
    SCOPED_TRACE(seed_note(i));
    CaptureProblem p = yielding_case(1e7, i);
    p.impact->compliant.samples = 20000;  // the dampers accelerate the light end-effectors within 0.1 ms
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    ASSERT_TRUE(r.impact() && r.impact()->compliant);
    const CompliantReport& c = *r.impact()->compliant;
    EXPECT_EQ(c.end, "settled");
    EXPECT_GT(c.duration, 1e-3);
    EXPECT_GT(c.energy_lost, 0);
    EXPECT_TRUE(row(r, "compliant_energy_residual").applies);
    const std::size_t first = first_sample(r, "contact"), last = last_sample(r, "contact");
    EXPECT_GT(last - first, 300u);
    EXPECT_EQ(r.series.time[first], 0);
    EXPECT_NEAR(r.series.time[last], c.duration, 1e-15);  // time advances, and the next phase begins there
    EXPECT_EQ(r.series.time[last + 1], r.series.time[last]);
    EXPECT_EQ(r.series.phases[1], "post_impact");
    EXPECT_NEAR(r.series.time.back(), 2 + c.duration, 1e-12);
    for (std::size_t k = 0; k < 2; ++k) {
      const GraspImpulse& g = r.impact()->grasps[k];
      ASSERT_TRUE(g.profile);
      const Vector3d P = impulse_of(r, g.end_effector, "contact");
      EXPECT_LT(integral.note(norm(P - g.impulse) / norm(g.impulse), i), 2e-3);  // 7e-5
      const double most = largest_force(r, g.end_effector);
      EXPECT_LE(most, g.profile->peak_force * (1 + 1e-12));
      EXPECT_LT(peak.note(1 - most / g.profile->peak_force, i), 2e-3);
      EXPECT_TRUE(r.grasps[k].captured);
      // The grasps are rigid from then on.
      EXPECT_LT(opening(p, r, k, last + 1, r.series.time.size() - 1).position, 1e-11);
      EXPECT_LT(norm(relative_twist_at(p, r, k, last + 1).linear), 1e-12);
    }
  }
}

TEST(CompliantGrasps, ConvergeToThePlasticImpact) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem rigid = contact_capture_case(1);
  const CaptureResult plastic = simulate_capture(rigid);
  double previous = 0, rate = 0;
  for (double stiffness : {1e7, 1e8, 1e9}) {
    const CaptureResult r = simulate_capture(yielding_case(stiffness, 1));
    expect_passes(r);
    double off = 0;
    for (std::size_t k = 0; k < 2; ++k)
      off = std::max(off, norm(r.impact()->grasps[k].impulse - plastic.impact()->grasps[k].impulse));
    rate = std::log10(previous / off);
    std::printf("[ measured ] stiffness %.0e: %.3g s, off by %.3g of %.3g N s, rate %.3g\n", stiffness,
                r.impact()->duration, off, norm(plastic.impact()->grasps[0].impulse), rate);
    if (previous > 0) {
      EXPECT_LT(off, previous);
    }
    previous = off;
  }
  // The duration is proportional to 1 / sqrt(stiffness), and so is the motion during the impact.
  EXPECT_NEAR(rate, 0.5, 0.1);
}

TEST(CompliantContacts, SeparateAndTargetIsFree) {
  Worst integral("integral of the force");
  for (int i = 0; i < 4; ++i) {
    SCOPED_TRACE(seed_note(i));
    const CaptureProblem p = soft_rebound(i);
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    EXPECT_EQ(r.impact()->compliant->end, "separated");
    const std::size_t last = last_sample(r, "contact");
    for (std::size_t k = 0; k < 2; ++k) {
      const GraspImpulse& g = r.impact()->grasps[k];
      EXPECT_FALSE(r.grasps[k].captured);
      EXPECT_GT(g.profile->energy_lost, 0);
      EXPECT_GE(g.profile->touches, 1);
      EXPECT_LT(integral.note(norm(impulse_of(r, g.end_effector, "contact") - g.impulse) / norm(g.impulse), i),
                2e-2);  // 1e-4
      for (std::size_t s = last + 1; s < r.series.time.size(); ++s)
        EXPECT_EQ(norm(vector_at(r, "grasps/" + g.end_effector + "/force", s)), 0);
    }
  }
}

// An undamped, frictionless contact converges to the rigid contact with e = 1 for high stiffness.
TEST(CompliantContacts, ConvergeToFullRestitution) {
  CaptureProblem p = rebound_case(Law::restitution, 1, 0, 2);
  p.grasps.pop_back(), p.targets.pop_back();
  const CaptureResult rigid = simulate_capture(p);
  p.impact->law = Law::compliant;
  double previous = 0, rate = 0;
  for (double stiffness : {1e6, 1e8, 1e10}) {
    p.impact->contact.stiffness = stiffness;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    const double off = norm(r.impact()->grasps[0].impulse - rigid.impact()->grasps[0].impulse);
    rate = std::log(previous / off) / std::log(100.0);
    std::printf("[ measured ] stiffness %.0e: off by %.3g of %.3g N s, rate %.3g\n", stiffness, off,
                norm(rigid.impact()->grasps[0].impulse), rate);
    previous = off;
  }
  EXPECT_NEAR(rate, 0.5, 0.1);
}

TEST(CompliantImpact, BrakedOrDrivenJointsReportedAndLedgerPasses) {
  for (RobotSetup::Base base : {RobotSetup::Base::free, RobotSetup::Base::fixed}) {
    for (Joints joints : {Joints::free, Joints::braked, Joints::driven}) {
      SCOPED_TRACE(static_cast<int>(base) * 10 + static_cast<int>(joints));
      CaptureProblem p = yielding_case(1e7, 2);
      p.robot.base_mode = base;
      if (base == RobotSetup::Base::fixed) p.V_WB.reset();
      p.impact->joints = joints;
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      if (joints == Joints::free) {
        EXPECT_TRUE(r.impact()->held_joints.empty());
        continue;
      }
      EXPECT_EQ(r.impact()->joints_during, joints == Joints::braked ? "braked" : "driven");
      ASSERT_EQ(r.impact()->held_joints.size(), 8u);
      const std::size_t s = first_sample(r, "contact");
      double work = 0;
      for (int j = 0; j < 8; ++j) {
        const double before = value_at(r, "joints/velocity", s, j);
        for (std::size_t k = s + 2; k < last_sample(r, "contact"); ++k)
          EXPECT_NEAR(value_at(r, "joints/velocity", k, j), joints == Joints::braked ? 0 : before, 1e-13);
        work += r.impact()->held_joints[static_cast<std::size_t>(j)].work;
      }
      // Energy balance of the impact: kinetic energy, spring energy, losses and the work of brakes or drives.
      const CompliantReport& c = *r.impact()->compliant;
      EXPECT_NEAR(r.impact()->kinetic_energy_after + c.elastic_energy_after + c.energy_lost - work,
                  r.impact()->kinetic_energy_before, 1e-8 * r.impact()->kinetic_energy_before);
      EXPECT_NEAR(r.impact()->kinetic_energy_before, value_at(r, "system/kinetic_energy", s), 1e-12);
      for (std::size_t j = 0; j < 8; ++j) {
        const HeldJoint& held = r.impact()->held_joints[j];
        for (const JointImpulse& joint : r.impact()->joints) {
          if (joint.joint != held.joint) continue;
          EXPECT_NEAR(joint.along_axis, held.impulse, 2e-2 * norm(joint.angular_impulse)) << held.joint;
        }
      }
    }
  }
}

TEST(CompliantImpact, BrakedJointsConvergeToPlasticImpact) {
  SKIP_UNDER_SANITIZERS();
  for (Joints joints : {Joints::braked, Joints::driven}) {
    CaptureProblem p = contact_capture_case(2);
    p.impact->joints = joints;
    const CaptureResult plastic = simulate_impact_only(p);
    CaptureProblem yielding = yielding_case(1e9, 2);
    yielding.impact->joints = joints;
    const CaptureResult r = simulate_capture(yielding);
    expect_passes(r);
    double off = 0, most = 0;
    for (std::size_t j = 0; j < 8; ++j) {
      off = std::max(off, std::abs(r.impact()->held_joints[j].impulse - plastic.impact()->held_joints[j].impulse));
      most = std::max(most, std::abs(plastic.impact()->held_joints[j].impulse));
    }
    std::printf("[ measured ] brakes and drives: off by %.3g of %.3g N m s\n", off, most);
    EXPECT_LT(off, 1e-2 * most);  // measured 6e-4, 1e-3
    EXPECT_LT(norm(r.impact()->grasps[0].impulse - plastic.impact()->grasps[0].impulse),
              1e-2 * norm(plastic.impact()->grasps[0].impulse));
  }
}

// One arm holds its target while the other contacts its own.
TEST(CompliantImpact, WhileAnotherArmHoldsTarget) {
  SKIP_UNDER_SANITIZERS();
  for (bool contact : {false, true}) {
    CaptureProblem p = contact ? soft_rebound(3) : yielding_case(1e7, 3);
    p.impact->grasp = yielding_case(1e7, 3).impact->grasp;
    p.grasps[0].contact = false;
    p.grasps[1].closes = GraspSetup::Closes::at_time, p.grasps[1].closes_at = 0.5;
    p.impact->compliant.samples = 20000;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    ASSERT_EQ(r.impacts.size(), 2u);
    EXPECT_EQ(r.impacts[1].time, 0.5);
    ASSERT_EQ(r.impacts[1].grasps.size(), 1u);
    const std::size_t first = first_sample(r, "contact_2"), last = last_sample(r, "contact_2");
    // The held target receives the impulse of its grasp throughout the impact.
    Vector3d passed = Vector3d::zero();
    for (std::size_t s = first + 1; s < last; ++s) {
      EXPECT_EQ(value_at(r, "grasps/hand0/holds", s), s + 1 < last ? 1 : value_at(r, "grasps/hand0/holds", s));
      passed += (0.5 * (r.series.time[s + 1] - r.series.time[s])) *
                (vector_at(r, "grasps/hand0/force", s) + vector_at(r, "grasps/hand0/force", s + 1));
    }
    const Vector3d gained = vector_at(r, "targets/target0/linear_momentum", last - 1) -
                            vector_at(r, "targets/target0/linear_momentum", first);
    ASSERT_GT(norm(gained), 1e-3);
    EXPECT_LT(norm(gained + passed), 1e-3 * norm(gained));  // measured 4e-6
    std::printf("[ measured ] held target: %.3g of %.3g N s\n", norm(gained + passed), norm(gained));
    EXPECT_LT(opening(p, r, 0, first, r.series.time.size() - 1).position, 1e-11);
  }
}

// The first arm's impact lasts longer than the delay of the second.
TEST(CompliantImpact, SkipsEventsDueDuringImpact) {
  CaptureProblem p = yielding_case(2e3, 3);
  p.grasps[1].closes = GraspSetup::Closes::at_time, p.grasps[1].closes_at = 1e-3;
  p.post_impact->releases = {{1.2, {"hand0"}}};
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_EQ(r.impact()->compliant->end, "time_over");  // soft grasps do not settle within one second
  for (const LedgerEntry& e : r.ledger.entries)
    EXPECT_EQ(e.pass(), e.name != "compliant_energy_residual") << e.name << " " << e.value;
  ASSERT_EQ(r.impacts.size(), 2u);
  EXPECT_GT(r.impacts[1].time, 1e-3);
  ASSERT_EQ(r.releases.size(), 1u);
  EXPECT_EQ(r.releases[0].end_effectors, std::vector<std::string>{"hand0"});
  EXPECT_TRUE(r.grasps[0].captured && r.grasps[1].captured);
}

TEST(CompliantImpact, WhileAnotherArmFollowsItsTrajectory) {
  for (JointControl mode : {JointControl::prescribed, JointControl::pd}) {
    CaptureProblem p = yielding_case(1e5, 4);
    p.approach.emplace();
    p.approach->duration = 3;
    p.approach->profile = JointProfile::quintic;
    for (double q : p.joint_position) p.approach->final_position.push_back(q + 0.2);
    p.approach->final_rates = std::vector<double>(8, 0.05);
    for (TargetSetup& t : p.targets) t.given_at = TargetSetup::Instant::start;
    if (mode == JointControl::pd) use_pd(p, 300, 100);
    p.grasps[0].closes = GraspSetup::Closes::at_time, p.grasps[0].closes_at = 1.5;
    const CaptureResult r = simulate_capture(p);
    expect_passes(r);
    EXPECT_EQ(r.impact()->time, 1.5);
    ASSERT_EQ(r.impacts.size(), 2u);
    EXPECT_EQ(r.impacts[1].time, 3);
    if (mode == JointControl::prescribed) {
      EXPECT_EQ(r.impact()->held_joints.size(), 4u);  // of the other arm
    }
  }
}

// A warning reports the deformation that remains at the end of the impact. More than a thousandth of the energy in the
// springs fails the conservation checks.
TEST(CompliantImpact, BrakesAfterwardsAndWarnsIfUnfinished) {
  CaptureProblem p = yielding_case(1e4, 1);
  p.impact->compliant.longest = 5e-3;
  p.post_impact->joints = PostImpactSetup::Joints::braked;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);  // 4e-4 of the energy remains in the springs
  EXPECT_EQ(r.impact()->compliant->end, "time_over");
  EXPECT_NEAR(r.impact()->duration, 5e-3, 1e-15);
  EXPECT_GT(r.impact()->compliant->residual_impulse, 1e-3);
  EXPECT_TRUE(warns(r, "impact.longest"));
  EXPECT_TRUE(warns(r, "hand0 is still deformed by "));
  EXPECT_TRUE(r.impact()->brake);
  EXPECT_EQ(value_at(r, "joints/velocity", r.series.time.size() - 1, 0), 0);
  EXPECT_GT(r.impact()->compliant->elastic_energy_after, 0);
}

// A contact is not reported as separated if its impact ends during compression; its spring energy counts.
TEST(CompliantContacts, UnfinishedCompressionFailsLedger) {
  const CaptureProblem whole = soft_rebound(2);
  const CaptureResult over = simulate_capture(whole);
  expect_passes(over);
  EXPECT_EQ(over.impact()->compliant->end, "separated");
  EXPECT_THAT(over.grasps[0].reason, HasSubstr("a contact that does not hold: relative speed "));
  CaptureProblem p = whole;
  p.impact->compliant.longest = over.impact()->grasps[0].profile->peak_force_time;  // at maximum compression
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_EQ(r.impact()->compliant->end, "time_over");
  EXPECT_THAT(r.grasps[0].reason, HasSubstr("a contact that does not hold: it is still compressed by "));
  EXPECT_THAT(r.grasps[0].reason, HasSubstr(" J in the springs"));
  EXPECT_FALSE(row(r, "compliant_energy_residual").pass());
  EXPECT_FALSE(r.ledger.pass());
  EXPECT_GT(r.impact()->compliant->elastic_energy_after, 0.1);  // measured 0.38 J
  EXPECT_GT(row(r, "compliant_energy_residual").value, 1e-2);   // measured 0.16
  EXPECT_TRUE(warns(r, "hand0 is still compressed by "));
}

// An end-effector slides on an undamped surface, and its slip reverses during the contact. The friction work reveals
// velocity errors within the slip speed.
TEST(CompliantContacts, EnergyBalanceAcrossSlipReversal) {
  struct Rub {
    double friction, slip_speed, stiffness;
  };
  for (const Rub rub : {Rub{2, 1e-4, 8e6}, Rub{0.5, 1e-5, 8e6}, Rub{0.5, 1e-6, 8e6}}) {
    CaptureProblem p = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/planar-admittance.yaml");
    p.clearance.enabled = false;
    p.impact->friction = rub.friction;
    p.impact->contact.slip_speed = rub.slip_speed;
    p.impact->contact.stiffness = rub.stiffness, p.impact->contact.damping = 0;
    const CaptureResult r = simulate_capture(p);
    EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
    ASSERT_TRUE(r.impact() && r.impact()->compliant);
    EXPECT_LT(r.impact()->compliant->energy_residual, 1e-10) << rub.slip_speed;  // measured 6e-12
    EXPECT_LT(r.impact()->compliant->rhs_evaluations, 30'000);                   // measured 8,715
  }
}

// Two arms hold a target in a loop when the third one grasps another target, or the same one. With growing stiffness
// the impulses converge to those of the plastic law.
TEST(CompliantImpact, WhileALoopHoldsATarget) {
  SKIP_UNDER_SANITIZERS();
  for (const int third : {1, 0}) {
    SCOPED_TRACE(third);
    LoopOptions options;
    options.target_of_arm = {0, 0, third};
    options.joints = 6;
    options.time = 0.7;
    CaptureProblem p = random_loops(options, 3);
    p.grasps[2].closes = GraspSetup::Closes::at_time, p.grasps[2].closes_at = 0.5;
    const CaptureResult plastic = simulate_capture(p);
    ASSERT_EQ(plastic.impacts.size(), 2u);
    p.impact->law = Law::compliant;
    double last = 0;
    for (const double stiffness : {1e7, 1e9}) {
      p.impact->grasp = yielding_case(stiffness, 1).impact->grasp;
      const CaptureResult r = simulate_capture(p);
      expect_passes(r);
      ASSERT_EQ(r.impacts.size(), 2u);
      EXPECT_EQ(r.impacts[1].time, 0.5);
      const Vector3d exact = plastic.impacts[1].grasps.back().impulse;
      const double off = norm(r.impacts[1].grasps.back().impulse - exact) / norm(exact);
      std::printf("[ measured ] stiffness %.0e: off by %.3g\n", stiffness, off);
      if (last > 0) {
        EXPECT_LT(off, 0.3 * last);
      }
      last = off;
    }
    EXPECT_LT(last, 0.02);
  }
}

TEST(CompliantImpact, OnArrivalInEnvelope) {
  CaptureProblem p = yielding_case(1e5, 5);
  p.grasps.pop_back(), p.targets.pop_back();
  p.grasps[0].closes = GraspSetup::Closes::on_arrival;
  // The grasp point lies 5 cm ahead of the end-effector, along the relative velocity.
  CaptureProblem now = p;
  now.grasps[0].closes = GraspSetup::Closes::together;
  const CaptureResult contact = simulate_impact_only(now);
  const Vector3d u = grasp_error(now, contact, 0, 0).relative_velocity();
  const double speed = norm(u);
  const Vector3d gap = (-0.05 / speed) * u;  // 5 cm before the point, on its path
  const Vector3d end_effector = contact.impact()->grasps[0].contact_point;
  p.targets[0].X_WT.p += (end_effector - gap) - (p.targets[0].X_WT * p.targets[0].grasp_points[0].X_TG.p);
  p.robot.end_effectors[0].envelope = CaptureEnvelope{0.04};
  p.post_impact->duration = 3 * 0.05 / speed;
  const CaptureResult r = simulate_capture(p);
  expect_passes(r);
  ASSERT_TRUE(r.impact());
  EXPECT_GT(r.impact()->time, 0);
  EXPECT_NEAR(r.grasps[0].distance, 0.04, 1e-6);
  EXPECT_TRUE(r.grasps[0].captured);
}

}  // namespace compliant_capture_test
}  // namespace grapnel::testing
