/// Motion without a capture, satellites without driven joints under sampled control, and sequences of phases.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "grapnel/campaign/campaign.hpp"
#include "grapnel/campaign/column.hpp"
#include "grapnel/campaign/study_files.hpp"
#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/result/result_documents.hpp"
#include "grapnel/result/result_table.hpp"
#include "grapnel/result/verdicts.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace motion_test {

// A scenario of the repository.
CaptureProblem scenario(const std::string& name) {
  return load_scenario(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios" / name);
}

// ---- Satellites without driven joints ----

const char* const kBus = "  base: {name: bus, mass: 50, inertia: [4, 5, 3]}\n";
const char* const kWheels = "  wheel_array: {configuration: pyramid, inertia: 0.02, torque: 0.2, rate: 400}\n";
const char* const kGyros =
    "  gyro_array: {configuration: pyramid, inertia: 0.005, spin_rate: 600, gimbal_inertia: 0.01, torque: 1, rate: "
    "1}\n";
const char* const kSprung =
    "  links:\n    - {name: panel, parent: bus, joint: {name: hinge, type: revolute, axis: [1, 0, 0], spring: "
    "{stiffness: 5, damping: 0.1}}, mass: 2, com: [0, 0.8, 0], inertia: [0.3, 0.1, 0.4]}\n";
const char* const kBeam =
    "  links:\n    - {name: boom, parent: bus, joint: {name: root, type: fixed}, mass: 2, com: [0.75, 0, 0], inertia: "
    "[0.01, 0.4, 0.4], beam: {to: [1.5, 0, 0], bending_stiffness_y: 60, bending_stiffness_z: 60, damping_ratio: 0.02, "
    "segments: 2}}\n";

CaptureProblem loaded(const std::string& text, const std::vector<Override>& changes = {}) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "scenario.yaml";
  write_file_atomically(file, text);
  return load_scenario(file, changes);
}

std::string faults(const std::string& text, const std::vector<Override>& changes = {}) {
  try {
    loaded(text, changes);
    return {};
  } catch (const InputError& error) {
    std::string all;
    for (const Fault& fault : error.faults()) all += fault.message + "\n";
    return all;
  }
}

// A rotating satellite with the given parts; `more` holds further keys of the scenario.
std::string satellite(const std::string& parts, const std::string& more) {
  return "schema: grapnel-scenario/1\nname: satellite\nrobot:\n  name: satellite\n" + std::string(kBus) + parts +
         "initial: {base: {angular_velocity: [0.02, -0.03, 0.01]}}\n"
         "output: {interval: 0.5}\n" +
         more;
}
const char* const kTurn = "motion: {duration: 20, base_control: {kp: 2, kd: 8, rpy: [0.1, 0.2, -0.1]}}\n";

struct Parts {
  const char* name;
  std::string parts;
};
const Parts kKinds[] = {{"wheels", kWheels},
                        {"gyros", kGyros},
                        {"sprung panel", kSprung},
                        {"beam", kBeam},
                        {"wheels and beam", std::string(kWheels) + kBeam},
                        {"gyros and panel", std::string(kGyros) + kSprung}};

// The sampled controller has no joint channels: it holds only the torque on the base.
TEST(SatelliteWithoutDrivenJoints, IsSampled) {
  for (const Parts& kind : kKinds) {
    const CaptureResult continuous = simulate_capture(loaded(satellite(kind.parts, kTurn)));
    ASSERT_EQ(continuous.status, CaptureStatus::completed) << kind.name << ": " << continuous.failure;
    double before = 1;
    for (const char* control : {"control: {period: 100 ms}\n", "control: {period: 10 ms}\n"}) {
      if (test::kSanitized && before < 1) continue;  // ten times as many samples
      const CaptureResult sampled = simulate_capture(loaded(satellite(kind.parts, kTurn + std::string(control))));
      ASSERT_EQ(sampled.status, CaptureStatus::completed) << kind.name << ": " << sampled.failure;
      EXPECT_TRUE(sampled.ledger.pass()) << kind.name << ": " << failure_text(*sampled.ledger.worst_failure());
      const BodyMotion &a = sampled.post_impact_end->base, &b = continuous.post_impact_end->base;
      const double apart =
          rotation_angle(rotation_matrix(a.quaternion_wxyz) * transpose(rotation_matrix(b.quaternion_wxyz)));
      EXPECT_GT(apart, 0) << kind.name;
      EXPECT_LT(apart, 0.3 * before) << kind.name << ", " << control;  // of first order in the period
      before = apart;
    }
    if (!test::kSanitized) {
      EXPECT_LT(before, 5e-3) << kind.name;
    }
  }
}

TEST(SatelliteWithoutDrivenJoints, AcceptsAnyControl) {
  SKIP_UNDER_SANITIZERS();
  for (const Parts& kind : kKinds) {
    for (const char* control :
         {"control: {period: 50 ms, delay: 20 ms}\n",
          "control: {period: 50 ms}\nsensors: {gyro: {noise: 1e-5}, attitude: {noise: 1e-5}}\n"}) {
      const CaptureResult r = simulate_capture(loaded(satellite(kind.parts, kTurn + std::string(control))));
      EXPECT_EQ(r.status, CaptureStatus::completed) << kind.name << ", " << control << r.failure;
      EXPECT_TRUE(r.ledger.pass()) << kind.name << ", " << control;
    }
    // An approach without joints, as in scenarios with a subsequent capture.
    const CaptureResult r =
        simulate_capture(loaded(satellite(kind.parts,
                                          "approach: {duration: 10, final_joints: {}, base_control: {kp: 2, kd: 8}}\n"
                                          "control: {period: 100 ms}\n")));
    EXPECT_EQ(r.status, CaptureStatus::completed) << kind.name << ": " << r.failure;
  }
}

// ---- Motion without a capture ----

const char* const kArm =
    "  links:\n"
    "    - {name: upper, parent: bus, joint: {name: shoulder, type: revolute, axis: [0, 0, 1], origin: {position: "
    "[0.5, "
    "0, 0]}, limits: {effort: 30}}, mass: 4, com: [0.4, 0, 0], inertia: [0.02, 0.3, 0.3]}\n"
    "    - {name: lower, parent: upper, joint: {name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [0.8, "
    "0, "
    "0]}, limits: {effort: 30}}, mass: 3, com: [0.3, 0, 0], inertia: [0.02, 0.2, 0.2]}\n";

std::string with_arm(const std::string& more, const std::string& parts = {}) {
  return "schema: grapnel-scenario/1\nname: arm\nrobot:\n  name: arm\n" + std::string(kBus) + parts + kArm +
         "initial: {joints: {shoulder: 0.3, elbow: -0.8}}\noutput: {interval: 0.25}\n" + more;
}

TEST(MotionWithoutCapture, HasApplicableVerdicts) {
  const CaptureResult r =
      simulate_capture(loaded(with_arm("motion: {duration: 5}\n"
                                       "external_wrenches: [{body: bus, torque: [0, 0, 1]}]\n")));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_TRUE(r.without_impact);
  EXPECT_TRUE(r.grasps.empty() && !r.impact() && !r.approach_end);
  EXPECT_EQ(capture_sentence(r), "");
  ASSERT_EQ(r.phases.size(), 1u);
  EXPECT_EQ(r.phases[0].name, "motion");
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::duration);
  EXPECT_EQ(r.series.phases, std::vector<std::string>{"motion"});
  EXPECT_EQ(r.post_impact_end->time, 5);
  const std::string table = result_table(r), summary = summary_json(r, "0");
  EXPECT_NE(table.find("motion, at its end (t = 5 s)"), std::string::npos) << table;
  EXPECT_EQ(table.find("captur"), std::string::npos) << table;
  EXPECT_NE(summary.find("\"motion\": {"), std::string::npos);
  EXPECT_EQ(summary.find("\"post_impact\""), std::string::npos);
  EXPECT_EQ(summary.find("\"capture\""), std::string::npos);
}

// Motion after an approach starts from the final state of the approach.
TEST(MotionWithoutCapture, FollowsAnApproach) {
  const CaptureResult r = simulate_capture(loaded(
      with_arm("approach: {duration: 4, final_joints: [0.8, -0.2]}\n"
               "motion: {duration: 6, joints: pd, kp: 60, kd: 90, move: {joints: [0.3, -0.8], duration: 4}}\n")));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_EQ(r.series.phases, (std::vector<std::string>{"approach", "motion"}));
  EXPECT_NEAR(r.approach_end->joints.position[0], 0.8, 1e-12);
  EXPECT_NEAR(r.post_impact_end->joints.position[0], 0.3, 0.02);
  // No external force acts: the base returns to its attitude with the arm, except for the tracking error.
  EXPECT_LT(std::abs(rotation_angle(rotation_matrix(r.post_impact_end->base.quaternion_wxyz))), 0.02);
}

// An impact with a sphere of negligible mass does not change the motion.
TEST(MotionWithoutCapture, EqualsCaptureWithoutTarget) {
  const std::string law = "joints: pd, kp: 40, kd: 60, base_control: {kp: 5, kd: 30, rpy: [0, 0, 0.2]}}\n";
  const std::string tip = "  end_effectors: [{name: tip, link: lower, position: [0.6, 0, 0]}]\n";
  const std::string dust =
      "targets: [{name: dust, mass: 1e-6, inertia: [1e-9, 1e-9, 1e-9], state: {position: [2, 0, 0]}, grasp_points: "
      "[{name: at}]}]\n"
      "grasps: [{end_effector: tip, target: dust, point: at, model: point}]\n"
      "contact: {gap: translate_target, largest_gap: any}\nimpact: {}\n";
  const CaptureResult plain = simulate_capture(loaded(with_arm("motion: {duration: 8, " + law)));
  const CaptureResult dusty = simulate_capture(loaded(with_arm(dust + "post_impact: {duration: 8, " + law, tip)));
  ASSERT_EQ(plain.status, CaptureStatus::completed) << plain.failure;
  ASSERT_EQ(dusty.status, CaptureStatus::completed) << dusty.failure;
  for (const std::size_t j : {0, 1})
    EXPECT_NEAR(plain.post_impact_end->joints.position[j], dusty.post_impact_end->joints.position[j], 1e-6);
  for (int k = 0; k < 3; ++k)
    EXPECT_NEAR(plain.post_impact_end->base.angular_velocity[k], dusty.post_impact_end->base.angular_velocity[k], 1e-6);
}

// A target without a grasp moves freely, before and during `motion`.
TEST(MotionWithoutCapture, WithTargets) {
  const std::string target =
      "targets: [{name: debris, mass: 20, inertia: [2, 3, 4], state: {at: start, position: [5, 0, 0], velocity: [0, "
      "0.1, 0], angular_velocity: [0, 0, 0.2]}}]\n";
  const CaptureResult r = simulate_capture(
      loaded(with_arm(target + "approach: {duration: 4, final_joints: [0.8, -0.2]}\n"
                               "motion: {duration: 6, joints: braked, until: {relative_rate: 0.5}}\n")));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  EXPECT_EQ(r.phases.at(0).duration(), 0);  // its condition holds from the beginning
  ASSERT_EQ(r.post_impact_end->targets.size(), 1u);
  EXPECT_NEAR(r.post_impact_end->targets[0].position[1], 0.4, 1e-12);
  EXPECT_NE(faults(with_arm(target + "approach: {duration: 4, plan: {}}\n")).find("no grasp refers to target"),
            std::string::npos);
}

// Brakes at the start act before the first sample: the ground's impulse is part of it.
TEST(MotionWithoutCapture, BrakesOnAFixedBaseAtTheStart) {
  const CaptureResult r = simulate_capture(
      loaded(with_arm("motion: {duration: 2, joints: braked}\nexternal_wrenches: [{body: bus, force: [1, 2, 3]}]\n"),
             {{"robot.base.mode", "fixed"}, {"initial.joint_rates", "[0.3, -0.2]"}}));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
}

TEST(MotionWithoutCapture, RejectsSettingsThatNeedCapture) {
  EXPECT_EQ(faults(with_arm("motion: {duration: 5}\n")), "");
  const auto refused = [](const std::string& keys) {
    return faults(with_arm("motion: {duration: 5, " + keys + "}\n"));
  };
  EXPECT_NE(refused("joints: detumble, kp: 1, kd: 1, detumble: {torque: 1}").find("motion.joints is detumble"),
            std::string::npos);
  EXPECT_NE(refused("release: [{after: 1}]").find("motion.release"), std::string::npos);
  EXPECT_NE(refused("model: truth").find("motion.model"), std::string::npos);
  EXPECT_NE(refused("move: {joints: [0, 0], duration: 9}").find("motion.move"), std::string::npos);
  EXPECT_NE(faults(with_arm("motion: {duration: 5}\nimpact: {}\n")).find("'motion' and 'impact'"), std::string::npos);
  EXPECT_NE(faults(with_arm("post_impact: {duration: 5}\n")).find("'post_impact' needs 'impact'"), std::string::npos);
}

// Tables of studies and campaigns contain only columns that apply to the problem.
TEST(MotionWithoutCapture, Columns) {
  const CaptureProblem p = loaded(satellite(kWheels, kTurn));
  const std::vector<Column> columns = standard_columns(p, true);
  const auto index = [&](std::string_view name) {
    return std::find_if(columns.begin(), columns.end(), [&](const Column& c) { return c.name == name; }) -
           columns.begin();
  };
  for (const char* absent : {"captured", "base/velocity_change/x", "rank"})
    EXPECT_EQ(index(absent), std::ssize(columns)) << absent;
  const CaptureResult r = simulate_capture(p, {}, CaptureDetail::columns);
  const auto error = static_cast<std::size_t>(index("end/base/attitude_error"));
  ASSERT_LT(error, columns.size());
  EXPECT_NEAR(columns[error].value({p, {}}, r),
              rotation_angle(rotation_matrix(r.post_impact_end->base.quaternion_wxyz) *
                             transpose(*p.post_impact->base_control->R_WD)),
              1e-12);
  EXPECT_GT(columns[error].value({p, {}}, r), 1e-6);
}

TEST(MotionWithoutCapture, ShippedScenariosRun) {
  const CaptureResult coast = simulate_capture(scenario("coast.yaml"));
  ASSERT_EQ(coast.status, CaptureStatus::completed) << coast.failure;
  EXPECT_TRUE(coast.ledger.pass());
  EXPECT_EQ(coast.ledger.feasibility(), Verdict::yes) << feasibility_sentence(coast);
  const CaptureResult turned = simulate_capture(scenario("attitude-manoeuvre.yaml"));
  ASSERT_EQ(turned.status, CaptureStatus::completed) << turned.failure;
  EXPECT_TRUE(turned.ledger.pass());
  ASSERT_EQ(turned.phases.size(), 3u);
  EXPECT_EQ(turned.phases[0].ended, MotionPhaseReport::End::condition);
  EXPECT_NEAR(norm(turned.phases[0].at_end->base.angular_velocity), 0.2 * M_PI / 180, 1e-9);
  EXPECT_LT(rotation_angle(rotation_matrix(turned.post_impact_end->base.quaternion_wxyz) *
                           transpose(rotation_from_rpy(0, 0, M_PI / 3))),
            1e-3);
}

// ---- Sequences of phases ----

// Two phases with one control law equal one phase with it, to the integrator's tolerance: set points and attitudes
// continue.
TEST(PhaseSequence, OneLawEqualsOnePhase) {
  const std::string law = "joints: pd, kp: 40, kd: 60, base_control: {kp: 5, kd: 30, rpy: [0, 0, 0.2]}";
  const std::string start = "external_wrenches: [{body: lower, torque: [0, 0, 2], time: {shape: constant, end: 2}}]\n";
  const CaptureResult one = simulate_capture(loaded(with_arm(start + "motion: {duration: 8, " + law + "}\n")));
  const CaptureResult two =
      simulate_capture(loaded(with_arm(start + "motion: [{duration: 3, " + law + "}, {duration: 5, " + law + "}]\n")));
  ASSERT_EQ(two.status, CaptureStatus::completed) << two.failure;
  EXPECT_TRUE(two.ledger.pass());
  EXPECT_EQ(two.series.phases, (std::vector<std::string>{"phase_1", "phase_2"}));
  EXPECT_EQ(two.post_impact_end->time, 8);
  for (const std::size_t j : {0, 1})
    EXPECT_NEAR(one.post_impact_end->joints.position[j], two.post_impact_end->joints.position[j], 1e-9);
  // A list of one phase equals the single phase, bit for bit.
  const CaptureResult list = simulate_capture(loaded(with_arm(start + "motion: [{duration: 8, " + law + "}]\n")));
  EXPECT_EQ(list.post_impact_end->joints.position, one.post_impact_end->joints.position);
  EXPECT_EQ(list.series.phases, one.series.phases);
}

// A damper kd decreases the rate of a base of inertia J as exp(-kd t / J), so the time of a given rate is known.
TEST(PhaseSequence, EndsAtCondition) {
  const std::string text =
      "schema: grapnel-scenario/1\nname: braked\nrobot: {name: bus, base: {name: bus, mass: 50, inertia: [4, 4, 4]}}\n"
      "initial: {base: {angular_velocity: [0.1, 0, 0]}}\n"
      "motion:\n  - {name: despin, duration: 100, until: {base_rate: 0.02}, base_control: {kp: 0, kd: 0.8}}\n"
      "  - {name: rest, duration: 5}\n";
  const CaptureResult r = simulate_capture(loaded(text));
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass());
  ASSERT_EQ(r.phases.size(), 2u);
  EXPECT_EQ(r.phases[0].name, "despin");
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::condition);
  EXPECT_NEAR(r.phases[0].end, 5 * std::log(5.0), 1e-10);  // measured 5e-12
  EXPECT_EQ(r.phases[1].begin, r.phases[0].end);
  EXPECT_NEAR(r.post_impact_end->time, 5 * std::log(5.0) + 5, 1e-8);
  EXPECT_NEAR(r.post_impact_end->base.angular_velocity[0], 0.02, 1e-10);  // no torque in the second phase
  // A phase ends immediately if its condition holds at the start, and after its duration if the condition never holds.
  const CaptureResult at_once = simulate_capture(loaded(text, {{"motion.despin.until.base_rate", "0.2"}}));
  EXPECT_EQ(at_once.phases.at(0).duration(), 0);
  EXPECT_EQ(at_once.phases.at(0).ended, MotionPhaseReport::End::condition);
  EXPECT_NEAR(at_once.post_impact_end->base.angular_velocity[0], 0.1, 1e-12);
  const CaptureResult never = simulate_capture(loaded(text, {{"motion.despin.duration", "4"}}));
  EXPECT_EQ(never.phases.at(0).ended, MotionPhaseReport::End::duration);
  EXPECT_EQ(never.phases.at(0).end, 4);
}

// A phase with several conditions ends when all hold: wheel momentum and base rate.
TEST(PhaseSequence, ConditionsHoldTogether) {
  const std::string turn = satellite(kWheels,
                                     "motion: [{name: spin, duration: 60, until: {UNTIL}, base_control: {kp: 0, "
                                     "kd: 2}}, {name: coast, duration: 1}]\n");
  const auto ended = [&](const std::string& until) {
    std::string text = turn;
    text.replace(text.find("UNTIL"), 5, until);
    const CaptureResult r = simulate_capture(loaded(text));
    EXPECT_EQ(r.status, CaptureStatus::completed) << r.failure;
    EXPECT_TRUE(r.ledger.pass());
    EXPECT_EQ(r.phases.at(0).ended, MotionPhaseReport::End::condition) << until;
    return r.phases.at(0).end;
  };
  const double rate = ended("base_rate: 0.02"), momentum = ended("wheel_momentum_above: 0.01");
  EXPECT_GT(rate, 0);
  EXPECT_GT(momentum, 0);
  EXPECT_NEAR(ended("base_rate: 0.02, wheel_momentum_above: 0.01"), std::max(rate, momentum), 1e-7);
}

// After a capture: brake, hold, posture. The results refer to every phase by its name.
TEST(PhaseSequence, FollowsACapture) {
  CaptureProblem p = scenario("wheels-keep-attitude.yaml");
  PostImpactSetup brake = *p.post_impact, hold = brake, posture = brake;
  brake.name = "brake wheels", brake.duration = 100;
  brake.until.emplace();
  brake.until->base_rate = 1e-3;
  hold.name = "hold", hold.duration = 20;
  hold.joints = PostImpactSetup::Joints::braked;
  posture.name = "posture", posture.duration = 60;
  posture.move = PostureMove{p.joint_position, 0, 50};
  p.post_impact.assign({brake, hold, posture});
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  EXPECT_TRUE(r.ledger.pass()) << failure_text(*r.ledger.worst_failure());
  ASSERT_EQ(r.phases.size(), 3u);
  EXPECT_EQ(r.phases[0].ended, MotionPhaseReport::End::condition);
  EXPECT_NEAR(norm(r.phases[0].at_end->base.angular_velocity), 1e-3, 1e-9);
  EXPECT_EQ(r.phases[1].duration(), 20);
  for (const double rate : r.phases[1].at_end->joints.velocity) EXPECT_EQ(rate, 0);
  for (std::size_t j = 0; j < 6; ++j)
    EXPECT_NEAR(r.post_impact_end->joints.position[j], p.joint_position[j], 2e-3) << j;
  for (const MotionPhaseReport& phase : r.phases) {
    EXPECT_EQ(std::count(r.series.phases.begin(), r.series.phases.end(), phase.name), 1) << phase.name;
    EXPECT_TRUE(std::any_of(r.cost.begin(), r.cost.end(), [&](const auto& c) { return c.phase == phase.name; }));
  }
  EXPECT_NE(summary_json(r, "0").find("\"name\": \"brake wheels\""), std::string::npos);
  EXPECT_NE(result_table(r).find("brake wheels"), std::string::npos);
}

// With `event: law_ended` the phase ends when its control law ends.
TEST(PhaseSequence, EndsWithItsLaw) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem p = scenario("dual-arm-detumbling.yaml");
  p.clearance.enabled = false;
  p.approach->tracking.noise.reset();   // whose bandwidth limits the steps
  p.post_impact->detumble->torque = 1;  // at rest ten times as soon
  PostImpactSetup rest = *p.post_impact;
  p.post_impact->until.emplace();
  p.post_impact->until->event = PhaseUntil::Event::law_ended;
  rest.duration = 2, rest.joints = PostImpactSetup::Joints::pd, rest.detumble.reset();
  p.post_impact.push_back(rest);
  const CaptureResult r = simulate_capture(p);
  ASSERT_EQ(r.status, CaptureStatus::completed) << r.failure;
  const LawReport* law = r.law(LawReport::Law::detumbling);
  ASSERT_TRUE(law);
  EXPECT_EQ(law->ended, LawEnd::at_rest);
  EXPECT_EQ(r.phases.at(0).ended, MotionPhaseReport::End::condition);
  EXPECT_EQ(r.phases[0].end, law->end);
  EXPECT_EQ(r.phases.at(1).duration(), 2);
  EXPECT_TRUE(r.ledger.pass());
}

// Campaigns restate the problem of a case as a scenario, with every key of its phases.
TEST(PhaseSequence, IsDrawnByACampaign) {
  const ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "campaign.yaml";
  write_file_atomically(file, "schema: grapnel-campaign/1\nname: c\nscenario: " GRAPNEL_SOURCE_DIR
                              "/scenarios/attitude-manoeuvre.yaml\nset: {output.interval: 50}\ncases: 3\nseed: 1\n"
                              "uncertain:\n  - {path: motion.despin.until.base_rate, uniform: {from: 0.2 deg/s, to: 1 "
                              "deg/s}}\nsuccess: [ledger/pass]\n");
  const Campaign campaign = load_campaign(file);
  double before = -1;
  for (std::uint64_t k = 0; k < 3; ++k) {
    const std::optional<CaseRow> row = run_campaign_case(campaign, k);
    ASSERT_TRUE(row);
    EXPECT_EQ(row->status, CaseStatus::ok) << row->reason;
    const auto at = std::ranges::find(campaign.columns, "phases/despin/duration", &Column::name);
    ASSERT_NE(at, campaign.columns.end());
    const double duration = row->values[static_cast<std::size_t>(at - campaign.columns.begin())];
    EXPECT_GT(duration, 1);
    EXPECT_NE(duration, before);
    before = duration;
  }
}

TEST(PhaseSequence, NamesErrors) {
  const auto of = [](const std::string& phases) { return faults(with_arm("motion: [" + phases + "]\n")); };
  EXPECT_EQ(of("{duration: 1}, {duration: 2, joints: braked}"), "");
  EXPECT_NE(of("{duration: 1}, {duration: 2, joints: pd}").find("missing key 'kp' in motion[1]"), std::string::npos);
  EXPECT_NE(of("{duration: 1}, {duration: 2, move: {joints: [0, 0], duration: 1}}")
                .find("motion[1].move: joints that are free"),
            std::string::npos);
  EXPECT_NE(of("{name: a, duration: 1}, {name: a, duration: 2}").find("motion[1].name is 'a', as that of motion[0]"),
            std::string::npos);
  EXPECT_NE(of("{name: contact, duration: 1}, {duration: 2}").find("motion[0].name is 'contact'"), std::string::npos);
  EXPECT_NE(of("{duration: 1, until: {wheel_momentum_above: 0.5}}, {duration: 2}").find("the robot has no wheels"),
            std::string::npos);
  EXPECT_NE(of("{duration: 1, until: {target_rate: 0.5}}, {duration: 2}").find("there are no targets"),
            std::string::npos);
  EXPECT_NE(of("{duration: 1, until: {event: law_ended}}, {duration: 2}").find("requires joints with a law that ends"),
            std::string::npos);
  EXPECT_NE(of("{duration: 1, until: {}}, {duration: 2}").find("motion[0].until is empty"), std::string::npos);
}

}  // namespace motion_test
}  // namespace grapnel::testing
