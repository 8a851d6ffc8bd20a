// The published schema and the reader agree, as an independent validator sees it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <set>

#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"
#include "support/schema_check.hpp"

namespace grapnel::test {
namespace schema_test {

using Json = nlohmann::json;

Json json_from(const Node& node) {
  switch (node.kind) {
    case Node::Kind::null:
      return nullptr;
    case Node::Kind::sequence: {
      Json list = Json::array();
      for (const Node& item : node.items) list.push_back(json_from(item));
      return list;
    }
    case Node::Kind::mapping: {
      Json object = Json::object();
      for (const NodeEntry& entry : node.entries) object[entry.key] = json_from(entry.value);
      return object;
    }
    case Node::Kind::scalar:
      break;
  }
  if (const auto number = number_of(node)) {
    const bool whole = node.text.find_first_not_of("+-0123456789") == std::string::npos;
    return whole ? Json(static_cast<long>(*number)) : Json(*number);
  }
  if (const auto truth = boolean_of(node)) return *truth;
  return node.text;
}

Json json_of(const std::string& text) {
  FaultList faults;
  const auto node = parse_document(text, std::make_shared<const std::string>("test"), faults);
  if (!node) throw std::logic_error("not YAML");
  return json_from(*node);
}

bool accepts(const std::string& schema_text, const Json& document) {
  return SchemaCheck(schema_text).faults_of(document).empty();
}

TEST(Schema, AcceptsEveryShippedFile) {
  SKIP_UNDER_SANITIZERS();
  for (const auto& path : shipped_robots()) {
    EXPECT_TRUE(accepts(robot_schema(), json_of(bytes_of(path)))) << path;
  }
  for (const auto& path : shipped_scenarios()) {
    EXPECT_TRUE(accepts(scenario_schema(), json_of(bytes_of(path)))) << path;
  }
}

// Structural faults: what a schema can express, an editor with the schema shows as the reader does.
TEST(Schema, RejectsTheSameFilesAsTheReader) {
  SKIP_UNDER_SANITIZERS();
  const std::vector<std::pair<std::string, std::string>> edits{
      {"name: test", "nam: test"},
      {"name: test", "schema: grapnel-scenario/2\nname: test"},
      {"name: test", "name: 12"},
      {"name: test", "name: ''"},
      {"duration: 20", "duration: 0"},
      {"duration: 20", "duration: '20'"},
      {"duration: 20", "duration: 020"},
      {"duration: 20", "duration: 0x14"},
      {"duration: 20", "duration: [20]"},
      {"  duration: 20\n", ""},
      {"  final_joints", "  profile: quartik\n  final_joints"},
      {"match: velocity", "match: velocty"},
      {"match: velocity", "match: velocity, shoulder: 1"},
      {"mass: 10\n", "mass: -10\n"},
      {"inertia: [1, 1, 1]", "inertia: [1, 1]"},
      {"inertia: [1, 1, 1]", "inertia: [1, 1, 1, 0]"},
      {"inertia: [1, 1, 1]", "inertia: {xx: 1, yy: 1}"},
      {"inertia: [1, 1, 1]", "inertia: 1"},
      {"[2, 0, 0]", "[2, 0]"},
      {"[2, 0, 0]", "[2, 0, zero]"},
      {"state: {", "state: {rpy: [0, 0, 0], quaternion_wxyz: [1, 0, 0, 0], "},
      {"initial:", "initial:\n  base: {momentum: {}, velocity: [0, 0, 0]}"},
      {"joints: {shoulder: 0.5, elbow: 1}", "joints: 0.5"},
      {"joints: {shoulder: 0.5, elbow: 1}", "joints: {shoulder: half, elbow: 1}"},
      {"\nimpact: {duration: 1e-3}", ""},
      {"grasps:\n  - {end_effector: tip, target: ball, point: grip}\n", ""},
      {"point: grip}", "point: grip, model: hinge}"},
      {"\nimpact:", "\ncontact: {gap: refuse}\nimpact:"},
      {"\nimpact:", "\nintegration: {max_steps: 1.5}\nimpact:"},
      {"\nimpact:", "\nintegration: {relative_tolerance: 1}\nimpact:"},
      {"  final_rates", "  tracking: {mode: pd}\n  final_rates"},
      {"  final_rates", "  tracking: {mode: pd, kp: -1, kd: 1}\n  final_rates"},
      {"post_impact: {duration: 10}", "post_impact: {duration: 10, joints: pd}"},
      {"    grasp_points", "    geometry: {shape: sphere, size: [1, 1, 1]}\n    grasp_points"},
      {"    grasp_points", "    geometry: {shape: sphere, radius: 1, length: 2}\n    grasp_points"},
      {"    grasp_points",
       "    geometry: [{shape: sphere, radius: 1}, {shape: sphere, size: [1, 1, 1]}]\n    grasp_points"},
      {"    grasp_points", "    geometry: [sphere]\n    grasp_points"},
      {"    grasp_points", "    geometry: sphere\n    grasp_points"},
      {"mass: 100, inertia: [10, 10, 10]", "mass: 100, inertia: [10, 10, 10], geometry: [{shape: box}]"},
      {"type: revolute, axis: [0, 0, 1], limits", "type: revolute, limits"},
      {"type: revolute, axis: [0, 0, 1], limits", "type: continuous, axis: [0, 0, 1], limits"},
      {"type: revolute, axis: [0, 0, 1], origin", "type: fixed, axis: [0, 0, 1], origin"},
      {"type: revolute, axis: [0, 0, 1], origin", "type: ball, axis: [0, 0, 1], origin"},
      {"  base: {mass: 100, inertia: [10, 10, 10]}\n", ""},
      {"rate: 1", "rate: 0"},
      {"name: upper", "nme: upper"},
      with_tip("envelope: {}"),
      with_tip("envelope: {position: 0}"),
      with_tip("approach_axis: [1, 0]"),
      with_grasp("orientation: axes"),
      with_approach("plan: {}"),
      with_approach("trajectory: motion.csv"),
      way("profile: quintic"),
      way("plan: {objective: nearest}"),
      way("plan: {starts: 0}"),
      way("plan: {starts: 1001}"),
      way("plan: {seed: -1}"),
      way("plan: {seed: 1.5}"),
      way("trajectory: motion.csv\n  profile: quintic"),
      way("trajectory: motion.csv\n  waypoints: []"),
      way("pieces: []"),
      way("pieces: [{series: [[0.5], [1]]}]"),
      way("pieces: [{until: 0, series: [[0.5], [1]]}]"),
      way("pieces: [{until: 20}]"),
      way("pieces: [{until: 20, series: [0.5, 1]}]"),
      way("pieces: [{until: 20, series: [[0.5], []]}]"),
      way("pieces: [{until: 20, series: {shoulder: [0.5], elbow: 1}}]"),
      way("pieces: [{until: 20, series: [[0.5], [1]]}]\n  profile: quintic"),
      way("pieces: [{until: 20, series: [[0.5], [1]]}]\n  final_rates: [0, 0]"),
      with_approach("pieces: [{until: 20, series: [[0.5], [1]]}]"),
      way("plan: {}\n  straight_in: {stand_off: 1, duration: 1}\n  final_rates: [0, 0]"),
      with_approach("straight_in: {stand_off: 1, duration: 1}"),
      with_approach("waypoints: [{time: 5}]"),
      with_approach("waypoints: [{joints: [0, 0]}]"),
      with_approach("waypoints: [{time: 5, end_effectors: {}}]"),
      with_approach("waypoints: [{time: 5, end_effectors: {tip: {}}}]"),
      with_approach("waypoints: [{time: 5, rates: [0, 0], end_effectors: {tip: {position: [1, 0, 0]}}}]"),
      with_approach("tracking: {mode: computed_torque, kp: 1}"),
      with_approach("base_control: {kp: 1}"),
      with_approach("base_control: {kp: [1, 1], kd: 1}"),
      with_approach("base_control: {kp: 1, kd: 1, limit: 0}"),
      with_post_impact("base_control: {kp: -1, kd: 1}"),
      with_approach("capture_at: start"),
      with_wrench("{force: [1, 0, 0]}"),
      with_wrench("{body: base, target: ball}"),
      with_wrench("{body: base, time: {shape: half_sine}}"),
      with_wrench("{body: base, time: {shape: sine, frequency: 0}}"),
      with_wrench("{body: base, time: {shape: constant, phase: 0}}"),
      with_wrench("{body: base, time: {shape: table, values: [[0, 0, 0, 0, 0, 0, 0]]}}"),
      with_grasp("closes_at: 0"),
      with_grasp("closes_at: 5, closes_on_arrival: false"),
      with_grasp("closes_on_arrival: yes"),
      with_post_impact("release: [{}]"),
      with_post_impact("release: [{after: 0}]"),
      with_post_impact("release: [{after: 1, end_effectors: []}]"),
      with_post_impact("release: [{after: 1, end_effectors: tip}]"),
      {"impact: {duration: 1e-3}", "impact: {law: published}"},
      with_top("integration: {loops: projected}"),
      with_top("integration: {baumgarte_time: 0.1}"),
      with_top("integration: {loops: acceleration, baumgarte_time: 0.1}"),
      with_top("integration: {loops: baumgarte, baumgarte_time: 0}"),
      with_top("clearance: {enabled: yes}"),
      with_top("clearance: {enabled: 1}"),
      with_top("clearance: {enabled: 'true'}"),
      with_top("clearance: {required: -1}"),
      with_top("clearance: {ignore: [[base]]}"),
  };
  ASSERT_TRUE(accepts(scenario_schema(), json_of(kSmallScenario)));
  for (const auto& edit : edits) {
    const std::string text = edited(kSmallScenario, {edit});
    EXPECT_FALSE(faults_of(text).empty()) << edit.second;
    EXPECT_FALSE(accepts(scenario_schema(), json_of(text))) << edit.second;
  }
}

TEST(Schema, AcceptsTheSameFilesAsTheReader) {
  const std::vector<std::vector<Edit>> edits{
      {with_tip("envelope: {angle: 0.1}")},
      {{"    grasp_points",
        "    geometry: [{shape: sphere, radius: 1}, {shape: box, size: [1, 1, 1]}]\n    grasp_points"}},
      {{"    grasp_points", "    geometry: []\n    grasp_points"}},
      {{"mass: 100, inertia: [10, 10, 10]",
        "mass: 100, inertia: [10, 10, 10], geometry: [{shape: sphere, radius: 1}]"}},
      {way("plan: {}")},
      {way("plan: {objective: nearest, guess: [0, 0], starts: 1000, seed: 9007199254740991}")},
      {way("plan: {}\n  straight_in: {stand_off: 1, duration: 1}"), with_tip("approach_axis: [1, 0, 0]"),
       with_point("approach_direction: [0, -1, 0]")},
      {with_approach("profile: quintic\n  waypoints: [{time: 5, end_effectors: {tip: {position: [1, 0, 0]}}}]")},
      {with_approach("base_control: {kp: 1, kd: [1, 2, 3], limit: 4}")},
      {with_wrench("{target: ball, force: [1, 0, 0], time: {shape: sine, frequency: 1}}")},
      {with_wrench("{body: base, time: {shape: table, values: [[0, 0, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0, 0]]}}")},
      {with_top("clearance: {enabled: false, ignore: [[base, ball]]}")},
      {with_grasp("closes_at: 25")},
      {with_grasp("closes_on_arrival: true"), with_tip("envelope: {position: 0.1}")},
      {with_post_impact("release: [{after: 1, end_effectors: [tip]}, {after: 2}]")},
      {{"impact: {duration: 1e-3}", "impact: {law: as_published}"}},
      {with_top("integration: {loops: baumgarte, baumgarte_time: 0.2}")},
      {with_top("integration: {loops: projection}")},
  };
  for (const auto& list : edits) {
    const std::string text = edited(kSmallScenario, list);
    EXPECT_THAT(faults_of(text), testing::IsEmpty()) << list[0].second;
    EXPECT_TRUE(accepts(scenario_schema(), json_of(text))) << list[0].second;
  }
  // The file that this names need not be there for the schema.
  const std::string trajectory = edited(kSmallScenario, {way("trajectory: motion.csv"), {"  duration: 20\n", ""}});
  EXPECT_TRUE(accepts(scenario_schema(), json_of(trajectory)));
}

// The reader's own validator knows these and no others: a keyword it would ignore must not enter a schema unnoticed.
void expect_known_keywords(const Json& schema, const std::string& where) {
  static const std::set<std::string> kKnown{"$schema",
                                            "$ref",
                                            "title",
                                            "description",
                                            "pattern",
                                            "x-any-unit",
                                            "default",
                                            "x-unit",
                                            "x-infinity",
                                            "x-largest",
                                            "x-plausible",
                                            "type",
                                            "enum",
                                            "const",
                                            "minimum",
                                            "maximum",
                                            "exclusiveMinimum",
                                            "minLength",
                                            "minProperties",
                                            "items",
                                            "minItems",
                                            "maxItems",
                                            "required",
                                            "properties",
                                            "additionalProperties",
                                            "dependencies",
                                            "anyOf",
                                            "oneOf",
                                            "allOf",
                                            "not",
                                            "if",
                                            "then",
                                            "definitions"};
  if (schema.is_boolean()) return;
  for (const auto& [key, value] : schema.items()) {
    EXPECT_TRUE(kKnown.contains(key)) << key << " in " << where;
    const std::string here = where + "/" + key;
    if (key == "properties" || key == "definitions") {
      for (const auto& [name, below] : value.items()) expect_known_keywords(below, here + "/" + name);
    } else if (key == "anyOf" || key == "allOf") {
      for (const auto& below : value) expect_known_keywords(below, here);
    } else if (key == "oneOf") {
      for (const auto& below : value) {
        EXPECT_EQ(below.size(), 1u) << here;
        EXPECT_EQ(below.at("required").size(), 1u) << here;
      }
    } else if (key == "pattern") {
      EXPECT_EQ(schema.at("type"), (Json{"number", "string"})) << here;  // a number with its unit, of the reader's own
    } else if (key == "minProperties") {
      EXPECT_EQ(value, 1) << here;
    } else if (key == "not" && value.empty()) {
      EXPECT_TRUE(schema.contains("description")) << where;  // the reason
    } else if (key == "not") {
      EXPECT_EQ(value.size(), 1u) << here;
      EXPECT_LE(value.at("required").size(), 2u) << here;  // of one key: only to tell alternatives apart
    } else if (key == "if" || key == "then" || key == "items" || (key == "additionalProperties" && value.is_object())) {
      expect_known_keywords(value, here);
    }
  }
}

TEST(Schema, UsesOnlyKeywordsOfTheReader) {
  expect_known_keywords(Json::parse(scenario_schema()), "scenario");
  expect_known_keywords(Json::parse(robot_schema()), "robot");
}

TEST(Schema, IsSelfContained) {
  EXPECT_EQ(Json::parse(scenario_schema()).at("$schema"), "http://json-schema.org/draft-07/schema#");
  EXPECT_EQ(Json::parse(robot_schema()).at("$schema"), "http://json-schema.org/draft-07/schema#");
  const Json scenario = Json::parse(scenario_schema()), robot = Json::parse(robot_schema());
  EXPECT_EQ(scenario.at("definitions").at("robot").at("properties"), robot.at("properties"));
}

}  // namespace schema_test
}  // namespace grapnel::test
