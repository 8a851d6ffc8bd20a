#pragma once

/// @file
/// The nearest of the points that keep linear inequalities.

#include <Eigen/Core>
#include <vector>

namespace grapnel {

/// Of the rows' mean square, what e^2 of (1) is where a row that can be kept is to be kept.
inline constexpr double kGiving = 1e-9;

struct LeastDistance {
  Eigen::VectorXd x;
  double left = 0;  // by which all rows have to give way for there to be such a point; 0 where they need not
  Eigen::VectorXd multipliers = {};  // l of (1), per row
};

/// The x nearest to c with A x <= b + left, left as small as it gets. A program in x and e^-1 left, e small,
///   min |x - c|^2 / 2 + (left / e)^2 / 2   with   A x - left <= b                                                  (1)
/// is solved in its multipliers l >= 0, x = c - A^T l and left = e^2 sum l, by active sets [Lawson and Hanson 1974,
/// chapter 23]. Where the rows can be kept, `left` is of the order of 1e-9 of what they ask for and not of interest.
///
/// For several e in turn: each begins with the rows that held the one before, and with their products. The less rows
/// may give way the more of them hold, so it takes least from the largest e down.
class NearestBelow {
 public:
  NearestBelow(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, Eigen::VectorXd c);

  LeastDistance with(double giving);
  /// Begins with these rows, of which most may hold the point.
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

/// For one of them.
LeastDistance nearest_below(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c,
                            double giving = kGiving);

}  // namespace grapnel
