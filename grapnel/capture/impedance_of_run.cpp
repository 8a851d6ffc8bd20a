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

std::vector<std::string> hands_of(const CaptureProblem& problem) {
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
Prepared prepare(const CaptureProblem& problem, const CaptureSystem& system) {
  const ImpedanceSetup& setup = *problem.impedance;
  Prepared p{{}, {{}, {}, problem.gravity}, hands_of(problem)};
  p.law.motion = static_cast<ImpedanceLaw::Motion>(setup.motion);
  p.law.transpose = setup.law == ImpedanceSetup::Law::transpose;
  p.law.senses = setup.force == ImpedanceSetup::Force::sensed;
  p.law.mass = setup.mass, p.law.damping = setup.damping, p.law.stiffness = setup.stiffness;
  p.law.inertia = setup.inertia, p.law.angular_damping = setup.angular_damping;
  p.law.angular_stiffness = setup.angular_stiffness;
  p.law.null_rate = setup.null_rate;
  const Model& model = system.model;
  std::vector<bool> carries(model.bodies().size(), false);
  for (const std::string& name : p.names) {
    const Frame& frame = model.frames()[model.frame_index(name)];
    ImpedanceHand hand;
    hand.body = frame.body, hand.X_BE = frame.X_BE;
    p.law.hands.push_back(hand);
    for (int body = frame.body; body >= 0; body = model.bodies()[body].parent) carries[body] = true;
  }
  for (int j : system.robot_joints) {
    if (carries[model.joints()[j]]) p.scope.joints.push_back(j);
  }
  return p;
}

// References: the end-effectors keep their current poses relative to the centre of mass.
void stay(const CaptureSystem& system, const State& state, double time, ImpedanceLaw& law) {
  const Kinematics k = forward_kinematics(system.model, state);
  for (ImpedanceHand& hand : law.hands) hand.reference = {-1, k.X_WB[hand.body] * hand.X_BE, time, drift_of(system, k)};
}

// References: straight paths to the grasp points, in the targets' frames.
void go(const CaptureProblem& problem, const CaptureSystem& system, const State& state, double time,
        const std::vector<std::string>& names, ImpedanceLaw& law) {
  const Kinematics k = forward_kinematics(system.model, state);
  stay(system, state, time, law);
  for (std::size_t h = 0; h < names.size(); ++h) {
    const auto grasp = std::find_if(problem.grasps.begin(), problem.grasps.end(),
                                    [&](const GraspSetup& g) { return g.end_effector == names[h]; });
    if (grasp == problem.grasps.end()) continue;
    const GraspPoint& point = grasp_point_of(problem, *grasp);
    const EndEffectorSetup& effector = end_effector_of(problem, *grasp);
    ImpedanceHand& hand = law.hands[h];
    const int target = target_body_index(system, target_index(problem, grasp->target));
    const Posed X_TE = inverse(k.X_WB[target]) * (k.X_WB[hand.body] * hand.X_BE);
    Rotationd R_end = X_TE.R;
    if (grasp->orientation == GraspSetup::Orientation::pose) R_end = point.X_TG.R;
    if (grasp->orientation == GraspSetup::Orientation::axis && effector.approach_axis && point.approach_direction)
      R_end = rotation_between(X_TE.R * *effector.approach_axis, *point.approach_direction) * X_TE.R;
    EndEffectorReference& reference = hand.reference;
    reference.body = target, reference.X_D = {R_end, point.X_TG.p}, reference.begin = time;
    reference.offset = X_TE.p - point.X_TG.p;
    reference.turn = rotation_vector(transpose(R_end) * X_TE.R);
    reference.arrival = grasp->relative_velocity, reference.arrival_time = problem.approach->duration;
    reference.way = {time, JointPath{problem.approach->profile, problem.approach->duration - time, 1, 0}};
    // It begins with the end-effector's velocity.
    const Posed& X_WT = k.X_WB[target];
    const Posed X_WE = X_WT * X_TE;
    const Vector3d w = k.V_WB[hand.body].angular - k.V_WB[target].angular;
    reference.departure = transposed_times(X_WT.R, shift(k.V_WB[hand.body], X_WE.p - k.X_WB[hand.body].p).linear -
                                                       shift(k.V_WB[target], X_WE.p - X_WT.p).linear);
    reference.turn_rate = rotation_vector_rate(reference.turn, transposed_times(X_WT.R * R_end, w));
  }
}

// Impedance control of end-effectors in a phase: the approach, or the motion after the impact.
class ImpedanceOfRun : public CoordinatedLaw {
 public:
  ImpedanceOfRun(const CaptureProblem& problem, bool approach) : problem_(problem), approach_(approach) {}

  bool has_work(const CaptureSystem& system) const override { return !approach_ || system.grasps.empty(); }

  std::shared_ptr<JointLaw> begin_piece(const CaptureSystem& system, const Model& law_model, const State& state,
                                        const State& known, double time) override {
    Prepared p = prepare(problem_, system);
    if (references_.empty()) {
      approach_ ? go(problem_, system, known, time, p.names, p.law) : stay(system, known, time, p.law);
      for (const ImpedanceHand& hand : p.law.hands) references_.push_back(hand.reference);
      report_.emplace().begin = time;
    } else {
      for (std::size_t h = 0; h < references_.size(); ++h) p.law.hands[h].reference = references_[h];
    }
    p.scope.steady = steady_joints(system);  // except in an impact, in which their motors are not modelled
    law_ = std::make_shared<Impedance>(law_model, std::move(p.law), std::move(p.scope));
    describe(state, time);
    return law_;
  }

  void note(const PhaseSample& sample, const JointLawCommand& command) override {
    ImpedanceReport& r = *report_;
    lower_to(r.least_share, r.least_share_time, command.scale, sample.time);
    lower_to(r.least_condition, r.least_condition_time, command.condition, sample.time);
    r.within_limits = r.within_limits && command.within_limits;
    const Impedance::Deviation d = law_->deviation(sample.time, sample.state);
    raise_to(r.largest_distance, r.largest_distance_time, d.distance, sample.time);
    raise_to(r.largest_angle, r.largest_angle_time, d.angle, sample.time);
  }

  void describe(const State& state, double time) override {
    const Impedance::Deviation d = law_->deviation(time, state);
    report_->end = time, report_->distance_after = d.distance, report_->angle_after = d.angle;
  }

  void end(LawEnd how, const std::string& joint) override { report_->ended = how, report_->joint = joint; }
  void released_at(double time) override { report_->end = time; }
  void write(CaptureResult& result) const override {
    (approach_ ? result.approach_impedance : result.impedance) = report_;
  }

 private:
  const CaptureProblem& problem_;
  const bool approach_;
  std::vector<EndEffectorReference> references_;
  std::shared_ptr<Impedance> law_;         // of the current piece
  std::optional<ImpedanceReport> report_;  // of all pieces
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

std::vector<EffectiveMass> effective_masses(const CaptureProblem& problem, const CaptureSystem& system,
                                            const State& state, std::span<const ClosingContact> contacts) {
  std::vector<EffectiveMass> masses;
  const Model& model = system.model;
  const Kinematics k = forward_kinematics(model, state);
  for (const ClosingContact& meeting : contacts) {
    const CompliantContact& c = meeting.contact;
    EffectiveMass m;
    m.end_effector = meeting.end_effector, m.target = meeting.target;
    m.hand = effective_mass(model, state, c.robot_body, c.p_WC, c.n_W);
    m.of_target = effective_mass(model, state, c.target_body, c.p_WC, c.n_W);
    const auto velocity = [&](int body) { return shift(k.V_WB[body], c.p_WC - k.X_WB[body].p).linear; };
    m.target_speed_before = dot(c.n_W, velocity(c.target_body) - velocity(c.robot_body));
    double mass = m.hand;
    const bool controlled = problem.impedance && problem.impact->joints == ImpactSetup::Joints::impedance &&
                            problem.impedance->law == ImpedanceSetup::Law::operational_space &&
                            problem.impedance->force == ImpedanceSetup::Force::sensed;
    if (controlled) {
      const Vector3d& M = problem.impedance->mass;  // along the end-effector's current axes
      const Vector3d n = transposed_times(frame_pose(model, k, model.frame_index(meeting.end_effector)).R, c.n_W);
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

std::shared_ptr<JointLaw> law_in_impact(const CaptureProblem& problem, const CaptureSystem& system,
                                        const Model& law_model, const State& state, double time,
                                        std::span<const ClosingContact> contacts,
                                        std::span<const EffectiveMass> masses) {
  if (!problem.impedance || problem.impact->joints != ImpactSetup::Joints::impedance) return {};
  Prepared p = prepare(problem, system);
  stay(system, state, time, p.law);
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    for (std::size_t h = 0; h < p.names.size(); ++h) {
      if (p.names[h] != contacts[c].end_effector || problem.impedance->match != ImpedanceSetup::Match::target) continue;
      p.law.hands[h].normal = contacts[c].contact.n_W;
      p.law.hands[h].matched_mass = masses[c].apparent.value_or(masses[c].hand);
    }
  }
  return std::make_shared<Impedance>(law_model, std::move(p.law), std::move(p.scope));
}

}  // namespace grapnel
