#include "grapnel/result/summary.hpp"

#include "grapnel/describe/contract.hpp"
#include "grapnel/describe/json.hpp"
#include "grapnel/result/json_text.hpp"
#include "grapnel/result/result_fields.hpp"

namespace grapnel {

std::string summary_json(const CaptureResult& result, std::string_view version) {
  return json_text(json_of(Summary{result, std::string(version)}));
}

std::string summary_schema() { return json_schema(type_of<Summary>(), "Grapnel summary, version 2"); }

std::string summary_types() {
  return typescript_types(type_of<Summary>(),
                          "Made by scripts/tables from the descriptions in grapnel/result: change those.");
}

std::string summary_page(std::string_view page) { return page_with_tables(page, type_of<Summary>()); }

}  // namespace grapnel
