#include "grapnel/simulate/reaction_wheels.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/simulate/thruster_bank.hpp"
#include "grapnel/spatial/decompositions.hpp"

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

// Threshold of the relative acceleration of a wheel at its maximum rate; smaller values are rounding errors [1/s].
constexpr double kDrivenOn = 1e-9;

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
    const double commanded = -factor(with_it_[i], torque) * dot(with_it_[i][i], torque);
    const double u = signs_[i] * std::min(0.0, signs_[i] * commanded);
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
    const double commanded = torques.empty() ? 0 : torques[i];
    double u = std::clamp(commanded, -wheels_[i].torque, wheels_[i].torque);
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

// --- Wheels as actuators of the base ---

WheelEffector::WheelEffector(std::vector<ReactionWheel> wheels, WheelCommands commands)
    : wheels_(std::move(wheels)), commands_(std::move(commands)) {
  if (!commands_.speeds.empty() && commands_.speeds.size() != wheels_.wheels().size())
    throw std::invalid_argument("WheelEffector: one speed per wheel is needed");
}

// Wheels are attached to the root that they turn, by joints without other drives.
void WheelEffector::check(const Model& model, int root, std::span<const std::uint8_t> is_free) const {
  for (const ReactionWheel& wheel : wheels_.wheels()) {
    const Body& body = model.bodies().at(model.joints().at(wheel.joint));
    if (body.v != wheel.velocity || body.parent != root || !is_free[wheel.joint])
      throw std::invalid_argument("WheelEffector: a wheel must be on a free joint of the root that it turns");
  }
}

EffectorVelocities WheelEffector::velocities() const {
  EffectorVelocities own;
  for (const ReactionWheel& wheel : wheels_.wheels()) own.all.push_back(wheel.velocity);
  own.fast = own.all;
  return own;
}

// Sets the rates of held wheels as prescribed.
void WheelEffector::prescribe(const PrescribedRates& rates) const {
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const int v = wheels_.wheels()[i].velocity;
    const bool held = wheels_.mode(i) == WheelArray::Mode::held;
    rates.prescribed[v] = rates.as_commanded[v] = held;
    rates.acceleration[v] = 0;
    if (held) rates.rate[v] = wheels_.held_rate(i);
  }
}

bool WheelEffector::holds(int velocity) const {
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (wheels_.wheels()[i].velocity == velocity) return wheels_.mode(i) == WheelArray::Mode::held;
  }
  return false;
}

// The torque that compensates dumping thrusters (18.5).
Vector3d WheelEffector::countered() const {
  return commands_.dumped_by ? commands_.dumped_by->mean_torque : Vector3d::zero();
}

// Commanded torque => motor efforts: wheels share it by (17.2), less that of dumping thrusters (18.5), and approach
// their stated rates in the null space (18.7). Commands of each motor are given within its limits.
void WheelEffector::drive(const BaseMoment&, const BaseCommand& command, std::span<double> effort, std::span<double>) {
  if (commands_.one_by_one) return wheels_.drive_each(command.each.wheel_torque, effort);
  wheels_.drive(command.torque - countered(), effort);
  if (!(commands_.speed_rate > 0) || command.wheel_rates.empty()) return;
  std::vector<double> torques;
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const double wanted = commands_.speeds.empty() ? 0 : commands_.speeds[i];
    torques.push_back(commands_.speed_rate * wheels_.wheels()[i].inertia * (wanted - command.wheel_rates[i]));
  }
  wheels_.add_in_null_space(torques, effort);
}

// Forces of the prescribed rates => efforts of motors that hold wheels (force less friction), and the torque given.
void WheelEffector::conclude(std::span<const double> force, std::span<const double> friction,
                             std::span<double> effort) {
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) == WheelArray::Mode::held) effort[wheel.joint] = force[wheel.velocity] - friction[wheel.joint];
  }
  given_ = wheels_.torque_of(effort);
}

// Torque => efforts by (17.2) at the wheels that are not held. Forces that hold wheels are unknown to the laws.
void WheelEffector::add_beside(const BaseMoment&, const Vector3d& torque, std::span<double> effort,
                               std::span<double> beside) {
  wheels_.drive(torque - countered(), effort);
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    const ReactionWheel& wheel = wheels_.wheels()[i];
    if (wheels_.mode(i) != WheelArray::Mode::held) beside[wheel.velocity] += effort[wheel.joint];
  }
}

std::optional<std::pair<int, double>> WheelEffector::tried_rate() const {
  if (!tried_) return {};
  return std::pair{wheels_.wheels()[*tried_].velocity, wheels_.held_rate(*tried_)};
}

// The acceleration that a held wheel would have if it were free.
double WheelEffector::driving_on(std::size_t wheel, const Evaluation& evaluate) {
  tried_ = wheel;
  wheels_.try_free(wheel);
  const std::span<const double> acceleration = evaluate();
  tried_.reset();
  wheels_.try_free({});
  return wheels_.driving_on(wheel, acceleration);
}

// Velocities => smallest margin, at most 1: relative distance of free wheels from their maximum rates, and the
// acceleration (17.3) of held wheels.
double WheelEffector::margin(std::span<const double> v, const Evaluation& evaluate) {
  double least = 1;
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (std::isfinite(wheels_.wheels()[i].rate) && wheels_.mode(i) != WheelArray::Mode::held)
      least = std::min(least, wheels_.margin(i, v));
  }
  for (std::size_t i = 0; i < wheels_.wheels().size(); ++i) {
    if (wheels_.mode(i) == WheelArray::Mode::held && !stays_held_[i]) least = std::min(least, driving_on(i, evaluate));
  }
  return least;
}

// Chooses modes by the rates, then by the accelerations that wheels at their maximum rates would have if they were
// free. Each is freed at most once. It is held again if freeing another one accelerates it further; then it stays held
// until the next choice, as does a wheel in doubt due to rounding.
void WheelEffector::choose_modes(double, std::span<const double> v, const Evaluation& evaluate) {
  const std::size_t count = wheels_.wheels().size();
  wheels_.take_modes(v);
  stays_held_.assign(count, 0);
  if (!wheels_.any_held()) return;
  std::vector<std::uint8_t> freed(count, 0);
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i < count && !changed; ++i) {
      if (wheels_.mode(i) != WheelArray::Mode::held || freed[i] || driving_on(i, evaluate) > 0) continue;
      wheels_.set_mode(i, WheelArray::Mode::free);
      freed[i] = 1, changed = true;
    }
    if (changed) continue;
    const std::span<const double> acceleration = evaluate();
    for (std::size_t i = 0; i < count && !changed; ++i) {
      if (!freed[i] || wheels_.mode(i) == WheelArray::Mode::held || !(wheels_.driving_on(i, acceleration) > kDrivenOn))
        continue;
      wheels_.set_mode(i, WheelArray::Mode::held);
      changed = true;
    }
  }
  for (std::size_t i = 0; i < count; ++i)
    stays_held_[i] = wheels_.mode(i) == WheelArray::Mode::held && !(driving_on(i, evaluate) > 0);
}

}  // namespace grapnel
