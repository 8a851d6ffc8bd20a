#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/impact/contact_path_motion.hpp"
#include "grapnel/impact/friction_at_rest.hpp"

namespace grapnel {

// The stiff step of PathMotion, for contacts that slide slowly, come to rest or begin to slide. Friction aligns with
// its direction in a time of |u_t|/(mu f W), which explicit methods cannot resolve, and several contacts can change
// between sticking and sliding at almost the same time. Friction is implicit and set-valued, a convex problem of all
// contacts in every substep (the time stepping of Moreau), so no such change must be located. Extrapolation over the
// number of substeps gives order kColumns where the step is smooth (Deuflhard's method; Hairer and Wanner, Solving
// Ordinary Differential Equations II, IV.9). Across a change the error is of second order in the step, which then
// becomes short.

namespace {
constexpr int kFewestColumns = 3, kColumns = static_cast<int>(PathMotion::kStiffColumns);
constexpr double kKink = 1e9;  // error reported if extrapolation fails: the step must be much shorter
}  // namespace

// Touching contacts with friction, and the response of their tangential velocities to it.
void PathMotion::prepare_stiff() {
  rubbing_.clear();
  for (int i = 0; i < count_; ++i) {
    if (touches(i) && friction(i) > 0) rubbing_.push_back(i);
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rubbing_.size());
  rub_.resize(2 * m, 2 * m), rub_rate_.resize(2 * m), rub_radius_.resize(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      rub_.block<2, 2>(2 * i, 2 * j) =
          W_.block<2, 2>(3 * rubbing_[static_cast<std::size_t>(i)] + 1, 3 * rubbing_[static_cast<std::size_t>(j)] + 1);
    }
  }
  // Extrapolated quantities must be smooth, including shares of redundant contacts.
  rub_choice_ = mobility_of(rubbing_).redundant ? FrictionChoice::middle : FrictionChoice::any;
}

// One substep from now() + `increment`, in place: f_1 = f_0 + h f'(u_0), then friction with u_1 = u_0 + h W F, which is
// (11.5) with velocities for rates. `l`: friction, initial guess and result. The work of friction uses u_1, that of
// normal forces the mean.
void PathMotion::moreau(double h, PathState& increment, Eigen::VectorXd& l) {
  const int n = count_;
  u_ = now_.u;
  u_.noalias() += W_ * increment.segment(n, 3 * n);
  force_.setZero(3 * n);
  for (int i = 0; i < n; ++i) {
    if (touches(i)) force_[3 * i] = now_.y[i] + increment[i] + h * force_rate(i, u_[3 * i]);
  }
  const Eigen::Index m = static_cast<Eigen::Index>(rubbing_.size());
  for (Eigen::Index k = 0; k < m; ++k) {
    const int i = rubbing_[static_cast<std::size_t>(k)];
    rub_rate_.segment<2>(2 * k) = u_.segment<2>(3 * i + 1) - contact(i).offset;
    rub_rate_.segment<2>(2 * k).noalias() += h * (W_.middleRows<2>(3 * i + 1) * force_);
    rub_radius_[k] = friction(i) * std::max(0.0, force_[3 * i]);
  }
  if (m > 0) {
    remove_rounding(rub_rate_, u_.norm() + h * force_.norm());
    const FrictionForces forces = friction_at_rest(h * rub_, rub_rate_, rub_radius_, l, rub_choice_);
    l = forces.force;
    count(forces);
  }
  for (Eigen::Index k = 0; k < m; ++k) {
    force_.segment<2>(3 * rubbing_[static_cast<std::size_t>(k)] + 1) = l.segment<2>(2 * k);
  }
  end_rate_.noalias() = h * (W_ * force_);
  increment.segment(n, 3 * n) += h * force_;
  for (int i = 0; i < n; ++i) {
    if (!touches(i)) continue;
    const double f = force_[3 * i], work = h * f * (u_[3 * i] + 0.5 * end_rate_[3 * i]);
    increment[i] = f - now_.y[i];
    if (contact(i).phase == NormalPhase::loading) increment[4 * n + i] += h * f, increment[5 * n + i] += work;
    increment[6 * n + i] += work;
    const Eigen::Vector2d u_t = u_.segment<2>(3 * i + 1) + end_rate_.segment<2>(3 * i + 1);
    increment[7 * n + i] += h * force_.segment<2>(3 * i + 1).dot(u_t);
  }
}

// Difference between the work of forces and of impulses: an estimate that does not depend on agreement of the columns.
double PathMotion::unexplained(const PathState& increment) const {
  const auto impulse = increment.segment(count_, 3 * count_);
  return std::abs(impulse.dot(now_.u + 0.5 * (W_ * impulse)) - increment.tail(2 * count_).sum()) / problem_.tolerance;
}

// Step h => error relative to the tolerance, at most 1 if accepted; the end point is in end_. Moreau's substeps
// (docs/theory, section 11, Numerical solution), extrapolated over 1, 2, ... substeps. Returns kKink if the columns
// stop converging.
double PathMotion::try_stiff_step(double h) {
  prepare_stiff();
  end_rates_known_ = false;
  Eigen::VectorXd first(2 * static_cast<Eigen::Index>(rubbing_.size()));
  for (std::size_t k = 0; k < rubbing_.size(); ++k) {
    first.segment<2>(2 * static_cast<Eigen::Index>(k)) = now_.rate.segment<2>(count_ + 3 * rubbing_[k] + 1);
  }
  // Extrapolates increments instead of states: their rounding errors are small for small steps. Aitken-Neville: row j
  // holds the results of 1, 2, ..., j + 1 substeps extrapolated.
  std::array<PathState, kStiffColumns> row;
  Eigen::VectorXd l;
  double error = std::numeric_limits<double>::infinity();
  for (int j = 0; j < kColumns; ++j) {
    PathState y = PathState::Zero(now_.y.size());
    l = first;
    for (int k = 0; k <= j; ++k) moreau(h / (j + 1), y, l);
    for (int m = 1; m <= j; ++m) {
      PathState& last = row[static_cast<std::size_t>(m - 1)];
      difference_ = (y - last) / ((j + 1.0) / (j + 1 - m) - 1);
      last = y;
      y += difference_;
    }
    row[static_cast<std::size_t>(j)] = y;
    if (j == 0) continue;
    difference_ = y - row[static_cast<std::size_t>(j - 1)];
    const double now = error_size(difference_);
    end_.y = now_.y + y;
    end_.u = before_;
    end_.u.noalias() += W_ * end_.y.segment(count_, 3 * count_);
    if (j + 1 >= kFewestColumns && now <= 1) return std::max(now, unexplained(y));
    if (j + 1 > kFewestColumns && now > 0.5 * error) return kKink;
    error = now;
  }
  return error;
}

}  // namespace grapnel
