#pragma once

/// @file
/// Superposed configurations of the whole system.

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_source.hpp"

namespace grapnel {

/// All bodies at some instants, early ones light and late ones dark, with the paths of end-effectors and targets up to
/// the last instant. A panel per phase: those asked for, else those that last. Bodies in the plane are seen along z,
/// others along request.view. Throws std::runtime_error naming what is missing.
Figure strobe_figure(const RunSource& run, const FigureRequest& request);

}  // namespace grapnel
