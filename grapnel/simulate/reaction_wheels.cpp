#include "grapnel/simulate/reaction_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// Tolerances relative to the maximum rate. Events are found to rounding, and a held wheel has exactly its maximum rate;
// a free wheel beyond kSlack has reached its maximum rate again.
constexpr double kAtLimit = 1e-11, kSlack = 1e-12;
// Axes whose component outside the others' plane is below this count as in the plane.
constexpr double kInRange = 1e-9;

// Rows of A^+ for the participating wheels; zero for the others.
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
    : wheels_(std::move(wheels)), modes_(wheels_.size(), Mode::free), signs_(wheels_.size(), 1.0) {
  for (const ReactionWheel& wheel : wheels_) {
    if (!(std::abs(norm(wheel.axis) - 1) < 1e-9) || !(wheel.torque > 0) || !(wheel.rate > 0))
      throw std::invalid_argument("WheelArray: axes must be unit vectors, and limits positive");
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
    modes_[i] = relative > 1 + kAtLimit ? Mode::beyond : relative >= 1 - kAtLimit ? Mode::held : Mode::free;
  }
  share_among_free();
}

void WheelArray::set_mode(std::size_t wheel, Mode mode) {
  modes_[wheel] = mode;
  share_among_free();
}

// Modes => rows of A^+ (17.2) of the free wheels and, for each other wheel, the rows with that wheel included (17.3).
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

// The largest factor up to 1 with which no motor exceeds its torque.
double WheelArray::factor(const std::vector<Vector3d>& rows, const Vector3d& torque) const {
  double factor = 1;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double u = std::abs(dot(rows[i], torque));
    if (u > wheels_[i].torque) factor = std::min(factor, wheels_[i].torque / u);
  }
  return factor;
}

// Torque on the base [N m] => motor efforts: wheels beyond their maximum rates only slow down; the free ones share the
// rest by (17.2). A wheel that is tried free shares as well.
void WheelArray::drive(const Vector3d& torque, std::span<double> effort) {
  // The torque of braking wheels beyond their rates, which reduces that of the others.
  Vector3d rest = torque;
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (mode(i) != Mode::beyond) continue;
    const double asked = -factor(with_it_[i], torque) * dot(with_it_[i][i], torque);
    const double u = signs_[i] * std::min(0.0, signs_[i] * asked);
    effort[wheels_[i].joint] = u;
    rest += u * wheels_[i].axis;
  }
  const std::vector<Vector3d>& rows = tried_ ? with_it_[*tried_] : shares_;
  const double common = factor(rows, rest);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (mode(i) == Mode::free) effort[wheels_[i].joint] = -common * dot(rows[i], rest);
  }
}

void WheelArray::drive_each(std::span<const double> torques, std::span<double> effort) const {
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    const double told = torques.empty() ? 0 : torques[i];
    double u = std::clamp(told, -wheels_[i].torque, wheels_[i].torque);
    if (mode(i) == Mode::beyond) u = signs_[i] * std::min(0.0, signs_[i] * u);
    if (mode(i) != Mode::held) effort[wheels_[i].joint] = u;
  }
}

// Desired wheel torques => efforts plus their projection (1 - A^+ A) u on the free wheels (18.7), scaled by one factor
// to the remaining motor torques. The torque on the base does not change.
void WheelArray::add_in_null_space(std::span<const double> torques, std::span<double> effort) const {
  const std::vector<Vector3d>& rows = tried_ ? with_it_[*tried_] : shares_;
  Vector3d given = Vector3d::zero();  // A u of the free wheels
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (mode(i) == Mode::free) given += torques[i] * wheels_[i].axis;
  }
  double factor = 1;
  std::vector<double> part(wheels_.size(), 0.0);
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (mode(i) != Mode::free) continue;
    part[i] = torques[i] - dot(rows[i], given);
    const double u = effort[wheels_[i].joint], most = wheels_[i].torque;
    const double room = part[i] > 0 ? most - u : most + u;
    if (std::abs(part[i]) > room) factor = std::min(factor, std::max(room, 0.0) / std::abs(part[i]));
  }
  for (std::size_t i = 0; i < wheels_.size(); ++i) {
    if (mode(i) == Mode::free) effort[wheels_[i].joint] += factor * part[i];
  }
}

Vector3d WheelArray::momentum(std::span<const double> rates) const {
  Vector3d momentum = Vector3d::zero();
  for (std::size_t i = 0; i < rates.size(); ++i) momentum += (wheels_[i].inertia * rates[i]) * wheels_[i].axis;
  return momentum;
}

Vector3d WheelArray::torque_of(std::span<const double> effort) const {
  Vector3d torque = Vector3d::zero();
  for (const ReactionWheel& wheel : wheels_) torque -= effort[wheel.joint] * wheel.axis;
  return torque;
}

double WheelArray::margin(std::size_t wheel, std::span<const double> v) const {
  const double left = 1 + kSlack - std::abs(v[wheels_[wheel].velocity]) / wheels_[wheel].rate;
  return modes_[wheel] == Mode::beyond ? -left : left;
}

double WheelArray::driving_on(std::size_t wheel, std::span<const double> acceleration) const {
  return signs_[wheel] * acceleration[wheels_[wheel].velocity] / wheels_[wheel].rate;
}

double lacking_torque(std::span<const Vector3d> wheel_axes, const Vector3d& axis) {
  const std::vector<Vector3d> rows = pseudo_inverse_rows(wheel_axes, std::vector<bool>(wheel_axes.size(), true));
  Vector3d left = axis;
  for (std::size_t i = 0; i < wheel_axes.size(); ++i) left -= dot(rows[i], axis) * wheel_axes[i];
  return norm(left);
}

}  // namespace grapnel
