#pragma once

/// @file
/// The impulses of a capture as bars.

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_source.hpp"

namespace grapnel {

/// Whether the run's summary.json has impulses.
bool has_impulses(const RunSource& run);

/// A pair of bars per grasp and impact: impulse and angular impulse, those as published beside them where there are
/// any. Throws std::runtime_error if there was no impact.
Figure impulse_figure(const RunSource& run, const FigureRequest& request);

}  // namespace grapnel
