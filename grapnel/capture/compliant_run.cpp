#include "grapnel/capture/compliant_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "grapnel/capture/contact.hpp"
#include "grapnel/capture/internal_loads.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/captured_model.hpp"
#include "grapnel/problem/enumeration_names.hpp"

namespace grapnel {

template <>
struct Described<ImpactSolution::Status>
    : Enumeration<ImpactSolution::Status, "ImpactStatus", "solved", "separated", "settled", "time_over", "failed"> {};

namespace {

// Relative to the kinetic energy before: permitted energy in grasps' springs at the end, which remains if grasps are at
// rest and the joined bodies rotate.
constexpr double kLeftInGrasps = 1e-3;
// Relative to the energy in the impact: remaining energy that barely changes the motion afterwards.
constexpr double kNegligible = 1e-4;

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
struct Closing {
  std::vector<Grasp> grasps;
  std::vector<Vector3d> normals;
};
Closing closing_in(const CaptureProblem& problem, const CaptureSystem& free, const Contact& contact,
                   const CaptureSystem& system) {
  Closing closing{contact.grasps, contact_normals(problem, free, forward_kinematics(free.model, contact.state))};
  for (Grasp& grasp : closing.grasps) {
    grasp.robot_body = same_body(free.model, grasp.robot_body, system.model);
    grasp.target_body = same_body(free.model, grasp.target_body, system.model);
  }
  return closing;
}

// Maximum loads of the joints over the samples, and their times.
class JointPeaks {
 public:
  JointPeaks(const Model& model, std::vector<JointImpulse>& joints) : model_(model), joints_(joints) {
    for (const JointImpulse& joint : joints) bodies_.push_back(model.body_index(joint.body));
    times_.resize(joints.size());
  }

  void observe(double time, const Kinematics& k, std::span<const Wrenchd> through) {
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

// The wrench of a closure on its body a at C, in W, from the multipliers of all.
Wrenchd closure_wrench_in_world(const CaptureSystem& system, const Kinematics& k, std::span<const double> multipliers,
                                std::size_t closure) {
  std::size_t row = 0;
  for (std::size_t c = 0; c < closure; ++c) row += static_cast<std::size_t>(row_count(system.closures[c].model));
  const LoopClosure& loop = system.closures[closure];
  const Rotationd R_WC = (k.X_WB[loop.body_a] * loop.X_AC).R;
  return R_WC * closure_wrench(loop, multipliers.subspan(row, static_cast<std::size_t>(row_count(loop.model))));
}

Momentumd momentum_about_origin(const Model& model, const State& state) {
  return momentum_about(model, forward_kinematics(model, state), Vector3d::zero());
}

// Evaluates the samples: peaks of the joints' loads are added to the report.
void evaluate_samples(const CompliantTask& task, std::span<const Grasp> grasps, const ImpactSolution& solution,
                      ImpactOutcome& outcome) {
  const Model& model = task.system.model;
  const bool fixed = !model.has_free_root(task.system.base);
  JointPeaks peaks(model, outcome.report.joints);
  Momentumd before = momentum_about_origin(model, task.start), from_fixed = Momentumd::zero();
  CompliantSample sample;
  sample.kinematics = Kinematics(model);
  const Kinematics& k = sample.kinematics;
  std::vector<ExternalWrench> external;
  std::vector<Wrenchd> through;  // per body: the wrench transmitted by its joint
  for (std::size_t s = 0; s < solution.times.size(); ++s) {
    sample.time = solution.times[s];
    sample.state = solution.states[s];
    forward_kinematics(model, sample.state, sample.kinematics);
    external.clear(), sample.grasp_wrenches.clear(), sample.held_wrenches.clear(), sample.slip_wrenches.clear();
    for (std::size_t i = 0; i < grasps.size(); ++i) {
      const ForceHistory& h = solution.forces[i];
      const Wrenchd F{h.moment[s], h.force[s]};
      external.push_back({grasps[i].robot_body, h.point[s], F});
      external.push_back({grasps[i].target_body, h.point[s], -F});
      sample.grasp_wrenches.push_back(F);
    }
    const ShapeSample* shapes = task.shapes && task.shapes->touched ? &task.shapes->samples[s] : nullptr;
    if (shapes) {
      external.insert(external.end(), shapes->wrenches.begin(), shapes->wrenches.end());
      sample.contacts = shapes->groups;
    }
    std::vector<Wrenchd> of_closures;
    for (std::size_t c = 0; c < task.system.closures.size(); ++c) {
      const LoopClosure& loop = task.system.closures[c];
      of_closures.push_back(closure_wrench_in_world(task.system, k, solution.loop_multipliers[s], c));
      const Vector3d p_WC = (k.X_WB[loop.body_a] * loop.X_AC).p;
      external.push_back({loop.body_a, p_WC, of_closures.back()});
      external.push_back({loop.body_b, p_WC, -of_closures.back()});
    }
    joint_wrenches(model, k, solution.accelerations[s], external, through);
    peaks.observe(sample.time, k, through);
    // its target hangs on the robot: the transmitted wrench, reversed; or it closes a loop
    for (const HeldGrasp& held : task.system.grasps) {
      if (held.closure != HeldGrasp::kInTree) {
        sample.held_wrenches.push_back(held.closure == HeldGrasp::kRedundant
                                           ? Wrenchd::zero()
                                           : of_closures[static_cast<std::size_t>(held.closure)]);
        continue;
      }
      const Grasp grasp = grasp_of(held, k);
      const int target = grasp.target_body;
      sample.held_wrenches.push_back(-shift(through[target], grasp.p_WC - k.X_WB[target].p));
    }
    for (const SlippingGrasp& slip : task.system.slips)
      sample.slip_wrenches.push_back(slip.closure < 0 ? Wrenchd::zero()
                                                      : of_closures[static_cast<std::size_t>(slip.closure)]);
    if (shapes && !fixed) {
      sample.from_ground = shapes->from_fixed - from_fixed;
      from_fixed = shapes->from_fixed;
    }
    if (fixed) {  // no other external load acts on the system
      const Momentumd now = momentum_about(model, k, Vector3d::zero());
      sample.from_ground = now - before;
      before = now;
    }
    if (task.observe) task.observe(sample);
  }
  if (fixed) outcome.from_ground = momentum_about_origin(model, outcome.after) - before;
  outcome.joint_peaks = std::move(peaks).times();
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
void describe_unfinished(const CompliantTask& task, std::span<const Grasp> grasps, const ImpactSolution& solution,
                         ImpactOutcome& outcome) {
  outcome.unfinished.resize(grasps.size());
  if (solution.status != ImpactSolution::Status::time_over) return;
  const double longest = task.problem.impact->compliant.longest;
  std::vector<std::string> places;
  bool pressed = false;
  double share = 0;  // of the energy, remaining at the end
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const ForceHistory& h = solution.forces[i];
    std::string& how = outcome.unfinished[i];
    const bool contact = task.problem.grasps[i].contact;
    share = std::max(share, moving_share(outcome.report.grasps[i], contact, h));
    if (h.deformation.back() > 0 && (!contact || norm(h.force.back()) > 0)) {
      pressed = pressed || contact;
      how = fmt::format("still {} by {:.4g} m at impact.longest = {:.4g} s, with {:.4g} J in the springs",
                        contact ? "compressed" : "deformed", h.deformation.back(), longest,
                        solution.elastic_energy_after);
    } else if (contact && h.touches == 0) {
      how = fmt::format("not in touch yet at impact.longest = {:.4g} s", longest);
      share = 1;  // its impact is ahead
    }
    if (!how.empty()) places.push_back(fmt::format("{} is {}", task.problem.grasps[i].end_effector, how));
  }
  // This energy is deleted, so the balance does not close. Grasps that rotate with their target never come to rest
  // entirely.
  const double missing = solution.elastic_energy_after / solution.kinetic_energy_taking_part;
  if (pressed || !(missing <= kLeftInGrasps)) *outcome.residuals.in_time += missing;
  if (!(share >= missing)) share = missing;
  const std::string consequence =
      !(share <= kNegligible)
          ? fmt::format("the motion afterwards is unreliable: {:.2g} of the energy remains", share)
          : fmt::format("the motion afterwards deviates little: {:.2g} of the energy remains", share);
  outcome.warnings.push_back(fmt::format(
      "impact: it was not over after impact.longest = {:.4g} s, {}; {}. The {:.4g} J in springs are deleted, and "
      "grasps stop the remaining relative motion instantaneously. Increase impact.longest or impact.settled "
      "to let the "
      "impact end",
      longest, consequence, places.empty() ? "relative motion remains" : fmt::format("{}", fmt::join(places, "; ")),
      solution.elastic_energy_after));
}

void describe(const CompliantTask& task, std::span<const Grasp> grasps, const ImpactSolution& solution,
              ImpactOutcome& outcome) {
  ImpactReport& report = outcome.report;
  const CaptureSystem& system = task.system;
  report.law = name_of(task.problem.impact->law);
  report.time = task.time;
  report.duration = solution.duration;
  report.as_published_absent = "the thesis's impact is instantaneous";
  CompliantReport c;
  c.end = name_of(solution.status);
  c.duration = solution.duration;
  c.elastic_energy_after = solution.elastic_energy_after;
  c.energy_residual = solution.energy_residual;
  c.motor_work = solution.drive_work;
  c.rhs_evaluations = solution.rhs_evaluations;
  std::vector<int> held;
  for (const HeldRate& h : task.held) held.push_back(h.velocity);
  for (const ElasticMode& mode : elastic_modes(system.model, task.start, held)) {  // slowest first
    const double period = 1 / mode.frequency;
    if (c.modes == 0) c.slowest_period = period;
    c.fastest_period = period;
    ++c.modes;
    if (period > c.duration) ++c.slower_modes;
  }
  const Kinematics before = forward_kinematics(task.free.model, task.contact.state);
  const Kinematics after = forward_kinematics(system.model, solution.after);
  for (std::size_t i = 0; i < grasps.size(); ++i) {
    const ForceHistory& history = solution.forces[i];
    GraspImpulse& g = report.grasps.emplace_back(describe_grasp_before(task.problem, task.contact, before, i));
    Grasp at_end = grasps[i];
    if (!history.point.empty()) at_end.p_WC = history.point.back();
    describe_grasp_after(at_end, solution.contacts[i], after, history.duration, g);
    g.profile = profile_of(history);
    c.energy_lost += history.energy_lost;
  }
  report.compliant = c;
  report.joints_during = name_of(task.problem.impact->joints);
  describe_held(system.model, task.held, task.start.v, solution, task.stopping, report);
  std::vector<ExternalImpulse> external = impulses_at(grasps, solution);
  if (task.shapes && task.shapes->touched) {
    for (const ShapeImpulse& P : task.shapes->impulses) {
      if (P.body_a >= 0) external.push_back({P.body_a, task.shapes->point, -P.on_b});
      if (P.body_b >= 0) external.push_back({P.body_b, task.shapes->point, P.on_b});
    }
  }
  for (std::size_t l = 0; l < solution.loop_impulses.size(); ++l) {
    external.push_back({system.closures[l].body_a, solution.loop_point, solution.loop_impulses[l]});
    external.push_back({system.closures[l].body_b, solution.loop_point, -solution.loop_impulses[l]});
  }
  describe_change(task.problem, system, task.start, solution.after, external, report);
}

}  // namespace

std::vector<ClosingContact> closing_contacts(const CaptureProblem& problem, const CaptureSystem& free,
                                             const Contact& contact, const CaptureSystem& system) {
  const Closing closing = closing_in(problem, free, contact, system);
  std::vector<ClosingContact> contacts;
  for (std::size_t i = 0; i < problem.grasps.size(); ++i) {
    const GraspSetup& grasp = problem.grasps[i];
    const Vector3d& n_W = closing.normals[i];
    if (grasp.contact)
      contacts.push_back(
          {grasp.end_effector, grasp.target, compliant_contact(*problem.impact, closing.grasps[i], n_W)});
  }
  return contacts;
}

ImpactOutcome run_compliant(const CompliantTask& task, const State& braked) {
  const ImpactSetup& setup = *task.problem.impact;
  const Closing closing = closing_in(task.problem, task.free, task.contact, task.system);
  const ImpactSolution solution = impact_law(setup).solve({.model = task.system.model,
                                                           .state = braked,
                                                           .setup = setup,
                                                           .root = task.system.base,
                                                           .grasps = closing.grasps,
                                                           .normals = closing.normals,
                                                           .held = task.held,
                                                           .each_step = task.each_step,
                                                           .drive = task.drive,
                                                           .shapes = task.shapes,
                                                           .loops = task.system.closures});
  if (solution.status == ImpactSolution::Status::failed)
    throw std::runtime_error(fmt::format("compliant impact from t = {:.6g} s: {}", task.time, solution.message));
  ImpactOutcome outcome;
  outcome.after = solution.after;
  outcome.residuals.in_time = solution.energy_residual;
  describe(task, closing.grasps, solution, outcome);
  evaluate_samples(task, closing.grasps, solution, outcome);
  describe_unfinished(task, closing.grasps, solution, outcome);
  return outcome;
}

}  // namespace grapnel
