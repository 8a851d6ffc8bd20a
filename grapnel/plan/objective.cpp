#include "grapnel/plan/objective.hpp"

#include <cmath>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// -sum log sigma over goals of the generalized Jacobian's rows: velocity, and spin where the goal has an orientation.
double lost_manipulability(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position) {
  base.place(position);
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

// Half the square of a distance of each joint from a place, over a length.
double half_squares(std::span<const double> position, const std::vector<double>& place, Objective::Gradient* gradient) {
  double sum = 0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double d = position[j] - place[j];
    sum += 0.5 * d * d;
    if (gradient) gradient->position[j] = d;
  }
  return sum;
}

}  // namespace

Objective::Objective(Kind kind, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
                     std::vector<double> upper)
    : kind_(kind), start_(start), guess_(std::move(guess)), lower_(std::move(lower)), upper_(std::move(upper)) {
  if (kind != Kind::excursion) return;
  // Simpson's rule on polynomials of order 8 or a cycloid: 1e-9.
  constexpr int kIntervals = 200;
  double ss = 0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double x = static_cast<double>(i) / kIntervals;
    const double weight = i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2;
    const double s = evaluate(JointPath{start.profile, 1, 0, 1, 0, 0}, x).rate;
    const double e = evaluate(JointPath{start.profile, 1, 0, 0, 0, 1}, x).rate;
    const double b = evaluate(JointPath{start.profile, 1, 0, 0, 1, 0}, x).rate;
    ss += weight * s * s, se_ += weight * s * e, sb_ += weight * s * b;
    ee_ += weight * e * e, eb_ += weight * e * b, bb_ += weight * b * b;
  }
  se_ /= ss, sb_ /= ss, ee_ /= ss, eb_ /= ss, bb_ /= ss;
}

double Objective::excursion(std::span<const double> position, std::span<const double> rate, Gradient* gradient) const {
  const double T = start_.end - start_.begin;
  double sum = 0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double d = position[j] - start_.position[j], b = T * start_.rate[j];
    const double e = rate.empty() ? 0.0 : T * rate[j];
    sum += 0.5 * (d * d + ee_ * e * e + bb_ * b * b) + se_ * d * e + sb_ * d * b + eb_ * e * b;
    if (!gradient) continue;
    gradient->position[j] = d + se_ * e + sb_ * b;
    gradient->rate[j] = T * (ee_ * e + se_ * d + eb_ * b);
  }
  return sum;
}

double Objective::value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
                        std::span<const double> rate, Gradient* gradient) const {
  const std::size_t n = position.size();
  if (gradient) gradient->position.assign(n, 0.0), gradient->rate.assign(n, 0.0);
  double sum = 0;
  switch (kind_) {
    case Kind::excursion:
      return excursion(position, rate, gradient);
    case Kind::nearest:
      return half_squares(position, guess_, gradient);
    case Kind::as_found:
      return 0;
    case Kind::limits:
      for (std::size_t j = 0; j < n; ++j) {
        const double range = upper_[j] - lower_[j];
        if (!std::isfinite(range) || range <= 0) continue;
        const double d = (position[j] - 0.5 * (lower_[j] + upper_[j])) / range;
        sum += 0.5 * d * d;
        if (gradient) gradient->position[j] = d / range;
      }
      return sum;
    case Kind::manipulability:
      break;
  }
  if (gradient) {
    constexpr double kDifference = 1e-6;
    std::vector<double> x(position.begin(), position.end());
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = position[j] + kDifference;
      const double above = lost_manipulability(base, goals, x);
      x[j] = position[j] - kDifference;
      gradient->position[j] = (above - lost_manipulability(base, goals, x)) / (2 * kDifference);
      x[j] = position[j];
    }
  }
  return lost_manipulability(base, goals, position);
}

}  // namespace grapnel
