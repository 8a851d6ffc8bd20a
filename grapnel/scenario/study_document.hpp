#pragma once

/// @file
/// The beginning that studies and optimizations have in common: a file, its text, its tree checked against a schema.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

struct StudyDocument {
  std::string bytes;
  Node root;           // with the schema's defaults filled in
  bool sound = false;  // false: structure faults were added; what is read must expect anything
};

/// `kind`: of the file, "study"; `expected`: in words, "a study". Faults of structure are added to `faults`.
/// @throws InputError if there is nothing to go on with: no file, no YAML, or a file of another kind.
StudyDocument read_study_document(const std::filesystem::path& path, const std::string& kind,
                                  const std::string& expected, const nlohmann::ordered_json& schema, FaultList& faults);

}  // namespace grapnel
