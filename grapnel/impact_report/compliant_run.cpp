#include "grapnel/impact_report/compliant_run.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact_report/contact.hpp"
#include "grapnel/impact_report/internal_loads.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/enumeration_names.hpp"

namespace grapnel {

template <>
struct Described<CompliantOutcome::Status>
    : Enumeration<CompliantOutcome::Status, "CompliantStatus", "separated", "settled", "time_over", "failed"> {};

namespace {

// Relative to the kinetic energy before: permitted energy in grasps' springs at the end, which remains if grasps are at
// rest and the joined bodies rotate.
constexpr double kLeftInGrasps = 1e-3;
// Relative to the energy in the impact: remaining energy that barely changes the motion afterwards.
constexpr double kNegligible = 1e-4;

// The index of a grasp of the problem in the solver's lists.
struct Place {
  bool contact = false;
  std::size_t index = 0;
};

int same_body(const Model& from, int body, const Model& in) {
  return in.body_index(from.bodies()[body].description.name);
}

ForceProfile profile_of(const ForceHistory& history) {
  ForceProfile p;
  p.peak_force = history.peak_force, p.peak_force_time = history.peak_force_time;
  p.peak_moment = history.peak_moment, p.peak_moment_time = history.peak_moment_time;
  p.largest_deformation = history.largest_deformation;
  p.duration = history.duration;
  p.energy_lost = history.energy_lost;
  p.touches = history.touches;
  return p;
}

// The grasps and contacts of the impact, in the bodies of `system`.
class Yielding {
 public:
  Yielding(const CaptureProblem& problem, const CaptureSystem& free, const Contact& contact,
           const CaptureSystem& system) {
    const ImpactSetup& impact = *problem.impact;
    const Kinematics k = forward_kinematics(free.model, contact.state);
    for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
      Grasp grasp = contact.grasps[i];
      grasp.robot_body = same_body(free.model, grasp.robot_body, system.model);
      grasp.target_body = same_body(free.model, grasp.target_body, system.model);
      if (!problem.grasps[i].contact) {
        places_.push_back({false, grasps_.size()});
        const GraspComplianceSetup& g = impact.grasp;
        grasps_.push_back({grasp, g.linear_stiffness, g.linear_damping, g.angular_stiffness, g.angular_damping});
        continue;
      }
      places_.push_back({true, contacts_.size()});
      const ContactComplianceSetup& c = impact.contact;
      CompliantContact yielding;
      yielding.robot_body = grasp.robot_body, yielding.target_body = grasp.target_body;
      yielding.p_WC = grasp.p_WC;
      yielding.n_W = contact_normal_in_world(problem, free, k, problem.grasps[i]);
      yielding.model = c.model, yielding.stiffness = c.stiffness, yielding.damping = c.damping;
      yielding.exponent = c.exponent, yielding.friction = impact.friction, yielding.slip_speed = c.slip_speed;
      contacts_.push_back(yielding);
    }
  }

  std::span<const CompliantContact> contacts() const { return contacts_; }
  std::span<const CompliantGrasp> grasps() const { return grasps_; }
  std::size_t size() const { return places_.size(); }

  const ForceHistory& history(const CompliantOutcome& outcome, std::size_t grasp) const {
    const Place& p = places_[grasp];
    return p.contact ? outcome.contacts[p.index] : outcome.grasps[p.index];
  }
  // The two bodies that a grasp joins.
  std::pair<int, int> bodies(std::size_t grasp) const {
    const Place& p = places_[grasp];
    if (p.contact) return {contacts_[p.index].robot_body, contacts_[p.index].target_body};
    return {grasps_[p.index].grasp.robot_body, grasps_[p.index].grasp.target_body};
  }

 private:
  std::vector<Place> places_;
  std::vector<CompliantContact> contacts_;
  std::vector<CompliantGrasp> grasps_;
};

// Maximum loads of the joints over the samples, and their times.
class JointPeaks {
 public:
  JointPeaks(const Model& model, std::vector<JointImpulse>& joints) : model_(model), joints_(joints) {
    for (const JointImpulse& joint : joints) bodies_.push_back(model.body_index(joint.body));
    times_.resize(joints.size());
  }

  void look(double time, const Kinematics& k, std::span<const Wrenchd> through) {
    const auto raise = [&](double value, double& peak, double& at) {
      if (value > peak) peak = value, at = time;
    };
    for (std::size_t j = 0; j < bodies_.size(); ++j) {
      const int body = bodies_[j];
      const JointDescription& description = model_.bodies()[body].description.joint;
      JointImpulse& joint = joints_[j];
      const Wrenchd& F = through[body];
      raise(norm(F.linear), joint.peak_force, times_[j].force);
      raise(norm(F.angular), joint.peak_moment, times_[j].moment);
      if (!has_one_axis(description.type)) continue;
      const Vector3d axis = k.X_WB[body].R * description.axis;
      const double driving = dot(axis, slides_along_axis(description.type) ? F.linear : F.angular);
      raise(std::abs(driving), joint.peak_driving, times_[j].driving);
    }
  }

  std::vector<JointPeakTimes> times() && { return std::move(times_); }

 private:
  const Model& model_;
  std::vector<JointImpulse>& joints_;
  std::vector<int> bodies_;
  std::vector<JointPeakTimes> times_;
};

Momentumd momentum_about_origin(const Model& model, const State& state) {
  return momentum_about(model, forward_kinematics(model, state), Vector3d::zero());
}

// Evaluates the samples: peaks of the joints' loads are added to the report.
void look_at_samples(const CompliantTask& task, const Yielding& yielding, const CompliantOutcome& outcome,
                     CompliantRun& run) {
  const Model& model = task.system.model;
  const bool fixed = !model.has_free_root(task.system.base);
  JointPeaks peaks(model, run.report.joints);
  Momentumd before = momentum_about_origin(model, task.met);
  CompliantSample sample;
  sample.kinematics = Kinematics(model);
  const Kinematics& k = sample.kinematics;
  std::vector<ExternalWrench> external;
  std::vector<Wrenchd> through;  // per body: the wrench transmitted by its joint
  for (std::size_t s = 0; s < outcome.times.size(); ++s) {
    sample.time = outcome.times[s];
    sample.state = outcome.states[s];
    forward_kinematics(model, sample.state, sample.kinematics);
    external.clear(), sample.grasp_wrenches.clear(), sample.held_wrenches.clear();
    for (std::size_t i = 0; i < yielding.size(); ++i) {
      const ForceHistory& h = yielding.history(outcome, i);
      const Wrenchd F{h.moment[s], h.force[s]};
      external.push_back({yielding.bodies(i).first, h.point[s], F});
      external.push_back({yielding.bodies(i).second, h.point[s], -F});
      sample.grasp_wrenches.push_back(F);
    }
    joint_wrenches(model, k, outcome.accelerations[s], external, through);
    peaks.look(sample.time, k, through);
    // its target hangs on the robot: the transmitted wrench, reversed
    for (const HeldGrasp& held : task.system.grasps) {
      const Grasp grasp = grasp_of(held, k);
      const int target = grasp.target_body;
      sample.held_wrenches.push_back(-shift(through[target], grasp.p_WC - k.X_WB[target].p));
    }
    if (fixed) {  // no other external load acts on the system
      const Momentumd now = momentum_about(model, k, Vector3d::zero());
      sample.from_ground = now - before;
      before = now;
    }
    if (task.look) task.look(sample);
  }
  if (fixed) run.from_ground = momentum_about_origin(model, run.after) - before;
  run.joint_peaks = std::move(peaks).times();
}

// Brakes and drives: immediately at the beginning, then at a constant rate.
void describe_held(const CompliantTask& task, const CompliantOutcome& outcome, ImpactReport& report) {
  report.joints_during = name_of(task.problem.impact->joints);
  for (std::size_t i = 0; i < task.held.size(); ++i) {
    const HeldRate& held = task.held[i];
    const double before = task.met.v[held.velocity], kept = outcome.held_impulses[i];
    HeldJoint joint;
    joint.joint = held_joint(task.system.model, held).name;
    joint.impulse = task.stopping[i] + kept;
    joint.work = 0.5 * task.stopping[i] * (before + held.after) + kept * held.after;
    joint.commanded_rate = joint.rate_after = held.after;
    report.held_joints.push_back(std::move(joint));
  }
}

// The remaining fraction of the energy of a grasp's relative motion. A contact that is still being compressed has its
// impact ahead, one that expands behind.
double moving_share(const GraspImpulse& g, bool contact, const ForceHistory& h) {
  const std::size_t size = h.deformation.size();
  if (contact && !(size > 1 && h.deformation[size - 1] > h.deformation[size - 2])) return 0;
  const auto share = [](const Vector3d& after, const Vector3d& before) {
    return dot(before, before) > 0 ? dot(after, after) / dot(before, before) : 0.0;
  };
  const double linear = share(g.relative_velocity_after, g.relative_velocity_before);
  if (contact) return linear;
  // Either part may be zero before.
  return std::min(linear, share(g.relative_angular_velocity_after, g.relative_angular_velocity_before));
}

// Effects of the end by impact.longest, per grasp; and on the energy balance.
void describe_unfinished(const CompliantTask& task, const Yielding& yielding, const CompliantOutcome& outcome,
                         CompliantRun& run) {
  run.unfinished.resize(yielding.size());
  if (outcome.status != CompliantOutcome::Status::time_over) return;
  const double longest = task.problem.impact->compliant.longest;
  std::vector<std::string> places;
  bool pressed = false;
  double share = 0;  // of the energy, remaining at the end
  for (std::size_t i = 0; i < yielding.size(); ++i) {
    const ForceHistory& h = yielding.history(outcome, i);
    std::string& how = run.unfinished[i];
    const bool contact = task.problem.grasps[i].contact;
    share = std::max(share, moving_share(run.report.grasps[i], contact, h));
    if (h.deformation.back() > 0 && (!contact || norm(h.force.back()) > 0)) {
      pressed = pressed || contact;
      how =
          fmt::format("still {} by {:.4g} m at impact.longest = {:.4g} s, with {:.4g} J in the springs",
                      contact ? "compressed" : "deformed", h.deformation.back(), longest, outcome.elastic_energy_after);
    } else if (contact && h.touches == 0) {
      how = fmt::format("not in touch yet at impact.longest = {:.4g} s", longest);
      share = 1;  // its impact is ahead
    }
    if (!how.empty()) places.push_back(fmt::format("{} is {}", task.problem.grasps[i].end_effector, how));
  }
  // This energy is deleted, so the balance does not close. Grasps that rotate with their target never come to rest
  // entirely.
  const double missing = outcome.elastic_energy_after / outcome.kinetic_energy_taking_part;
  if (pressed || !(missing <= kLeftInGrasps)) run.energy_residual += missing;
  if (!(share >= missing)) share = missing;
  const std::string consequence =
      !(share <= kNegligible)
          ? fmt::format("the motion afterwards is unreliable: {:.2g} of the energy remains", share)
          : fmt::format("the motion afterwards deviates little: {:.2g} of the energy remains", share);
  run.warnings.push_back(fmt::format(
      "impact: it was not over after impact.longest = {:.4g} s, {}; {}. The {:.4g} J in springs are deleted, and "
      "grasps stop the remaining relative motion instantaneously. Increase impact.longest or impact.settled "
      "to let the "
      "impact end",
      longest, consequence, places.empty() ? "relative motion remains" : fmt::format("{}", fmt::join(places, "; ")),
      outcome.elastic_energy_after));
}

// One grasp or contact; `after`: of the system.
GraspImpulse describe_yielding(const CompliantTask& task, const Yielding& yielding, const CompliantOutcome& outcome,
                               const Kinematics& before, const Kinematics& after, std::size_t i) {
  const ForceHistory& history = yielding.history(outcome, i);
  GraspImpulse g = describe_meeting(task.problem, task.contact, before, i);
  g.impulse = history.impulse.linear, g.angular_impulse = history.impulse.angular;
  g.impulse_magnitude = norm(g.impulse);
  g.mean_force = history.duration > 0 ? g.impulse_magnitude / history.duration : 0;
  g.determined.assign(6, true);
  g.profile = profile_of(history);
  const auto [robot, target] = yielding.bodies(i);
  const Vector3d p = history.point.empty() ? g.contact_point : history.point.back();
  const Twistd u =
      shift(after.V_WB[robot], p - after.X_WB[robot].p) - shift(after.V_WB[target], p - after.X_WB[target].p);
  g.relative_velocity_after = u.linear, g.relative_angular_velocity_after = u.angular;
  return g;
}

void describe(const CompliantTask& task, const Yielding& yielding, const CompliantOutcome& outcome, CompliantRun& run) {
  ImpactReport& report = run.report;
  const CaptureSystem& system = task.system;
  report.law = name_of(ImpactSetup::Law::compliant);
  report.time = task.time;
  report.duration = outcome.duration;
  report.as_published_absent = "the thesis's impact is instantaneous";
  CompliantReport c;
  c.end = name_of(outcome.status);
  c.duration = outcome.duration;
  c.elastic_energy_after = outcome.elastic_energy_after;
  c.energy_residual = outcome.energy_residual;
  c.motor_work = outcome.drive_work;
  c.rhs_evaluations = outcome.rhs_evaluations;
  std::vector<int> held;
  for (const HeldRate& h : task.held) held.push_back(h.velocity);
  for (const ElasticMode& mode : elastic_modes(system.model, task.met, held)) {  // slowest first
    const double period = 1 / mode.frequency;
    if (c.modes == 0) c.slowest_period = period;
    c.fastest_period = period;
    ++c.modes;
    if (period > c.duration) ++c.slower_modes;
  }
  const Kinematics before = forward_kinematics(task.free.model, task.contact.state);
  const Kinematics after = forward_kinematics(system.model, outcome.after);
  std::vector<ExternalImpulse> external;
  for (std::size_t i = 0; i < yielding.size(); ++i) {
    const GraspImpulse g = describe_yielding(task, yielding, outcome, before, after, i);
    c.energy_lost += g.profile->energy_lost;
    const Impulsed P{g.angular_impulse, g.impulse};
    external.push_back({yielding.bodies(i).first, g.contact_point, P});
    external.push_back({yielding.bodies(i).second, g.contact_point, -P});
    report.grasps.push_back(g);
  }
  report.compliant = c;
  describe_held(task, outcome, report);
  describe_change(task.problem, system, task.met, outcome.after, external, report);
}

}  // namespace

std::vector<YieldingContact> yielding_contacts(const CaptureProblem& problem, const CaptureSystem& free,
                                               const Contact& contact, const CaptureSystem& system) {
  const Yielding yielding(problem, free, contact, system);
  std::vector<YieldingContact> contacts;
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    if (problem.grasps[i].contact) contacts.push_back({i, yielding.contacts()[contacts.size()]});
  }
  return contacts;
}

CompliantRun run_compliant(const CompliantTask& task, const State& braked) {
  const Yielding yielding(task.problem, task.free, task.contact, task.system);
  std::vector<int> held;
  for (const HeldRate& h : task.held) held.push_back(h.velocity);
  const CompliantSetup& setup = task.problem.impact->compliant;
  const CompliantOutcome outcome = compliant_impact(task.system.model, braked, yielding.contacts(), yielding.grasps(),
                                                    setup, held, task.each_step, task.drive);
  CompliantRun run;
  if (outcome.status == CompliantOutcome::Status::failed) {
    run.failure = fmt::format("compliant impact from t = {:.6g} s: {}", task.time, outcome.message);
    return run;
  }
  run.after = outcome.after;
  run.duration = outcome.duration;
  run.energy_residual = outcome.energy_residual;
  describe(task, yielding, outcome, run);
  look_at_samples(task, yielding, outcome, run);
  describe_unfinished(task, yielding, outcome, run);
  return run;
}

}  // namespace grapnel
