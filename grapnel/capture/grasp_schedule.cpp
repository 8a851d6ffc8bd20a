#include "grapnel/capture/grasp_schedule.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace grapnel {
namespace {

// An envelope's excess counts as met within rounding, as decide_grasps() has it.
constexpr double kMet = 1e-9;

double largest(const std::vector<double>& values, const std::vector<std::size_t>& of) {
  double most = -1;
  for (std::size_t i : of) most = std::max(most, values[i]);
  return most;
}

}  // namespace

GraspSchedule::GraspSchedule(const CaptureProblem& problem) : problem_(problem), outcomes_(problem.grasps.size()) {}

bool GraspSchedule::is_now(double t, double now) { return std::abs(t - now) <= 1e-9 * std::max(1.0, now); }

std::vector<std::size_t> GraspSchedule::undecided(GraspSetup::Closes how) const {
  std::vector<std::size_t> grasps;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (!outcomes_[i] && problem_.grasps[i].closes == how) grasps.push_back(i);
  }
  return grasps;
}

std::vector<std::size_t> GraspSchedule::due_at(double now) const {
  std::vector<std::size_t> due = undecided(GraspSetup::Closes::at_time);
  // Earlier ones too: an impact in time may have passed over them.
  std::erase_if(due, [&](std::size_t i) {
    return problem_.grasps[i].closes_at > now && !is_now(problem_.grasps[i].closes_at, now);
  });
  return due;
}

std::vector<std::size_t> GraspSchedule::due_together(double now) const {
  std::vector<std::size_t> due = undecided(GraspSetup::Closes::together);
  for (std::size_t i : due_at(now)) due.push_back(i);
  std::sort(due.begin(), due.end());
  return due;
}

std::vector<std::size_t> GraspSchedule::arrived(const CaptureSystem& system, const State& state) const {
  std::vector<std::size_t> waiting = undecided(GraspSetup::Closes::on_arrival);
  if (waiting.empty()) return waiting;
  const std::vector<double> excess = envelope_excesses(problem_, system, forward_kinematics(system.model, state));
  std::erase_if(waiting, [&](std::size_t i) { return !(excess[i] <= kMet); });
  return waiting;
}

bool GraspSchedule::together_in_envelopes(const CaptureSystem& system, const State& state) const {
  const std::vector<std::size_t> together = undecided(GraspSetup::Closes::together);
  if (together.empty()) return false;
  return largest(envelope_excesses(problem_, system, forward_kinematics(system.model, state)), together) <= kMet;
}

StopCondition GraspSchedule::stop_condition(const CaptureSystem& system, bool together) const {
  const std::vector<std::size_t> waiting = undecided(GraspSetup::Closes::on_arrival);
  std::vector<std::size_t> group;
  if (together) group = undecided(GraspSetup::Closes::together);
  if (waiting.empty() && group.empty()) return {};
  return [this, &system, waiting, group, kinematics = Kinematics(system.model)](double, const State& state) mutable {
    forward_kinematics(system.model, state, kinematics);
    const std::vector<double> excess = envelope_excesses(problem_, system, kinematics);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i : waiting) least = std::min(least, excess[i]);
    if (!group.empty()) least = std::min(least, largest(excess, group));
    return least;
  };
}

std::vector<double> GraspSchedule::stated_times() const {
  std::vector<double> times;
  for (std::size_t i : undecided(GraspSetup::Closes::at_time)) times.push_back(problem_.grasps[i].closes_at);
  return times;
}

bool GraspSchedule::any_left() const {
  return !undecided(GraspSetup::Closes::at_time).empty() || !undecided(GraspSetup::Closes::on_arrival).empty();
}

GraspOutcome GraspSchedule::outcome(std::size_t grasp, bool captured, const std::string& reason, double time,
                                    const GraspDeviation& deviation) const {
  const GraspSetup& g = problem_.grasps[grasp];
  GraspOutcome outcome;
  outcome.end_effector = g.end_effector, outcome.target = g.target, outcome.grasp_point = g.grasp_point;
  outcome.captured = captured, outcome.reason = reason, outcome.time = time;
  outcome.distance = deviation.position, outcome.angle = deviation.angle;
  outcome.velocity = deviation.velocity, outcome.angular_velocity = deviation.angular_velocity;
  return outcome;
}

std::vector<std::size_t> GraspSchedule::decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                               const State& state, double time) {
  std::vector<std::size_t> closing;
  if (grasps.empty()) return closing;
  if (!first_time_) first_time_ = time;
  const std::vector<GraspDecision> decisions = decide_grasps(problem_, system, forward_kinematics(system.model, state));
  for (std::size_t i : grasps) {
    const GraspDecision& d = decisions[i];
    outcomes_[i] = outcome(i, d.captured, d.reason, time, d.deviation);
    outcomes_[i]->judged = d.judged, outcomes_[i]->limiting = d.limiting;
    if (d.captured) closing.push_back(i);
  }
  return closing;
}

void GraspSchedule::refuse(const std::vector<std::size_t>& grasps, const std::string& reason) {
  for (std::size_t i : grasps) outcomes_[i]->captured = false, outcomes_[i]->reason = reason;
}

void GraspSchedule::release(std::size_t grasp, double time) { outcomes_[grasp]->released = time; }

void GraspSchedule::moved(std::size_t grasp, double distance) { outcomes_[grasp]->target_moved = distance; }

// A grasp that has not been decided on by the end of the run.
GraspOutcome GraspSchedule::undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const {
  const GraspSetup& g = problem_.grasps[grasp];
  const bool waits = g.closes == GraspSetup::Closes::on_arrival;
  const double time = g.closes == GraspSetup::Closes::at_time ? g.closes_at : end;
  GraspOutcome missed =
      outcome(grasp, false,
              waits ? "did not come within its envelope before the run's end" : "the run ended before it was to close",
              time, at_end.deviation);
  if (waits) missed.judged = at_end.judged, missed.limiting = at_end.limiting;
  return missed;
}

void GraspSchedule::write(double last_look, const CaptureSystem& system, const State& state,
                          CaptureResult& result) const {
  if (!first_time_) return;
  result.capture_time = *first_time_;
  const double end = std::max(*first_time_, last_look);
  // After a failure nobody knows where things are.
  GraspDecision unknown;
  unknown.deviation = {NAN, NAN, NAN, NAN};
  std::vector<GraspDecision> at_end(outcomes_.size(), unknown);
  const bool all_decided = std::all_of(outcomes_.begin(), outcomes_.end(), [](const auto& o) { return o.has_value(); });
  if (result.failure.empty() && !all_decided)
    at_end = decide_grasps(problem_, system, forward_kinematics(system.model, state));
  for (std::size_t i = 0; i < outcomes_.size(); ++i)
    result.grasps.push_back(outcomes_[i] ? *outcomes_[i] : undecided_outcome(i, end, at_end[i]));
}

}  // namespace grapnel
