#include "grapnel/result/summary.hpp"

#include "grapnel/describe/json.hpp"
#include "grapnel/result/json_text.hpp"
#include "grapnel/result/result_fields.hpp"

namespace grapnel {

std::string summary_json(const CaptureResult& result, std::string_view version) {
  return json_text(json_of(Summary{result, std::string(version)}));
}

}  // namespace grapnel
