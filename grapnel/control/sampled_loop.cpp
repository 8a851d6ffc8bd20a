#include "grapnel/control/sampled_loop.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

constexpr double kGrows = 1e-9;  // of a factor: less is rounding
constexpr int kMostPeriodsOfDelay = 8;

// [x; x'; efforts still to come, the latest last] from tick to tick.
Eigen::MatrixXd transition(const SampledLoop& loop) {
  const Eigen::Index n = loop.kp.size();
  const double T = loop.timing.period;
  const double periods = std::min(loop.timing.delay / T, static_cast<double>(kMostPeriodsOfDelay));
  const int whole = static_cast<int>(periods * (1 + 1e-12));
  const double late = std::max(0.0, (periods - whole) * T), rest = T - late;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  // The last `waiting` efforts are part of the state; the effort of this tick follows from x and x'.
  const int waiting = whole + 1;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * (2 + waiting), n * (2 + waiting));
  A.block(0, 0, n, n) = one, A.block(0, n, n, n) = T * one, A.block(n, n, n, n) = one;
  Eigen::MatrixXd now(n, 2 * n);
  now << -Eigen::MatrixXd(loop.kp.asDiagonal()), -Eigen::MatrixXd(loop.kd.asDiagonal());
  // An effort that acts for `duration`, ending `after` before the next tick. `age`: ticks ago; 0: of this tick.
  const auto act = [&](int age, double duration, double after) {
    if (!(duration > 0)) return;
    const double moved = duration * (after + 0.5 * duration);
    if (age == 0) {
      A.block(0, 0, n, 2 * n) += moved * loop.response * now;
      A.block(n, 0, n, 2 * n) += duration * loop.response * now;
    } else {
      const Eigen::Index column = n * (2 + waiting - age);
      A.block(0, column, n, n) += moved * loop.response;
      A.block(n, column, n, n) += duration * loop.response;
    }
  };
  act(whole + 1, late, rest);
  act(whole, rest, 0);
  for (int k = 0; k + 1 < waiting; ++k) A.block(n * (2 + k), n * (3 + k), n, n) = one;
  A.block(n * (1 + waiting), 0, n, 2 * n) = now;
  return A;
}

}  // namespace

double growth_per_tick(const SampledLoop& loop) {
  if (loop.kp.size() == 0) return 0;
  Eigen::MatrixXd A = transition(loop);
  // Units: efforts as accelerations times the period.
  const double size = std::max(loop.response.norm(), 1e-300);
  const Eigen::Index n = loop.kp.size(), states = A.rows();
  A.leftCols(2 * n).bottomRows(states - 2 * n) *= size;
  A.rightCols(states - 2 * n).topRows(2 * n) /= size;
  // |A^(2^k)|^(1/2^k), squared again and again.
  constexpr int kSquares = 40;
  double logarithm = 0, power = 1;
  for (int k = 0; k < kSquares; ++k) {
    const double norm = A.norm();
    if (!(norm > 0)) return 0;
    if (!std::isfinite(norm)) return norm;
    logarithm += std::log(norm) / power;
    A /= norm;
    A = Eigen::MatrixXd(A * A), power *= 2;
  }
  return std::exp(logarithm);
}

double largest_stable_share(const SampledLoop& loop) {
  const auto is_stable = [&](double share) {
    SampledLoop scaled = loop;
    scaled.kp *= share, scaled.kd *= share;
    return growth_per_tick(scaled) <= 1 + kGrows;
  };
  if (is_stable(1)) return 1;
  // From small gains up: of a loop with enough damping these are stable.
  double low = 0, high = 1;
  for (double share = 0.5; share > 1e-6; share *= 0.5) {
    if (is_stable(share)) {
      low = share;
      break;
    }
    high = share;
  }
  for (int i = 0; low > 0 && i < 12; ++i) (is_stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

}  // namespace grapnel
