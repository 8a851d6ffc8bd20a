#pragma once

/// @file
/// The page of a comparison with a log: verdicts, overlays and residuals (web/src/log_page.ts).

#include "grapnel/compare/compare_log.hpp"
#include "grapnel/report/report_data.hpp"

namespace grapnel {

/// The data of the page. Long logs are thinned to at most about 4000 samples per component.
ReportData comparison_page_data(const LogComparison& comparison);

}  // namespace grapnel
