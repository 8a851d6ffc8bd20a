// Compliant grasps: convergence to the plastic impact with increasing stiffness.
#include <gtest/gtest.h>

#include "impact/compliant_case.hpp"
#include "impact/contact_case.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_grasp_test {

using Status = ImpactSolution::Status;

std::vector<CompliantGrasp> yielding(const std::vector<Grasp>& grasps, double stiffness, double damping_ratio = 0.7) {
  const double c = 2 * damping_ratio * std::sqrt(stiffness * 5);  // targets have about 10 kg
  std::vector<CompliantGrasp> springs;
  for (const Grasp& g : grasps) springs.push_back({g, stiffness, c, 0.2 * stiffness, 0.2 * c});
  return springs;
}

// Both arms of the thesis robot grasp one target at points 1 m apart. The target rotates and moves relative to them, in
// the plane.
ImpactCase shared_target(GraspModel model) {
  ModelBuilder builder;
  for (const BodyDescription& b : thesis_robot()) builder.add(b);
  for (const FrameDescription& f : thesis_tips(0.5)) builder.add(f);
  builder.add(thesis_target("target"));
  ImpactCase c{builder.build(), {}, {}};
  c.state = zero_state(c.model);
  const double angles[] = {0.360186, 1.523012, 1.164168, 2.504549, -1.390707, -1.208070};
  const double rates[] = {0.02, -0.05, 0.08, -0.03, 0.04, 0.06};
  for (int j = 0; j < 6; ++j) {
    const Body& body = c.model.bodies()[c.model.joints()[j]];
    c.state.q[body.q] = angles[j], c.state.v[body.v] = rates[j];
  }
  const int base = c.model.body_index("base"), target = c.model.body_index("target");
  set_root_pose(c.model, base, {rotation_about({0, 0, 1}, 0.094227), {-0.000786, -0.054439, 0}}, c.state);
  set_root_pose(c.model, target, {rotation_about({0, 0, 1}, 0.3), {0, 1.35, 0}}, c.state);
  set_root_twist(c.model, target, {{0, 0, 0.2}, {0.02, -0.03, 0}}, c.state);
  const Kinematics k = forward_kinematics(c.model, c.state);
  for (const char* tip : {"tip-1", "tip-2"}) {
    const int frame = c.model.frame_index(tip);
    c.grasps.push_back({c.model.frames()[frame].body, target, model, frame_pose(c.model, k, frame).p, {0, 0, 1}});
  }
  return c;
}

// Deviation of the velocities from those of the plastic impact, relative to the largest change.
double velocity_error(const ImpactSolution& o, const State& before, const ImpactSolution& rigid) {
  double error = 0, change = 0;
  for (std::size_t i = 0; i < before.v.size(); ++i) {
    error = std::max(error, std::abs(o.after.v[i] - rigid.velocity[i]));
    change = std::max(change, std::abs(rigid.velocity[i] - before.v[i]));
  }
  return error / change;
}

void expect_balanced(const Model& model, const State& state, const ImpactSolution& o, Worst& energy, Worst& momentum,
                     int where) {
  EXPECT_LT(energy.note(o.energy_residual, where), 1e-8);                         // measured 1.3e-9
  EXPECT_LT(momentum.note(momentum_error(model, state, o.after), where), 1e-12);  // measured 6e-16
}

// The duration of the impact, and the motion during it, are proportional to k^(-1/2).
void expect_convergence(const Model& model, const State& state, const std::vector<Grasp>& grasps, bool unique,
                        double settled) {
  const ImpactSolution rigid = plastic_impact(model, state, grasps);
  Worst energy("energy residual"), momentum("momentum error");
  double last_velocity = 0, last_impulse = 0;
  for (const double k : {1e6, 1e8, 1e10}) {
    const ImpactSolution o =
        compliant_impact(model, state, {}, yielding(grasps, k), {.longest = 2, .settled = settled});
    ASSERT_EQ(o.status, Status::settled) << o.message;
    expect_balanced(model, state, o, energy, momentum, static_cast<int>(std::log10(k)));
    double impulse = 0, size = 0;
    for (std::size_t g = 0; g < grasps.size(); ++g) {
      impulse = std::max(impulse, norm(o.forces[g].impulse.linear - rigid.contacts[g].P_WC.linear));
      impulse = std::max(impulse, norm(o.forces[g].impulse.angular - rigid.contacts[g].P_WC.angular));
      size = std::max(size, norm(rigid.contacts[g].P_WC.linear));
    }
    const double velocity = velocity_error(o, state, rigid);
    std::printf("[ measured ] k = %.0e: velocities off by %.3g, impulses by %.3g; duration %.3g s, %ld steps\n", k,
                velocity, impulse / size, o.duration, o.steps);
    if (last_velocity > 0) {
      const double rate = std::log10(last_velocity / velocity) / 2;
      std::printf("[ measured ] rate %.3f", rate);
      EXPECT_NEAR(rate, 0.5, 0.02);  // measured 0.498 to 0.501
      if (unique) {
        const double impulse_rate = std::log10(last_impulse / impulse) / 2;
        std::printf(", of impulses %.3f", impulse_rate);
        EXPECT_NEAR(impulse_rate, 0.5, 0.02);  // measured 0.499 to 0.503
      }
      std::printf("\n");
    }
    last_velocity = velocity, last_impulse = impulse;
  }
  EXPECT_LT(last_velocity, 2e-3);  // measured 4.5e-4
}

TEST(CompliantGrasps, ConvergeToPlasticOnTwoTargets) {
  for (GraspModel model : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    SCOPED_TRACE(row_count(model));
    const ReferenceImpact r = reference_impact(model, 0.5);
    expect_convergence(r.model, r.state, r.grasps, true, 1e-8);
  }
}

TEST(CompliantGrasps, ConvergeToPlasticOnSharedTarget) {
  for (GraspModel model : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    SCOPED_TRACE(row_count(model));
    const ImpactCase c = shared_target(model);
    expect_convergence(c.model, c.state, c.grasps, false, 1e-14);
  }
}

// All kinds of grasps, joints and roots in three dimensions, with light damping and a duration too short to settle.
TEST(CompliantGrasps, MomentumAndEnergyOfRandomRobots) {
  Worst energy("energy residual"), momentum("momentum error"), impulse("impulse against the integral of samples");
  int free_roots = 0;
  const int cases = test::repetitions(24);
  for (int i = 0; i < cases; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const ImpactSolution o =
        compliant_impact(c.model, c.state, {}, yielding(c.grasps, 1e4, 0.05), {.longest = 0.05, .samples = 4000});
    ASSERT_EQ(o.status, Status::time_over) << o.message;
    EXPECT_LT(energy.note(o.energy_residual, i), 1e-8);  // measured 1.6e-10
    EXPECT_EQ(o.duration, 0.05);
    if (c.model.has_free_root(c.model.body_index("b0"))) {
      ++free_roots;
      EXPECT_LT(momentum.note(momentum_error(c.model, c.state, o.after), i), 1e-12);  // measured 5.5e-15
    }
    for (const ForceHistory& h : o.forces) {
      const Vector3d sampled = integral(o.times, h.force);
      double largest = 0, furthest = 0;
      for (std::size_t s = 0; s < o.times.size(); ++s) {
        largest = std::max(largest, norm(h.force[s]));
        furthest = std::max(furthest, h.deformation[s]);
      }
      EXPECT_LT(impulse.note(norm(sampled - h.impulse.linear) / (largest * o.duration), i), 1e-5);  // measured 2.4e-7
      EXPECT_GE(h.peak_force, largest * (1 - 1e-9));
      EXPECT_LT(h.peak_force, 1.001 * largest);
      EXPECT_GE(h.largest_deformation, furthest * (1 - 1e-9));
      EXPECT_GT(h.energy_lost, 0);
    }
  }
  EXPECT_GT(free_roots, cases / 2);  // every fifth robot has a fixed root
}

TEST(CompliantGrasps, HeldJointsMaintainTheirRates) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  std::vector<int> held;
  std::vector<HeldRate> rates;
  for (const char* name : {"arm-1-link-2", "arm-2-link-1", "arm-2-link-3"}) {
    const int v = r.model.bodies()[r.model.body_index(name)].v;
    held.push_back(v), rates.push_back({v, r.state.v[v]});
    ASSERT_GT(std::abs(r.state.v[v]), 1e-3);
  }
  const ImpactSolution rigid = plastic_impact(r.model, r.state, r.grasps, rates);
  Worst energy("energy residual"), momentum("momentum error");
  double last = 0;
  for (const double k : {1e6, 1e8, 1e10}) {
    const ImpactSolution o = compliant_impact(r.model, r.state, {}, yielding(r.grasps, k), {.longest = 2}, held);
    ASSERT_EQ(o.status, Status::settled) << o.message;
    expect_balanced(r.model, r.state, o, energy, momentum, static_cast<int>(std::log10(k)));
    ASSERT_EQ(o.held_impulses.size(), held.size());
    double error = velocity_error(o, r.state, rigid);
    for (std::size_t i = 0; i < held.size(); ++i) {
      EXPECT_EQ(o.after.v[held[i]], r.state.v[held[i]]);
      error = std::max(error, std::abs(o.held_impulses[i] - rigid.held_impulses[i]));
    }
    EXPECT_NE(o.held_work, 0);
    std::printf("[ measured ] k = %.0e: velocities and held impulses off by %.3g\n", k, error);
    if (last > 0) {
      EXPECT_NEAR(std::log10(last / error) / 2, 0.5, 0.05);
    }
    last = error;
  }
  EXPECT_LT(last, 5e-3);  // measured 1.2e-3
}

// A held base transmits momentum to the environment and continues to rotate at its rate.
TEST(CompliantGrasps, HeldBaseMaintainsMotion) {
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  const int base = r.model.body_index("base");
  set_root_twist(r.model, base, {{0.1, -0.2, 0.3}, {0.02, 0.01, -0.03}}, r.state);
  std::vector<int> held;
  for (int k = 0; k < 6; ++k) held.push_back(r.model.bodies()[base].v + k);
  const ImpactSolution o = compliant_impact(r.model, r.state, {}, yielding(r.grasps, 1e5), {.longest = 0.3}, held);
  ASSERT_NE(o.status, Status::failed) << o.message;
  for (int v : held) EXPECT_EQ(o.after.v[v], r.state.v[v]);
  EXPECT_LT(o.energy_residual, 1e-8);
  EXPECT_GT(momentum_error(r.model, r.state, o.after), 1e-3);
  // The velocity in B is constant: B's origin moves on a helix.
  const Twistd V = root_twist(r.model, r.state, base);
  const Posed X0 = root_pose(r.model, r.state, base), X1 = root_pose(r.model, o.after, base);
  const double turn = norm(V.angular) * o.duration;
  EXPECT_LT(std::abs(rotation_angle(transpose(X0.R) * X1.R) - turn), 1e-10);
  const Vector3d axis = (1 / norm(V.angular)) * V.angular;
  EXPECT_LT(std::abs(dot(axis, X1.p - X0.p) - dot(axis, V.linear) * o.duration), 1e-10);
}

// One arm has no relative motion at its grasp; only the other grasp's effect on the base loads it. The error scale must
// not be the relative motion, which is of the order of rounding.
TEST(CompliantGrasps, MatchedGraspIsMovedByOthers) {
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  const Grasp& g = r.grasps[0];
  const Kinematics k = forward_kinematics(r.model, r.state);
  const Vector3d arm = k.X_WB[g.target_body].p - k.X_WB[g.robot_body].p;
  set_root_twist(r.model, g.target_body, shift(k.V_WB[g.robot_body], arm), r.state);
  ASSERT_LT(norm(relative_velocity(r.model, r.state, g.robot_body, g.target_body, g.p_WC)), 1e-15);
  const ImpactSolution o = compliant_impact(r.model, r.state, {}, yielding(r.grasps, 1e6), {.longest = 2});
  ASSERT_EQ(o.status, Status::settled) << o.message;
  std::printf("[ measured ] %ld steps, energy residual %.3g, impulses %.3g and %.3g\n", o.steps, o.energy_residual,
              norm(o.forces[0].impulse.linear), norm(o.forces[1].impulse.linear));
  EXPECT_LT(o.steps, 300);  // measured 71
  EXPECT_LT(o.energy_residual, 1e-8);
  EXPECT_GT(norm(o.forces[0].impulse.linear), 1e-3 * norm(o.forces[1].impulse.linear));
  EXPECT_LT(momentum_error(r.model, r.state, o.after), 1e-12);
}

TEST(CompliantGrasps, UndampedGraspsNeverRest) {
  const ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  const ImpactSolution o = compliant_impact(r.model, r.state, {}, yielding(r.grasps, 1e6, 0), {.longest = 0.1});
  EXPECT_EQ(o.status, Status::time_over);
  EXPECT_EQ(o.forces[0].energy_lost, 0);
  EXPECT_GT(o.elastic_energy_after, 0);
  EXPECT_LT(o.energy_residual, 1e-8);
}

// At a very low stiffness a grasp rotates by half a turn, beyond the range of the springs' law.
TEST(CompliantGrasps, HalfTurnFailsWithMessage) {
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.5);
  std::vector<CompliantGrasp> grasps = yielding(r.grasps, 1e-3, 0);
  const ImpactSolution o = compliant_impact(r.model, r.state, {}, grasps, {.longest = 1000});
  EXPECT_EQ(o.status, Status::failed);
  EXPECT_NE(o.message.find("a grasp has turned by"), std::string::npos) << o.message;
}

// A loop closure between two free bodies makes them one composite body.
TEST(CompliantLoops, AClosureJoinsTwoBodies) {
  const Lump striker{"striker", 1.5, {0.2, 0.3, 0.1}, {0.4, 0.1, 0.6}, {{0.3, -0.2, 0.1}, {0.2, 0.1, -1}}};
  const ContactCase two =
      lumps({striker, {"left", 2, {0.3, 0.4, 0.5}, {-0.5, 0, -0.5}}, {"right", 2, {0.3, 0.4, 0.5}, {0.5, 0, -0.5}}});
  const ContactCase one = lumps({striker, {"both", 4, {0.6, 0.8 + 1, 1.0 + 1}, {0, 0, -0.5}}});
  LoopClosure loop{"loop", 1, {}, 2, {}};
  loop.X_AC = Posed{Rotationd::identity(), {0.5, 0.1, 0.2}}, loop.X_BD = Posed{Rotationd::identity(), {-0.5, 0.1, 0.2}};
  CompliantContact contact{0, 2, {0.3, 0.2, 0}, {0, 0, 1}};
  contact.stiffness = 1e4, contact.damping = 20, contact.friction = 0.3;
  CompliantContact alone = contact;
  alone.target_body = 1;
  const ImpactSolution a =
      compliant_impact(two.model, two.state, {&contact, 1}, {}, {}, {}, {}, nullptr, nullptr, {&loop, 1});
  const ImpactSolution b = compliant_impact(one.model, one.state, {&alone, 1}, {}, {});
  ASSERT_EQ(a.status, Status::separated) << a.message;
  ASSERT_EQ(b.status, Status::separated) << b.message;
  const double size = norm(b.forces[0].impulse.linear);
  EXPECT_NEAR(norm(a.forces[0].impulse.linear - b.forces[0].impulse.linear), 0, 1e-9 * size);
  EXPECT_NEAR(a.duration, b.duration, 1e-9 * b.duration);
  EXPECT_LT(a.energy_residual, 1e-9);
  EXPECT_LT(momentum_error(two.model, two.state, a.after), 1e-12);
  const Kinematics k = forward_kinematics(two.model, a.after);
  const ClosureDefect defect = closure_defect(loop, k);
  EXPECT_LT(std::max({defect.position, defect.angle, defect.velocity, defect.angular_velocity}), 1e-10);
  ASSERT_EQ(a.loop_impulses.size(), 1u);
  EXPECT_NEAR(norm(a.loop_impulses[0].linear - 2.0 * shift(k.V_WB[1], Vector3d::zero()).linear), 0, 1e-9 * size);
}

}  // namespace compliant_grasp_test
}  // namespace grapnel::testing
