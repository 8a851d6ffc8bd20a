#pragma once

/// @file
/// URDF models as robots, for the tests of imports.

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>
#include <string>

#include "grapnel/import/assemble.hpp"
#include "grapnel/import/xml_file.hpp"
#include "grapnel/scenario/imported_robot.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "import/import_files.hpp"

namespace grapnel::testing {

/// The output of an import: errors with line and column, or decisions.
struct Imported {
  std::optional<ImportedRobot> robot;
  std::string faults;     // "3:5: text" a line each
  std::string decisions;  // texts, a line each

  const Node& link(const std::string& name) const {
    for (const Node& one : robot->tree.find("links")->items) {
      if (one.find("name")->text == name) return one;
    }
    throw std::out_of_range("no link " + name);
  }
  const Node& joint(const std::string& name) const {
    for (const Node& one : robot->tree.find("links")->items) {
      if (one.find("joint")->find("name")->text == name) return *one.find("joint");
    }
    throw std::out_of_range("no joint " + name);
  }
};

inline Imported import_text(const std::string& text, ImportOptions options = {},
                            const std::string& name = "test.urdf") {
  FaultList faults;
  Imported result;
  const XmlFile file(name, text, faults, XmlFile::Numbers::arithmetic);
  const SourceModel model = read_urdf(file, faults);
  if (options.source.empty()) options.source = name;
  if (options.place.empty()) options.place = "test.yaml";
  if (faults.empty()) result.robot = assemble_robot(model, options, faults);
  for (const Fault& fault : sorted_faults(faults.all()))
    result.faults += std::to_string(fault.line) + ":" + std::to_string(fault.column) + ": " + fault.message + "\n";
  if (result.robot) {
    for (const ImportDecision& one : result.robot->decisions) result.decisions += one.text + "\n";
  }
  return result;
}
inline Imported import_corpus(const std::string& name, ImportOptions options = {}) {
  options.source = corpus(name);
  return import_text(bytes_of(corpus(name)), std::move(options), name);
}

/// The robot of an import, read back from its file. @throws InputError
inline RobotSetup robot_of(const Imported& imported) {
  ScenarioFiles files;
  ImportedFile file;
  file.tree = imported.robot->tree;
  return read_imported(file, "test.yaml", files);
}

inline const BodyDescription& body_of(const RobotSetup& robot, const std::string& name) {
  for (const BodyDescription& body : robot.bodies) {
    if (body.name == name) return body;
  }
  throw std::out_of_range("no body " + name);
}
inline const BodyDescription& carried_by(const RobotSetup& robot, const std::string& joint) {
  for (const BodyDescription& body : robot.bodies) {
    if (body.joint.name == joint) return body;
  }
  throw std::out_of_range("no joint " + joint);
}

}  // namespace grapnel::testing
