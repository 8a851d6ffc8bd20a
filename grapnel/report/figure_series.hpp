#pragma once

/// @file
/// Figures of quantities over time.

#include <string>
#include <vector>

#include "grapnel/report/figure.hpp"
#include "grapnel/report/run_source.hpp"

namespace grapnel {

/// What a folder offers to `--what`.
struct FigureOffer {
  std::string what, about;
};

/// Those of quantities over time that this run has recorded.
std::vector<FigureOffer> series_offers(const RunSource& run);

/// One of them. Throws std::runtime_error if the run has not recorded it, or no sample lies in the range asked for.
Figure series_figure(const RunSource& run, const FigureRequest& request);

}  // namespace grapnel
