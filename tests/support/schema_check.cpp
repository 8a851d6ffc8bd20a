#include "support/schema_check.hpp"

#include <nlohmann/json.hpp>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>

namespace grapnel::test {

using valijson::adapters::NlohmannJsonAdapter;

struct SchemaCheck::Parsed {
  valijson::Schema schema;
};

SchemaCheck::SchemaCheck(const std::string& schema_text) : parsed_(std::make_unique<Parsed>()) {
  const nlohmann::json json = nlohmann::json::parse(schema_text);
  valijson::SchemaParser parser;
  parser.populateSchema(NlohmannJsonAdapter(json), parsed_->schema);
}

SchemaCheck::~SchemaCheck() = default;

std::vector<std::string> SchemaCheck::faults_of(const nlohmann::json& document) const {
  valijson::Validator validator;
  valijson::ValidationResults results;
  validator.validate(parsed_->schema, NlohmannJsonAdapter(document), &results);
  std::vector<std::string> faults;
  for (valijson::ValidationResults::Error error; results.popError(error);) {
    std::string place;
    for (const std::string& step : error.context) place += step;
    faults.push_back(place + ": " + error.description);
  }
  return faults;
}

}  // namespace grapnel::test
