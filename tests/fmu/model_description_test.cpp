/// What modelDescription.xml must be by the standards: the rules of the schemas of FMI 2.0 and 3.0 that concern what is
/// written, and those that only the text states.

#include <gtest/gtest.h>

#include <pugixml.hpp>
#include <regex>
#include <set>

#include "fmu/master.hpp"
#include "grapnel/plant/model_description_text.hpp"

namespace grapnel::testing {
namespace model_description_test {

class ModelDescriptionOfPlants : public ExportFmu {
 protected:
  // Of one of the scenarios shipped, unpacked.
  pugi::xml_document description(const std::string& scenario, int version, const std::string& more = {}) {
    const fmi::Fmu fmu(exported(scenario, version, more), "plant.fmu");
    pugi::xml_document document;
    const std::string file = (fmu.resources().parent_path() / "modelDescription.xml").string();
    EXPECT_TRUE(document.load_file(file.c_str()));
    return document;
  }
};

std::vector<std::string> names_of(const pugi::xml_node& parent) {
  std::vector<std::string> names;
  for (const pugi::xml_node& child : parent.children()) names.emplace_back(child.name());
  return names;
}

void expect_only(const pugi::xml_node& node, const std::set<std::string>& allowed) {
  for (const pugi::xml_attribute& a : node.attributes())
    EXPECT_TRUE(allowed.count(a.name())) << "<" << node.name() << "> has " << a.name();
}
void expect_all(const pugi::xml_node& node, const std::set<std::string>& required) {
  for (const std::string& name : required)
    EXPECT_TRUE(node.attribute(name.c_str())) << "<" << node.name() << "> lacks " << name;
}

struct Checked {
  std::set<std::string> units;
  std::set<unsigned> references;
  std::set<std::string> names;
  std::vector<std::string> outputs;  // position or reference, as the structure names them
  int parameters = 0, inputs = 0;
};

void check_units(const pugi::xml_node& units, Checked& checked) {
  for (const pugi::xml_node& unit : units.children()) {
    EXPECT_STREQ(unit.name(), "Unit");
    EXPECT_TRUE(checked.units.insert(unit.attribute("name").value()).second);
    expect_only(unit, {"name"});
    ASSERT_STREQ(unit.first_child().name(), "BaseUnit");
    expect_only(unit.first_child(), {"kg", "m", "s", "A", "K", "mol", "cd", "rad", "factor", "offset"});
    for (const pugi::xml_attribute& power : unit.first_child().attributes())
      EXPECT_TRUE(std::regex_match(power.value(), std::regex("-?[0-9]+"))) << power.value();
  }
}

// Attributes that a variable has, by causality and variability (2.0: section 2.2.7; 3.0: section 2.4.7.4).
void check_variable(const pugi::xml_node& variable, const pugi::xml_node& value, const std::string& type,
                    const std::string& position, Checked& checked) {
  expect_all(variable, {"name", "valueReference", "causality", "variability"});
  const std::string name = variable.attribute("name").value(), causality = variable.attribute("causality").value(),
                    variability = variable.attribute("variability").value();
  EXPECT_FALSE(name.empty());
  EXPECT_TRUE(checked.names.insert(name).second) << name;
  EXPECT_TRUE(checked.references.insert(variable.attribute("valueReference").as_uint()).second) << name;
  const bool is_real = type == "Real" || type == "Float64";
  if (value.attribute("unit")) {
    EXPECT_TRUE(is_real && checked.units.count(value.attribute("unit").value())) << name;
  }
  if (variability == "continuous") {
    EXPECT_TRUE(is_real) << name;
  }
  if (causality == "independent") {
    EXPECT_EQ(variability, "continuous");
    EXPECT_FALSE(variable.attribute("initial") || value.attribute("start"));
  } else if (causality == "parameter") {
    ++checked.parameters;
    EXPECT_EQ(variability, "fixed");
    EXPECT_STREQ(variable.attribute("initial").value(), "exact");
    EXPECT_TRUE(value.attribute("start")) << name;
  } else if (causality == "input") {
    ++checked.inputs;
    EXPECT_EQ(variability, is_real ? "continuous" : "discrete");
    EXPECT_FALSE(variable.attribute("initial")) << name;  // not of inputs
    EXPECT_TRUE(value.attribute("start")) << name;
  } else {
    EXPECT_EQ(causality, "output");
    EXPECT_EQ(variability, is_real ? "continuous" : "discrete");
    EXPECT_STREQ(variable.attribute("initial").value(), "calculated");
    EXPECT_FALSE(value.attribute("start")) << name;  // not where it is calculated
    checked.outputs.push_back(position);
  }
}

void check_unknowns(const pugi::xml_node& parent, const char* element, const char* key,
                    const std::vector<std::string>& wanted, const std::string& dependencies) {
  std::vector<std::string> found;
  for (const pugi::xml_node& unknown : parent.children(element)) {
    found.emplace_back(unknown.attribute(key).value());
    EXPECT_EQ(unknown.attribute("dependencies").value(), dependencies);
  }
  EXPECT_EQ(found, wanted);
}

std::string parameters_list(int count) {
  std::string list;
  for (int i = 1; i <= count; ++i) list += (i > 1 ? " " : "") + std::to_string(i);
  return list;
}

TEST_F(ModelDescriptionOfPlants, ConformsToFmi2) {
  const auto document = description(scenario("detumble-envisat.yaml"), 2);
  const pugi::xml_node root = document.document_element();
  ASSERT_STREQ(root.name(), "fmiModelDescription");
  EXPECT_STREQ(root.attribute("fmiVersion").value(), "2.0");
  expect_all(root, {"fmiVersion", "modelName", "guid"});
  expect_only(root, {"fmiVersion", "modelName", "guid", "description", "author", "version", "copyright", "license",
                     "generationTool", "generationDateAndTime", "variableNamingConvention", "numberOfEventIndicators"});
  // A sequence in the schema.
  EXPECT_EQ(names_of(root), (std::vector<std::string>{"CoSimulation", "UnitDefinitions", "LogCategories",
                                                      "DefaultExperiment", "ModelVariables", "ModelStructure"}));
  const pugi::xml_node cs = root.child("CoSimulation");
  EXPECT_TRUE(std::regex_match(cs.attribute("modelIdentifier").value(), std::regex("[A-Za-z_][A-Za-z_0-9]*")));
  expect_only(cs, {"modelIdentifier", "needsExecutionTool", "canHandleVariableCommunicationStepSize",
                   "canInterpolateInputs", "maxOutputDerivativeOrder", "canRunAsynchronuously",
                   "canBeInstantiatedOnlyOncePerProcess", "canNotUseMemoryManagementFunctions", "canGetAndSetFMUstate",
                   "canSerializeFMUstate", "providesDirectionalDerivative"});
  expect_only(root.child("DefaultExperiment"), {"startTime", "stopTime", "tolerance", "stepSize"});
  Checked checked;
  check_units(root.child("UnitDefinitions"), checked);
  int position = 0;
  for (const pugi::xml_node& variable : root.child("ModelVariables").children()) {
    ASSERT_STREQ(variable.name(), "ScalarVariable");
    expect_only(variable, {"name", "valueReference", "description", "causality", "variability", "initial",
                           "canHandleMultipleSetPerTimeInstant"});
    const pugi::xml_node value = variable.first_child();
    const std::string type = value.name();
    EXPECT_TRUE(type == "Real" || type == "Integer" || type == "Boolean") << type;
    expect_only(value, {"unit", "start"});
    check_variable(variable, value, type, std::to_string(++position), checked);
  }
  // 14 joints, 4 wheels, 12 thrusters.
  EXPECT_EQ(checked.inputs, 14 + 4 + 12);
  EXPECT_GT(checked.parameters, 10);
  const pugi::xml_node structure = root.child("ModelStructure");
  EXPECT_EQ(names_of(structure), (std::vector<std::string>{"Outputs", "InitialUnknowns"}));
  check_unknowns(structure.child("Outputs"), "Unknown", "index", checked.outputs, "");
  check_unknowns(structure.child("InitialUnknowns"), "Unknown", "index", checked.outputs,
                 parameters_list(checked.parameters));
}

TEST_F(ModelDescriptionOfPlants, ConformsToFmi3) {
  const auto document = description(scenario("detumble-envisat.yaml"), 3);
  const pugi::xml_node root = document.document_element();
  EXPECT_TRUE(std::regex_match(root.attribute("fmiVersion").value(), std::regex("3[.]0([.].*)?")));
  expect_all(root, {"fmiVersion", "modelName", "instantiationToken"});
  expect_only(root, {"fmiVersion", "modelName", "instantiationToken", "description", "author", "version", "copyright",
                     "license", "generationTool", "generationDateAndTime", "variableNamingConvention"});
  EXPECT_EQ(names_of(root), (std::vector<std::string>{"CoSimulation", "UnitDefinitions", "LogCategories",
                                                      "DefaultExperiment", "ModelVariables", "ModelStructure"}));
  expect_only(root.child("CoSimulation"),
              {"modelIdentifier", "needsExecutionTool", "canBeInstantiatedOnlyOncePerProcess", "canGetAndSetFMUState",
               "canSerializeFMUState", "providesDirectionalDerivatives", "providesAdjointDerivatives",
               "providesPerElementDependencies", "canHandleVariableCommunicationStepSize", "fixedInternalStepSize",
               "maxOutputDerivativeOrder", "recommendedIntermediateInputSmoothness", "providesIntermediateUpdate",
               "mightReturnEarlyFromDoStep", "canReturnEarlyAfterIntermediateUpdate", "hasEventMode",
               "providesEvaluateDiscreteStates"});
  Checked checked;
  check_units(root.child("UnitDefinitions"), checked);
  int independent = 0;
  for (const pugi::xml_node& variable : root.child("ModelVariables").children()) {
    const std::string type = variable.name();
    EXPECT_TRUE(type == "Float64" || type == "Int32" || type == "Boolean") << type;
    expect_only(variable,
                {"name", "valueReference", "description", "causality", "variability", "initial", "unit", "start"});
    check_variable(variable, variable, type, variable.attribute("valueReference").value(), checked);
    independent += std::string(variable.attribute("causality").value()) == "independent";
  }
  EXPECT_EQ(independent, 1);  // exactly one in 3.0
  EXPECT_EQ(checked.inputs, 14 + 4 + 12);
  const pugi::xml_node structure = root.child("ModelStructure");
  check_unknowns(structure, "Output", "valueReference", checked.outputs, "");
  check_unknowns(structure, "InitialUnknown", "valueReference", checked.outputs, parameters_list(checked.parameters));
}

TEST(ModelDescriptionText, EscapingAndNames) {
  EXPECT_EQ(c_identifier("two-arms 2.1"), "two_arms_2_1");
  EXPECT_EQ(c_identifier("2 arms"), "plant_2_arms");
  EXPECT_EQ(c_identifier(""), "plant_");
  PlantVariables variables;
  variables.all.push_back({"a<b>&\"c\"", "N.m", "", PlantVariable::Type::real, PlantVariable::Causality::input, 0.1});
  variables.inputs = 1;
  const std::string text = model_description_text({3, "x & y", "x", "{}", "tool", 0.01, 1}, variables);
  EXPECT_NE(text.find("name=\"a&lt;b&gt;&amp;&quot;c&quot;\""), std::string::npos) << text;
  EXPECT_NE(text.find("start=\"0.10000000000000001\""), std::string::npos);
  EXPECT_NE(text.find("<Unit name=\"N.m\"><BaseUnit kg=\"1\" m=\"2\" s=\"-2\"/></Unit>"), std::string::npos);
}

}  // namespace model_description_test
}  // namespace grapnel::testing
