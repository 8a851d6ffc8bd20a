#include "grapnel/simulate/moment_gyros.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

namespace grapnel {
namespace {

// A symmetric matrix by its rows.
using Rows = std::array<Vector3d, 3>;

// A A^T divided by the square of a momentum.
Rows products(std::span<const Vector3d> columns, double momentum) {
  Rows rows{Vector3d::zero(), Vector3d::zero(), Vector3d::zero()};
  for (const Vector3d& c : columns) {
    const Vector3d unit = (1 / momentum) * c;
    for (int i = 0; i < 3; ++i) rows[i] += unit[i] * unit;
  }
  return rows;
}

double determinant(const Rows& m) { return dot(m[0], cross(m[1], m[2])); }

Vector3d solved(const Rows& m, const Vector3d& b) {
  return (1 / determinant(m)) * (b[0] * cross(m[1], m[2]) + b[1] * cross(m[2], m[0]) + b[2] * cross(m[0], m[1]));
}

// With fewer than three columns the determinant is zero up to rounding.
double measure_of(std::span<const Vector3d> columns, double momentum) {
  return columns.size() < 3 ? 0 : std::sqrt(std::max(determinant(products(columns, momentum)), 0.0));
}

double largest_momentum(std::span<const MomentGyro> gyros) {
  double largest = 0;
  for (const MomentGyro& gyro : gyros) largest = std::max(largest, std::abs(gyro.momentum()));
  return largest;
}

}  // namespace

// Gyros and steering => array with storage for h and h' (17.7), per gyro, and the largest momentum, to which (17.9)
// refers. Throws std::invalid_argument for invalid axes, inertia, limits or steering parameters.
GyroArray::GyroArray(std::vector<MomentGyro> gyros, const GyroSteering& steering)
    : gyros_(std::move(gyros)),
      steering_(steering),
      h_(gyros_.size()),
      dh_(gyros_.size()),
      commanded_(gyros_.size()),
      cut_(gyros_.size()) {
  for (const MomentGyro& g : gyros_) {
    if (!(std::abs(norm(g.gimbal_axis) - 1) < 1e-9) || !(std::abs(norm(g.spin_axis) - 1) < 1e-9) ||
        !(std::abs(dot(g.gimbal_axis, g.spin_axis)) < 1e-6) || !(g.inertia > 0) || !std::isfinite(g.momentum()) ||
        g.spin_rate == 0 || !(g.torque > 0) || !(g.rate > 0) || !(g.bandwidth > 0))
      throw std::invalid_argument(
          "GyroArray: axes must be perpendicular unit vectors, inertia, limits and bandwidth positive, spin rates not "
          "zero");
  }
  if (!(steering.near > 0) || !(steering.damping > 0) || !(steering.dither >= 0 && steering.dither < 0.5))
    throw std::invalid_argument("GyroArray: parameters of the steering are out of range");
  if (!gyros_.empty()) largest_ = largest_momentum(gyros_);
}

void GyroArray::take(std::span<const double> q) {
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    h_[i] = momentum_of(gyros_[i], q[gyros_[i].gimbal_coordinate]);
    dh_[i] = cross(gyros_[i].gimbal_axis, h_[i]);
  }
  measure_ = measure_of(dh_, largest_);
  std::fill(commanded_.begin(), commanded_.end(), 0.0);
  std::fill(cut_.begin(), cut_.end(), std::uint8_t{0});
  lacking_ = Vector3d::zero();
}

Vector3d GyroArray::momentum() const {
  Vector3d sum = Vector3d::zero();
  for (const Vector3d& h : h_) sum += h;
  return sum;
}

// (17.8)-(17.10)
void GyroArray::steer(const Vector3d& torque, const Vector3d& w_B, double t) {
  const Vector3d wanted = -(torque + cross(w_B, momentum()));  // required value of A d
  Rows m = products(dh_, largest_);
  if (measure_ < steering_.near) {
    const double apart = 1 - measure_ / steering_.near, lambda = steering_.damping * apart * apart;
    constexpr double kRate = 0.5 * std::numbers::pi;
    const auto e = [&](int i) { return steering_.dither * std::sin(kRate * t + i * kRate); };
    m[0] += lambda * Vector3d{1, e(2), e(1)};
    m[1] += lambda * Vector3d{e(2), 1, e(0)};
    m[2] += lambda * Vector3d{e(1), e(0), 1};
  }
  const Vector3d x = solved(m, (1 / (largest_ * largest_)) * wanted);
  double factor = 1;
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    commanded_[i] = dot(dh_[i], x);
    if (std::abs(commanded_[i]) > gyros_[i].rate) factor = std::min(factor, gyros_[i].rate / std::abs(commanded_[i]));
  }
  lacking_ = -wanted;
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    commanded_[i] *= factor;
    lacking_ += commanded_[i] * dh_[i];
  }
}

void GyroArray::command(std::span<const double> rates) {
  for (std::size_t i = 0; i < gyros_.size(); ++i) commanded_[i] = std::clamp(rates[i], -gyros_[i].rate, gyros_[i].rate);
}

// (17.6)
void GyroArray::prescribe(std::span<const double> v, std::span<std::uint8_t> prescribed,
                          std::span<std::uint8_t> as_commanded, std::span<double> acceleration) {
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    const MomentGyro& g = gyros_[i];
    for (const int at : {g.gimbal_velocity, g.rotor_velocity}) prescribed[at] = as_commanded[at] = 1;
    acceleration[g.gimbal_velocity] = g.bandwidth * (commanded_[i] - v[g.gimbal_velocity]);
    acceleration[g.rotor_velocity] = g.bandwidth * (g.spin_rate - v[g.rotor_velocity]);
  }
}

bool GyroArray::cut(std::span<const double> force, std::span<std::uint8_t> prescribed, std::span<double> effort) {
  bool any = false;
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    const MomentGyro& g = gyros_[i];
    const double needed = force[g.gimbal_velocity];
    if (cut_[i] || !(std::abs(needed) > g.torque)) continue;
    cut_[i] = 1, any = true;
    prescribed[g.gimbal_velocity] = 0;
    effort[g.gimbal] = needed > 0 ? g.torque : -g.torque;
  }
  return any;
}

void GyroArray::conclude(std::span<const double> force, std::span<double> effort) const {
  for (std::size_t i = 0; i < gyros_.size(); ++i) {
    const MomentGyro& g = gyros_[i];
    if (!cut_[i]) effort[g.gimbal] = force[g.gimbal_velocity];
    effort[g.rotor] = force[g.rotor_velocity];
  }
}

Vector3d GyroArray::torque_of(std::span<const double> v, const Vector3d& w_B) const {
  Vector3d torque = -cross(w_B, momentum());
  for (std::size_t i = 0; i < gyros_.size(); ++i) torque -= v[gyros_[i].gimbal_velocity] * dh_[i];
  return torque;
}

Vector3d momentum_of(const MomentGyro& gyro, double angle) { return momentum_of(gyro, angle, gyro.spin_rate); }

Vector3d momentum_of(const MomentGyro& gyro, double angle, double rotor_rate) {
  const Vector3d across = cross(gyro.gimbal_axis, gyro.spin_axis);
  return gyro.inertia * rotor_rate * (std::cos(angle) * gyro.spin_axis + std::sin(angle) * across);
}

double singularity_measure(std::span<const MomentGyro> gyros, std::span<const double> angles) {
  std::vector<Vector3d> columns;
  for (std::size_t i = 0; i < gyros.size(); ++i)
    columns.push_back(cross(gyros[i].gimbal_axis, momentum_of(gyros[i], angles[i])));
  return measure_of(columns, largest_momentum(gyros));
}

// --- Gyros as actuators of the base ---

GyroEffector::GyroEffector(std::vector<MomentGyro> gyros, const std::optional<GyroSteering>& steering, bool one_by_one)
    : gyros_(std::move(gyros), steering.value_or(GyroSteering{})),
      steers_(steering.has_value()),
      one_by_one_(one_by_one) {
  if (steers_ && gyros_.gyros().size() < 3)
    throw std::invalid_argument("GyroEffector: a torque by gyros needs at least three of them");
}

// Each gyro is a rotor in a gimbal on the actuated root, both on free joints.
void GyroEffector::check(const Model& model, int root, std::span<const std::uint8_t> is_free) const {
  for (const MomentGyro& gyro : gyros_.gyros()) {
    const int gimbal = model.joints().at(gyro.gimbal), rotor = model.joints().at(gyro.rotor);
    const Body &on_base = model.bodies()[gimbal], &in_gimbal = model.bodies()[rotor];
    if (on_base.v != gyro.gimbal_velocity || on_base.q != gyro.gimbal_coordinate ||
        in_gimbal.v != gyro.rotor_velocity || in_gimbal.parent != gimbal || (root >= 0 && on_base.parent != root) ||
        !is_free[gyro.gimbal] || !is_free[gyro.rotor])
      throw std::invalid_argument("GyroEffector: a gyro must be a rotor in a gimbal of the root, on free joints");
  }
}

EffectorVelocities GyroEffector::velocities() const {
  EffectorVelocities own;
  for (const MomentGyro& gyro : gyros_.gyros()) {
    own.all.push_back(gyro.gimbal_velocity), own.all.push_back(gyro.rotor_velocity);
    own.fast.push_back(gyro.rotor_velocity);
  }
  own.rate_controlled = own.all;
  return own;
}

// The command is converted in turn(), which is also called without an actuated root.
void GyroEffector::drive(const BaseMoment&, const BaseCommand&, std::span<double>, std::span<double>) {}

// State, and the commanded torque or gimbal rates => prescribed accelerations of gimbals and rotors (17.6), by the
// steering law (17.9); remembers the resulting torque (17.7).
void GyroEffector::turn(const BaseMoment& at, const Vector3d& torque, const ActuatorCommands& each,
                        const PrescribedRates& rates) {
  gyros_.take(at.state.q);
  const Vector3d w_B = at.v >= 0 ? at.rate() : Vector3d::zero();
  if (steers_) {
    gyros_.steer(torque, w_B, at.time);
  } else if (one_by_one_ && !each.gimbal_rate.empty()) {
    gyros_.command(each.gimbal_rate);
  }
  gyros_.prescribe(at.state.v, rates.prescribed, rates.as_commanded, rates.acceleration);
  turned_ = gyros_.torque_of(at.state.v, w_B);
}

void GyroEffector::conclude(std::span<const double> force, std::span<const double>, std::span<double> effort) {
  gyros_.conclude(force, effort);
}

}  // namespace grapnel
