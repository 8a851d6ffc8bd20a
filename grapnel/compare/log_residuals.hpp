#pragma once

/// @file
/// The residuals of a log as a vector of uncorrelated numbers with variance 1.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "grapnel/compare/log_fit.hpp"

namespace grapnel {

using Quantities = std::vector<ComparedQuantity>;

/// Per quantity and sample: whether the fit uses it.
using Selection = std::vector<std::vector<bool>>;

/// The samples that compare uses, of quantities with an uncertainty. With a fitted clock, samples within one interval
/// of a jump or of an end of the run are left out, since the fit could move them to the other side.
Selection selected_samples(const FittedLog& log, const Quantities& quantities, const LogClock& clock);

/// A clock to begin with, of this drift.
LogClock first_clock(const FittedLog& log, const Quantities& quantities, double drift);

/// Residuals of selected samples, or derivatives of them.
struct WhiteResiduals {
  Eigen::VectorXd white;  ///< (26.3)
  Eigen::VectorXd means;  ///< of each component of each quantity with an uncertainty
};

/// A sample that a trial of the clock moves beyond an end of the run is compared with the value there, so that the
/// search may continue; the selection at the end omits it. Empty if a selected sample has no residual.
std::optional<WhiteResiduals> white_residuals(const Quantities& quantities, const LogClock& clock,
                                              const Selection& selection);
/// Their derivative by the time of the run, times 1, or with `by_drift` times log time - reference.
WhiteResiduals clock_derivative(const Quantities& quantities, const LogClock& clock, const Selection& selection,
                                bool by_drift);

/// The number of independent residuals: a free bias takes one of each component.
double independent_numbers(const Quantities& quantities, const Selection& selection);

/// A component whose mean WhiteResiduals::means holds.
struct MeanOf {
  std::size_t quantity = 0, component = 0;
  double samples = 0;
};
std::vector<MeanOf> means_of(const Quantities& quantities, const Selection& selection);

}  // namespace grapnel
