/// Captures by flexible robots: they arrive, satisfy the conservation checks, and the reported dependence of the impact
/// on the modes is correct.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "capture/recorded.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace flexible_capture_test {

CaptureProblem load(const std::string& name, const std::vector<Override>& overrides = {}) {
  return load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + name, overrides);
}

// A shorter approach, since plans are corrected by simulations.
CaptureProblem quick(const std::string& name) {
  return load(name, {{"approach.duration", "4"}, {"post_impact.duration", "0.1"}});
}

CaptureResult completed(const CaptureProblem& problem) {
  CaptureResult r = simulate_capture(problem);
  EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.name != "clearance_violation") {
      EXPECT_TRUE(e.pass()) << e.name << " " << e.value;
    }
  }
  return r;
}

void expect_arrival(const CaptureProblem& problem, const CaptureResult& r) {
  for (std::size_t g = 0; g < problem.grasps.size(); ++g) {
    const GraspError m = grasp_error(problem, r, g, last_sample(r, "approach"));
    EXPECT_LT(m.distance(), 1e-9);  // measured 2e-12
    if (problem.approach->match) {
      EXPECT_LT(norm(m.relative_velocity()), 1e-9);  // of the deflected end-effector; measured 3e-12
    }
  }
}

TEST(FlexibleCapture, AcceptsMaterialSectionsAndStations) {
  const std::string beam = "robot.links.arm-1-link-3.beam", tube = "{diameter: 60 mm, wall_thickness: 1 mm}";
  const std::vector<Override> overrides{
      {beam,
       "{to: [1, 0, 0], segments: 2, material: {young_modulus: 70 GPa, shear_modulus: 26000 MPa, density: 2.7 "
       "g/cm^3}, stations: [{at: 0, section: " +
           tube + "}, {at: 1, section: {diameter: 4 cm, wall_thickness: 1 mm}}]}"}};
  const CaptureProblem problem = load("thesis/closed-loop-flexible.yaml", overrides);
  for (const BodyDescription& link : problem.robot.bodies) {
    if (link.name != "arm-1-link-3") continue;
    ASSERT_TRUE(link.beam && link.beam->material);
    EXPECT_EQ(link.beam->material->young_modulus, 70e9);
    EXPECT_EQ(link.beam->material->shear_modulus, 26e9);
    EXPECT_EQ(link.beam->material->density, 2700);
    ASSERT_EQ(link.beam->stations.size(), 2u);
    EXPECT_EQ(link.beam->stations[1].at, 1);
    EXPECT_EQ(link.beam->stations[1].section->diameter, 0.04);
    EXPECT_EQ(link.beam->stations[0].section->wall_thickness, 0.001);
  }
  std::vector<Override> wrong = overrides;
  wrong.push_back({beam + ".section", tube});
  try {
    load("thesis/closed-loop-flexible.yaml", wrong);
    ADD_FAILURE() << "accepted";
  } catch (const std::exception& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("a section is stated by the beam or by its stations, not by both"));
  }
}

// The plan is corrected for the deflection. The reported mode dependence of the impact ends at the simulated impact and
// begins at that of the robot with fixed segment rates.
TEST(FlexibleCapture, ArrivesAndReportsInfluenceOfModesOnImpact) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = quick("thesis/closed-loop-flexible.yaml");
  for (BodyDescription& body : p.robot.bodies) {
    if (body.beam) body.beam->segments = 1;
  }
  const CaptureResult r = completed(p);
  expect_arrival(p, r);
  ASSERT_EQ(r.elastic.size(), 2u);
  EXPECT_EQ(r.elastic[0].springs, 12);
  EXPECT_LT(r.elastic[1].modes[0].held, r.elastic[0].modes[0].held);
  const std::vector<RetainedModes>& by_modes = r.impact()->by_modes;
  ASSERT_GT(by_modes.size(), 10u);
  EXPECT_EQ(by_modes.back().modes, 12);
  for (std::size_t g = 0; g < 2; ++g)
    EXPECT_NEAR(by_modes.back().impulses[g], norm(r.impact()->grasps[g].impulse), 1e-9);

  p.impact->modes = ImpactSetup::Modes::none;
  const CaptureResult none = completed(p);
  for (std::size_t g = 0; g < 2; ++g) {
    EXPECT_NEAR(none.impact()->by_modes.front().impulses[g], norm(none.impact()->grasps[g].impulse), 1e-9);
    EXPECT_NEAR(none.impact()->by_modes.front().impulses[g], by_modes.front().impulses[g], 1e-12);
  }
  EXPECT_TRUE(none.impact()->held_joints.empty());  // segments are not driven joints

  // Only modes with a period longer than the impact: the list shows the impact for that number of modes.
  p.impact->modes = ImpactSetup::Modes::slow;
  for (const std::size_t n : {0u, 5u, 12u}) {
    const double above = n == 12 ? 1e6 : by_modes[n + 1].frequency;
    p.impact->duration = 2 / (by_modes[n].frequency + above);
    const CaptureResult slow = completed(p);
    for (std::size_t g = 0; g < 2; ++g) {
      EXPECT_NEAR(by_modes[n].impulses[g], norm(slow.impact()->grasps[g].impulse), 1e-9) << n;
      EXPECT_EQ(slow.impact()->by_modes.size(), by_modes.size());
    }
    EXPECT_TRUE(slow.impact()->held_joints.empty());
    EXPECT_EQ(slow.impact()->sensitivities.empty(), n < 12);
  }
  // Also with braked joints.
  p.impact->joints = ImpactSetup::Joints::braked;
  const CaptureResult braked = completed(p);
  EXPECT_NEAR(braked.impact()->by_modes.back().impulses[0], norm(braked.impact()->grasps[0].impulse), 1e-9);
  p.impact->duration = 2 / (braked.impact()->by_modes[6].frequency + braked.impact()->by_modes[7].frequency);
  const CaptureResult stiff = completed(p);
  EXPECT_NEAR(braked.impact()->by_modes[6].impulses[0], norm(stiff.impact()->grasps[0].impulse), 1e-9);
  EXPECT_FALSE(stiff.impact()->held_joints.empty());
  EXPECT_TRUE(warns(r, "depends on the number of responding modes"));
  EXPECT_FALSE(warns(none, "depends on the number of responding modes"));
}

// With increasing stiffness all results converge to the rigid robot of the thesis, with no modes in the impact.
TEST(FlexibleCapture, ComesToTheRigidRobotAsLinksStiffen) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult rigid = completed(quick("thesis/closed-loop.yaml"));
  std::vector<double> apart;
  for (const double stiffness : {2117.0, 21170.0}) {
    CaptureProblem p = quick("thesis/closed-loop-flexible.yaml");
    for (BodyDescription& body : p.robot.bodies) {
      if (body.beam) body.beam->bending_stiffness_z = stiffness, body.beam->segments = 1;
    }
    p.impact->modes = ImpactSetup::Modes::none;
    const CaptureResult r = completed(p);
    apart.push_back(std::abs(norm(r.impact()->grasps[0].impulse) - norm(rigid.impact()->grasps[0].impulse)));
  }
  EXPECT_LT(apart[0], 0.1 * norm(rigid.impact()->grasps[0].impulse));
  EXPECT_LT(apart[1], 0.3 * apart[0]);
}

// Compliant grasps: bending continues during the impact, and energy and momentum are conserved.
TEST(FlexibleCapture, CompliantImpacts) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = quick("thesis/closed-loop-flexible-contact.yaml");
  p.post_impact.reset();
  p.impact->compliant.longest = 0.6;
  const CaptureResult r = completed(p);
  EXPECT_TRUE(r.impact()->by_modes.empty());
  EXPECT_GT(norm(r.impact()->grasps[0].impulse), 0.1);
  // Modes slower than the impact.
  const CompliantReport& c = *r.impact()->compliant;
  EXPECT_EQ(c.modes, r.elastic[0].springs);
  EXPECT_NEAR(c.duration, 0.6, 1e-12);
  EXPECT_LT(c.fastest_period, c.slowest_period);
  EXPECT_EQ(c.slower_modes, 0);  // with free joints the lowest is 22 Hz
  EXPECT_NEAR(c.slowest_period, 1 / 21.7, 2e-3);
}

// Elastic gears, a panel on a sprung hinge, a load on a link's far end.
TEST(FlexibleCapture, GearsPanelsAndLoads) {
  CaptureProblem p = load("first-plan.yaml");
  p.post_impact->duration = 1;
  for (BodyDescription& body : p.robot.bodies) {
    if (body.joint.type != JointType::revolute) continue;
    body.joint.rotor_inertia = 1e-4, body.joint.gear_ratio = 100;
    body.joint.elasticity = JointElasticity{5000, 5};
  }
  BodyDescription panel;
  panel.name = "panel", panel.parent = p.robot.base;
  panel.joint.name = "panel-hinge", panel.joint.type = JointType::revolute, panel.joint.axis = {0, 0, 1};
  panel.joint.spring = JointSpring{30, 0.1, 0.2};
  panel.X_PF.p = {0, 0.5, 0};  // in the plane of this robot's motion
  panel.mass = 8, panel.com = {0, 1, 0}, panel.inertia = Symmetric3d::diagonal(3, 0.2, 3);
  p.robot.bodies.push_back(panel);
  LoadSetup load;
  load.body = "panel", load.p_BP = {0, 1, 0}, load.amplitude.linear = {0.01, 0, 0};
  p.loads.push_back(load);
  const CaptureResult r = completed(p);
  expect_arrival(p, r);
  EXPECT_EQ(r.elastic[0].springs, static_cast<int>(p.robot.bodies.size()) - 1);
  const auto deflection = std::find_if(r.series.series.begin(), r.series.series.end(),
                                       [](const Series& s) { return s.path == "elastic/deflection"; });
  ASSERT_TRUE(deflection != r.series.series.end());
  EXPECT_EQ(deflection->components.size(), p.robot.bodies.size() - 1);
  EXPECT_EQ(r.plan->joints.size(), p.joint_position.size());
}

// Panels of a target: they oscillate after the capture, and the damper work belongs to the target until it is held.
TEST(FlexibleCapture, SatelliteWithPanels) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = load("dual-arm-satellite-panels.yaml", {{"post_impact.duration", "5"}});
  for (PanelSetup& panel : p.targets[0].panels) panel.beam->damping_ratio = 0.1;
  const CaptureResult r = completed(p);
  EXPECT_EQ(r.elastic[0].springs, 16);
  const auto series = [&](const std::string& path) {
    return std::find_if(r.series.series.begin(), r.series.series.end(),
                        [&](const Series& s) { return s.path == path; });
  };
  ASSERT_NE(series("links/satellite/right-panel:4/position"), r.series.series.end());
  const auto deflection = series("elastic/deflection");
  double before = 0, after = 0;
  for (std::size_t s = 0; s < r.series.time.size(); ++s) {
    const double size = std::abs(deflection->data[s * deflection->components.size()]);
    (r.series.time[s] < 45 ? before : after) = std::max(r.series.time[s] < 45 ? before : after, size);
  }
  EXPECT_GT(before, 1e-6);
  EXPECT_GT(after, 5 * before);
}

// A rigid panel is part of its target: grasp loads are those of the whole.
TEST(FlexibleCapture, LoadsOnAGraspAreThoseOfTheWholeTarget) {
  CaptureProblem p = load("first-plan.yaml");
  p.post_impact->duration = 1;
  p.targets[0].inertia = Symmetric3d::diagonal(3, 3, 3);
  const CaptureResult one = completed(p);
  PanelSetup panel;
  panel.name = "a", panel.mass = 5, panel.com = {0.2, 0, 0}, panel.X_TP.p = {0.1, 0.2, 0};
  panel.inertia = Symmetric3d::diagonal(0.17, 0.17, 0.17);
  p.targets[0].panels.push_back(panel);
  const CaptureResult two = completed(p);
  ASSERT_EQ(one.grasp_loads.size(), two.grasp_loads.size());
  for (std::size_t i = 0; i < one.grasp_loads.size(); ++i) {
    EXPECT_NEAR(one.grasp_loads[i].largest_force, two.grasp_loads[i].largest_force, 1e-9);
    EXPECT_NEAR(one.grasp_loads[i].largest_moment, two.grasp_loads[i].largest_moment, 1e-9);
  }
}

// Excessive stiffness is rejected immediately.
TEST(FlexibleCapture, RejectsExcessivelyFastVibrations) {
  CaptureProblem p = quick("thesis/closed-loop-flexible.yaml");
  for (BodyDescription& body : p.robot.bodies) {
    if (body.beam) body.beam->bending_stiffness_z = 1e15;
  }
  const CaptureResult r = simulate_capture(p);
  EXPECT_EQ(r.status, CaptureStatus::failed);
  EXPECT_NE(r.failure.find("the flexible modes have up to"), std::string::npos) << r.failure;
}

// A plan without correction for the deflection misses by the deflection.
TEST(FlexibleCapture, UncorrectedPlanMisses) {
  SKIP_UNDER_SANITIZERS();
  const CaptureResult planned = completed(quick("thesis/closed-loop.yaml"));
  CaptureProblem p = quick("thesis/closed-loop-flexible.yaml");
  p.contact = ContactSetup{};
  p.approach->plan.reset();
  p.approach->final_position = planned.plan->final_position;
  const CaptureResult r = completed(p);
  const double miss = grasp_error(p, r, 0, last_sample(r, "approach")).distance();
  EXPECT_GT(miss, 1e-6);
  EXPECT_LT(miss, 1e-2);
}

}  // namespace flexible_capture_test
}  // namespace grapnel::testing
