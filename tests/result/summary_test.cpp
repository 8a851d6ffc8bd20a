#include "grapnel/result/result_documents.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "result/sample_result.hpp"

namespace grapnel {
namespace summary_test {

using nlohmann::json;
using testing::HasSubstr;

std::vector<double> numbers(const Vector3d& v) { return {v[0], v[1], v[2]}; }

void expect_keys(const json& object, const std::vector<std::string>& keys, const std::string& where) {
  ASSERT_TRUE(object.is_object()) << where;
  for (const std::string& key : keys) EXPECT_TRUE(object.contains(key)) << where << "." << key;
}
// Keys of parts that do not apply are absent.
void expect_only_keys(const json& object, const std::vector<std::string>& keys, const std::string& where) {
  expect_keys(object, keys, where);
  EXPECT_EQ(object.size(), keys.size()) << where;
}

json parsed(const CaptureResult& result) { return json::parse(summary_json(result, "1.2.3")); }

const std::vector<std::string> kBody{"name", "position", "quaternion_wxyz", "angular_velocity", "velocity"};

TEST(Summary, HasEveryKeyOfTheContract) {
  const json summary = parsed(test::sample_result_with_laws());
  expect_keys(summary, {"schema",   "version",   "scenario",    "status",        "failure",     "warnings", "verdicts",
                        "approach", "impact",    "post_impact", "later_impacts", "slips",       "losses",   "releases",
                        "capture",  "clearance", "limits",      "ledger",        "feasibility", "cost"},
              "");
  expect_keys(summary["scenario"], {"name", "sha256"}, "scenario");
  ASSERT_EQ(summary["verdicts"].size(), 4u);
  expect_keys(summary["verdicts"][0], {"question", "tone", "word", "sentence", "remarks"}, "verdicts[]");
  expect_keys(summary["verdicts"][0]["remarks"][1], {"tone", "of", "text"}, "verdicts[].remarks[]");
  expect_keys(summary["approach"], {"start", "end", "planned_final_rates", "plan"}, "approach");
  expect_keys(summary["post_impact"], {"end", "phases", "loops", "grasp_loads"}, "post_impact");
  for (const json& end : {summary["approach"]["start"], summary["approach"]["end"], summary["post_impact"]["end"]}) {
    expect_keys(end, {"time", "base", "joints", "end_effectors", "targets"}, "end");
    expect_keys(end["base"], kBody, "end.base");
    expect_keys(end["joints"], {"names", "position", "velocity"}, "end.joints");
    expect_keys(end["targets"][0], kBody, "end.targets[]");
    expect_keys(end["end_effectors"][0],
                {"name", "position", "velocity", "angular_velocity", "target", "grasp_point", "miss_distance",
                 "relative_velocity", "relative_angular_velocity"},
                "end.end_effectors[]");
    expect_only_keys(end["end_effectors"][2], {"name", "position", "velocity", "angular_velocity"},
                     "free end-effector");
  }
  const json& impact = summary["impact"];
  expect_keys(impact,
              {"law",
               "time",
               "duration",
               "grasps",
               "rank",
               "rows",
               "null_space",
               "loops",
               "body_impulses",
               "kinetic_energy_before",
               "kinetic_energy_after",
               "base_velocity_change",
               "base_angular_velocity_change",
               "joint_names",
               "joint_velocity_change",
               "joints",
               "base_reaction",
               "targets_before",
               "targets_after",
               "as_published",
               "show_as_published",
               "brake",
               "joints_during",
               "held_joints",
               "unique",
               "energy_created",
               "hypothesis",
               "inconsistent",
               "compliant",
               "measures",
               "sensitivities",
               "margins",
               "speed_limits"},
              "impact");
  expect_keys(impact["grasps"][0],
              {"end_effector", "target", "grasp_point", "model", "contact_point", "gap", "gap_angle",
               "target_displacement", "impulse", "angular_impulse", "impulse_magnitude", "mean_force", "determined",
               "relative_velocity_before", "relative_angular_velocity_before", "relative_velocity_after",
               "relative_angular_velocity_after", "rebound", "profile"},
              "impact.grasps[]");
  expect_keys(
      impact["joints"][0],
      {"joint", "body", "impulse", "angular_impulse", "along_axis", "peak_force", "peak_moment", "peak_driving"},
      "impact.joints[]");
  expect_keys(impact["base_reaction"], {"impulse", "angular_impulse"}, "impact.base_reaction");
  expect_keys(impact["targets_before"][0], kBody, "impact.targets_before[]");
  expect_keys(impact["brake"],
              {"joints", "impulse", "kinetic_energy_before", "kinetic_energy_after", "grasps", "base_velocity_change",
               "base_angular_velocity_change"},
              "impact.brake");
  expect_keys(impact["brake"]["grasps"][0],
              {"end_effector", "target", "impulse", "angular_impulse", "impulse_magnitude"}, "impact.brake.grasps[]");
}

TEST(Summary, HasPartsOfLawsMeasuresAndRatings) {
  const json impact = parsed(test::sample_result_with_laws())["impact"];
  expect_keys(impact["grasps"][0]["rebound"],
              {"normal", "normal_impulse", "tangential_impulse", "compression", "normal_work", "friction_work", "modes",
               "spread"},
              "impact.grasps[].rebound");
  expect_keys(impact["grasps"][0]["profile"],
              {"peak_force", "peak_force_time", "peak_moment", "peak_moment_time", "largest_deformation", "duration",
               "energy_lost", "touches"},
              "impact.grasps[].profile");
  expect_keys(impact["held_joints"][0], {"joint", "impulse", "work", "commanded_rate", "rate_after", "was_overpowered"},
              "impact.held_joints[]");
  expect_keys(impact["compliant"],
              {"end", "duration", "energy_lost", "elastic_energy_after", "residual_impulse", "energy_residual",
               "motor_work", "rhs_evaluations", "modes", "slower_modes", "slowest_period", "fastest_period"},
              "impact.compliant");
  expect_keys(impact["measures"],
              {"end_effectors", "largest_impulse", "smallest_impulse", "coupled_index", "miss_of_robot_com",
               "miss_of_system_com", "base_response", "zero_disturbance", "zero_base_angular_velocity"},
              "impact.measures");
  expect_keys(impact["measures"]["end_effectors"][0],
              {"end_effector", "inverse_inertia", "pair_inverse_inertia", "linear_axes", "linear_mass", "angular_axes",
               "angular_inertia", "impulse_index", "robot_effective_mass", "pair_effective_mass", "miss_of_robot_com",
               "miss_of_system_com"},
              "impact.measures.end_effectors[]");
  EXPECT_EQ(impact["measures"]["end_effectors"][0]["inverse_inertia"][1][2], 9);  // row by row
  EXPECT_TRUE(impact["measures"]["miss_of_robot_com"].is_null());                 // infinite
  expect_keys(impact["sensitivities"][0],
              {"parameter", "unit", "end_effector", "target", "impulse", "angular_impulse", "impulse_magnitude",
               "base_velocity_change", "base_angular_velocity_change"},
              "impact.sensitivities[]");
  expect_only_keys(impact["sensitivities"][1], {"parameter", "unit", "end_effector", "target", "undefined"},
                   "impact.sensitivities[], undefined");
  expect_keys(impact["margins"][0], {"of", "quantity", "load", "rating", "margin", "assumed_duration"},
              "impact.margins[]");
  EXPECT_EQ(impact["margins"][0]["margin"], 0.75);
  expect_keys(impact["speed_limits"][0], {"end_effector", "factor", "largest_speed", "of", "quantity"},
              "impact.speed_limits[]");
}

TEST(Summary, HasLoopsLaterImpactsAndReleases) {
  const json summary = parsed(test::sample_result());
  const json& impact = summary["impact"];
  ASSERT_EQ(impact["null_space"].size(), 1u);
  expect_keys(impact["null_space"][0], {"grasps"}, "impact.null_space[]");
  ASSERT_EQ(impact["null_space"][0]["grasps"].size(), 2u);
  expect_keys(impact["null_space"][0]["grasps"][0], {"end_effector", "impulse", "angular_impulse"},
              "impact.null_space[].grasps[]");
  expect_keys(impact["loops"][0],
              {"target", "end_effectors", "grasp_points", "end_effector_distance", "grasp_point_distance", "gap"},
              "impact.loops[]");
  expect_keys(impact["body_impulses"][0], {"body", "impulse", "angular_impulse"}, "impact.body_impulses[]");
  ASSERT_EQ(summary["later_impacts"].size(), 1u);
  EXPECT_EQ(summary["later_impacts"][0].size(), impact.size());
  EXPECT_EQ(summary["later_impacts"][0]["time"], 27);
  EXPECT_TRUE(summary["later_impacts"][0]["null_space"].empty());
  EXPECT_TRUE(summary["later_impacts"][0]["null_space"].is_array());
  expect_keys(summary["losses"][0],
              {"time", "end_effector", "target", "force", "moment", "load", "in_impact", "by_slip"}, "losses[]");
  expect_keys(summary["slips"][0],
              {"time", "end_effector", "target", "force", "moment", "ended", "until", "distance", "angle", "energy"},
              "slips[]");
  EXPECT_EQ(summary["slips"][0]["ended"], "lost");
  expect_keys(summary["releases"][0], {"time", "end_effectors", "targets"}, "releases[]");
  expect_keys(summary["post_impact"]["loops"][0],
              {"phase", "closures", "rows", "rank", "unprojected_position", "unprojected_angle", "unprojected_velocity",
               "unprojected_angular_velocity", "correction_total", "integration_error"},
              "post_impact.loops[]");
  expect_keys(
      summary["post_impact"]["grasp_loads"][0],
      {"phase", "end_effector", "target", "largest_force", "force_time", "largest_moment", "moment_time", "determined"},
      "post_impact.grasp_loads[]");
}

TEST(Summary, PutsEachValueOfLoopsUnderItsOwnKey) {
  const CaptureResult result = test::sample_result();
  const json summary = parsed(result);
  const ImpactReport& impact = result.impacts[0];
  const json& stress = summary["impact"]["null_space"][0]["grasps"][1];
  EXPECT_EQ(stress["end_effector"], "right");
  EXPECT_EQ(stress["impulse"], numbers(impact.null_space[0].impulse[1]));
  EXPECT_EQ(stress["angular_impulse"], numbers(impact.null_space[0].angular_impulse[1]));
  const json& loop = summary["impact"]["loops"][0];
  EXPECT_EQ(loop["end_effectors"], (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(loop["grasp_points"], (std::vector<std::string>{"left_handle", "right_handle"}));
  EXPECT_EQ(loop["end_effector_distance"], 1.25);
  EXPECT_EQ(loop["grasp_point_distance"], 1);
  EXPECT_EQ(loop["gap"], 0.25);
  const json& body = summary["impact"]["body_impulses"][1];
  EXPECT_EQ(body["body"], "debris");
  EXPECT_EQ(body["impulse"], numbers(impact.body_impulses[1].impulse));
  EXPECT_EQ(body["angular_impulse"], numbers(impact.body_impulses[1].angular_impulse));
  EXPECT_EQ(summary["releases"][0]["time"], 45);
  const LoopReport& loop_report = result.loops[0];
  const json& loops = summary["post_impact"]["loops"][0];
  EXPECT_EQ(loops["closures"], loop_report.closures);
  EXPECT_EQ(loops["rows"], 12);
  EXPECT_EQ(loops["rank"], 9);
  EXPECT_EQ(loops["unprojected_position"], loop_report.unprojected_position);
  EXPECT_EQ(loops["unprojected_angle"], loop_report.unprojected_angle);
  EXPECT_EQ(loops["unprojected_velocity"], loop_report.unprojected_velocity);
  EXPECT_EQ(loops["unprojected_angular_velocity"], loop_report.unprojected_angular_velocity);
  EXPECT_EQ(loops["correction_total"], loop_report.correction_total);
  EXPECT_EQ(loops["integration_error"], loop_report.integration_error);
  const GraspLoad& load = result.grasp_loads[1];
  const json& grasp = summary["post_impact"]["grasp_loads"][1];
  EXPECT_EQ(grasp["end_effector"], "right");
  EXPECT_EQ(grasp["largest_force"], load.largest_force);
  EXPECT_EQ(grasp["force_time"], load.force_time);
  EXPECT_EQ(grasp["largest_moment"], load.largest_moment);
  EXPECT_EQ(grasp["moment_time"], load.moment_time);
  EXPECT_EQ(grasp["determined"], load.determined);
}

TEST(Summary, HasPlanCaptureClearanceAndLimits) {
  const json summary = parsed(test::sample_result());
  const json& plan = summary["approach"]["plan"];
  expect_keys(plan,
              {"joints", "final_position", "final_rates", "unmet_rate", "rhs_evaluations", "found", "objective",
               "objective_value", "terms", "miss", "starts", "solutions", "distinct_solutions", "iterations",
               "smallest_singular_value", "straight_in"},
              "approach.plan");
  expect_keys(plan["terms"][0], {"name", "weight", "value"}, "approach.plan.terms[]");
  expect_keys(plan["miss"][0], {"end_effector", "distance", "angle", "velocity", "angular_velocity"},
              "approach.plan.miss[]");
  expect_only_keys(plan["miss"][1], {"end_effector", "distance", "angle"}, "approach.plan.miss[]");
  expect_keys(plan["straight_in"],
              {"begin", "stand_off", "final_speed", "smallest_singular_value", "damped", "damped_interval", "unmet",
               "unmet_time", "fit_error", "self_motion"},
              "approach.plan.straight_in");
  EXPECT_EQ(summary["approach"]["planned_final_rates"], plan["final_rates"]);
  const json& capture = summary["capture"];
  expect_keys(capture, {"captured", "verdict", "time", "grasps"}, "capture");
  EXPECT_EQ(capture["captured"], "no");
  expect_keys(capture["grasps"][1],
              {"end_effector", "target", "grasp_point", "captured", "judged", "reason", "limiting", "distance", "angle",
               "velocity", "angular_velocity", "time", "target_moved", "closings"},
              "capture.grasps[]");
  EXPECT_EQ(capture["grasps"][0]["time"], 20);
  EXPECT_EQ(capture["grasps"][0]["released"], 45);
  EXPECT_EQ(capture["grasps"][1]["time"], 27);
  EXPECT_FALSE(capture["grasps"][1].contains("released"));
  EXPECT_EQ(capture["grasps"][0]["captured"], "yes");
  EXPECT_EQ(capture["grasps"][1]["captured"], "no");
  EXPECT_EQ(capture["grasps"][1]["limiting"], "angle");
  EXPECT_EQ(capture["grasps"][1]["reason"], "outside the envelope");
  const json& clearance = summary["clearance"];
  expect_keys(clearance, {"unwatched", "minimum", "phases", "events"}, "clearance");
  EXPECT_EQ(clearance["minimum"]["distance"], -0.05);
  EXPECT_EQ(clearance["minimum"]["bodies"], (std::vector<std::string>{"base", "debris"}));
  expect_keys(clearance["phases"][0], {"phase", "distance", "bodies", "points", "time"}, "clearance.phases[]");
  expect_keys(clearance["events"][0],
              {"phase", "bodies", "begin", "end", "required", "minimum_distance", "minimum_time", "overlap_begin"},
              "clearance.events[]");
  expect_keys(summary["limits"]["events"][0],
              {"kind", "joint", "phase", "begin", "end", "limit", "worst_value", "worst_time"}, "limits.events[]");
  EXPECT_EQ(summary["limits"]["events"][0]["kind"], "rate");
}

TEST(Summary, HasTheContractsFeasibility) {
  CaptureResult result = test::sample_result();
  const json feasibility = parsed(result)["feasibility"];
  expect_keys(feasibility, {"verdict", "sentence", "first", "worst", "by_phase", "not_checked", "valid_until"},
              "feasibility");
  EXPECT_EQ(feasibility["verdict"], "no");
  EXPECT_EQ(feasibility["first"]["kind"], "rate");
  EXPECT_EQ(feasibility["first"]["time"], 3);
  expect_keys(feasibility["first"], {"kind", "what", "phase", "time"}, "feasibility.first");
  expect_keys(feasibility["worst"], {"kind", "what", "phase", "time", "value"}, "feasibility.worst");
  EXPECT_EQ(feasibility["worst"]["kind"], "overlap");
  EXPECT_EQ(feasibility["worst"]["value"], 0.05);
  EXPECT_EQ(feasibility["by_phase"].size(), 2u);
  EXPECT_EQ(feasibility["valid_until"], 32);
  EXPECT_EQ(feasibility["not_checked"], json::array());

  // Not evaluated: neither true nor false.
  LedgerEntry& clearance = result.ledger.entries.back();
  clearance.value = 0, clearance.not_checked = "no body has a shape";
  result.clearance_events.clear(), result.limit_events.clear();
  result.first_violation.reset(), result.valid_until.reset();
  const json unseen = parsed(result);
  EXPECT_EQ(unseen["ledger"]["feasible"], "not checked");
  EXPECT_TRUE(unseen["ledger"]["clearance_violation"]["pass"].is_null());
  EXPECT_EQ(unseen["ledger"]["clearance_violation"]["not_checked"], "no body has a shape");
  EXPECT_EQ(unseen["feasibility"]["not_checked"], json::array({"clearance: no body has a shape"}));
  for (const char* key : {"first", "worst", "valid_until"}) EXPECT_FALSE(unseen["feasibility"].contains(key)) << key;
}

TEST(Summary, HasTheContractsPublishedAndLedgerKeys) {
  const json summary = parsed(test::sample_result());
  const json& published = summary["impact"]["as_published"];
  expect_keys(published,
              {"grasps", "joint_velocity_after", "linear_momentum_error", "angular_momentum_error",
               "relative_linear_momentum_error", "relative_angular_momentum_error"},
              "as_published");
  expect_keys(published["grasps"][0], {"end_effector", "impulse", "angular_impulse", "impulse_magnitude"},
              "as_published.grasps[]");
  const json& ledger = summary["ledger"];
  expect_keys(ledger,
              {"linear_momentum_drift", "angular_momentum_drift", "loop_closure_position", "clearance_violation",
               "scale", "pass", "feasible"},
              "ledger");
  EXPECT_EQ(ledger["feasible"], "no");
  EXPECT_EQ(ledger["clearance_violation"]["kind"], "feasibility");
  EXPECT_EQ(ledger["linear_momentum_drift"]["kind"], "conservation");
  expect_keys(ledger["scale"], {"linear_momentum", "angular_momentum", "energy"}, "ledger.scale");
  expect_keys(ledger["linear_momentum_drift"], {"value", "bound", "pass", "unit", "note", "applies", "kind"},
              "ledger entry");
  EXPECT_EQ(ledger["linear_momentum_drift"]["pass"], true);
  EXPECT_EQ(ledger["angular_momentum_drift"]["pass"], false);
  EXPECT_EQ(ledger["loop_closure_position"]["applies"], false);
  EXPECT_EQ(ledger["pass"], false);
  expect_keys(summary["cost"][1], {"phase", "rhs_evaluations", "steps", "rejected"}, "cost[]");
}

TEST(Summary, PutsEachValueUnderItsOwnKey) {
  const CaptureResult result = test::sample_result();
  const json summary = parsed(result);
  EXPECT_EQ(summary["version"], "1.2.3");
  EXPECT_EQ(summary["status"], "completed");
  const PhaseEnd& end = *result.approach_end;
  const json& base = summary["approach"]["end"]["base"];
  EXPECT_EQ(base["position"], numbers(end.base.position));
  EXPECT_EQ(base["quaternion_wxyz"], (std::vector<double>{0.5, -0.5, 0.5, -0.5}));
  EXPECT_EQ(base["angular_velocity"], numbers(end.base.angular_velocity));
  EXPECT_EQ(base["velocity"], numbers(end.base.velocity));
  const json& end_effector = summary["approach"]["end"]["end_effectors"][1];
  EXPECT_EQ(end_effector["miss_distance"], end.end_effectors[1].miss_distance);
  EXPECT_EQ(end_effector["relative_velocity"], numbers(end.end_effectors[1].relative_velocity));
  EXPECT_EQ(end_effector["relative_angular_velocity"], numbers(end.end_effectors[1].relative_angular_velocity));
  const ImpactReport& impact = result.impacts[0];
  const json& grasp = summary["impact"]["grasps"][1];
  EXPECT_EQ(grasp["impulse"], numbers(impact.grasps[1].impulse));
  EXPECT_EQ(grasp["angular_impulse"], numbers(impact.grasps[1].angular_impulse));
  EXPECT_EQ(grasp["determined"], (std::vector<bool>{true, true, false, true, true, true}));
  EXPECT_EQ(summary["impact"]["base_reaction"]["impulse"], numbers(impact.base_impulse));
  EXPECT_EQ(summary["impact"]["base_velocity_change"], numbers(impact.base_velocity_change));
  EXPECT_EQ(summary["impact"]["base_angular_velocity_change"], numbers(impact.base_angular_velocity_change));
  EXPECT_EQ(summary["impact"]["rank"], 11);
  EXPECT_EQ(summary["impact"]["rows"], 12);
  EXPECT_EQ(summary["impact"]["targets_after"][0]["velocity"], numbers(impact.targets_after[0].velocity));
}

TEST(Summary, LeavesAbsentPhasesOut) {
  CaptureResult result;
  const json summary = parsed(result);
  for (const char* key : {"approach", "impact", "later_impacts", "releases", "post_impact"}) {
    EXPECT_FALSE(summary.contains(key)) << key;
  }
  EXPECT_EQ(summary["status"], "not_run");
  result = test::sample_result();
  result.loops.clear();
  result.grasp_loads.clear();
  expect_keys(parsed(result)["post_impact"], {"end", "phases"}, "post_impact without loops and loads");
  result.impacts[0].as_published.reset();
  result.impacts[0].as_published_absent = "(J^T)+ is not defined here";
  result.impacts[0].brake.reset();
  const json impact = parsed(result)["impact"];
  EXPECT_FALSE(impact.contains("as_published"));
  EXPECT_FALSE(impact.contains("brake"));
  EXPECT_EQ(impact["as_published_absent"], "(J^T)+ is not defined here");
}

TEST(Summary, TurnsNaNAndInfinityIntoNullAndBadTextIntoText) {
  CaptureResult result = test::sample_result();
  result.impacts[0].kinetic_energy_after = std::numeric_limits<double>::quiet_NaN();
  result.impacts[0].base_velocity_change[1] = -std::numeric_limits<double>::infinity();
  result.ledger.entries[0].value = std::numeric_limits<double>::quiet_NaN();
  result.scenario_name = "bad \xff text \"quoted\"\n";
  const json summary = parsed(result);
  EXPECT_TRUE(summary["impact"]["kinetic_energy_after"].is_null());
  EXPECT_TRUE(summary["impact"]["base_velocity_change"][1].is_null());
  EXPECT_TRUE(summary["ledger"]["linear_momentum_drift"]["value"].is_null());
  EXPECT_EQ(summary["ledger"]["linear_momentum_drift"]["pass"], false);  // NaN fails
  EXPECT_EQ(summary["scenario"]["name"], "bad \xef\xbf\xbd text \"quoted\"\n");
}

TEST(Summary, PreservesKeyOrderAndWritesVectorsOnOneLine) {
  const std::string text = summary_json(test::sample_result(), "1.2.3");
  EXPECT_LT(text.find("\"schema\""), text.find("\"approach\""));
  EXPECT_LT(text.find("\"approach\""), text.find("\"impact\""));
  EXPECT_LT(text.find("\"impact\""), text.find("\"ledger\""));
  EXPECT_THAT(text, HasSubstr("\"quaternion_wxyz\": [0.5, -0.5, 0.5, -0.5],\n"));
  EXPECT_EQ(text.back(), '\n');
}

}  // namespace summary_test
}  // namespace grapnel
