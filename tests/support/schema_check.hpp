#pragma once

/// @file
/// Documents against a JSON Schema, as an independent validator sees them.

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "grapnel/describe/contract.hpp"

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

/// The same against the published schema of a described document.
template <class Document>
std::vector<std::string> contract_faults(const nlohmann::json& document) {
  static const SchemaCheck check(json_schema(type_of<Document>(), "document"));
  return check.faults_of(document);
}

}  // namespace grapnel::test
