#include "grapnel/plan/measure.hpp"

#include <Eigen/SVD>
#include <cmath>

namespace grapnel {
namespace {

// -sum log sigma over goals of the generalized Jacobian's rows: velocity, and spin where the goal has an orientation.
double lost_manipulability(FloatingBase& base, std::span<const Goal> goals, std::span<const double> theta) {
  base.place(theta);
  double sum = 0;
  Matrix6Xd J;
  for (const Goal& g : goals) {
    base.generalized_jacobian(g.frame, J);
    const bool spin = g.orientation != Goal::Orientation::free;
    const Eigen::MatrixXd rows = spin ? Eigen::MatrixXd(J) : Eigen::MatrixXd(J.bottomRows(3));
    const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues();
    // What a planar arm can never do does not count.
    for (double s : sigma) {
      if (s > 1e-9 * sigma[0]) sum -= std::log(s);
    }
  }
  return sum;
}

}  // namespace

double Measure::value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> theta,
                      std::vector<double>* gradient) const {
  const std::size_t n = theta.size();
  if (gradient) gradient->assign(n, 0.0);
  double sum = 0;
  switch (kind) {
    case Kind::excursion:
    case Kind::nearest:
      for (std::size_t j = 0; j < n; ++j) {
        const double d = theta[j] - reference[j];
        sum += 0.5 * d * d;
        if (gradient) (*gradient)[j] = d;
      }
      return sum;
    case Kind::limits:
      for (std::size_t j = 0; j < n; ++j) {
        const double range = upper[j] - lower[j];
        if (!std::isfinite(range) || range <= 0) continue;
        const double d = (theta[j] - 0.5 * (lower[j] + upper[j])) / range;
        sum += 0.5 * d * d;
        if (gradient) (*gradient)[j] = d / range;
      }
      return sum;
    case Kind::as_found:
      return 0;
    case Kind::manipulability:
      break;
  }
  if (gradient) {
    constexpr double kStep = 1e-6;
    std::vector<double> x(theta.begin(), theta.end());
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = theta[j] + kStep;
      const double above = lost_manipulability(base, goals, x);
      x[j] = theta[j] - kStep;
      (*gradient)[j] = (above - lost_manipulability(base, goals, x)) / (2 * kStep);
      x[j] = theta[j];
    }
  }
  return lost_manipulability(base, goals, theta);
}

}  // namespace grapnel
