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
// Prescribed joints may turn by this much together in a step [rad]: on a base that is held or fixed, where no
// integrated number limits the step, and on one that reacts. Beyond it, velocities change by directions.
constexpr double kLargestTurn = 0.2, kLargestTurnOfReacting = 1;
// A base that reacts moves shapes at a distance r from the joint at most this often r times the rate of the joint.
constexpr double kReaction = 2;

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

// Body of a joint, poses at the end of a step => the farthest point of the contacts' shapes that its joint moves, from
// its origin; with a base that reacts, of all shapes of its tree.
double PhaseDynamics::arm_of(int joint_body, bool reacts) const {
  const auto is_moved = [&](int body) {
    while (body >= 0 && body != joint_body) body = model_.bodies()[body].parent;
    return body == joint_body;
  };
  const int root = model_.bodies()[joint_body].root;
  const std::vector<Posed>& X_WB = workspace_.kinematics.X_WB;
  double arm = 0;
  for (std::size_t i = 0; i < reaches_.size(); ++i) {
    if (reaches_[i] == 0) continue;
    if (reacts ? model_.bodies()[i].root != root : !is_moved(static_cast<int>(i))) continue;
    arm = std::max(arm, norm(X_WB[i].p - X_WB[joint_body].p) + reaches_[i]);
  }
  return reacts ? kReaction * arm : arm;
}

// Poses at the end of a step => a bound of the travel that changes of prescribed rates add inside of it. Infinite if
// the joints turn too far, slide on a base that reacts, or move closed loops, or if anything besides motions of joints
// and a held base is prescribed; also backwards.
double PhaseDynamics::prescribed_travel(double t, double duration) {
  const auto prescribed = std::count_if(prescribed_.begin(), prescribed_.end(), [](auto p) { return p != 0; });
  std::ptrdiff_t explained = setup_.held_root >= 0 ? 6 : 0;
  if (prescribed == 0) return 0;
  const double infinity = std::numeric_limits<double>::infinity();
  if (!model_.couplings().empty() || !setup_.closures.empty() || duration < 0) return infinity;
  double travel = 0, turn = 0, turn_of_reacting = 0;
  for (std::size_t j = 0; j < setup_.drives.size(); ++j) {
    const JointDrive& drive = setup_.drives[j];
    if (output_of(drive.control) != ControlOutput::motion) continue;
    ++explained;
    const Body& body = model_.bodies()[model_.joints()[j]];
    const bool slides = body.description.joint.type == JointType::prismatic;
    const bool reacts =
        model_.bodies()[body.root].description.joint.type == JointType::free && body.root != setup_.held_root;
    const double arm = arm_of(model_.joints()[j], reacts);
    if (arm == 0) continue;
    const StepRates rates = rates_in_step(drive.trajectory, t, duration);
    const double noise = drive.noise.rate_change(duration);
    if (slides && reacts && rates.largest + noise > 0) return infinity;
    travel += duration * (slides ? 1 : arm) * (rates.change + noise);
    if (!slides) (reacts ? turn_of_reacting : turn) += duration * (rates.largest + noise);
  }
  const bool is_bounded = explained == prescribed && turn < kLargestTurn && turn_of_reacting < kLargestTurnOfReacting;
  return is_bounded && travel < infinity ? travel : infinity;
}

void PhaseDynamics::begin_step(double t, std::span<const double> y, double duration) {
  if (!setup_.contacts) return;
  load_integrated(t, y);
  forward_kinematics(model_, now_, workspace_.kinematics);
  setup_.contacts->begin_step(workspace_.kinematics, duration);
}

bool PhaseDynamics::end_step(double t, std::span<const double> y, double duration, double next) {
  if (!setup_.contacts || !modes_.empty() || base_.switches()) {
    begin_step(t, y, next);
    return true;
  }
  load_integrated(t, y);
  forward_kinematics(model_, now_, workspace_.kinematics);
  return setup_.contacts->end_step(workspace_.kinematics, std::abs(duration), prescribed_travel(t, duration), next);
}

double PhaseDynamics::least_overlap(double t, std::span<const double> y) {
  if (!setup_.contacts || !setup_.contacts->touches()) return std::numeric_limits<double>::infinity();
  load_integrated(t, y);
  place_bodies_now();
  return setup_.contacts->least_overlap(workspace_.kinematics);
}

}  // namespace grapnel
