#include "grapnel/approach/predicted_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "grapnel/approach/phase_setups.hpp"
#include "grapnel/problem/contact_surfaces.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {
namespace {

// Pairs of targets, panels and obstacles.
std::vector<ContactPair> pairs_without_links(const CaptureProblem& problem) {
  if (problem.contacts.empty()) return {};
  std::vector<ContactPair> pairs = contact_pairs(problem, make_capture_system(problem));
  const auto is_link = [](const BodyName& body) { return !body.target && !body.obstacle; };
  std::erase_if(pairs, [&](const ContactPair& pair) { return is_link(pair.a) || is_link(pair.b); });
  return pairs;
}

// The problem without its servicer: a base fixed in W, without shape, takes its place.
CaptureProblem targets_alone(const CaptureProblem& problem) {
  CaptureProblem alone;
  alone.robot.base = "base", alone.robot.base_mode = RobotSetup::Base::fixed;
  BodyDescription base;
  base.name = alone.robot.base, base.joint.name = base.name, base.joint.type = JointType::fixed;
  base.mass = 1, base.inertia = Symmetric3d::diagonal(1, 1, 1);
  alone.robot.bodies = {base};
  alone.gravity = problem.gravity, alone.orbit = problem.orbit;
  alone.targets = problem.targets, alone.obstacles = problem.obstacles;
  alone.integration = problem.integration;
  for (const LoadSetup& load : problem.loads) {
    if (load.body.target) alone.loads.push_back(load);
  }
  return alone;
}

// One simulation of the targets alone.
class TargetsWithContacts {
 public:
  TargetsWithContacts(const CaptureProblem& problem, std::vector<ContactPair> pairs)
      : problem_(targets_alone(problem)),
        pairs_(std::move(pairs)),
        system_(make_capture_system(problem_)),
        contacts_(make_contact_set(problem_, system_, pairs_)) {}

  // Motion at t0 => outcome at t1; instants are recorded while bodies touch and after each impact.
  PhaseOutcome simulate(const TargetPlan& plan, double t0, double t1, const std::function<void(double)>& each_step) {
    State start = initial_servicer_state(problem_, system_);
    for (std::size_t t = 0; t < plan.start.size(); ++t) {
      const int body = system_.model.frames()[system_.target_frames[t]].body;
      set_root_pose(system_.model, body, plan.start[t].X_WT, start);
      set_root_twist(system_.model, body, plan.start[t].V_WT, start);
    }
    let_overlaps_pass(start, t0);
    PhaseSetup setup;
    setup.drives.resize(system_.model.joints().size());
    setup.gravity = problem_.gravity;
    setup.loads = loads_on(system_, problem_.loads);
    if (problem_.orbit) setup.orbit = reference_orbit(*problem_.orbit);
    setup.contacts = contacts_;
    PhaseDynamics dynamics(system_.model, setup);
    StepWatch watch;
    watch.each_step = each_step;
    watch.probe = [&](const PhaseStep& step) { note(step); };
    watch.impact = [&](const HardImpact&) { jumped_ = true; };
    return simulate_phase(dynamics, {start, t0, t1}, problem_.integration, {.watch = watch});
  }

  std::vector<TargetMotion> motions(const State& state) const {
    const Kinematics kinematics = forward_kinematics(system_.model, state);
    std::vector<TargetMotion> result;
    for (const int frame : system_.target_frames)
      result.push_back({frame_pose(system_.model, kinematics, frame), frame_twist(system_.model, kinematics, frame)});
    return result;
  }

  struct Recorded {
    double time;
    std::vector<TargetMotion> targets;
  };
  const std::vector<Recorded>& recorded() const { return recorded_; }

  std::vector<TargetContact> contacts() const {
    std::vector<TargetContact> found;
    for (std::size_t g = 0; g < pairs_.size(); ++g) {
      if (const std::optional<double> time = contacts_->history(g).first_time)
        found.push_back({pairs_[g].a, pairs_[g].b, *time});
    }
    std::ranges::stable_sort(found, {}, &TargetContact::time);
    return found;
  }

 private:
  void let_overlaps_pass(const State& start, double t0) {
    const Kinematics kinematics = forward_kinematics(system_.model, start);
    for (std::size_t p = 0; p < contacts_->size(); ++p) {
      if (contacts_->separation(p, kinematics).distance < 0)
        contacts_->let_pass(contacts_->group_of(p), kinematics, t0);
    }
  }

  // A contact ends with a step, whose end is the last instant; modes change after the step.
  void note(const PhaseStep& step) {
    if (jumped_) recorded_.push_back({step.begin, motions(step.state_at(step.begin))});
    if (contacts_->touches()) recorded_.push_back({step.end, motions(step.state_at(step.end))});
    jumped_ = false;
  }

  const CaptureProblem problem_;
  const std::vector<ContactPair> pairs_;
  const CaptureSystem system_;
  const std::shared_ptr<ContactSet> contacts_;
  std::vector<Recorded> recorded_;
  bool jumped_ = false;  // by an impact, since the last step
};

}  // namespace

// Motion without contacts => the same with those of targets and obstacles.
TargetPlan predict_contacts(const CaptureProblem& problem, TargetPlan free, double begin, double end,
                            const std::function<void(double t)>& each_step) {
  std::vector<ContactPair> pairs = pairs_without_links(problem);
  if (pairs.empty()) return free;
  TargetsWithContacts targets(problem, std::move(pairs));
  const PhaseOutcome outcome = targets.simulate(free, begin, end, each_step);
  if (!outcome.finished)
    throw std::runtime_error("predicting contacts of the targets before the capture: " + outcome.failure);
  free.contacts = targets.contacts();
  if (free.contacts.empty()) return free;
  free.instants.assign(problem.targets.size(), {});
  const std::vector<TargetMotion> at_end = targets.motions(outcome.end_state);
  for (std::size_t t = 0; t < problem.targets.size(); ++t) {
    const bool touched = std::ranges::any_of(
        free.contacts, [&](const TargetContact& contact) { return contact.a.target == t || contact.b.target == t; });
    if (!touched) continue;
    free.instants[t].push_back({begin, free.start[t]});
    for (const auto& instant : targets.recorded()) free.instants[t].push_back({instant.time, instant.targets[t]});
    free.capture[t] = at_end[t];
  }
  return free;
}

// Plan => motion at a time, propagated from the capture, or from the last instant before it if there are contacts.
TargetMotion motion_in_plan(const CaptureProblem& problem, const TargetPlan& plan, std::size_t target, double end,
                            double time, const std::function<void(double t)>& each_step) {
  const TargetSetup& setup = problem.targets[target];
  if (plan.instants.empty() || plan.instants[target].empty() || time >= end)
    return propagate_target(problem, setup, plan.capture[target], end, time, each_step);
  const std::vector<TargetPlan::Instant>& instants = plan.instants[target];
  auto after = std::ranges::upper_bound(instants, time, {}, &TargetPlan::Instant::time);
  if (after != instants.begin()) --after;
  return propagate_target(problem, setup, after->motion, after->time, time, each_step);
}

bool touches_after(const TargetPlan& plan, double time) {
  return std::ranges::any_of(plan.instants, [&](const std::vector<TargetPlan::Instant>& instants) {
    return !instants.empty() && instants.back().time > time;
  });
}

}  // namespace grapnel
