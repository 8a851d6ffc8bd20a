#pragma once

/// @file
/// Documents against a JSON Schema, as an independent validator sees them.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace grapnel::test {

class SchemaCheck {
 public:
  explicit SchemaCheck(const std::string& schema_text);
  ~SchemaCheck();
  /// What is wrong with a document, each with its place; empty if nothing is.
  std::vector<std::string> faults_of(const nlohmann::json& document) const;

 private:
  struct Parsed;
  std::unique_ptr<Parsed> parsed_;
};

}  // namespace grapnel::test
