#pragma once

/// @file
/// The figures there are: impulses as bars, quantities over time, sweeps, superposed configurations. A new one is
/// declared here, and offered and made in figure_files.cpp.

#include <string>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_source.hpp"
#include "grapnel/report/study_source.hpp"

namespace grapnel {

// ---- Impulses of a capture as bars ----

/// Whether the run's summary.json has impulses.
bool has_impulses(const RunSource& run);

/// A pair of bars per grasp and impact: impulse and angular impulse, those as published beside them where there are
/// any. Throws std::runtime_error if there was no impact.
Figure impulse_figure(const RunSource& run, const FigureRequest& request);

// ---- Quantities over time ----

/// What a folder offers to `--what`.
struct FigureOffer {
  std::string what, about;
};

/// Those of quantities over time that this run has recorded.
std::vector<FigureOffer> series_offers(const RunSource& run);

/// One of them. Throws std::runtime_error if the run has not recorded it, or no sample lies in the range asked for.
Figure series_figure(const RunSource& run, const FigureRequest& request);

// ---- Sweeps: a quantity against one axis, a line per value of another, or a heat map over two ----

/// impulse-map. Without request.columns: every grasp's impulse_magnitude, else the first column. Axes beyond the second
/// are shown at their first value, and the data file's head says so. Two numeric axes make a heat map if asked for, or
/// if the second has more values than lines can be told apart (12). Throws std::runtime_error naming what there is
/// where the request names an axis or a column that the study lacks.
Figure study_figure(const StudySource& study, const FigureRequest& request);

// Superposed configurations of the whole system.

/// All bodies at some instants, early ones light and late ones dark, with the paths of end-effectors and targets up to
/// the last instant. A panel per phase: those asked for, else those that last. Bodies in the plane are seen along z,
/// others along request.view. Throws std::runtime_error naming what is missing.
Figure strobe_figure(const RunSource& run, const FigureRequest& request);

}  // namespace grapnel
