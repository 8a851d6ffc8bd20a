#include "grapnel/scenario/schema.hpp"

#include <nlohmann/json.hpp>

#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/schema_text.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

// References to the robot's schema become references into the one document.
void point_inside(Json& part) {
  const std::string file = "robot.schema.json";
  if (part.is_object() && part.contains("$ref")) {
    std::string& reference = part["$ref"].get_ref<std::string&>();
    if (reference == file)
      reference = "#/definitions/robot";
    else if (reference.starts_with(file))
      reference.erase(0, file.size());
  }
  if (part.is_structured()) {
    for (Json& below : part) point_inside(below);
  }
}

Json bundled_scenario_schema() {
  Json scenario = Json::parse(kScenarioSchemaText);
  point_inside(scenario);
  Json robot = robot_schema_document();
  for (const auto& [name, definition] : robot["definitions"].items()) scenario["definitions"][name] = definition;
  robot.erase("definitions");
  robot.erase("$schema");
  scenario["definitions"]["robot"] = std::move(robot);
  return scenario;
}

}  // namespace

const Json& robot_schema_document() {
  static const Json kSchema = Json::parse(kRobotSchemaText);
  return kSchema;
}
const Json& scenario_schema_document() {
  static const Json kSchema = bundled_scenario_schema();
  return kSchema;
}
const Json& study_schema_document() {
  static const Json kSchema = Json::parse(kStudySchemaText);
  return kSchema;
}
const Json& optimization_schema_document() {
  static const Json kSchema = Json::parse(kOptimizationSchemaText);
  return kSchema;
}
const Json& campaign_schema_document() {
  static const Json kSchema = Json::parse(kCampaignSchemaText);
  return kSchema;
}

std::string scenario_schema() { return scenario_schema_document().dump(2) + "\n"; }
std::string robot_schema() { return robot_schema_document().dump(2) + "\n"; }
std::string study_schema() { return study_schema_document().dump(2) + "\n"; }
std::string optimization_schema() { return optimization_schema_document().dump(2) + "\n"; }
std::string campaign_schema() { return campaign_schema_document().dump(2) + "\n"; }

}  // namespace grapnel
