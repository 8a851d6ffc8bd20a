#include "grapnel/impact/least_impulse.hpp"

#include <algorithm>

namespace grapnel {
namespace {

// What an impulse about C in C's axes does to the lone body, at C: J_t M_t^-1 J_t^T P.
Twistd response(const LoneBody& body, const Posed& X_bC, const Impulsed& P_C) {
  const Vector3d r = X_bC.p - body.com;
  const Impulsed P = X_bC.R * P_C;
  const Vector3d turn = body.inverse_inertia * (P.angular + cross(r, P.linear));
  return transposed_times(X_bC.R, Twistd{turn, body.inverse_mass * P.linear + cross(turn, r)});
}

}  // namespace

LeastImpulse::LeastImpulse(int rows)
    : rows_(rows),
      self_stress_(static_cast<std::size_t>(rows * rows)),
      weighted_(self_stress_),
      scaled_(static_cast<std::size_t>(rows)),
      right_(scaled_),
      z_(scaled_),
      ignored_(scaled_),
      small_(rows) {}

// D x in the rows' units.
void LeastImpulse::multiply_by_metric(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
                                      std::span<const LoneBody> targets, std::span<const double> x,
                                      std::span<double> product) const {
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const LoopPath& path = paths[k];
    Impulsed P = Impulsed::zero();
    for (int r = 0; r < path.angular_count; ++r)
      P.angular += path.angular_scale * x[path.first_row + r] * path.angular_rows[r];
    for (int r = 0; r < 3; ++r) P.linear[r] = path.linear_scale * x[path.first_row + path.angular_count + r];
    const std::span<double> part = product.subspan(path.first_row, path.rows);
    take_rows(path, response(targets[k], places[k].X_bC, P), part);
    for (int r = 0; r < path.rows; ++r) part[r] *= path.scale(r);
  }
}

void LeastImpulse::choose(const PivotedCholesky& factor, std::span<const LoopPath> paths,
                          std::span<const LoopPlace> places, std::span<const LoneBody> targets, std::span<double> P) {
  const int count = rows_ - factor.rank();
  if (count <= 0) return;
  const auto size = static_cast<std::size_t>(rows_);
  for (const LoopPath& path : paths) {
    for (int r = 0; r < path.rows; ++r) scaled_[path.first_row + r] = P[path.first_row + r] / path.scale(r);
  }
  // Rows of `small_` beyond the self-stresses are those of the identity.
  const std::span<double> A = small_.matrix();
  std::fill(A.begin(), A.end(), 0.0);
  for (int k = 0; k < rows_; ++k) A[static_cast<std::size_t>(k * rows_ + k)] = 1, right_[k] = 0;
  for (int k = 0; k < count; ++k) {
    const std::span<double> n = std::span(self_stress_).subspan(k * size, size);
    const std::span<double> Dn = std::span(weighted_).subspan(k * size, size);
    factor.null_vector(k, n);
    multiply_by_metric(paths, places, targets, n, Dn);
    for (int i = 0; i < rows_; ++i) right_[k] -= Dn[i] * scaled_[i];
    for (int l = 0; l <= k; ++l) {
      double sum = 0;
      for (int i = 0; i < rows_; ++i) sum += Dn[i] * at(self_stress_, l, i);
      A[static_cast<std::size_t>(k * rows_ + l)] = A[static_cast<std::size_t>(l * rows_ + k)] = sum;
    }
  }
  small_.factor(0);
  small_.solve(right_, z_, ignored_);
  for (const LoopPath& path : paths) {
    for (int r = 0; r < path.rows; ++r) {
      double sum = 0;
      for (int k = 0; k < count; ++k) sum += at(self_stress_, k, path.first_row + r) * z_[k];
      P[path.first_row + r] += path.scale(r) * sum;
    }
  }
}

}  // namespace grapnel
