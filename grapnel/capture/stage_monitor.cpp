#include "grapnel/capture/stage_monitor.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "grapnel/contact/caging.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

// Instants per step at which motion is evaluated, beyond its begin.
constexpr int kMotionParts = 4;

// Of a target's shapes about its frame [m].
double radius_of(const TargetSetup& target) {
  double radius = 0;
  for (const Geometry& geometry : target.geometry) {
    const ContactShape shape(geometry);
    radius = std::max(radius, norm(shape.X_BC().p) + shape.reach());
  }
  return radius;
}

StagesReport::Cage stage_cage(CageAnswer::Verdict verdict) {
  switch (verdict) {
    case CageAnswer::Verdict::caged:
      return StagesReport::Cage::caged;
    case CageAnswer::Verdict::can_leave:
      return StagesReport::Cage::can_leave;
    case CageAnswer::Verdict::undecided:
      break;
  }
  return StagesReport::Cage::undecided;
}

}  // namespace

StageMonitor::StageMonitor(const CaptureProblem& problem, const CaptureSystem& free) : problem_(problem) {
  if (problem.stages.empty()) return;
  pairs_ = contact_pairs(problem, free);
  for (const StagesSetup& setup : problem.stages) {
    Watch& watch = watches_.emplace_back();
    watch.setup = setup, watch.target = stage_target(problem, setup);
    watch.pairs = stage_pairs(problem, setup, pairs_);
    watch.report.target = problem.targets[watch.target].name;
    if (!(setup.away > 0)) watch.setup.away = radius_of(problem.targets[watch.target]);
    if (watch.setup.closing.empty() && problem.post_impact) watch.setup.closing = phase_name(problem, 0);
  }
}

// --- Time series ---

std::vector<Series> StageMonitor::series() const {
  std::vector<Series> all;
  for (const Watch& watch : watches_) {
    const std::string& target = watch.report.target;
    const std::string group = "stages/" + target + "/";
    const auto add = [&](const char* key, const char* unit, const std::string& text) {
      all.push_back({group + key, unit, text, {key}, {}});
    };
    add("grip_force", "N", "sum of the normal forces of the gripper on " + target);
    add("friction_margin", "1", "smallest share of friction that is left, over the pairs; 0: one slips; NaN: apart");
    add("speed", "m/s", "speed of the centre of mass of " + target + " relative to the gripper's link");
    add("rate", "rad/s", "angular rate of " + target + " relative to the gripper's link");
  }
  return all;
}

void StageMonitor::put(const CaptureSystem& system, const PhaseSample& sample, SeriesRow& row) const {
  const ContactSet* set = sample.dynamics ? sample.dynamics->setup().contacts.get() : nullptr;
  const Kinematics kinematics = forward_kinematics(system.model, sample.state);
  for (const Watch& watch : watches_) {
    double force = 0, use = std::nan("");
    for (const std::size_t pair : watch.pairs) {
      if (!set || !set->group(pair).touches) continue;
      force += set->group(pair).normal_force;
      use = std::fmax(use, set->group(pair).friction_use);
    }
    const RelativeMotion now = motion(watch, system, kinematics);
    row.put(force);
    row.put(1 - use);
    row.put(now.speed);
    row.put(now.rate);
  }
}

// --- Phases ---

void StageMonitor::begin_motion(const std::string& name, const PostImpactSetup& phase, double begin) {
  for (Watch& watch : watches_) {
    if (watch.report.closing_time || name != watch.setup.closing) continue;
    watch.report.closing_time = begin;
    watch.closing_end =
        begin + (phase.move ? std::min(phase.move->after + phase.move->duration, phase.duration) : phase.duration);
  }
}

void StageMonitor::end_motion(double time) {
  for (Watch& watch : watches_) {
    if (watch.report.closing_time && !watch.closed) watch.closing_end = std::min(watch.closing_end, time);
  }
}

void StageMonitor::latch(std::size_t target, double time) {
  for (Watch& watch : watches_) {
    if (watch.target == target && !watch.report.latched_time) watch.report.latched_time = time;
  }
}

void StageMonitor::begin_phase(const CaptureSystem& system, const PhaseDynamics& dynamics) {
  system_ = &system, set_ = dynamics.setup().contacts.get();
  kinematics_ = Kinematics(system.model);
}

void StageMonitor::end_phase(double) { set_ = nullptr; }

// --- Steps ---

StageMonitor::RelativeMotion StageMonitor::motion(const Watch& watch, const CaptureSystem& system,
                                                  const Kinematics& kinematics) const {
  const Model& model = system.model;
  const int frame = system.target_frames[watch.target];
  const std::string& link = watch.setup.relative_to;
  const int reference = link.empty() ? system.base : model.body_index(name_in_model(problem_, BodyName(link)));
  const Posed X_WT = frame_pose(model, kinematics, frame);
  const Vector3d p = X_WT * problem_.targets[watch.target].com;
  const Twistd V_T = shift(frame_twist(model, kinematics, frame), p - X_WT.p);
  const Twistd V_R = shift(kinematics.V_WB[reference], p - kinematics.X_WB[reference].p);
  return {norm(V_T.linear - V_R.linear), norm(V_T.angular - V_R.angular)};
}

// Relative excess of the motion over the bounds at a time of the step: not positive within them.
double StageMonitor::excess(const Watch& watch, const PhaseStep& step, double t) {
  forward_kinematics(system_->model, step.state_at(t), kinematics_);
  const RelativeMotion now = motion(watch, *system_, kinematics_);
  return std::max(now.speed / watch.setup.speed, now.rate / watch.setup.rate) - 1;
}

bool StageMonitor::touches(const Watch& watch) const {
  return std::ranges::any_of(watch.pairs, [&](std::size_t pair) { return set_->history(pair).since.has_value(); });
}

void StageMonitor::step(const PhaseStep& step) {
  if (!set_) return;
  for (Watch& watch : watches_) {
    if (!watch.report.latched_time) observe_target(watch, step);
  }
}

// Step => contact, end of closing, and rest of the target.
void StageMonitor::observe_target(Watch& watch, const PhaseStep& step) {
  watch.touches = touches(watch);
  for (const std::size_t pair : watch.pairs) {
    const std::optional<double>& first = set_->history(pair).first_time;
    std::optional<double>& earliest = watch.report.contact_time;
    if (first && (!earliest || *first < *earliest)) earliest = first;
  }
  if (watch.report.closing_time && !watch.closed && watch.closing_end <= step.end * (1 + 1e-12)) close(watch, step);
  if (watch.report.closing_time) observe_rest(watch, step);
  if (!watch.report.contact_time) return;
  forward_kinematics(system_->model, step.state_at(step.end), kinematics_);
  if (watch.touches) {
    watch.away_since.reset();
    note_grip(watch);
  } else {
    watch.report.grip_force = 0;
    observe_distance(watch, step.end);
  }
}

// A touched target without contact => since when it is away; the kinematics are those of the time.
void StageMonitor::observe_distance(Watch& watch, double time) {
  for (std::size_t p = 0; p < set_->size(); ++p) {
    if (std::ranges::find(watch.pairs, static_cast<std::size_t>(set_->group_of(p))) == watch.pairs.end()) continue;
    if (set_->separation(p, kinematics_).distance > watch.setup.away) continue;
    watch.away_since.reset();
    return;
  }
  if (!watch.away_since) watch.away_since = time;
}

// Step => the time since which the target is quiet, and the settling.
void StageMonitor::observe_rest(Watch& watch, const PhaseStep& step) {
  double before = step.begin, excess_before = watch.quiet_since ? -1 : excess(watch, step, step.begin);
  for (int i = 1; i <= kMotionParts; ++i) {
    const double t = i == kMotionParts ? step.end : step.begin + (step.end - step.begin) * i / kMotionParts;
    const double now = excess(watch, step, t);
    if (!watch.touches || now > 0) {
      disturb(watch, t);
    } else if (!watch.quiet_since) {
      double low = before, high = t;
      for (int k = 0; k < 40 && excess_before > 0; ++k) {
        const double middle = 0.5 * (low + high);
        (excess(watch, step, middle) > 0 ? low : high) = middle;
      }
      watch.quiet_since = excess_before > 0 ? high : before;
    }
    before = t, excess_before = now;
  }
  watch.due.reset();
  if (!watch.quiet_since) return;
  const double due = *watch.quiet_since + watch.setup.time;
  if (step.end >= due && !watch.settled) settle(watch, step);
  // Past times come due in the next step, since its stop condition is evaluated before this function.
  constexpr double kSoon = 1e-9;
  if (!watch.settled || !may_leave(watch)) watch.due = std::max(due, step.end + kSoon * std::max(1.0, step.end));
}

// The target moves, or is not touched.
void StageMonitor::disturb(Watch& watch, double time) {
  watch.quiet_since.reset();
  if (!watch.settled) return;
  using Failure = StagesReport::Failure;
  watch.settled = false;
  watch.report.failure = watch.touches ? Failure::slipped : Failure::lost;
  watch.report.failure_time = time;
}

void StageMonitor::settle(Watch& watch, const PhaseStep& step) {
  watch.settled = true;
  watch.report.failure = StagesReport::Failure::none, watch.report.failure_time.reset();
  if (!watch.report.settled_time) watch.report.settled_time = *watch.quiet_since + watch.setup.time;
  if (watch.setup.cage) search(watch, step, step.end);
}

// Closing ends.
void StageMonitor::close(Watch& watch, const PhaseStep& step) {
  watch.closed = true;
  if (watch.touches) watch.report.closed_time = watch.closing_end;
  if (watch.setup.cage) search(watch, step, std::clamp(watch.closing_end, step.begin, step.end));
}

// Grip force and friction margin at the end of a step; the kinematics are those of its state.
void StageMonitor::note_grip(Watch& watch) {
  wrenches_.clear();
  set_->evaluate(kinematics_, wrenches_);
  double force = 0, use = 0;
  for (const std::size_t pair : watch.pairs) {
    force += set_->group(pair).normal_force;
    use = std::max(use, set_->group(pair).friction_use);
  }
  watch.report.grip_force = force;
  if (!watch.settled) return;
  watch.report.least_friction_margin = std::min(watch.report.least_friction_margin.value_or(1), 1 - use);
}

// Bodies at a time of the step => search of an escape path from the gripper.
void StageMonitor::search(Watch& watch, const PhaseStep& step, double time) {
  forward_kinematics(system_->model, step.state_at(time), kinematics_);
  const BodyName target = BodyName::of_target(watch.target);
  std::vector<int> of_gripper, of_target = bodies_of_target(*system_, watch.target);
  for (const std::size_t pair : watch.pairs) {
    const ContactPair& bodies = pairs_[pair];
    const BodyName& link = bodies.a.target == watch.target ? bodies.b : bodies.a;
    for (const int body : bodies_named(problem_, *system_, link)) of_gripper.push_back(body);
  }
  const Posed X_WT = kinematics_.X_WB[target_body_index(*system_, watch.target)];
  const auto contains = [](const std::vector<int>& bodies, int body) {
    return std::ranges::find(bodies, body) != bodies.end();
  };
  Cage cage{{}, {}, X_WT};
  for (const PlacedShape& shape : shapes_in_model(problem_, *system_)) {
    if (contains(of_gripper, shape.body)) {
      cage.fixed.push_back({kinematics_.X_WB[shape.body], ContactShape(shape.geometry)});
    } else if (contains(of_target, shape.body)) {
      Geometry geometry = shape.geometry;  // panels are at rest, too
      geometry.X_BG = inverse(X_WT) * kinematics_.X_WB[shape.body] * geometry.X_BG;
      cage.moving.push_back(ContactShape(geometry));
    }
  }
  const CageAnswer answer = search_cage(cage, {watch.setup.cage->resolution, watch.setup.cage->poses});
  StagesReport& report = watch.report;
  report.cage = stage_cage(answer.verdict);
  report.cage_time = time, report.cage_allowance = answer.allowance, report.cage_poses = answer.cells;
  if (report.cage == StagesReport::Cage::caged && !report.caged_time) report.caged_time = time;
}

// --- Grasps ---

bool StageMonitor::has_latched() const {
  return std::ranges::any_of(watches_, [](const Watch& watch) { return watch.report.latched_time.has_value(); });
}

bool StageMonitor::is_settled(std::size_t target) const {
  return std::ranges::any_of(
      watches_, [&](const Watch& watch) { return watch.target == target && watch.settled && !may_leave(watch); });
}

// A target settles at `due` unless it moves before; observe_rest() moves that time.
StopCondition StageMonitor::stop_condition(const std::vector<bool>& waiting) const {
  if (std::ranges::none_of(watches_, [&](const Watch& watch) { return waiting[watch.target]; })) return {};
  return [this, waiting](double t, const State&) {
    double least = std::numeric_limits<double>::infinity();
    for (const Watch& watch : watches_) {
      if (waiting[watch.target] && watch.due) least = std::min(least, *watch.due - t);
    }
    return least;
  };
}

// --- The end ---

// Observations => the last stage and the failure.
void StageMonitor::conclude(const Watch& watch, StagesReport& report) {
  using Stage = StagesReport::Stage;
  using Failure = StagesReport::Failure;
  for (const Choice& choice : type_of<Stage>().choices) {
    const auto stage = static_cast<Stage>(choice.value);
    if (stage_time(report, stage)) report.reached = std::max(report.reached, stage);
  }
  if (report.latched_time || report.failure != Failure::none) return;
  const auto fail = [&](Failure failure, std::optional<double> time) {
    report.failure = failure, report.failure_time = time;
  };
  if (!report.contact_time) return fail(watch.closed ? Failure::closed_on_nothing : Failure::no_contact, {});
  if (watch.settled) {
    if (may_leave(watch)) fail(Failure::jammed, report.settled_time);
  } else {
    watch.away_since ? fail(Failure::pushed_away, watch.away_since) : fail(Failure::not_settled, {});
  }
}

void StageMonitor::write(CaptureResult& result) const {
  for (const Watch& watch : watches_) {
    StagesReport report = watch.report;
    conclude(watch, report);
    result.stages.push_back(std::move(report));
  }
}

}  // namespace grapnel
