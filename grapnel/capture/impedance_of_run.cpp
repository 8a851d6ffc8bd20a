#include <algorithm>
#include <cmath>

#include "grapnel/capture/coordinated_law.hpp"
#include "grapnel/control/impedance.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {
namespace {

// Velocity of the centre of mass of the robot with its held targets; zero for a base on the ground.
Vector3d drift_of(const CaptureSystem& system, const Kinematics& kinematics) {
  if (!system.model.has_free_root(system.base)) return Vector3d::zero();
  double mass = 0;
  for (const Body& b : system.model.bodies()) mass += b.root == system.base ? b.description.mass : 0;
  const int roots[] = {system.base};
  return (1 / mass) * momentum_about(system.model, kinematics, kinematics.X_WB[system.base].p, roots).linear;
}

std::vector<std::string> controlled_end_effectors(const CaptureProblem& problem) {
  std::vector<std::string> names = problem.impedance->end_effectors;
  for (const GraspSetup& grasp : problem.grasps) {
    const bool fresh = std::find(names.begin(), names.end(), grasp.end_effector) == names.end();
    if (problem.impedance->end_effectors.empty() && fresh) names.push_back(grasp.end_effector);
  }
  return names;
}

// The law without the end-effectors' references, and the joints between the base and the end-effectors.
struct Prepared {
  ImpedanceLaw law;
  LawScope scope;
  std::vector<std::string> names;
};
// Problem, system => impedance law (21.1) with gains and end-effectors but without references, and the joints between
// these and the base.
Prepared prepare(const CaptureProblem& problem, const CaptureSystem& system) {
  const ImpedanceSetup& setup = *problem.impedance;
  Prepared p{{}, {{}, {}, problem.gravity}, controlled_end_effectors(problem)};
  static_cast<ImpedanceGains&>(p.law) = setup;
  const Model& model = system.model;
  std::vector<bool> carries(model.bodies().size(), false);
  for (const std::string& name : p.names) {
    const Frame& frame = model.frames()[model.frame_index(name)];
    ImpedanceEndEffector end_effector;
    end_effector.body = frame.body, end_effector.X_BE = frame.X_BE;
    p.law.end_effectors.push_back(end_effector);
    for (int body = frame.body; body >= 0; body = model.bodies()[body].parent) carries[body] = true;
  }
  for (int j : system.robot_joints) {
    if (carries[model.joints()[j]]) p.scope.joints.push_back(j);
  }
  return p;
}

// References: the end-effectors keep their current poses relative to the centre of mass.
void set_hold_references(const CaptureSystem& system, const State& state, double time, ImpedanceLaw& law) {
  const Kinematics k = forward_kinematics(system.model, state);
  for (ImpedanceEndEffector& end_effector : law.end_effectors)
    end_effector.reference = {-1, k.X_WB[end_effector.body] * end_effector.X_BE, time, drift_of(system, k)};
}

// References: straight paths to the grasp points, in the targets' frames.
void set_approach_references(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                             double time, const std::vector<std::string>& names, ImpedanceLaw& law) {
  const Kinematics k = forward_kinematics(system.model, state);
  set_hold_references(system, state, time, law);
  for (std::size_t h = 0; h < names.size(); ++h) {
    const auto grasp = std::find_if(problem.grasps.begin(), problem.grasps.end(),
                                    [&](const GraspSetup& g) { return g.end_effector == names[h]; });
    if (grasp == problem.grasps.end()) continue;
    const GraspPoint& point = grasp_point_of(problem, *grasp);
    const EndEffectorSetup& effector = end_effector_of(problem, *grasp);
    ImpedanceEndEffector& end_effector = law.end_effectors[h];
    const int target = target_body_index(system, target_index(problem, grasp->target));
    const Posed X_TE = inverse(k.X_WB[target]) * (k.X_WB[end_effector.body] * end_effector.X_BE);
    Rotationd R_end = X_TE.R;
    if (grasp->orientation == GraspSetup::Orientation::pose) R_end = point.X_TG.R;
    if (grasp->orientation == GraspSetup::Orientation::axis && effector.approach_axis && point.approach_direction)
      R_end = rotation_between(X_TE.R * *effector.approach_axis, *point.approach_direction) * X_TE.R;
    EndEffectorReference& reference = end_effector.reference;
    reference.body = target, reference.X_D = {R_end, point.X_TG.p}, reference.begin = time;
    reference.offset = X_TE.p - point.X_TG.p;
    reference.turn = rotation_vector(transpose(R_end) * X_TE.R);
    reference.arrival = grasp->relative_velocity, reference.arrival_time = problem.approach->duration;
    reference.remaining_fraction = {time,
                                    JointPath{problem.approach->profile, problem.approach->duration - time, 1, 0}};
    // It begins with the end-effector's velocity.
    const Posed& X_WT = k.X_WB[target];
    const Posed X_WE = X_WT * X_TE;
    const Vector3d w = k.V_WB[end_effector.body].angular - k.V_WB[target].angular;
    reference.departure =
        transposed_times(X_WT.R, shift(k.V_WB[end_effector.body], X_WE.p - k.X_WB[end_effector.body].p).linear -
                                     shift(k.V_WB[target], X_WE.p - X_WT.p).linear);
    reference.turn_rate = rotation_vector_rate(reference.turn, transposed_times(X_WT.R * R_end, w));
  }
}

// Impedance control of end-effectors in a phase: the approach, or the motion after the impact.
class ImpedanceOfRun : public CoordinatedLaw {
 public:
  ImpedanceOfRun(const CaptureProblem& problem, bool approach)
      : CoordinatedLaw(LawReport::Law::impedance, approach), problem_(problem), approach_(approach) {}

  bool has_work(const CaptureSystem& system) const override { return !approach_ || system.grasps.empty(); }

  std::shared_ptr<JointLaw> begin_segment(const CaptureSystem& system, const Model& law_model, const State& state,
                                          const State& known, double time) override {
    Prepared p = prepare(problem_, system);
    if (references_.empty()) {
      approach_ ? set_approach_references(problem_, system, known, time, p.names, p.law)
                : set_hold_references(system, known, time, p.law);
      for (const ImpedanceEndEffector& end_effector : p.law.end_effectors)
        references_.push_back(end_effector.reference);
      begin_report(time);
    } else {
      for (std::size_t h = 0; h < references_.size(); ++h) p.law.end_effectors[h].reference = references_[h];
    }
    p.scope.steady = steady_joints(system);  // except in an impact, in which their motors are not modelled
    law_ = std::make_shared<Impedance>(law_model, std::move(p.law), std::move(p.scope));
    describe(state, time);
    return law_;
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    note_command(sample.time, command);
    LawReport& r = *report_;
    const Impedance::Deviation d = law_->deviation(sample.time, sample.state);
    raise_to(r.largest_distance, r.largest_distance_time, d.distance, sample.time);
    raise_to(r.largest_angle, r.largest_angle_time, d.angle, sample.time);
  }

  void describe(const State& state, double time) override {
    const Impedance::Deviation d = law_->deviation(time, state);
    report_->end = time, report_->distance_after = d.distance, report_->angle_after = d.angle;
  }

 private:
  const CaptureProblem& problem_;
  const bool approach_;
  std::vector<EndEffectorReference> references_;
  std::shared_ptr<Impedance> law_;  // of the current piece
};

}  // namespace

std::unique_ptr<CoordinatedLaw> impedance_of_run(const CaptureProblem& problem) {
  if (!problem.impedance) return {};
  return std::make_unique<ImpedanceOfRun>(problem, false);
}

std::unique_ptr<CoordinatedLaw> coordinated_law_of_approach(const CaptureProblem& problem) {
  if (!problem.approach || !problem.impedance || problem.approach->tracking.mode != JointControl::impedance) return {};
  return std::make_unique<ImpedanceOfRun>(problem, true);
}

// Contacts and state before => per contact, along its normal: effective masses [kg] of end-effector and target (21.7),
// the controlled mass (or (21.9) for match: target), approach speed [m/s] and expected restitution.
std::vector<EffectiveMass> effective_masses(const CaptureProblem& problem, const CaptureSystem& system,
                                            const State& state, std::span<const ClosingContact> contacts) {
  std::vector<EffectiveMass> masses;
  const Model& model = system.model;
  const Kinematics k = forward_kinematics(model, state);
  for (const ClosingContact& contact : contacts) {
    const CompliantContact& c = contact.contact;
    EffectiveMass m;
    m.end_effector = contact.end_effector, m.target = contact.target;
    m.of_end_effector = effective_mass(model, state, c.robot_body, c.p_WC, c.n_W);
    m.of_target = effective_mass(model, state, c.target_body, c.p_WC, c.n_W);
    const auto velocity = [&](int body) { return shift(k.V_WB[body], c.p_WC - k.X_WB[body].p).linear; };
    m.target_speed_before = dot(c.n_W, velocity(c.target_body) - velocity(c.robot_body));
    double mass = m.of_end_effector;
    const bool controlled = problem.impedance && problem.impact->joints == ImpactSetup::Joints::impedance &&
                            problem.impedance->law == ImpedanceSetup::Law::operational_space &&
                            problem.impedance->force == ImpedanceSetup::Force::sensed;
    if (controlled) {
      const Vector3d& M = problem.impedance->mass;  // along the end-effector's current axes
      const Vector3d n = transposed_times(frame_pose(model, k, model.frame_index(contact.end_effector)).R, c.n_W);
      mass = 1 / (n[0] * n[0] / M[0] + n[1] * n[1] / M[1] + n[2] * n[2] / M[2]);
      if (problem.impedance->match == ImpedanceSetup::Match::target)
        mass = matching_mass(c, m.of_target, std::abs(m.target_speed_before));
      m.apparent = mass;
    }
    m.restitution = restitution_of(c, mass * m.of_target / (mass + m.of_target), std::abs(m.target_speed_before));
    masses.push_back(std::move(m));
  }
  return masses;
}

// Contacts and their effective masses => impedance law that holds the current poses during the impact (docs/theory,
// section 21.3), with matched masses along the normals for match: target; null without impedance in the impact.
std::shared_ptr<JointLaw> law_in_impact(const CaptureProblem& problem, const CaptureSystem& system,
                                        const Model& law_model, const State& state, double time,
                                        const ClosingContacts& closing) {
  if (!problem.impedance || problem.impact->joints != ImpactSetup::Joints::impedance) return {};
  const auto& [contacts, masses] = closing;
  Prepared p = prepare(problem, system);
  set_hold_references(system, state, time, p.law);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    for (std::size_t h = 0; h < p.names.size(); ++h) {
      if (p.names[h] != contacts[c].end_effector || problem.impedance->match != ImpedanceSetup::Match::target) continue;
      p.law.end_effectors[h].normal = contacts[c].contact.n_W;
      p.law.end_effectors[h].matched_mass = masses[c].apparent.value_or(masses[c].of_end_effector);
    }
  }
  return std::make_shared<Impedance>(law_model, std::move(p.law), std::move(p.scope));
}

}  // namespace grapnel
