// The closing times of grasps, and their outcomes.
#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "grapnel/capture/capture_run.hpp"

namespace grapnel {

namespace {

// An envelope's excess below this counts as met, as in decide_grasps().
constexpr double kExcessTolerance = 1e-9;
// An envelope's excess from which on an end-effector counts as outside.
constexpr double kOutside = 1e-6;
// A grasp that closes and opens more often is rejected: its events may accumulate.
constexpr int kMaxClosings = 1000;
// The same for slips.
constexpr long kMaxSlips = 10'000;

double largest(const std::vector<double>& values, const std::vector<std::size_t>& of) {
  double most = -1;
  for (std::size_t i : of) most = std::max(most, values[i]);
  return most;
}

}  // namespace

GraspSchedule::GraspSchedule(const CaptureProblem& problem)
    : problem_(problem),
      outcomes_(problem.grasps.size()),
      slips_(outcomes_.size(), 0),
      open_since_(outcomes_.size(), 0),
      departed_(outcomes_.size(), false) {}

bool GraspSchedule::is_now(double t, double now) { return std::abs(t - now) <= 1e-9 * std::max(1.0, now); }

std::vector<std::size_t> GraspSchedule::undecided(GraspSetup::Closes how) const {
  std::vector<std::size_t> grasps;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (!outcomes_[i] && problem_.grasps[i].closes == how) grasps.push_back(i);
  }
  return grasps;
}

bool GraspSchedule::is_open(std::size_t grasp) const {
  return outcomes_[grasp] && (!outcomes_[grasp]->captured || outcomes_[grasp]->released);
}

// Whether an open grasp waits for its end-effector's return.
bool GraspSchedule::waits_again(std::size_t grasp) const {
  return problem_.grasps[grasp].closes_again_on_arrival && is_open(grasp);
}

// Whether a later closing time of an open grasp has passed since it opened.
bool GraspSchedule::is_due_again(std::size_t grasp, double now) const {
  return is_open(grasp) && std::ranges::any_of(problem_.grasps[grasp].closes_again_at, [&](double t) {
           const double since = open_since_[grasp];
           return t > since && !is_now(t, since) && (t <= now || is_now(t, now));
         });
}

void GraspSchedule::open(std::size_t grasp, double time) { open_since_[grasp] = time, departed_[grasp] = false; }

std::vector<std::size_t> GraspSchedule::due_at(double now) const {
  std::vector<std::size_t> due = undecided(GraspSetup::Closes::at_time);
  // Earlier ones, too: a compliant impact may have passed them.
  std::erase_if(due, [&](std::size_t i) {
    return problem_.grasps[i].closes_at > now && !is_now(problem_.grasps[i].closes_at, now);
  });
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (is_due_again(i, now)) due.push_back(i);
  }
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
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i) && departed_[i]) waiting.push_back(i);
  }
  if (waiting.empty()) return waiting;
  const std::vector<double> excess = envelope_excesses(problem_, system, forward_kinematics(system.model, state));
  std::erase_if(waiting, [&](std::size_t i) { return !(excess[i] <= kExcessTolerance); });
  return waiting;
}

std::vector<bool> GraspSchedule::awaited_targets() const {
  std::vector<bool> awaited(problem_.targets.size(), false);
  for (const std::size_t i : undecided(GraspSetup::Closes::when_settled))
    awaited[target_index(problem_, problem_.grasps[i].target)] = true;
  return awaited;
}

std::vector<std::size_t> GraspSchedule::settled(const StageMonitor& stages) const {
  std::vector<std::size_t> grasps = undecided(GraspSetup::Closes::when_settled);
  std::erase_if(grasps,
                [&](std::size_t i) { return !stages.is_settled(target_index(problem_, problem_.grasps[i].target)); });
  return grasps;
}

void GraspSchedule::note_departures(const CaptureSystem& system, const State& state) {
  std::vector<std::size_t> staying;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i) && !departed_[i]) staying.push_back(i);
  }
  if (staying.empty()) return;
  const std::vector<double> excess = envelope_excesses(problem_, system, forward_kinematics(system.model, state));
  for (const std::size_t i : staying) departed_[i] = excess[i] > 0.9 * kOutside;  // located to within rounding
}

bool GraspSchedule::together_in_envelopes(const CaptureSystem& system, const State& state) const {
  const std::vector<std::size_t> together = undecided(GraspSetup::Closes::together);
  if (together.empty()) return false;
  return largest(envelope_excesses(problem_, system, forward_kinematics(system.model, state)), together) <=
         kExcessTolerance;
}

// System, whether the group counts => function of time and state: minimum excess over the capture envelopes, at most
// zero when a waiting grasp or the whole group is within them, or an open grasp leaves its own; empty if no grasp
// waits.
StopCondition GraspSchedule::stop_condition(const CaptureSystem& system, bool together) const {
  std::vector<std::size_t> waiting = undecided(GraspSetup::Closes::on_arrival), group, staying;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (waits_again(i)) (departed_[i] ? waiting : staying).push_back(i);
  }
  if (together) group = undecided(GraspSetup::Closes::together);
  if (waiting.empty() && group.empty() && staying.empty()) return {};
  return [this, &system, waiting, group, staying, kinematics = Kinematics(system.model)](double,
                                                                                         const State& state) mutable {
    forward_kinematics(system.model, state, kinematics);
    const std::vector<double> excess = envelope_excesses(problem_, system, kinematics);
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i : waiting) least = std::min(least, excess[i]);
    for (std::size_t i : staying) least = std::min(least, kOutside - excess[i]);
    if (!group.empty()) least = std::min(least, largest(excess, group));
    return least;
  };
}

std::vector<double> GraspSchedule::stated_times() const {
  std::vector<double> times;
  for (std::size_t i : undecided(GraspSetup::Closes::at_time)) times.push_back(problem_.grasps[i].closes_at);
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    const std::vector<double>& again = problem_.grasps[i].closes_again_at;
    if (is_open(i)) times.insert(times.end(), again.begin(), again.end());
  }
  return times;
}

bool GraspSchedule::any_left() const {
  for (std::size_t i = 0; i < outcomes_.size(); ++i) {
    if (is_open(i) && closes_again(problem_.grasps[i])) return true;
  }
  using Closes = GraspSetup::Closes;
  return std::ranges::any_of(std::array{Closes::at_time, Closes::on_arrival, Closes::when_settled},
                             [&](Closes how) { return !undecided(how).empty(); });
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

// Due grasps and state at `time` [s] => grasps that close, by their capture envelopes (docs/theory, section 6.5);
// records the outcome of each and the time of the first decision.
std::vector<std::size_t> GraspSchedule::decide(const std::vector<std::size_t>& grasps, const CaptureSystem& system,
                                               const State& state, double time) {
  std::vector<std::size_t> closing;
  if (grasps.empty()) return closing;
  if (!first_time_) first_time_ = time;
  const std::vector<GraspDecision> decisions = decide_grasps(problem_, system, forward_kinematics(system.model, state));
  for (std::size_t i : grasps) {
    const GraspDecision& d = decisions[i];
    const GraspOutcome before = outcomes_[i].value_or(GraspOutcome{});
    outcomes_[i] = outcome(i, d.captured, d.reason, time, d.deviation);
    outcomes_[i]->judged = d.judged, outcomes_[i]->limiting = d.limiting;
    if (problem_.grasps[i].closes == GraspSetup::Closes::when_settled && d.captured && !d.judged)
      outcomes_[i]->judged = true, outcomes_[i]->reason = "its target was settled in the gripper";
    outcomes_[i]->largest_load = before.largest_load, outcomes_[i]->largest_load_time = before.largest_load_time;
    outcomes_[i]->closings = before.closings + d.captured;
    if (d.captured) {
      closing.push_back(i);
    } else {
      outcomes_[i]->lost = before.lost;
      open(i, time);
    }
  }
  return closing;
}

void GraspSchedule::refuse(const std::vector<std::size_t>& grasps, const std::string& reason) {
  for (std::size_t i : grasps) {
    outcomes_[i]->closings -= outcomes_[i]->captured;
    outcomes_[i]->captured = false, outcomes_[i]->reason = reason;
    open(i, outcomes_[i]->time);
  }
}

void GraspSchedule::release(std::size_t grasp, double time) {
  outcomes_[grasp]->released = time, outcomes_[grasp]->slips = false;
  open(grasp, time);
}

void GraspSchedule::slip(std::size_t grasp, double time) {
  GraspOutcome& outcome = *outcomes_[grasp];
  outcome.slips = true;
  if (!outcome.slipped) outcome.slipped = time;
  if (++slips_[grasp] > kMaxSlips) {
    throw RunFailure(fmt::format("grasp of {}: it slips and sticks more than {} times up to t = {:.9g} s",
                                 outcome.end_effector, kMaxSlips, time));
  }
}

void GraspSchedule::note_slip(std::size_t grasp, double distance, double angle) {
  outcomes_[grasp]->slip_distance = distance, outcomes_[grasp]->slip_angle = angle;
}

void GraspSchedule::lose_by_slip(std::size_t grasp, double time) {
  GraspOutcome& outcome = *outcomes_[grasp];
  outcome.captured = false, outcome.slips = false, outcome.lost = time;
  outcome.reason = fmt::format("lost at t = {:.6g} s: it slipped by {:.4g} m and {:.4g} rad", time,
                               outcome.slip_distance, outcome.slip_angle);
  open(grasp, time);
}

void GraspSchedule::lose(const HoldLoad& load, bool in_impact) {
  GraspOutcome& outcome = *outcomes_[load.grasp];
  const GraspLimits& limits = *problem_.grasps[load.grasp].holds;
  const auto part = [](const char* name, double value, double limit, const char* unit) {
    return std::isfinite(limit) ? fmt::format("{} {:.4g} of {:.4g} {}", name, value, limit, unit)
                                : fmt::format("{} {:.4g} {}", name, value, unit);
  };
  outcome.captured = false, outcome.slips = false, outcome.lost = load.time;
  outcome.reason =
      fmt::format("lost at t = {:.6g} s{}: {}, {}", load.time, in_impact ? ", in an impact" : "",
                  part("force", load.force, limits.force, "N"), part("moment", load.moment, limits.moment, "N m"));
  note_load(load);
  open(load.grasp, load.time);
  if (outcome.closings > kMaxClosings) {
    throw RunFailure(fmt::format("grasp of {}: it closes and is lost more than {} times up to t = {:.9g} s",
                                 outcome.end_effector, kMaxClosings, load.time));
  }
}

void GraspSchedule::note_load(const HoldLoad& load) {
  GraspOutcome& outcome = *outcomes_[load.grasp];
  if (outcome.largest_load && !(load.share > *outcome.largest_load)) return;
  outcome.largest_load = load.share, outcome.largest_load_time = load.time;
}

std::vector<bool> GraspSchedule::opened() const {
  std::vector<bool> opened;
  for (std::size_t i = 0; i < outcomes_.size(); ++i) opened.push_back(is_open(i));
  return opened;
}

void GraspSchedule::moved(std::size_t grasp, double distance) { outcomes_[grasp]->target_moved = distance; }

// The outcome of a grasp without a decision at the end of the run.
GraspOutcome GraspSchedule::undecided_outcome(std::size_t grasp, double end, const GraspDecision& at_end) const {
  const GraspSetup& g = problem_.grasps[grasp];
  const bool waits = g.closes == GraspSetup::Closes::on_arrival;
  if (g.closes == GraspSetup::Closes::when_settled)
    return outcome(grasp, false, "its target did not settle in the gripper before the run's end", end,
                   at_end.deviation);
  const double time = g.closes == GraspSetup::Closes::at_time ? g.closes_at : end;
  GraspOutcome missed =
      outcome(grasp, false,
              waits ? "did not come within its envelope before the run's end" : "the run ended before its closing time",
              time, at_end.deviation);
  if (waits) missed.judged = at_end.judged, missed.limiting = at_end.limiting;
  return missed;
}

// Time of the last check and final state => capture time and outcomes of all grasps in the result; undecided ones get
// their deviations at the end (NaN after a failure). Writes nothing if no grasp was due.
void GraspSchedule::write(double last_check, const CaptureSystem& system, const State& state,
                          CaptureResult& result) const {
  if (!first_time_ && undecided(GraspSetup::Closes::when_settled).empty()) return;
  result.capture_time = first_time_.value_or(last_check);
  const double end = std::max(result.capture_time, last_check);
  // After a failure the positions are unknown.
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
