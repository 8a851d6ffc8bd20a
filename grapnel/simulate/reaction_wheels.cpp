#include "grapnel/simulate/reaction_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// Of the largest rate: events are found to about 1e-14 of a step, and what holds a wheel sets its rate exactly.
constexpr double kAtLimit = 1e-9;
// Axes whose part outside the others' plane is less than this count as in it.
constexpr double kInRange = 1e-9;

// Rows of A^+ for the wheels that take part; zero for the others.
std::vector<Vector3d> pseudo_inverse_rows(std::span<const Vector3d> axes, const std::vector<bool>& takes_part) {
  std::vector<Vector3d> rows(axes.size(), Vector3d::zero());
  const auto count = std::count(takes_part.begin(), takes_part.end(), true);
  if (count == 0) return rows;
  Eigen::MatrixXd A(3, count);
  Eigen::Index column = 0;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (!takes_part[i]) continue;
    for (int k = 0; k < 3; ++k) A(k, column) = axes[i][k];
    ++column;
  }
  const Eigen::MatrixXd inverse = pseudo_inverse(A, kInRange);
  column = 0;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    if (!takes_part[i]) continue;
    for (int k = 0; k < 3; ++k) rows[i][k] = inverse(column, k);
    ++column;
  }
  return rows;
}

std::vector<Vector3d> axes_of(const std::vector<ReactionWheel>& wheels) {
  std::vector<Vector3d> axes;
  for (const ReactionWheel& wheel : wheels) axes.push_back(wheel.axis);
  return axes;
}

double sign_of(double x) { return x < 0 ? -1 : 1; }

}  // namespace

WheelArray::WheelArray(std::vector<ReactionWheel> wheels)
    : wheels_(std::move(wheels)),
      modes_(wheels_.size(), Mode::free),
      signs_(wheels_.size(), 1.0),
      asked_(wheels_.size()) {
  for (const ReactionWheel& wheel : wheels_) {
    if (!(std::abs(norm(wheel.axis) - 1) < 1e-9) || !(wheel.torque > 0) || !(wheel.rate > 0))
      throw std::invalid_argument("WheelArray: axes are unit vectors, and limits positive");
  }
  all_ = pseudo_inverse_rows(axes_of(wheels_), std::vector<bool>(wheels_.size(), true));
  shares_ = all_;
}

bool WheelArray::any_held() const { return std::find(modes_.begin(), modes_.end(), Mode::held) != modes_.end(); }

bool WheelArray::has_rate_limits() const {
  return std::any_of(wheels_.begin(), wheels_.end(), [](const ReactionWheel& w) { return std::isfinite(w.rate); });
}

void WheelArray::take_modes(std::span<const double> v) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double rate = v[wheels_[i].velocity], relative = std::abs(rate) / wheels_[i].rate;
    signs_[i] = sign_of(rate);
    modes_[i] = relative > 1 + kAtLimit ? Mode::beyond : relative >= 1 - kAtLimit ? Mode::held : Mode::free;
  }
  share_among_free();
}

bool WheelArray::free_those_asked_to_slow_down(std::span<const double> holding) {
  bool any = false;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (modes_[i] != Mode::held || signs_[i] * (asked_[i] - holding[wheels_[i].joint]) > 0) continue;
    modes_[i] = Mode::free;
    any = true;
  }
  if (any) share_among_free();
  return any;
}

void WheelArray::share_among_free() {
  std::vector<bool> free(wheels_.size());
  for (std::size_t i = 0; i < wheels_.size(); ++i) free[i] = modes_[i] == Mode::free;
  shares_ = pseudo_inverse_rows(axes_of(wheels_), free);
}

void WheelArray::drive(const Vector3d& torque, std::span<double> effort) {
  const auto share = [&](const std::vector<Vector3d>& rows, std::size_t i) { return -dot(rows[i], torque); };
  double factor = 1, factor_of_all = 1;
  const auto cut = [](double u, double limit) { return std::abs(u) > limit ? limit / std::abs(u) : 1.0; };
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    factor = std::min(factor, cut(share(shares_, i), wheels_[i].torque));
    factor_of_all = std::min(factor_of_all, cut(share(all_, i), wheels_[i].torque));
  }
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    asked_[i] = factor_of_all * share(all_, i);
    if (modes_[i] == Mode::free) effort[wheels_[i].joint] = factor * share(shares_, i);
    if (modes_[i] == Mode::beyond) effort[wheels_[i].joint] = signs_[i] * std::min(0.0, signs_[i] * asked_[i]);
  }
}

Vector3d WheelArray::torque_of(std::span<const double> effort) const {
  Vector3d torque = Vector3d::zero();
  for (const ReactionWheel& wheel : wheels_) torque -= effort[wheel.joint] * wheel.axis;
  return torque;
}

double WheelArray::margin(std::span<const double> v, std::span<const double> holding) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const ReactionWheel& wheel = wheels_[i];
    if (!std::isfinite(wheel.rate)) continue;
    const double left = 1 - std::abs(v[wheel.velocity]) / wheel.rate;
    const double scale = std::isfinite(wheel.torque) ? wheel.torque : 1;
    switch (modes_[i]) {
      case Mode::free:
        least = std::min(least, left);
        break;
      case Mode::beyond:
        least = std::min(least, -left);
        break;
      case Mode::held:
        least = std::min(least, signs_[i] * (asked_[i] - holding[wheel.joint]) / scale);
        break;
    }
  }
  return std::isfinite(least) ? least : 1;
}

double lacking_torque(std::span<const Vector3d> wheel_axes, const Vector3d& axis) {
  const std::vector<Vector3d> rows = pseudo_inverse_rows(wheel_axes, std::vector<bool>(wheel_axes.size(), true));
  Vector3d left = axis;
  for (std::size_t i = 0; i < wheel_axes.size(); ++i) left -= dot(rows[i], axis) * wheel_axes[i];
  return norm(left);
}

}  // namespace grapnel
