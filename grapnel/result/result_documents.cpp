#include "grapnel/result/result_documents.hpp"

#include <nlohmann/json.hpp>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/json_document.hpp"

namespace grapnel {

std::string summary_json(const CaptureResult& result, std::string_view version) {
  return json_text(json_of(Summary{&result, std::string(version)}));
}

using Json = nlohmann::ordered_json;

void SourceTexts::add(std::string part, const std::string& text) {
  files.push_back({std::move(part), text.size() <= kLargestText ? text : std::string(), text.size()});
}

std::string source_texts_json(const SourceTexts& texts, std::string_view scenario_name,
                              std::string_view scenario_sha256, std::string_view version) {
  Json files = Json::array();
  for (const SourceTexts::File& file : texts.files)
    files.push_back({{"part", file.part}, {"bytes", file.bytes}, {"text", file.text}});
  return json_text(Json{{"schema", "grapnel-scenario-texts/1"},
                        {"version", version},
                        {"scenario", {{"name", scenario_name}, {"sha256", scenario_sha256}}},
                        {"description", texts.description},
                        {"settings", texts.settings},
                        {"files", std::move(files)}});
}

}  // namespace grapnel
