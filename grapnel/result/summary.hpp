#pragma once

/// @file
/// summary.json: one capture's results as text, and its contract: the schema, the page docs/formats/summary.md, the
/// viewer's types. All follow from the descriptions in result_fields.hpp.

#include <string>
#include <string_view>

#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// Pretty JSON with keys in a fixed order and a newline at the end. Numbers read back to the same double; NaN and
/// infinities, which JSON lacks, become null. Phases that did not happen are absent. `version`: of Grapnel.
std::string summary_json(const CaptureResult& result, std::string_view version);

/// The JSON Schema of the file.
std::string summary_schema();
/// Its types in TypeScript: web/src/summary_types.ts.
std::string summary_types();
/// docs/formats/summary.md with its tables remade. @throws std::runtime_error where the page lacks the place of one.
std::string summary_page(std::string_view page);

}  // namespace grapnel
