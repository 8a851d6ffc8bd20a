#include "grapnel/control/sampled_loop.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr double kGrows = 1e-9;  // tolerance of a growth factor for rounding error
constexpr int kMaxPeriodsOfDelay = 8;

// The columns of B = L L^T, without immovable directions, as of closed loops. With x = L y the loop is y'' = -L^T (K_p
// x + K_d x').
Eigen::MatrixXd factor_of(const Eigen::MatrixXd& response) {
  constexpr double kImmobile = 1e-10;  // of the largest eigenvalue
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(Eigen::MatrixXd(0.5 * (response + response.transpose())));
  const Eigen::VectorXd& values = solver.eigenvalues();  // increasing
  Eigen::Index first = 0;
  while (first < values.size() && !(values[first] > kImmobile * values[values.size() - 1])) ++first;
  const Eigen::Index rank = values.size() - first;
  return solver.eigenvectors().rightCols(rank) * values.tail(rank).cwiseSqrt().asDiagonal();
}

// Transition of [y; y'; delayed accelerations, latest last] from tick to tick.
Eigen::MatrixXd transition(const SampledLoop& loop) {
  const Eigen::MatrixXd L = factor_of(loop.response);
  const Eigen::Index n = L.cols();
  if (n == 0) return {};
  const double T = loop.timing.period;
  const double periods = std::min(loop.timing.delay / T, static_cast<double>(kMaxPeriodsOfDelay));
  const int whole = static_cast<int>(periods * (1 + 1e-12));
  const double late = std::max(0.0, (periods - whole) * T), rest = T - late;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  // The last `waiting` accelerations are part of the state; that of this tick follows from y and y'.
  const int waiting = whole + 1;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n * (2 + waiting), n * (2 + waiting));
  A.block(0, 0, n, n) = one, A.block(0, n, n, n) = T * one, A.block(n, n, n, n) = one;
  Eigen::MatrixXd now(n, 2 * n);
  now << -(L.transpose() * loop.kp.asDiagonal() * L), -(L.transpose() * loop.kd.asDiagonal() * L);
  // An acceleration that acts for `duration`, ending `after` before the next tick. `age`: ticks since it was computed;
  // 0: this tick.
  const auto act = [&](int age, double duration, double after) {
    if (!(duration > 0)) return;
    const double moved = duration * (after + 0.5 * duration);
    if (age == 0) {
      A.block(0, 0, n, 2 * n) += moved * now;
      A.block(n, 0, n, 2 * n) += duration * now;
    } else {
      const Eigen::Index column = n * (2 + waiting - age);
      A.block(0, column, n, n) += moved * one;
      A.block(n, column, n, n) += duration * one;
    }
  };
  act(whole + 1, late, rest);
  act(whole, rest, 0);
  for (int k = 0; k + 1 < waiting; ++k) A.block(n * (2 + k), n * (3 + k), n, n) = one;
  A.block(n * (1 + waiting), 0, n, 2 * n) = now;
  return A;
}

}  // namespace

// Loop => spectral radius of its transition per sample, from 40 squarings of the matrix; 0 without gains or mobility.
double growth_per_tick(const SampledLoop& loop) {
  if (loop.kp.size() == 0) return 0;
  Eigen::MatrixXd A = transition(loop);
  if (A.size() == 0) return 0;
  // |A^(2^k)|^(1/2^k) by repeated squaring.
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

// Loop => largest factor of all gains up to 1 with a stable loop: halving down to 1e-6, then bisection to 12 bits; 0 if
// none is stable.
double largest_stable_share(const SampledLoop& loop) {
  const auto is_stable = [&](double share) {
    SampledLoop scaled = loop;
    scaled.kp *= share, scaled.kd *= share;
    return growth_per_tick(scaled) <= 1 + kGrows;
  };
  if (is_stable(1)) return 1;
  // Increases the gains from small ones, which are stable for a loop with sufficient damping.
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
