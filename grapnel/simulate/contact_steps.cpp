#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {
namespace {

// Chebyshev points at which the rates of prescribed joints are compared, and a bound of the polynomial through values
// of magnitude 1 there (its Lebesgue constant is 2.3).
constexpr int kPoints = 9;
constexpr double kBetween = 2.5;
// Prescribed joints on a base that does not react may turn by this much together in a step [rad]. Beyond it, velocities
// change by directions, and no integrated number limits the step.
constexpr double kLargestTurn = 0.2;

// Trajectory and the times of a step => the largest rate, and the largest change from that at the end. Rates are
// polynomials of degree 8 at most, or sines over a segment. Series with more numbers are accepted for steps in which
// they change as little.
struct StepRates {
  double largest = 0, change = 0;
};
StepRates rates_in_step(const JointTrajectory& trajectory, double t, double duration) {
  StepRates rates;
  const double middle = t - 0.5 * duration, last = evaluate(trajectory, t, middle).rate;
  for (int k = 0; k < kPoints; ++k) {
    const double rate = evaluate(trajectory, chebyshev_point(t - duration, t, k, kPoints - 1), middle).rate;
    rates.largest = std::max(rates.largest, std::abs(rate));
    rates.change = std::max(rates.change, std::abs(rate - last));
  }
  for (const JointSegment& segment : trajectory.segments) {
    const auto* series = std::get_if<ChebyshevSegment>(&segment.shape);
    if (!series || segment.begin > middle || segment.end < middle) continue;
    const double numbers = static_cast<double>(series->coefficients.size());
    if (numbers > kPoints && numbers * duration > segment.end - segment.begin)
      rates.change = std::numeric_limits<double>::infinity();
  }
  return {kBetween * rates.largest, kBetween * rates.change};
}

}  // namespace

// Poses at the end of a step => per body: the farthest point of a contact's shape that its joint moves, from its
// origin.
void PhaseDynamics::measure_arms() {
  std::fill(arms_.begin(), arms_.end(), 0.0);
  for (std::size_t i = 0; i < arms_.size(); ++i) {
    if (reaches_[i] == 0) continue;
    const Vector3d p = workspace_.kinematics.X_WB[i].p;
    for (int b = static_cast<int>(i); b >= 0; b = model_.bodies()[b].parent)
      arms_[b] = std::max(arms_[b], norm(p - workspace_.kinematics.X_WB[b].p) + reaches_[i]);
  }
}

// Poses at the end of a step => a bound of the travel that changes of prescribed rates add inside of it. Infinite if
// the joints turn too far, or if anything besides motions of joints and a held base is prescribed.
double PhaseDynamics::prescribed_travel(double t, double duration) {
  const auto prescribed = std::count_if(prescribed_.begin(), prescribed_.end(), [](auto p) { return p != 0; });
  std::ptrdiff_t explained = setup_.held_root >= 0 ? 6 : 0;
  if (prescribed == 0) return 0;
  measure_arms();
  double travel = 0, turn = 0;
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (output_of(drive.control) != ControlOutput::motion) continue;
    ++explained;
    const Body& body = model_.bodies()[model_.joints()[j]];
    const bool slides = body.description.joint.type == JointType::prismatic;
    const bool reacts =
        model_.bodies()[body.root].description.joint.type == JointType::free && body.root != setup_.held_root;
    const double arm = slides ? 1 : arms_[model_.joints()[j]];
    if (arm == 0) continue;
    const StepRates rates = rates_in_step(drive.trajectory, t, duration);
    const double noise = drive.noise.rate_change(duration);
    travel += duration * arm * (rates.change + noise);
    if (!slides && !reacts) turn += duration * (rates.largest + noise);
  }
  const double infinity = std::numeric_limits<double>::infinity();
  const bool is_bounded = explained == prescribed && model_.couplings().empty() && turn < kLargestTurn;
  return is_bounded && travel < infinity ? travel : infinity;
}

void PhaseDynamics::begin_step(double t, std::span<const double> y) {
  if (!setup_.contacts) return;
  load_integrated(t, y);
  forward_kinematics(model_, now_, workspace_.kinematics);
  setup_.contacts->begin_step(workspace_.kinematics);
}

bool PhaseDynamics::end_step(double t, std::span<const double> y, double duration) {
  if (!setup_.contacts || !modes_.empty() || base_.switches()) {
    begin_step(t, y);
    return true;
  }
  load_integrated(t, y);
  forward_kinematics(model_, now_, workspace_.kinematics);
  return setup_.contacts->end_step(workspace_.kinematics, duration, prescribed_travel(t, duration));
}

double PhaseDynamics::least_overlap(double t, std::span<const double> y) {
  if (!setup_.contacts || !setup_.contacts->touches()) return std::numeric_limits<double>::infinity();
  load_integrated(t, y);
  place_bodies_now();
  return setup_.contacts->least_overlap(workspace_.kinematics);
}

}  // namespace grapnel
