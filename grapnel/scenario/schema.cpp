#include "grapnel/scenario/schema.hpp"

#include <nlohmann/json.hpp>

#include "grapnel/scenario/descriptions.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/scenario/schema_of.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

}  // namespace

const Json& robot_schema_document() {
  static const Json kSchema = schema_of(robot_description(), "Grapnel robot, version 1");
  return kSchema;
}
const Json& scenario_schema_document() {
  static const Json kSchema = schema_of(scenario_description(), "Grapnel scenario, version 1");
  return kSchema;
}

std::string scenario_schema() { return scenario_schema_document().dump(2) + "\n"; }
std::string robot_schema() { return robot_schema_document().dump(2) + "\n"; }

}  // namespace grapnel
