#include "grapnel/simulate/reaction_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// Of the largest rate. Events are found to rounding, and what holds a wheel sets its rate exactly; beyond kSlack a
// wheel that is free has come to its largest rate again.
constexpr double kAtLimit = 1e-11, kSlack = 1e-12;
// Of the largest rate [1/s]: less is no driving on.
constexpr double kDrivingOn = 1e-9;
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
      at_limit_(wheels_.size()),
      settled_(wheels_.size()),
      asked_(wheels_.size()) {
  for (const ReactionWheel& wheel : wheels_) {
    if (!(std::abs(norm(wheel.axis) - 1) < 1e-9) || !(wheel.torque > 0) || !(wheel.rate > 0))
      throw std::invalid_argument("WheelArray: axes are unit vectors, and limits positive");
  }
  share_among_free();
}

bool WheelArray::any_held() const { return std::find(modes_.begin(), modes_.end(), Mode::held) != modes_.end(); }

bool WheelArray::has_rate_limits() const {
  return std::any_of(wheels_.begin(), wheels_.end(), [](const ReactionWheel& w) { return std::isfinite(w.rate); });
}

void WheelArray::take_modes(std::span<const double> v) {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double rate = v[wheels_[i].velocity], relative = std::abs(rate) / wheels_[i].rate;
    signs_[i] = sign_of(rate);
    at_limit_[i] = relative >= 1 - kAtLimit && relative <= 1 + kAtLimit;
    settled_[i] = false;
    modes_[i] = at_limit_[i] ? Mode::held : relative > 1 ? Mode::beyond : Mode::free;
  }
  share_among_free();
}

bool WheelArray::settle_one(std::span<const double> holding, std::span<const double> acceleration) {
  std::size_t freed = wheels_.size();
  double least = 0;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const ReactionWheel& wheel = wheels_[i];
    if (modes_[i] == Mode::free && at_limit_[i] && signs_[i] * acceleration[wheel.velocity] > kDrivingOn * wheel.rate) {
      // What others give has changed with its mode: it stays held until modes are chosen again.
      modes_[i] = Mode::held, settled_[i] = true;
      share_among_free();
      return true;
    }
    const double beyond_holding = signs_[i] * (asked_[i] - holding[wheel.joint]);
    if (modes_[i] == Mode::held && !settled_[i] && beyond_holding <= least) freed = i, least = beyond_holding;
  }
  if (freed == wheels_.size()) return false;
  modes_[freed] = Mode::free;
  share_among_free();
  return true;
}

void WheelArray::share_among_free() {
  const std::vector<Vector3d> axes = axes_of(wheels_);
  std::vector<bool> shares(wheels_.size());
  for (std::size_t i = 0; i < wheels_.size(); ++i) shares[i] = modes_[i] == Mode::free;
  shares_ = pseudo_inverse_rows(axes, shares);
  with_it_.assign(wheels_.size(), {});
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (shares[i]) continue;
    shares[i] = true;
    with_it_[i] = pseudo_inverse_rows(axes, shares);
    shares[i] = false;
  }
}

// With which no motor exceeds its torque.
double WheelArray::factor(const std::vector<Vector3d>& rows, const Vector3d& torque) const {
  double factor = 1;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double u = std::abs(dot(rows[i], torque));
    if (u > wheels_[i].torque) factor = std::min(factor, wheels_[i].torque / u);
  }
  return factor;
}

void WheelArray::drive(const Vector3d& torque, std::span<double> effort) {
  const double common = factor(shares_, torque);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const std::vector<Vector3d>& rows = modes_[i] == Mode::free ? shares_ : with_it_[i];
    asked_[i] = -(modes_[i] == Mode::free ? common : factor(rows, torque)) * dot(rows[i], torque);
    if (modes_[i] == Mode::free) effort[wheels_[i].joint] = asked_[i];
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
    const double left = 1 + kSlack - std::abs(v[wheel.velocity]) / wheel.rate;
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
