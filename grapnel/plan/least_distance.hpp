#pragma once

/// @file
/// The point closest to a given one that satisfies linear inequalities.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// e^2 of (1) relative to the mean square of the rows, for rows to be satisfied whenever possible.
inline constexpr double kGiving = 1e-9;

struct LeastDistance {
  Eigen::VectorXd x;
  double left = 0;                   // relaxation of all rows required for a feasible point; 0 if none is needed
  Eigen::VectorXd multipliers = {};  // l of (1), per row
};

/// Minimizes |x - c| subject to A x <= b + left, with the minimum `left`. A program in x and e^-1 left, with small e,
///   min |x - c|^2 / 2 + (left / e)^2 / 2   with   A x - left <= b                                                  (1)
/// is solved for its multipliers l >= 0, x = c - A^T l and left = e^2 sum l, by an active-set method [Lawson and Hanson
/// 1974, chapter 23]. For feasible rows, `left` is of the order of 1e-9 of the rows' right-hand sides and negligible.
///
/// Supports several values of e in turn. Each solution starts from the active rows and row products of the previous
/// one. Smaller e activates more rows, so a descending sequence of e is the cheapest order.
class NearestBelow {
 public:
  NearestBelow(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Eigen::VectorXd c);

  LeastDistance with(double giving);
  /// Sets the initial active rows.
  void begin_with(std::vector<Eigen::Index> rows);

 private:
  Eigen::Index count() const { return rows_of_.cols(); }
  void add(Eigen::Index row);
  void factor();
  void settle();
  const Eigen::VectorXd& products(Eigen::Index row);

  Eigen::MatrixXd rows_of_;  // A^T
  Eigen::VectorXd c_, r_;    // A c - b
  double mean_square_ = 0;   // of the rows
  double square_ = 0;        // e^2
  std::vector<Eigen::Index> active_;
  Eigen::MatrixXd L_;  // lower factor of their products, up to row factored_
  Eigen::Index factored_ = 0;
  Eigen::VectorXd l_;                      // multipliers of the active rows
  std::vector<Eigen::VectorXd> products_;  // A A^T, columns of the rows that were ever active
};

/// Solves (1) for one e.
LeastDistance nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c,
                            double giving = kGiving);

}  // namespace grapnel
