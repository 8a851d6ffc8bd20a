#pragma once

/// @file
/// Figures of sweeps: a quantity against one axis, a line per value of another, or a heat map over two.

#include <string>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/study_source.hpp"

namespace grapnel {

/// impulse-map. Without request.columns: every grasp's impulse_magnitude, else the first column. Axes beyond the second
/// are shown at their first value, and the data file's head says so. Two numeric axes make a heat map if asked for, or
/// if the second has more values than lines can be told apart (12). Throws std::runtime_error naming what there is
/// where the request names an axis or a column that the study lacks.
Figure study_figure(const StudySource& study, const FigureRequest& request);

}  // namespace grapnel
