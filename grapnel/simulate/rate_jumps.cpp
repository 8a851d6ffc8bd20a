/// Jumps of prescribed joint rates (theory section 6, Rates that jump): impulses in the joints, and their effect on all
/// velocities, (6.13a).

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {
namespace {

// Rates that differ by rounding errors are equal.
bool rates_differ(double a, double b) {
  constexpr double kRounding = 16 * std::numeric_limits<double>::epsilon();
  return std::abs(a - b) > kRounding * std::max(std::abs(a), std::abs(b));
}

}  // namespace

bool PhaseDynamics::cross_break(double begin, double end, std::span<double> y) {
  if (!setup_.contacts) return false;  // as in lanes, which have no contacts
  const std::optional<double> before = inside_;
  enter_interval(begin, end);
  if (!before) return join_references(begin, y);
  std::vector<int> jumping;
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (output_of(drive.control) != ControlOutput::motion) continue;
    if (rates_differ(evaluate(drive.trajectory, begin, *before).rate, evaluate(drive.trajectory, begin, *inside_).rate))
      jumping.push_back(model_.joint_body(j).v);
  }
  return jump(begin, jumping, y);
}

bool PhaseDynamics::join_references(double t, std::span<double> y) {
  load(t, y);
  std::vector<int> jumping;
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    if (output_of(setup_.drives[j].control) != ControlOutput::motion) continue;
    const int v = model_.joint_body(j).v;
    if (rates_differ(y[now_.q.size() + v], now_.v[v])) jumping.push_back(v);
  }
  return jump(t, jumping, y);
}

State PhaseDynamics::on_references(const State& state, double t) {
  std::vector<double> y = initial(state, t);
  if (setup_.contacts) join_references(t, y);
  return unprojected_state(t, y);
}

// Prescribed velocities that jump => y after the impulses of these joints: M change = J^T P as for stops (19.3). Other
// prescribed rates do not change, and joints in static friction remain at rest. The change is from the integrated rate,
// to which the integrated velocities of the roots belong. Closed loops that contradict the changes leave y as it was.
bool PhaseDynamics::jump(double t, std::span<const int> velocities, std::span<double> y) {
  if (velocities.empty()) return false;
  load(t, y);
  const std::size_t nq = now_.q.size();
  std::vector<JointModes::RateChange> changes;
  for (const int v : velocities) changes.push_back({v, now_.v[v] - y[nq + v]});
  for (const int v : velocities) now_.v[v] = y[nq + v];
  recover(t);
  const std::vector<std::uint8_t> prescribed = prescribed_;
  respond_to(changes, true);
  prescribed_ = prescribed;
  if (solver_ && !(solver_->contradiction() <= loop_limits::kContradiction)) return false;
  book_impulses(y);
  for (std::size_t i = 0; i < now_.v.size(); ++i) y[nq + i] += vdot_[i];
  return true;
}

}  // namespace grapnel
