/// Cases in lanes against single runs of the same cases: equal results with any monitors.

#include "grapnel/campaign/campaign.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <stop_token>

#include "capture/capture_case.hpp"
#include "grapnel/campaign/quantity.hpp"
#include "grapnel/campaign/run_campaign.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace lane_block_test {

// The thesis capture under PD control with a different target mass in every case. Joint limits and clearance are
// monitored and exceeded.
CaptureProblem watched_problem() {
  CaptureProblem p = thesis_case_pd();
  p.contact.gap = ContactSetup::Gap::translate_target;
  p.post_impact = PostImpactSetup{};
  p.post_impact->duration = 8;
  p.integration.relative_tolerance = p.integration.absolute_tolerance = 1e-10;
  watch_closely(p);
  p.output_interval = 0.02;  // single runs also check at these instants
  return p;
}

// Ledger rows with the violations of monitored limits; the last columns.
constexpr const char* kWatched[] = {"joint_position_violation", "joint_rate_violation", "clearance_violation"};

Campaign campaign_of(const CaptureProblem& base) {
  Campaign campaign;
  campaign.cases = 24;
  campaign.inputs = {{"mass", "kg", ""}};
  campaign.columns = standard_columns(base, true);
  for (const char* row : kWatched) {
    campaign.columns.push_back({row, "", "", [row = std::string(row)](const StudyCase&, const CaptureResult& r) {
                                  for (const LedgerEntry& e : r.ledger.entries) {
                                    if (e.name == row) return e.value;
                                  }
                                  return std::nan("");
                                }});
  }
  campaign.draw = [](std::uint64_t k) { return std::vector<double>{5.0 + static_cast<double>(k)}; };
  campaign.problem = [base](std::uint64_t k) {
    StudyCase point{base, inward_normals(base)};
    point.problem.targets[0].mass = 5.0 + static_cast<double>(k);
    return point;
  };
  return campaign;
}

std::size_t column(const Campaign& campaign, const std::string& name) {
  for (std::size_t i = 0; i < campaign.columns.size(); ++i) {
    if (campaign.columns[i].name == name) return i;
  }
  ADD_FAILURE() << name;
  return 0;
}

// Largest difference of the columns from `first` to before `last`, relative to a column's largest value.
double difference(const Campaign& campaign, const std::vector<CaseRow>& a, const std::vector<CaseRow>& b,
                  std::size_t first, std::size_t last) {
  double largest = 0;
  for (std::size_t i = first; i < last; ++i) {
    const std::string& name = campaign.columns[i].name;
    double scale = 1e-6, change = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
      const double x = a[k].values[i], y = b[k].values[i];
      if (std::isnan(x) && std::isnan(y)) continue;
      scale = std::max(scale, std::abs(x)), change = std::max(change, std::abs(x - y));
      if (std::isnan(x) != std::isnan(y)) ADD_FAILURE() << name << ": " << x << ", " << y;
    }
    if (change / scale > 1e-9) std::printf("%s: %g of %g\n", name.c_str(), change, scale);
    largest = std::max(largest, change / scale);
  }
  return largest;
}

std::vector<CaseRow> one_by_one(const Campaign& campaign) {
  std::vector<CaseRow> rows;
  for (std::uint64_t k = 0; k < campaign.cases; ++k) rows.push_back(*run_campaign_case(campaign, k, {}));
  return rows;
}

TEST(LaneBlock, MonitorsTheSameAsWithoutLanes) {
  Campaign campaign = campaign_of(watched_problem());
  if (test::kSanitized) campaign.cases = 3;
  const std::vector<CaseRow> alone = one_by_one(campaign);
  const std::size_t all = campaign.columns.size(), watched = column(campaign, kWatched[0]);
  const std::size_t clearance = column(campaign, "clearance/minimum");
  for (std::size_t i = watched; i < all; ++i) EXPECT_GT(alone[0].values[i], 1e-3) << campaign.columns[i].name;
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
    ASSERT_EQ(rows.size(), alone.size());
    for (const CaseRow& row : rows) EXPECT_EQ(row.status, CaseStatus::ok) << row.reason;
    // Monitors check states at the ends of steps in lanes, and at output instants in single runs.
    const double of_motion = difference(campaign, rows, alone, 0, clearance),
                 of_watches = difference(campaign, rows, alone, clearance, all);
    std::printf(
        "[ measured ] %s: largest difference from cases alone, of a column's largest value: %.2g, watched %.2g\n",
        std::string(lanes::name(set)).c_str(), of_motion, of_watches);
    EXPECT_LT(of_motion, test::kSanitized ? 1e-5 : 1e-6);  // fewer cases have smaller largest values: 1.7e-6
    EXPECT_LT(of_watches, 1e-3);
  }
}

// A scenario with overrides and a different mass of the first target in every case.
struct Varied {
  std::string name;
  std::vector<Override> overrides;
  std::uint64_t cases = 9;
  double bound = 3e-8;
  std::string at_work = {};  // a column that is not zero; empty: none is checked
};

// All segments are integrated in lanes, with separate conservation checks, and give the results of single cases.
void expect_lanes_as_alone(const Varied& varied) {
  const auto& [name, overrides, cases, bound, at_work] = varied;
  SCOPED_TRACE(name + (overrides.empty() ? "" : ", with " + overrides.back().path));
  const auto is_clock = [](const Override& o) { return o.path == "control"; };
  // A clock's many short steps take minutes under sanitizers, and lane_phase_test has clocks as well.
  if (test::kSanitized && std::any_of(overrides.begin(), overrides.end(), is_clock)) return;
  CaptureProblem base = load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/") + name + ".yaml", overrides);
  base.clearance.enabled = false;
  base.output_interval = 0;
  Campaign campaign;
  campaign.cases = test::kSanitized ? 3 : cases;
  campaign.columns = standard_columns(base, true);
  std::erase_if(campaign.columns, [](const Column& c) { return c.needs_loads; });  // these columns require single runs
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [base](std::uint64_t k) {
    StudyCase point{base, inward_normals(base)};
    point.problem.targets[0].mass *= 1 + 0.02 * static_cast<double>(k);
    return point;
  };
  for (const std::string& line : slow_settings(campaign, 0))
    EXPECT_EQ(line.find("case by case"), std::string::npos) << line;
  const std::vector<CaseRow> alone = one_by_one(campaign);
  if (!at_work.empty()) {
    EXPECT_NE(alone[0].values[column(campaign, at_work)], 0);
  }
  const std::size_t pass = column(campaign, "ledger/pass");
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
    ASSERT_EQ(rows.size(), alone.size());
    for (std::size_t k = 0; k < rows.size(); ++k) {
      ASSERT_EQ(rows[k].status, CaseStatus::ok) << rows[k].reason;
      EXPECT_EQ(rows[k].values[pass], 1);
      EXPECT_EQ(alone[k].values[pass], 1);
    }
    const double off = difference(campaign, rows, alone, 0, campaign.columns.size());
    std::printf("[ measured ] %s, %s: largest difference from cases alone, of a column's largest value: %.2g\n",
                name.c_str(), std::string(lanes::name(set)).c_str(), off);
    EXPECT_LT(off, bound);
  }
}

// Loads, orbital gravity, base attitude control and sampled control from shipped scenarios. All segments are integrated
// in lanes with separate conservation checks and agree with single runs. Held or delayed commands continue through the
// impact.
TEST(LaneBlock, ExternalLoadsActInLanes) {
  // Measured 3.6e-9; commands lost at the impact give 1.7e-7. Spinning wheels amplify rounding errors.
  const std::vector<Varied> scenarios{
      {"orbit-drift", {}},
      {"thesis/open-loop-case-1-stabilized", {}, 5},
      {"thesis/open-loop-case-1-stabilized",
       {{"control", "{period: 0.1, delay: 0.25}"},
        {"approach.base_control", "{kp: 20, kd: 180, limit: 5}"},
        {"contact", "{gap: weld_as_found}"}},
       3},
      {"wheels-keep-attitude", {{"post_impact.duration", "30"}}, 3, 3e-7},
      {"wheels-keep-attitude", {{"post_impact.duration", "10"}, {"control", "{period: 0.1}"}}, 3, 3e-7}};
  for (const Varied& varied : scenarios) expect_lanes_as_alone(varied);
}

// Thrusters in pairs about every axis of a small base. `more`: keys of each, with a comma before them.
std::string twelve_thrusters(const std::string& more = "") {
  std::string all = "[";
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {0.6, -0.6}) {
      for (const int sense : {1, -1}) {
        double p[3] = {}, d[3] = {};
        p[axis] = side, d[(axis + 1) % 3] = sense;
        all += fmt::format(
            "{}{{name: t{}{}{}, position: [{}, {}, {}], direction: [{}, {}, {}], force: 1, specific_impulse: 220, "
            "min_on_time: 20 ms, rise_time: 10 ms, fall_time: 5 ms{}}}",
            all.size() > 1 ? ", " : "", axis, side > 0 ? "a" : "b", sense > 0 ? "+" : "-", p[0], p[1], p[2], d[0], d[1],
            d[2], more);
      }
    }
  }
  return all + "]";
}

// Sensor readings and controller updates at ticks, with motion in lanes: noisy sensors, delays, target identification,
// computed torque with a wrong model, a custom controller, thrusters, wheel speeds, feedforward of the arms. The noise
// equals that of single runs, number by number.
TEST(LaneBlock, ControllerUpdatesAreSeparateForEveryCase) {
  SKIP_UNDER_SANITIZERS();
  const std::string identified =
      "{duration: 12, joints: computed_torque, kp: 0.09, kd: 0.6, base_control: {kp: 0, kd: 4000, limit: 60}, assumed: "
      "{mass: 3000, com: [0, 0, 0], inertia: [9000, 4000, 11000]}, identify: {from: 1, duration: 6, sample_time: 200 "
      "ms, excitation: {amplitude: 0.2, swings: 2}}}";
  const Override clock{"control", "{period: 0.1, delay: 0.03}"};
  const std::vector<Varied> scenarios{
      {"noisy-sensors", {{"control", "{period: 0.1, delay: 0.01}"}, {"post_impact", identified}}, 3, 3e-8},
      {"own-controller", {{"post_impact.duration", "3"}}, 5, 1e-5},  // the impact's forces are zero up to rounding
      {"wheels-keep-attitude",
       {clock,
        {"approach.duration", "30"},
        {"post_impact.duration", "10"},
        {"approach.base_control", "{kp: 1.5, kd: 20, feedforward: true}"},
        {"post_impact.base_control", "{kp: 3, kd: 60, rpy: [0, 0, 0], wheel_speed_rate: 0.05}"}},
       3,
       3e-7},
      // Control laws are evaluated in packs until the impact; afterwards wheels have separate speeds.
      {"wheels-keep-attitude",
       {clock,
        {"initial.wheel_rates", "[500 rpm, 100 rpm, 0 rpm, 0 rpm]"},
        {"approach.duration", "30"},
        {"post_impact.duration", "10"},
        {"post_impact.base_control", "{kp: 3, kd: 60, rpy: [0, 0, 0], wheel_speed_rate: 0.2}"}},
       3,
       3e-7},
      {"wheels-keep-attitude",
       {clock,
        {"robot.thrusters", twelve_thrusters()},
        {"approach.duration", "15"},
        {"post_impact.duration", "5"},
        {"approach.base_control", "{kp: 1.5, kd: 20, actuators: thrusters}"},
        {"post_impact.base_control",
         "{kp: 3, kd: 60, rpy: [0, 0, 0], dumping: {above: 0.1, below: 0.05, torque: 0.2}}"}},
       3,
       3e-8,
       "thrusters/propellant"}};
  for (const Varied& varied : scenarios) expect_lanes_as_alone(varied);
}

// A base held by an ideal wrench until the first grasp, or fixed to the ground. The momentum balances include the
// ground reaction.
TEST(LaneBlock, BasesThatAreHeldOrFixedAreInLanes) {
  for (const char* mode : {"held", "fixed"}) {
    const std::vector<Override> overrides{{"robot.base.mode", mode}, {"contact", "{gap: weld_as_found}"}};
    expect_lanes_as_alone({"thesis/open-loop-case-1-planned", overrides, 9, 3e-8});
    std::vector<Override> driven = overrides;
    driven.insert(driven.begin(), {"approach.tracking", "{mode: computed_torque, kp: 4, kd: 4}"});
    expect_lanes_as_alone({"thesis/open-loop-case-1-planned", driven, 5, 3e-8});
  }
}

// Grasps that close when an envelope is reached, together or one by one. Lanes hand the case back before the step of a
// possible arrival; a single run integrates the remaining segment. Measured 1e-11, except for impulses that are zero up
// to rounding.
TEST(LaneBlock, ArrivalsAreFoundAsAlone) {
  const std::vector<Override> envelopes{{"robot.end_effectors.tip-1.envelope", "{position: 0.2}"},
                                        {"robot.end_effectors.tip-2.envelope", "{position: 0.25}"},
                                        {"contact", "{gap: weld_as_found}"},
                                        {"integration", "{relative_tolerance: 1e-9, absolute_tolerance: 1e-10}"},
                                        {"post_impact.duration", "5"}};
  const auto with = [&](const std::vector<Override>& more) {
    std::vector<Override> all = envelopes;
    all.insert(all.end(), more.begin(), more.end());
    return all;
  };
  const Override together{"approach.capture_at", "envelope"}, first{"grasps[0].closes_on_arrival", "true"},
      second{"grasps[1].closes_on_arrival", "true"};
  const std::string scenario = "thesis/open-loop-case-1";
  expect_lanes_as_alone({scenario, with({together}), 3, 1e-8});
  expect_lanes_as_alone({scenario, with({first, second}), 5, 1e-8});
  expect_lanes_as_alone({scenario, with({{"robot.base.mode", "held"}, first}), 3, 1e-8});
  const Override computed{"approach.tracking", "{mode: computed_torque, kp: 4, kd: 4}"},
      sampled{"control", "{period: 0.1, delay: 0.04}"};
  expect_lanes_as_alone({scenario, with({computed, sampled, second, first}), 3, 1e-8});
}

// Two or three arms on one target: planar loops (with redundant rows) and spatial loops, after one or two impacts, with
// free, driven or braked joints.
TEST(LaneBlock, ClosedLoopsAreInLanes) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<Varied> scenarios{
      {"thesis/closed-loop", {}, 9, 3e-8},
      {"thesis/closed-loop-published-angles", {{"post_impact.duration", "20"}}, 5, 3e-8},
      {"dual-arm-satellite-handles", {{"approach.tracking", "{mode: ideal}"}, {"post_impact.duration", "10"}}, 3, 3e-7},
      {"triple-arm-satellite", {{"approach.tracking", "{mode: ideal}"}, {"post_impact.duration", "10"}}, 3, 3e-7},
      {"thesis/closed-loop", {{"post_impact", "{duration: 5, joints: braked}"}}, 5, 3e-8}};
  for (const Varied& varied : scenarios) expect_lanes_as_alone(varied);
}

// Flexible links: springs, dampers and massless segments, in the approach and after the impact.
TEST(LaneBlock, FlexibleRobotsRunInLanes) {
  SKIP_UNDER_SANITIZERS();
  std::vector<Override> overrides{{"robot", "../robots/planar-dual-arm-flexible.yaml"},
                                  {"post_impact", "{duration: 0.5}"},
                                  {"approach.final_rates", "[0, 0, 0, 0, 0, 0]"},
                                  {"approach.duration", "6"}};
  for (const char* arm : {"arm-1", "arm-2"}) {
    for (int link = 1; link <= 3; ++link)
      overrides.push_back(
          {"robot.links." + std::string(arm) + "-link-" + std::to_string(link) + ".beam.segments", "1"});
  }
  expect_lanes_as_alone({"first-plan", overrides, 3, 3e-8});
}

// Every fifth case has another structure (joint friction), and the eighth fails before the impact (target out of
// reach). With few simultaneous cases, free lanes take over cases that start later. Rows equal those of a
// block with all cases in progress.
TEST(LaneBlock, FillsLanesAgainFromCasesBegunMeanwhile) {
  CaptureProblem base = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1.yaml",
                                      std::vector<Override>{{"post_impact.duration", "2"}});
  base.clearance.enabled = false;
  base.output_interval = 0;
  Campaign campaign;
  campaign.cases = test::kSanitized ? 10 : 24;
  campaign.columns = standard_columns(base, true);
  std::erase_if(campaign.columns, [](const Column& c) { return c.needs_loads; });
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [base](std::uint64_t k) {
    StudyCase point{base, inward_normals(base)};
    point.problem.targets[0].mass *= 1 + 0.02 * static_cast<double>(k);
    if (k % 5 == 0) point.problem.robot.bodies[2].joint.friction.viscous = 0.1;
    if (k == 7) point.problem.targets[0].X_WT.p[0] += 5;
    return point;
  };
  const Block block{0, 0, campaign.cases};
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    SCOPED_TRACE(lanes::name(set));
    const std::vector<CaseRow> all = run_block_in_lanes(campaign, block, set, {}, campaign.cases);
    ASSERT_EQ(all.size(), campaign.cases);
    EXPECT_EQ(all[7].status, CaseStatus::failed);
    // All numbers of cases in progress on one set, one number on the others.
    const bool first = set == lanes::supported_instruction_sets().front();
    for (const std::size_t in_progress : first ? std::vector<std::size_t>{1, 3, 12} : std::vector<std::size_t>{3}) {
      const std::vector<CaseRow> rows = run_block_in_lanes(campaign, block, set, {}, in_progress);
      ASSERT_EQ(rows.size(), all.size());
      for (std::size_t k = 0; k < rows.size(); ++k) {
        EXPECT_EQ(rows[k].index, k);
        EXPECT_EQ(rows[k].status, all[k].status) << rows[k].reason;
        EXPECT_EQ(rows[k].reason, all[k].reason);
        ASSERT_EQ(rows[k].values.size(), all[k].values.size());
        EXPECT_EQ(std::memcmp(rows[k].values.data(), all[k].values.data(), sizeof(double) * all[k].values.size()), 0)
            << k;
      }
    }
  }
}

// A stop request while lanes are being refilled abandons the block.
TEST(LaneBlock, StopsWhileLanesAreFilledAgain) {
  CaptureProblem base = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/open-loop-case-1.yaml",
                                      std::vector<Override>{{"post_impact.duration", "2"}});
  base.clearance.enabled = false;
  base.output_interval = 0;
  std::stop_source stop;
  std::uint64_t begun = 0;
  Campaign campaign;
  campaign.cases = 40;
  campaign.columns = standard_columns(base, true);
  std::erase_if(campaign.columns, [](const Column& c) { return c.needs_loads; });
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [&](std::uint64_t) {
    if (++begun == 9) stop.request_stop();
    return StudyCase{base, inward_normals(base)};
  };
  const auto set = lanes::supported_instruction_sets().back();
  EXPECT_TRUE(run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, stop.get_token(), 6).empty());
  EXPECT_LT(begun, 12u);
}

// Lanes provide the ledger rows of loop closure errors, in agreement with single runs.
TEST(LaneBlock, LoopsAreWatchedInLanes) {
  const std::vector<Override> shorter{{"post_impact.duration", "10"}, {"clearance.enabled", "false"}};
  const CaptureProblem whole = load_scenario(GRAPNEL_SOURCE_DIR "/scenarios/thesis/closed-loop.yaml", shorter);
  Campaign campaign;
  campaign.cases = 6;
  const char* const kRows[] = {"loop_closure_position", "loop_closure_angle", "loop_closure_velocity",
                               "unprojected_defect", "correction_total"};
  for (const std::string name : kRows) {
    campaign.columns.push_back({name, "", "", [name](const StudyCase&, const CaptureResult& r) {
                                  for (const LedgerEntry& e : r.ledger.entries)
                                    if (e.name == name) return e.value / e.bound;
                                  return std::nan("");
                                }});
  }
  campaign.columns.push_back({"rows - rank", "", "", [](const StudyCase&, const CaptureResult& r) {
                                return static_cast<double>(r.loops.back().rows - r.loops.back().rank);
                              }});
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [&](std::uint64_t k) {
    StudyCase point{whole, inward_normals(whole)};
    point.problem.targets[0].mass *= 1 + 0.02 * static_cast<double>(k);
    return point;
  };
  const std::vector<CaseRow> alone = one_by_one(campaign);
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
    for (std::size_t k = 0; k < rows.size(); ++k) {
      ASSERT_EQ(rows[k].status, CaseStatus::ok) << rows[k].reason;
      for (std::size_t c = 0; c < 5; ++c) {
        EXPECT_GT(rows[k].values[c], 0) << kRows[c];
        EXPECT_LT(rows[k].values[c], 0.3) << kRows[c];
      }
      EXPECT_NEAR(rows[k].values[3], alone[k].values[3], 0.5 * alone[k].values[3]);
      EXPECT_NEAR(rows[k].values[4], alone[k].values[4], 0.5 * alone[k].values[4]);
      EXPECT_EQ(rows[k].values[5], alone[k].values[5]);
      EXPECT_EQ(rows[k].values[5], 3);
    }
  }
}

// Some cases reach the maximum wheel rate: these continue in single runs from the previous step, the others in lanes.
TEST(LaneBlock, WheelsNearTheirLargestRatesContinueAlone) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<Override> overrides{{"robot.wheels[0].rate", "640 rpm"}, {"post_impact.duration", "60"}};
  CaptureProblem base =
      load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml"), overrides);
  base.clearance.enabled = false;
  base.output_interval = 0;
  Campaign campaign;
  campaign.cases = 8;
  campaign.columns = standard_columns(base, true);
  campaign.columns.push_back({"wheel rate", "rad/s", "",
                              [](const StudyCase&, const CaptureResult& r) { return r.wheels.at(0).largest_rate; }});
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [base](std::uint64_t k) {
    StudyCase point{base, inward_normals(base)};
    TargetSetup& target = point.problem.targets[0];
    target.V_WT.angular = (0.15 * static_cast<double>(k)) * target.V_WT.angular;
    return point;
  };
  const std::vector<CaseRow> alone = one_by_one(campaign);
  const std::size_t rate = campaign.columns.size() - 1;
  const double most = base.robot.wheels[0].rate;
  EXPECT_LT(alone.front().values[rate], 0.95 * most);
  EXPECT_NEAR(alone.back().values[rate], most, 1e-9 * most);
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
    ASSERT_EQ(rows.size(), alone.size());
    for (const CaseRow& row : rows) ASSERT_EQ(row.status, CaseStatus::ok) << row.reason;
    EXPECT_LT(difference(campaign, rows, alone, 0, rate), 3e-7);
    EXPECT_LT(difference(campaign, rows, alone, rate, rate + 1), 1e-2);  // sampled at the ends of different steps
  }
}

// A case that leaves its lane after sensor readings restarts as a single run. Its readings do not count twice, and its
// results equal a single run bit for bit.
TEST(LaneBlock, CasesAfterSensorReadingsRestart) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<Override> overrides{{"robot.wheels[0].rate", "640 rpm"},
                                        {"post_impact.duration", "60"},
                                        {"control", "{period: 0.1}"},
                                        {"sensors", "{seed: 3, gyro: {angle_random_walk: 1e-4}}"}};
  CaptureProblem base =
      load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml"), overrides);
  base.clearance.enabled = false;
  base.output_interval = 0;
  Campaign campaign;
  campaign.cases = 4;
  campaign.columns = standard_columns(base, true);
  campaign.columns.push_back({"gyro readings", "", "", [](const StudyCase&, const CaptureResult& r) {
                                return static_cast<double>(r.sensors.at(0).readings);
                              }});
  campaign.columns.push_back({"wheel rate", "rad/s", "",
                              [](const StudyCase&, const CaptureResult& r) { return r.wheels.at(0).largest_rate; }});
  campaign.draw = [](std::uint64_t) { return std::vector<double>(); };
  campaign.problem = [base](std::uint64_t k) {
    StudyCase point{base, inward_normals(base)};
    TargetSetup& target = point.problem.targets[0];
    target.V_WT.angular = (0.5 * static_cast<double>(k)) * target.V_WT.angular;
    return point;
  };
  const std::vector<CaseRow> alone = one_by_one(campaign);
  const std::size_t rate = campaign.columns.size() - 1;
  const double most = base.robot.wheels[0].rate;
  ASSERT_LT(alone.front().values[rate], 0.95 * most);
  ASSERT_NEAR(alone.back().values[rate], most, 1e-9 * most);
  const lanes::InstructionSet set = lanes::supported_instruction_sets().back();
  const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
  ASSERT_EQ(rows.size(), alone.size());
  for (const CaseRow& row : rows) ASSERT_EQ(row.status, CaseStatus::ok) << row.reason;
  EXPECT_EQ(difference(campaign, {rows.back()}, {alone.back()}, 0, campaign.columns.size()), 0);
  const double off = difference(campaign, rows, alone, 0, rate);
  EXPECT_GT(off, 0) << "others are in lanes";
  EXPECT_LT(off, 3e-7);
}

// Conservation checks in lanes are separate for each group of touching bodies: a heavy bystander hides no error.
TEST(LaneBlock, AHeavyBystanderHidesNothing) {
  const auto rows_with = [](double mass, lanes::InstructionSet set) {
    CaptureProblem p = watched_problem();
    p.contact.gap = ContactSetup::Gap::weld_as_found;
    p.robot.end_effectors[1].envelope = CaptureEnvelope{};
    p.robot.end_effectors[1].envelope->position = 0.01;
    p.approach->match.reset();
    TargetSetup& bystander = p.targets[1];  // out of reach of its arm
    bystander.mass = mass;
    bystander.inertia = Symmetric3d::diagonal(mass, mass, mass);
    bystander.X_WT.p = {300, 400, 0};
    bystander.V_WT = {{0, 0, 0.1}, {1, -2, 0}};
    Campaign campaign = campaign_of(p);
    campaign.cases = 8;
    campaign.columns.clear();
    for (const std::string name : {"work_energy_residual", "linear_momentum_drift", "energy_identity_residual"}) {
      campaign.columns.push_back({name, "", "", [name](const StudyCase&, const CaptureResult& r) {
                                    for (const LedgerEntry& e : r.ledger.entries)
                                      if (e.name == name) return e.value;
                                    return std::nan("");
                                  }});
    }
    return run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
  };
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> light = rows_with(1, set), heavy = rows_with(1e9, set);
    ASSERT_EQ(heavy.size(), light.size());
    for (std::size_t k = 0; k < light.size(); ++k) {
      ASSERT_EQ(heavy[k].status, CaseStatus::ok) << heavy[k].reason;
      const double energy = light[k].values[0];
      EXPECT_GT(energy, 1e-13) << "nothing to hide";
      EXPECT_GT(heavy[k].values[0], 0.5 * energy);  // relative to the scene's energy it would be 1e-10 times this
      EXPECT_LT(heavy[k].values[1], 1e-11);
      EXPECT_LT(heavy[k].values[2], 1e-10);
    }
  }
}

// Cases with load columns are integrated in single runs: their results equal single runs bit for bit.
TEST(LaneBlock, LoadsAreThoseOfCasesAlone) {
  Campaign campaign = campaign_of(watched_problem());
  for (const Column& column : offered_columns(watched_problem(), true)) {
    if (column.needs_loads) campaign.columns.push_back(column);
  }
  campaign.cases = 3;
  const std::vector<CaseRow> alone = one_by_one(campaign);
  const std::size_t first = column(campaign, "loads/arm-1-joint-1/force");
  for (lanes::InstructionSet set : lanes::supported_instruction_sets()) {
    const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
    ASSERT_EQ(rows.size(), alone.size());
    EXPECT_EQ(difference(campaign, rows, alone, 0, campaign.columns.size()), 0);
    for (const CaseRow& row : rows) EXPECT_GT(row.values[first], 1e-3) << row.reason;
  }
}

// A stop while some cases are complete and others are in progress.
TEST(LaneBlock, StoppedBlockIsAbandonedCompletely) {
  Campaign campaign = campaign_of(watched_problem());
  std::stop_source stop;
  campaign.columns.push_back({"stop", "", "", [&](const StudyCase&, const CaptureResult&) {
                                stop.request_stop();
                                return 0.0;
                              }});
  const lanes::InstructionSet set = lanes::supported_instruction_sets().back();
  EXPECT_TRUE(run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, stop.get_token()).empty());
}

TEST(LaneBlock, AWatchThatThrowsFailsItsCaseAlone) {
  Campaign campaign = campaign_of(watched_problem());
  campaign.time_limit = 1e-9;  // checked at each monitor evaluation
  const lanes::InstructionSet set = lanes::supported_instruction_sets().back();
  const std::vector<CaseRow> rows = run_block_in_lanes(campaign, {0, 0, campaign.cases}, set, {});
  ASSERT_EQ(rows.size(), campaign.cases);
  for (const CaseRow& row : rows) {
    EXPECT_EQ(row.status, CaseStatus::failed);
    EXPECT_EQ(row.reason, "took longer than the time limit of 1e-09 s");
    EXPECT_EQ(row.values.size(), campaign.columns.size());
  }
}

// One case suffices to list the monitors, and the segments without lane support with their reasons.
TEST(SlowSettings, NameTheCausesOfLongRunTimes) {
  SKIP_UNDER_SANITIZERS();
  CaptureProblem base = watched_problem();
  const auto text = [&](CampaignPlan plan) {
    Campaign campaign = campaign_of(base);
    campaign.plan = plan;
    std::string all;
    for (const std::string& line : slow_settings(campaign, 0)) all += line + "\n";
    return all;
  };
  const std::string watched = text(CampaignPlan::per_case);
  EXPECT_NE(watched.find("every case is planned separately (plan: nominal plans once)\n"), std::string::npos)
      << watched;
  EXPECT_NE(watched.find("no criterion uses them (clearance: {enabled: false} in 'set')\n"), std::string::npos)
      << watched;
  EXPECT_EQ(watched.find("case by case"), std::string::npos) << "all of it is in lanes\n" << watched;
  base.clearance.enabled = false;
  base.integration.method = IntegrationSetup::Method::rk4;
  const std::string fixed_steps = text(CampaignPlan::nominal);
  EXPECT_NE(fixed_steps.find("approach is integrated case by case instead of in SIMD lanes: the method is "
                             "neither automatic nor adaptive_8 (integration.method)\n"),
            std::string::npos)
      << fixed_steps;
  EXPECT_EQ(fixed_steps.find("distances"), std::string::npos) << fixed_steps;
}

// A column that needs the loads of every step prevents integration in lanes.
TEST(SlowSettings, NameColumnsOfLoads) {
  CaptureProblem base = watched_problem();
  base.clearance.enabled = false;
  Campaign campaign = campaign_of(base);
  ASSERT_FALSE(campaign.columns.empty());
  const auto reports = [&] {
    std::string all;
    for (const std::string& line : slow_settings(campaign, 0)) all += line + "\n";
    return all.find("case by case instead of in SIMD lanes: loads are monitored (the columns margins/") !=
           std::string::npos;
  };
  for (Column& column : campaign.columns) column.needs_loads = false;
  EXPECT_FALSE(reports());
  campaign.columns.back().needs_loads = true;
  EXPECT_TRUE(reports());
}

// Plume impingement is checked within steps, which lanes do not support.
TEST(SlowSettings, NamePlumes) {
  SKIP_UNDER_SANITIZERS();
  const auto text = [](const std::string& more) {
    const std::vector<Override> overrides{{"control", "{period: 0.5}"},
                                          {"robot.thrusters", twelve_thrusters(more)},
                                          {"approach.duration", "15"},
                                          {"post_impact", "{duration: 1}"},
                                          {"approach.base_control", "{kp: 1.5, kd: 20, actuators: thrusters}"}};
    CaptureProblem base =
        load_scenario(std::string(GRAPNEL_SOURCE_DIR "/scenarios/wheels-keep-attitude.yaml"), overrides);
    base.clearance.enabled = false;
    Campaign campaign;
    campaign.problem = [&base](std::uint64_t) { return StudyCase{base, inward_normals(base)}; };
    std::string all;
    for (const std::string& line : slow_settings(campaign, 0)) all += line + "\n";
    return all;
  };
  EXPECT_EQ(text("").find("case by case"), std::string::npos) << text("");
  EXPECT_NE(text(", plume: {half_angle: 20 deg, range: 5}")
                .find("approach is integrated case by case instead of in SIMD lanes: plumes, or gyros, are watched in "
                      "every step (plume of the robot's thrusters, or its gyros)"),
            std::string::npos);
}

}  // namespace lane_block_test
}  // namespace grapnel::testing
