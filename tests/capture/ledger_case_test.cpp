/// Conservation checks of whole runs: vanishing or small quantities, large exchanges, and wrong motion.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "capture/capture_case.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::testing {
namespace ledger_case_test {

CaptureProblem problem_of(const std::string& text) {
  const test::TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", "schema: grapnel-scenario/1\nname: case\n" + text));
}

CaptureResult run(const std::string& text) { return simulate_capture(problem_of(text), {}, CaptureDetail::columns); }

// A servicer with a panel, or with an arm of two links, as the value of `robot:`.
const std::string kPanel =
    "{base: {mass: 400, com: [0.02, -0.03, 0.01], inertia: [80, 110, 95, 4, -1, 3]}, links: [{name: p, parent: base, "
    "joint: {name: h, type: revolute, axis: [0, 0, 1], origin: {position: [0.7, 0, 0]}}, mass: 12, com: [0.6, 0.02, "
    "0.1], inertia: [0.1, 1, 1]}], end_effectors: [{name: e, link: p, position: [1.2, 0, 0]}]}";
std::string arm(const std::string& mode, const std::string& limits = "") {
  return "{base: {mode: " + mode +
         ", mass: 400, com: [0.02, -0.03, 0.01], inertia: [80, 110, 95, 4, -1, 3]}, links: ["
         "{name: a, parent: base, joint: {name: ja, type: revolute, axis: [0, 0, 1], origin: {position: [0.7, 0, 0]}" +
         limits +
         "}, mass: 12, com: [0.6, 0.02, 0.1], inertia: [0.1, 1, 1]}, "
         "{name: b, parent: a, joint: {name: jb, type: revolute, axis: [0, 1, 0], origin: {position: [1, 0, 0]}}, "
         "mass: 10, com: [0.6, 0.02, 0.1], inertia: [0.1, 1, 1]}], "
         "end_effectors: [{name: e, link: b, position: [1, 0, 0]}]}";
}
std::string hold(const std::string& tracking, const std::string& duration = "60") {
  return "initial: {joints: {ja: 0.3, jb: -0.4}}\napproach: {duration: " + duration +
         ", final_joints: {ja: 0.3, jb: -0.4}, tracking: {mode: " + tracking + "}}\n";
}
std::string jitter(const std::string& force, const std::string& rest) {
  return "robot: " + kPanel + "\nexternal_wrenches: [{body: base, position: [0.2, 0.1, 0], force: [" + force + ", 0, " +
         force + "], torque: [0, " + force + ", 0], time: {shape: sine, frequency: 50}}]\n" + rest;
}
const std::string kHeldPanel = "initial: {joints: {h: 0.3}}\napproach: {duration: 4, final_joints: {h: 0.3}}\n";
// Motion after an impact with a target beside the panel; `speed` of the target relative to the robot [m/s].
std::string loose_panel(const std::string& speed) {
  return "initial: {joints: {h: 0.3}}\ntargets: [{name: t, mass: 20, inertia: [2, 2, 2], state: {position: [1.85, "
         "0.35, 0], velocity: [0, " +
         speed +
         ", 0]}, grasp_points: [{name: g}]}]\ngrasps: [{end_effector: e, target: t, point: g}]\n"
         "contact: {largest_gap: any}\nimpact: {}\npost_impact: {duration: 5}\nclearance: {enabled: false}\n";
}
std::string orbit(const std::string& body, const std::string& place, const std::string& duration) {
  return "robot: " + kPanel + "\norbit: {body: " + body + ", altitude: 500 km}\ninitial: {base: {position: " + place +
         "}, joints: {h: 0.3}}\napproach: {duration: " + duration + ", final_joints: {h: 1.2}}\n";
}

struct Case {
  const char* name;
  std::string text;
};
void PrintTo(const Case& value, std::ostream* out) { *out << value.name; }

class RightMotion : public ::testing::TestWithParam<Case> {};

TEST_P(RightMotion, Passes) {
  const CaptureResult r = run(GetParam().text);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  for (const LedgerEntry& e : r.ledger.entries) {
    EXPECT_TRUE(std::isfinite(e.value)) << e.name;
    if (e.kind == LedgerEntry::Kind::conservation) {
      EXPECT_TRUE(e.pass()) << failure_text(e) << "; " << e.note;
    }
  }
  const LedgerEntry* worst = nullptr;
  for (const LedgerEntry& e : r.ledger.entries) {
    if (e.kind == LedgerEntry::Kind::conservation && e.applies && e.unit == "1" &&
        (!worst || e.value / e.bound > worst->value / worst->bound))
      worst = &e;
  }
  ASSERT_NE(worst, nullptr);
  std::printf("[ measured ] %s: %.2g of the bound, %s\n", GetParam().name, worst->value / worst->bound,
              worst->name.c_str());
}

const std::string kBall = "{base: {mass: 100, inertia: [20, 20, 20]}}", kNoJoints = "initial: {joints: {}}\n";

INSTANTIATE_TEST_SUITE_P(
    Ledger, RightMotion,
    ::testing::Values(
        Case{"rest", "robot: " + kBall + "\n" + kNoJoints + "approach: {duration: 6000, final_joints: {}}\n"},
        Case{"rest_in_orbit", "robot: " + kBall + "\norbit: {altitude: 500 km}\n" + kNoJoints +
                                  "approach: {duration: 6000, final_joints: {}}\n"},
        Case{"pure_rotation", "robot: " + kPanel +
                                  "\ninitial: {base: {momentum: {angular: [1, 2, -3]}}, joints: {h: 0.3}}\n"
                                  "approach: {duration: 60, final_joints: {h: 0.3}}\n"},
        Case{"slow_rotation", "robot: " + kPanel +
                                  "\ninitial: {base: {angular_velocity: [0, 0, 1.0e-8]}, joints: {h: 0.3}}\napproach: "
                                  "{duration: 600, final_joints: {h: 0.3}, tracking: {mode: pd, kp: 100, kd: 50}}\n"},
        Case{"push_through_the_center_of_mass", "robot: " + kBall +
                                                    "\nexternal_wrenches: [{body: base, force: [1, 0.3, 0.2]}]\n" +
                                                    kNoJoints + "approach: {duration: 1000, final_joints: {}}\n"},
        Case{"push_with_an_offset", "robot: " + kPanel +
                                        "\nexternal_wrenches: [{body: base, position: [0, 0.3, 0.1], frame: body, "
                                        "force: [1, 0.3, 0.2]}]\ninitial: {joints: {h: 0.3}}\napproach: {duration: "
                                        "1000, final_joints: {h: 1.2}}\n"},
        Case{"small_scales",
             "robot: {base: {mass: 1.0e-6, inertia: [2.0e-12, 2.0e-12, 2.0e-12]}}\n"
             "external_wrenches: [{body: base, force: [1.0e-8, 0, 2.0e-9]}]\n" +
                 kNoJoints + "approach: {duration: 100, final_joints: {}}\n"},
        Case{"ground_held_by_pd",
             "robot: " + arm("fixed") + "\ngravity: [0, 0, -9.81]\n" + hold("pd, kp: 1000, kd: 50")},
        Case{"ground_at_rest", "robot: " + arm("fixed") + "\ngravity: [0, 0, -9.81]\n" + hold("ideal")},
        Case{"held_base_under_gravity",
             "robot: " + arm("held") + "\ngravity: [0, 0, -9.81]\n" + hold("pd, kp: 1000, kd: 50")},
        Case{"arm_at_rest_in_orbit",
             "robot: " + arm("free") + "\norbit: {altitude: 500 km}\n" + hold("pd, kp: 100, kd: 50", "600")},
        Case{"braked_arm_beside_a_moving_ball",
             "robot: " + arm("fixed") +
                 "\ninitial: {joints: {ja: 0, jb: 0}}\ntargets: [{name: t, mass: 20, inertia: [2, 2, 2], state: "
                 "{position: [3.2, 0, 0], velocity: [-0.5, 0, 0]}, grasp_points: [{name: g, position: [-0.5, 0, 0], "
                 "normal: [-1, 0, 0]}]}]\ngrasps: [{end_effector: e, target: t, point: g, model: contact}]\n"
                 "contact: {largest_gap: any}\nimpact: {law: restitution, restitution: 0.5, joints: braked}\n"
                 "post_impact: {duration: 4, joints: braked}\nexternal_wrenches: [{body: a, position: [0.1, 0.2, "
                 "0.3], frame: body, force: [-1.42, -1.81, 2.39], torque: [0.1, 0.2, 0.3]}]\n"
                 "clearance: {enabled: false}\n"},
        Case{"rest_with_keep_base_attitude",
             "robot: " + arm("free") +
                 "\ninitial: {joints: {ja: 0.3, jb: -0.4}}\ntargets: [{name: t, mass: 20, inertia: [2, 2, 2], state: "
                 "{position: [2.5, 0.6, 0.4]}, grasp_points: [{name: g}]}]\ngrasps: [{end_effector: e, target: t, "
                 "point: g}]\ncontact: {largest_gap: any}\nimpact: {}\npost_impact: {duration: 60, joints: "
                 "keep_base_attitude, kp: 1, kd: 1}\nclearance: {enabled: false}\n"},
        Case{"orbit_behind_the_reference", orbit("earth", "[-200, 0, 0]", "5677")},
        Case{"orbit_of_the_moon", orbit("moon", "[-200, 3, 10]", "3000")}, Case{"jitter", jitter("10", kHeldPanel)},
        Case{"small_jitter", jitter("1.0e-4", kHeldPanel)},
        Case{"jitter_of_loose_joints", jitter("10", loose_panel("0"))},
        Case{"small_jitter_of_loose_joints", jitter("1.0e-3", loose_panel("0"))},
        Case{"tiny_target",
             "robot: {base: {mass: 4.0e5, inertia: [8.0e6, 8.0e6, 8.0e6]}, end_effectors: [{name: e, link: base, "
             "position: [8, 0, 0]}]}\ninitial: {base: {angular_velocity: [0.001, 0.02, 0.03]}, joints: {}}\ntargets: "
             "[{name: t, mass: 0.001, inertia: [1.0e-8, 2.0e-8, 2.5e-8], state: {position: [8.01, 0, 0], velocity: "
             "[0, 0.3, 0], angular_velocity: [3, 1, 2]}, grasp_points: [{name: g, position: [-0.01, 0, 0], normal: "
             "[-1, 0, 0]}]}]\ngrasps: [{end_effector: e, target: t, point: g, model: contact}]\ncontact: {largest_gap: "
             "any}\nimpact: {law: restitution, "
             "restitution: 0.5}\npost_impact: {duration: 50}\nclearance: {enabled: false}\n"}),
    [](const auto& test) { return std::string(test.param.name); });

// --- Wrong motion ---

struct Wrong {
  const char* name;
  std::string text;
  const char* row;
};
void PrintTo(const Wrong& value, std::ostream* out) { *out << value.name; }

class WrongMotion : public ::testing::TestWithParam<Wrong> {};

// The same motions with rk4 steps that are too long. `row` exceeds its bound by at least a factor of three.
TEST_P(WrongMotion, Fails) {
  const CaptureResult r = run(GetParam().text);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LedgerEntry& e = row(r, GetParam().row);
  std::printf("[ measured ] %s: %s\n", GetParam().name, failure_text(e).c_str());
  EXPECT_GT(e.value, 3 * e.bound);
  EXPECT_FALSE(r.ledger.pass());
}

std::string rk4(const std::string& text, const std::string& step) {
  return text + "integration: {method: rk4, step: " + step + "}\n";
}

INSTANTIATE_TEST_SUITE_P(
    Ledger, WrongMotion,
    ::testing::Values(Wrong{"jitter", rk4(jitter("10", kHeldPanel), "1.0e-3"), "work_energy_residual"},
                      Wrong{"jitter_of_loose_joints", rk4(jitter("10", loose_panel("0")), "1.0e-3"), "energy_drift"},
                      Wrong{"orbit", rk4(orbit("earth", "[-200, 0, 0]", "5677"), "60"), "angular_momentum_drift"},
                      Wrong{"push",
                            rk4("robot: " + kPanel +
                                    "\nexternal_wrenches: [{body: base, position: [0, 0.3, 0.1], frame: body, "
                                    "force: [1, 0.3, 0.2]}]\ninitial: {joints: {h: 0.3}}\napproach: "
                                    "{duration: 1000, final_joints: {h: 1.2}}\n",
                                "0.5"),
                            "angular_momentum_drift"},
                      Wrong{"loose_joints", rk4("robot: " + kPanel + "\n" + loose_panel("0.5"), "0.2"),
                            "energy_drift"}),
    [](const auto& test) { return std::string(test.param.name); });

}  // namespace ledger_case_test
}  // namespace grapnel::testing
