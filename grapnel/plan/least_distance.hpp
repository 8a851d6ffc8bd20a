#pragma once

/// @file
/// The nearest of the points that keep linear inequalities.

#include <Eigen/Core>

namespace grapnel {

/// Of the rows' mean square, what e^2 of (1) is where a row that can be kept is to be kept.
inline constexpr double kGiving = 1e-9;

struct LeastDistance {
  Eigen::VectorXd x;
  double left = 0;  // by which all rows have to give way for there to be such a point; 0 where they need not
};

/// The x nearest to c with A x <= b + left, left as small as it gets. A program in x and e^-1 left, e small,
///   min |x - c|^2 / 2 + (left / e)^2 / 2   with   A x - left <= b                                                  (1)
/// is solved in its multipliers l >= 0, x = c - A^T l and left = e^2 sum l, by active sets [Lawson and Hanson 1974,
/// chapter 23]. Where the rows can be kept, `left` is of the order of 1e-9 of what they ask for and not of interest.
LeastDistance nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c,
                            double giving = kGiving);

}  // namespace grapnel
