#pragma once

/// @file
/// The published JSON Schemas and the check of a document against them. They are the one place that says which keys
/// there are, their types, ranges and defaults.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "grapnel/text/yaml_tree.hpp"

namespace grapnel {

/// Self-contained draft-7 schemas, as objects.
const nlohmann::ordered_json& scenario_schema_document();
const nlohmann::ordered_json& robot_schema_document();

/// Checks the structure: keys, types, lengths, ranges, choices. `document` names the whole in messages ("the
/// scenario"); `path` leads to it where it is part of a larger whole. A misspelt key is reported and gets the name that
/// was meant, so that what it holds is checked too and nothing misses it.
void check_structure(Node& node, const nlohmann::ordered_json& schema, const std::string& document, FaultList& faults,
                     const std::string& path = {});

/// Adds what is absent and has a default, so that readers need none of their own.
void fill_defaults(Node& node, const nlohmann::ordered_json& schema);

}  // namespace grapnel
