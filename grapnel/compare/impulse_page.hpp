#pragma once

/// @file
/// The page of impulses from a log (web/src/impulses_page.ts).

#include "grapnel/compare/measured_impulses.hpp"
#include "grapnel/report/report_data.hpp"

namespace grapnel {

/// The data of the page: the report, and the curves of momentum.
ReportData impulse_page_data(const MeasuredImpulses& impulses);

}  // namespace grapnel
