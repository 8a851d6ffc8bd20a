#pragma once

/// @file
/// What of a number's variance several inputs explain together.

#include <cstdint>
#include <span>
#include <vector>

#include "grapnel/campaign/sensitivity.hpp"

namespace grapnel {

/// The variance of a number that goes with a group of inputs: Var(E[y|x1 ... xd]) / Var(y), of which neighbours in many
/// dimensions tell little, as far as a quadratic function of the inputs has it. That is the share of the variance of
/// the least squares fit, less what chance adds to it (adjusted R^2, Ezekiel 1930): a lower bound but for chance, exact
/// for what is quadratic, a half to nine tenths of what is yes or no.
class GroupSensitivity {
 public:
  /// Of groups with more inputs no products are in the fit.
  static constexpr std::size_t kMostCrossed = 12;

  /// `inputs`: of each its numbers, all with as many rows.
  explicit GroupSensitivity(const std::vector<std::vector<double>>& inputs);

  /// Of one number, NaN where it does not exist. The error is that of a squared multiple correlation (Olkin and Finn
  /// 1995). NaN where y is constant or rows are fewer than ten and twice the terms of the fit. No rank correlation.
  Sensitivity of(std::span<const double> y);

 private:
  void fit_rows(const std::vector<std::uint8_t>& used);

  std::vector<std::vector<double>> terms_;  // per term its numbers; NaN where an input does not exist
  std::vector<std::uint8_t> used_;          // rows of `basis_`
  std::vector<std::vector<double>> basis_;  // orthonormal, of the rows used, without their means
};

}  // namespace grapnel
