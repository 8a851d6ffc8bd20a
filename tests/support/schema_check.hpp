#pragma once

/// @file
/// Validation of documents against a JSON Schema, by an independent validator.

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
  /// The errors in a document, each with its location; empty if there are none.
  std::vector<std::string> faults_of(const nlohmann::json& document) const;

 private:
  struct Parsed;
  std::unique_ptr<Parsed> parsed_;
};

/// The same with the published schema of a described document.
template <class Document>
std::vector<std::string> contract_faults(const nlohmann::json& document) {
  static const SchemaCheck check(json_schema(type_of<Document>(), "document"));
  return check.faults_of(document);
}

}  // namespace grapnel::test
