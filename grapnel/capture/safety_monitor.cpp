#include "grapnel/capture/safety_monitor.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/model/coupling.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

// Why clearances were not checked, or not of all bodies; empty: all were checked.
std::string clearance_not_checked(const CaptureProblem& problem) {
  if (!problem.clearance.enabled) return "switched off by clearance.enabled";
  std::vector<std::string> without;
  std::optional<RobotSetup> made;
  const RobotSetup& robot = modelled_robot(problem.robot, false, made);  // links, not their pieces
  for (const BodyDescription& body : robot.bodies) {
    const auto is_its = [&](const auto& shape) { return shape.first == body.name; };
    if (std::none_of(robot.geometry.begin(), robot.geometry.end(), is_its)) without.push_back(body.name);
  }
  for (const TargetSetup& t : problem.targets) {
    const auto is_none = [](const Geometry& shape) { return shape.shape == Geometry::Shape::none; };
    if (std::all_of(t.geometry.begin(), t.geometry.end(), is_none)) without.push_back(t.name);
  }
  const std::size_t bodies = robot.bodies.size() + problem.targets.size();
  if (without.empty() || bodies < 2) return "";
  if (without.size() == bodies) return "no body has a shape";
  constexpr std::size_t kNamed = 4;
  const std::size_t named = std::min(kNamed, without.size());
  std::string text =
      fmt::format("no shape is stated for {}", fmt::join(without.begin(), without.begin() + named, ", "));
  if (named < without.size()) text += fmt::format(" and {} more", without.size() - named);
  return text;
}

}  // namespace

// Problem => monitor of the required clearance [m]; it has no bodies before begin_phase().
SafetyMonitor::SafetyMonitor(const CaptureProblem& problem)
    : problem_(problem), clearance_(problem.clearance.required) {}

// System, whether drives limit efforts, opened grasps => clearance model and limits observed from now on; records which
// kinds of limits exist.
void SafetyMonitor::begin_phase(const std::string& name, const CaptureSystem& system, bool efforts_are_cut,
                                std::vector<bool> opened) {
  open_ = any_phase_ = true;
  name_ = name, system_ = &system.model, efforts_are_cut_ = efforts_are_cut;
  opened_ = std::move(opened);
  model_ = make_clearance_model(problem_, system, opened_);
  parting_ = gripper_pairs(problem_, system, model_, opened_);
  any_pair_ = any_pair_ || !model_.pairs().empty();
  for (int i = 0; any_pair_ && i < static_cast<int>(system.model.bodies().size()); ++i)
    shown_.emplace(system.model.bodies()[i].description.name, shown_name(system, i));
  begin();
  for (int body : system.model.joints()) {
    const JointLimits& l = system.model.bodies()[body].description.joint.limits;
    any_position_limit_ = any_position_limit_ || std::isfinite(l.lower) || std::isfinite(l.upper);
    any_rate_limit_ = any_rate_limit_ || std::isfinite(l.rate);
    any_effort_limit_ = any_effort_limit_ || std::isfinite(l.effort);
  }
}

void SafetyMonitor::begin() {
  clearance_.begin_phase(name_, *system_, model_, parting_);
  limits_.emplace(efforts_are_cut_);
  limits_->begin_phase(name_, *system_);
  step_end_.reset();
}

void SafetyMonitor::restart_phase() {
  clearance_.forget_phase();
  begin();
}

double SafetyMonitor::sample(double time, const State& state, std::span<const double> motor) {
  if (any_limit()) limits_->sample(time, state, motor);
  if (model_.pairs().empty()) return std::numeric_limits<double>::quiet_NaN();
  return clearance_.sample(time, state).distance;
}

void SafetyMonitor::step(const PhaseStep& step) {
  if (any_limit()) limits_->step(step.begin, step.end, step.fresh, step.state_at);
  if (model_.pairs().empty()) return;
  if (step.fresh && step_end_) {
    const State& after = step.state_at(step.begin);
    if (after.v != step_end_->v) {
      clearance_.sample(step.begin, *step_end_);
      clearance_.sample(step.begin, after);
    }
  }
  step_end_ = step.state_at(step.end);
}

double SafetyMonitor::instant(const CaptureSystem& system, const Kinematics& kinematics) const {
  const ClearanceModel model = make_clearance_model(problem_, system);
  return model.pairs().empty() ? std::numeric_limits<double>::quiet_NaN() : model.minimum(kinematics).distance;
}

void SafetyMonitor::end_phase() {
  clearance_.end_phase();
  limits_->end_phase();
  for (const LimitEvent& e : limits_->events()) limit_events_.push_back(e);
  open_ = false;
}

void SafetyMonitor::add(const std::vector<LimitEvent>& events) {
  limit_events_.insert(limit_events_.end(), events.begin(), events.end());
}

void SafetyMonitor::write(CaptureResult& result) {
  if (open_) end_phase();
  write_events(result);
  write_rows(result);
  const std::vector<GradedViolation> violations = violations_of(result);
  if (!violations.empty()) result.first_violation = violations.front();
  const auto overlap =
      std::find_if(violations.begin(), violations.end(), [](const auto& v) { return v.kind == "overlap"; });
  if (overlap != violations.end()) result.valid_until = overlap->time;
}

// Clearance and limits of all phases => minimum clearances, violations and unchecked pairs under the names of the
// input, limit events in order of time.
void SafetyMonitor::write_events(CaptureResult& result) {
  const auto show = [&](MinimumClearance& minimum) {
    minimum.body_a = shown_[minimum.body_a], minimum.body_b = shown_[minimum.body_b];
  };
  for (MinimumClearance minimum : clearance_.minima()) {
    if (minimum.body_a.empty()) continue;
    show(minimum);
    result.clearance.push_back(minimum);
  }
  for (ClearanceEvent e : clearance_.events()) {
    show(e.minimum);
    result.clearance_events.push_back(e);
  }
  for (const GraspSetup& g : problem_.grasps) {
    result.clearance_unwatched.emplace_back(end_effector_of(problem_, g).body, g.target);
  }
  for (const auto& [a, b] : problem_.clearance.ignore) {
    result.clearance_unwatched.emplace_back(shown_name(problem_, a), shown_name(problem_, b));
  }
  std::ranges::stable_sort(limit_events_, {}, &LimitEvent::begin_time);
  result.limit_events = limit_events_;
}

// Events => feasibility rows with bound 0: clearance [m], joint positions, rates and efforts (docs/theory, section 9).
// `not_checked` gives the reason where a check was incomplete.
void SafetyMonitor::write_rows(CaptureResult& result) const {
  double overlap = 0;
  for (const ClearanceEvent& event : result.clearance_events)
    overlap = std::max(overlap, event.required - event.minimum.distance);
  const auto excess = [&](LimitKind kind) {
    double largest = 0;
    for (const LimitEvent& e : limit_events_) {
      if (e.kind == kind) largest = std::max(largest, std::abs(e.worst_value - e.limit));
    }
    return largest;
  };
  const std::string early = !result.failure.empty() ? "the run failed before its end"
                            : any_phase_            ? ""
                                                    : "no motion is simulated";
  const auto row = [&](const char* name, double value, const char* unit, const std::string& note, bool applies,
                       const std::string& not_checked) {
    LedgerEntry entry{name, value, 0, unit, note, applies && any_phase_, LedgerEntry::Kind::feasibility};
    entry.not_checked = not_checked;
    result.ledger.entries.push_back(std::move(entry));
  };
  const auto limit = [&](const char* name, LimitKind kind, bool any, const char* unit, const std::string& note) {
    row(name, excess(kind), unit, any ? note : note + "; no such limits are stated", any, any ? early : "");
  };
  const std::string unseen = clearance_not_checked(problem_);
  row("clearance_violation", overlap, "m",
      fmt::format("maximum violation of the minimum distance {:g} m of two bodies, by their shapes, at any time; does "
                  "not affect the motion",
                  problem_.clearance.required),
      any_pair_, unseen.empty() ? early : unseen);
  limit("joint_position_violation", LimitKind::position, any_position_limit_, "rad or m",
        "largest excess over a joint's position limits");
  limit("joint_rate_violation", LimitKind::rate, any_rate_limit_, "rad/s or m/s",
        "largest excess over a joint's rate limit");
  limit("joint_effort_violation", LimitKind::effort, any_effort_limit_, "N m or N",
        "largest excess over a joint's effort limit, by a motion that is followed exactly");
}

namespace {

// Running maximum; a NaN is kept.
void raise_to(double& largest, double value) {
  if (!(value <= largest)) largest = value;
}

}  // namespace

// Phase name, system => report with the names of its closures; no report without closed loops.
void LoopMonitor::begin_phase(const std::string& name, const CaptureProblem& problem, const CaptureSystem& system) {
  problem_ = &problem;
  system_ = &system;
  phase_largest_ = {};
  if (system.closures.empty() && system.model.couplings().empty()) return;
  any_ = true;
  LoopReport report;
  report.phase = name;
  for (const HeldGrasp& grasp : system.grasps) {
    const GraspSetup& g = problem.grasps[grasp.grasp];
    if (grasp.closure >= 0) report.closures.push_back(g.end_effector + " - " + g.target);
  }
  for (const SlippingGrasp& slip : system.slips) {
    const GraspSetup& g = problem.grasps[slip.grasp];
    if (slip.closure >= 0) report.closures.push_back(g.end_effector + " - " + g.target + " (slips)");
  }
  for (const JointCoupling& coupling : system.model.couplings())
    report.closures.push_back(system.model.bodies()[dependent_body(coupling)].description.joint.name);
  reports_.push_back(std::move(report));
}

// Sample => per grasp its wrench on the robot and, in a loop, its defect (8.4), computed with the roots moved to the
// origin to reduce rounding errors; adds the self-stress of loops to `motor`, in place.
std::vector<GraspSample> LoopMonitor::sample(const PhaseSample& sample, const Kinematics& kinematics,
                                             std::span<double> motor) {
  std::vector<GraspSample> result(problem_->grasps.size());
  phase_largest_.raise(coupling_defects(system_->model, sample.state));
  const std::vector<Wrenchd> slips = wrenches_of_slips(*system_, kinematics, sample);
  for (std::size_t i = 0; i < slips.size(); ++i) {
    const SlippingGrasp& slip = system_->slips[i];
    result[slip.grasp].holds = true, result[slip.grasp].F_WC = slips[i];
    // Between two trees their places matter.
    if (slip.closure >= 0) phase_largest_.raise(closure_defect(slip.frames, kinematics));
  }
  if (system_->grasps.empty()) return result;
  const std::vector<GraspWrench> wrenches = wrenches_of_grasps(*system_, kinematics, sample);
  Kinematics near;
  if (!system_->closures.empty()) {
    State at_origin = sample.state;
    move_roots_to_origin(system_->model, at_origin);
    near = forward_kinematics(system_->model, at_origin);
    add_self_stress(*system_, kinematics, wrenches, motor);
  }
  for (std::size_t i = 0; i < system_->grasps.size(); ++i) {
    const HeldGrasp& grasp = system_->grasps[i];
    GraspSample& s = result[grasp.grasp];
    s.holds = grasp.closure < 0 || !sample.dynamics->setup().closures.empty();  // otherwise the loop is cut
    s.F_WC = wrenches[i].F_WC;
    if (grasp.closure < 0) continue;
    s.defect = closure_defect(grasp.frames, near);
    phase_largest_.raise(*s.defect);
  }
  return result;
}

// Outcome => rows, rank, defects before projection and sum of corrections (8.11) in the report; for cut loops the
// defects at samples.
void LoopMonitor::end_phase(const LoopOutcome& outcome) {
  if (system_->closures.empty() && system_->model.couplings().empty()) return;
  largest_.raise(phase_largest_);
  LoopReport& report = reports_.back();
  // Cut loops are not projected, so their defect is the final one.
  const bool is_cut = outcome.rows <= static_cast<int>(system_->model.couplings().size()) && !system_->closures.empty();
  const ClosureDefect& left = is_cut ? phase_largest_ : outcome.unprojected;
  report.rows = outcome.rows;
  report.rank = outcome.rank;
  report.unprojected_position = left.position;
  report.unprojected_angle = left.angle;
  report.unprojected_velocity = left.velocity;
  report.unprojected_angular_velocity = left.angular_velocity;
  report.correction_total = outcome.correction_total;
  report.integration_error = outcome.integration_error;
}

// Reports => loop reports and five ledger rows: closure defects at samples, unprojected defect, and correction_total
// with the integration error as bound (8.11). Rows do not apply without closed loops.
void LoopMonitor::write(CaptureResult& result) const {
  result.loops = reports_;
  const std::string none = "no closed loop in this run: no target is held by several arms, and no joint is coupled";
  double unprojected = 0, corrections = 0, error = 0;
  for (const LoopReport& r : reports_) {
    raise_to(unprojected, std::max(r.unprojected_position, r.unprojected_angle));
    corrections += r.correction_total;
    error += r.integration_error;
  }
  const auto row = [&](const char* name, double value, double bound, const char* unit, const char* note) {
    result.ledger.entries.push_back({name, value, bound, unit, any_ ? note : none, any_});
  };
  row("loop_closure_position", largest_.position, 1e-12, "m",
      "largest distance of a grasp's frames on end-effector and target that close a loop, and largest defect of a "
      "sliding joint that follows others, at any sample");
  row("loop_closure_angle", largest_.angle, 1e-12, "rad", "the same for their orientation, and for turning joints");
  row("loop_closure_velocity", std::max(largest_.velocity, largest_.angular_velocity), 1e-12, "m/s or rad/s",
      "the same for their relative motion");
  row("unprojected_defect", unprojected, 1e-10, "m or rad", "largest defect of one step before projection");
  row("correction_total", corrections, any_ ? error : 1e-10, "1",
      "sum of all projections; bound: the steps' error estimates and rounding; both in the norm of the step control");
}

}  // namespace grapnel
