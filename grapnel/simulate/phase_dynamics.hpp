#pragma once

/// @file
/// A model with joint controllers and gravity, or the field near an orbit, as a differential equation, including the
/// integrals for its conservation checks.
///
/// State vector y = [q; v; integrals], with the deformations of sticking contacts among the integrals. These are the
/// work of motors, of friction and of external forces, and the external impulse; likewise for each tree, if there are
/// external effects. They are under error control: for prescribed joint motion, little else limits the step. The
/// exchanged magnitudes (TreeExchange) are also integrated. Joints are free, driven by a controller, or move as
/// prescribed; a root may be held by an ideal wrench or be under attitude control; loads may act on any body; closures
/// keep loops of the tree closed, and the model's couplings keep joints together, as further rows of the loops. Thread
/// safety: one thread at a time (it owns a workspace).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/impact/impact_solution.hpp"
#include "grapnel/integrate/manifold.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/base_actuation.hpp"
#include "grapnel/simulate/controller.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/grasp_slip.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/joint_modes.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/simulate/orbit.hpp"
#include "grapnel/simulate/phase_integrals.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/simulate/sensor_reader.hpp"
#include "grapnel/simulate/tendon.hpp"
#include "grapnel/simulate/tracking_noise.hpp"

namespace grapnel {

struct Tolerances;

/// The drive of one joint along its trajectory.
struct JointDrive {
  JointControl control = JointControl::free;
  JointTrajectory trajectory = {};  // in absolute time; not read by free joints
  double kp = 0;                    // pd [N m/rad or N/m]; computed_torque [1/s^2]
  double kd = 0;                    // pd [N m s/rad or N s/m]; computed_torque [1/s]
  NoiseSignal noise = {};           // n
};

/// An impact of hard contacts at an instant of a phase.
struct HardImpact {
  double time;                           // [s]
  State before;                          // the state just before it, and before brakes stop joints
  std::vector<double> change;            // of all velocities
  std::vector<ExternalWrench> impulses;  // of the contacts on bodies, in W [N m s; N s]
  std::vector<double> loop_impulses;     // per row of the closures and couplings (LoopSolver::multipliers)
};

struct PhaseSetup {
  std::vector<JointDrive> drives;  // per entry of Model::joints(); empty: all free
  int held_root = -1;              // body index of a free root held at its pose; -1: none
  Vector3d gravity = Vector3d::zero();
  std::vector<ExternalLoad> loads;
  std::optional<ReferenceOrbit> orbit = {};  // whose field acts on every body; absent: none
  std::optional<AttitudeControl> attitude;
  /// Commands the efforts of joints under JointControl::controller, and the torque on commanded_root.
  std::shared_ptr<Controller> controller = {};
  int commanded_root = -1;  // body index of a free root, not under attitude control; -1: none
  /// Wheels that give the torque of attitude control or the controller on its root; empty: the torque is external.
  /// Their joints are free.
  std::vector<ReactionWheel> wheels = {};
  /// All control moment gyros: their motors are active in every phase. Their joints are free.
  std::vector<MomentGyro> gyros = {};
  /// Thrusters, gyro steering, and the interaction of wheels and thrusters.
  BaseActuators actuators = {};
  /// Other actuators of the base. The last one that drives() gives the torque of attitude control or the controller.
  BaseActuation::Effectors effectors = {};
  /// Clock of all laws, including attitude control; null: they act continuously. Controller and clock keep their state
  /// beyond a phase: two concurrent phases must not share them.
  std::shared_ptr<ControlClock> clock = {};
  /// The clock's channels: indices in Model::joints(), empty for a robot without driven joints; absent: all joints, in
  /// their order.
  std::optional<std::vector<int>> channels = {};
  /// Reads the sensors at the clock's sample times for laws and controller; null: they receive true values. It has a
  /// state, like the clock.
  std::shared_ptr<SensorReader> sensors = {};
  /// The model used by model-based laws and the controller: same structure, different inertia; null: the model itself.
  std::shared_ptr<const Model> law_model = {};
  /// Compute the velocities of free roots from the momentum at initial() (2.3), and their positions from the uniform
  /// motion of the centre of mass, unless gravity, ground or a holding wrench changes them; otherwise they are
  /// integrated.
  bool recover_roots = true;
  /// Velocities of joints that keep their values in impacts of hard contacts, and of those that such an impact stops.
  /// Prescribed joints always keep theirs; all others are free.
  std::vector<int> driven_in_impacts = {}, braked_in_impacts = {};
  /// Contacts of the model's bodies. They keep modes and histories beyond a phase: two concurrent phases must not share
  /// them. Null: none.
  std::shared_ptr<ContactSet> contacts = {};
  std::vector<Tendon> tendons = {};   // that pull free joints
  std::vector<LoopClosure> closures;  // closed loops
  bool project_loops = true;          // project states onto the closures
  double loop_feedback = 0;           // Baumgarte's rate [1/s]; 0: none
  std::vector<GraspSlip> slips = {};  // grasps that slip
};

/// The integrals from the integrated numbers (phase_integral): in total, and of each tree if there are several.
PhaseIntegrals phase_integrals(std::span<const double> numbers);

/// Times strictly between t0 and t1 at which dy/dt of a phase may have a jump or kink: ends of trajectories' pieces,
/// breaks of loads, the clock's sample times and the times at which its commands begin to act, in the order from t0 to
/// t1. Times that differ only by rounding count once.
std::vector<double> phase_breaks(const PhaseSetup& setup, double t0, double t1);
/// Times that differ by less count as equal [s].
double break_resolution(double t0, double t1);

/// Sizes of a momentum's two parts.
struct MomentumDefect {
  double linear = 0;   // [N s]
  double angular = 0;  // about a tree's centre of mass [N m s]
};

class PhaseDynamics {
 public:
  /// @throws std::invalid_argument if drives do not match the model's joints; held_root is not a free root; the root
  /// under attitude control or a controller's torque is not free, is held or is under both; joints need a controller
  /// that is missing; the clock has other channels; a trajectory or a load is invalid (see validate) or on no body; an
  /// orbit is invalid (see fault_of); or a load is in the axes of a missing orbit.
  PhaseDynamics(const Model& model, PhaseSetup setup);

  const Model& model() const { return model_; }
  const PhaseSetup& setup() const { return setup_; }
  /// Whether there are external effects: gravity, an orbit's field, loads, contacts, slipping grasps, attitude control,
  /// the ground under a fixed or held root.
  bool is_disturbed() const { return has_external_; }
  int size() const { return model_.coordinates() + model_.velocities() + integral_count(); }
  Manifold manifold() const;
  /// Tolerances of the numbers in y. Those of contact deformations are relative to 1, at which they slip (23.7a): a
  /// smaller deformation has no smaller effect on the force's error.
  Tolerances tolerances(double relative, double absolute) const;
  /// Appends the indices of the numbers in y on which dy/dt depends with the present modes; all others are integrals
  /// without an effect on the motion.
  void coupled(std::vector<int>& numbers) const;
  /// Appends the ranges of the numbers in y that remain constant with the present modes: integrals of contacts that are
  /// apart, and of external effects if there are no others.
  void still(std::vector<NumberRange>& ranges) const;
  /// y for a state at time t, with zero integrals; remembers its momenta.
  std::vector<double> initial(const State& state, double t);
  /// The same for a phase that continues, with its integrals so far. @throws std::invalid_argument if these are the
  /// integrals of another phase.
  std::vector<double> initial(const State& state, double t, const PhaseIntegrals& integrals);

  /// See phase_breaks().
  std::vector<double> breaks(double t0, double t1) const { return phase_breaks(setup_, t0, t1); }
  /// Selects the smooth trajectories and loads between the neighbouring breaks `begin` and `end` (in any order), also
  /// at these times themselves: evaluations at an end are limits from inside.
  void enter_interval(double begin, double end) { inside_ = 0.5 * (begin + end); }
  /// From now on, evaluations at a break are the later limits.
  void leave_interval() { inside_.reset(); }
  /// enter_interval(), in y at the break `begin`, also the begin of a phase. Where rates of prescribed joints jump
  /// there, all velocities in y jump, as by impulses in these joints; their work and the ground's impulse are added to
  /// the integrals. Returns whether y changed.
  bool cross_break(double begin, double end, std::span<double> y);
  /// `state` with prescribed joints on their references at t, the state after these impulses.
  State on_references(const State& state, double t);
  /// Begins a phase from t to `end`: notifies the controller. @throws std::logic_error if a clock would run backwards.
  void begin_control(double t, double end);
  /// Ends the phase at t.
  void end_control(double t) { base_.reach(t); }
  /// The first time after t, and before `end`, at which an actuator switches by time alone; otherwise `end`.
  double next_edge(double t, double end) const { return base_.next_edge(t, end); }
  /// Begins a smooth piece, in y, between the neighbouring breaks `begin` and `end`: enter_interval(), tick() and
  /// choose_modes(). Returns its end: `end`, or an earlier edge of an actuator. @throws ControllerError as tick().
  double begin_smooth_interval(double begin, double end, std::span<const double> y);
  /// Advances to the time t, in y: at a sample time of the clock, reads sensors and evaluates laws; due commands begin
  /// to act. Does nothing without a clock. @throws ControllerError, also if the control is unstable: a speed exceeds
  /// kRunaway.
  void tick(double t, std::span<const double> y);

  /// The drives under a clock that are independent of the state, from begin_smooth_interval() to that piece's end; the
  /// thrusters' wrench is separate (BaseActuation::thrust_at). Joints with a JointMotor, and wheels at their maximum
  /// rates, give what their rates permit instead. Valid until the next evaluation.
  struct HeldDrive {
    std::span<const double> motor;  // efforts per Model::joints(), of wheels too; zero of prescribed joints [N m or N]
    Vector3d outer_torque;          // external, on the root's body, in its axes; zero without any [N m]
  };
  HeldDrive held_drive(double t);

  /// Computes impacts of joints at their stops, in y at t, which changes. Does nothing without stops.
  void apply_stop_impacts(double t, std::span<double> y);
  /// Computes the impact of hard contacts, if they close in y at t; y changes. All of them, closed loops and rates that
  /// joints hold are solved together. If no finite impulse can separate bodies, since held rates press them together,
  /// their contact lasts without an impact. Returns why another impact has no solution; empty otherwise.
  std::string apply_contact_impacts(double t, std::span<double> y);
  /// The impact of the last call of apply_contact_impacts(); empty: there was none.
  const std::optional<HardImpact>& hard_impact() const { return hard_impact_; }
  /// The pair with the most impacts, for messages; empty: there were no impacts.
  std::string busiest_hard_contact() const;
  /// Joints with static friction or stops.
  const JointModes& joint_modes() const { return modes_; }
  /// Whether modes of the base's actuators, of joints or of contacts can change: then choose_modes() is needed at the
  /// beginning of each smooth piece.
  bool switches() const { return base_.switches() || !modes_.empty() || setup_.contacts; }
  /// Positive while the modes are valid: for wheels distances from maximum rates, and accelerations of held wheels; for
  /// thrusters distances from their levels; for joints JointModes' margins; for contacts ContactSet's.
  double switch_margin(double t, std::span<const double> y);
  /// Begins a step in y at t, of this expected duration: from now on switch_margin() watches all contacts.
  void begin_step(double t, std::span<const double> y, double duration);
  /// Ends a step of this duration, negative backwards, in y at t, in which the next one begins, of the expected
  /// duration `next`. Returns whether modes may change in it; for times in it, switch_margin() is that of the contacts
  /// that may change (ContactSet::end_step). Always if other modes than those of contacts can change. Trajectories
  /// bound the motions of prescribed joints.
  bool end_step(double t, std::span<const double> y, double duration, double next);
  /// ContactSet::may_part().
  bool may_part(double duration) const { return setup_.contacts && setup_.contacts->may_part(duration); }
  /// The least overlap of touching contacts in y, where their forces end [m]: ContactSet::least_overlap().
  double least_overlap(double t, std::span<const double> y);
  /// Chooses the modes of joints and actuators, in y at t; does nothing if none can change.
  void choose_modes(double t, std::span<const double> y);

  /// dy/dt.
  void operator()(double t, std::span<const double> y, std::span<double> dydt);

  /// The state in y; prescribed joints have exactly their prescribed motion, roots' velocities follow from the
  /// conserved momenta, and loops are closed by projection (if setup.project_loops). Valid until the next call.
  const State& state(double t, std::span<const double> y);
  /// The same without closing loops.
  const State& unprojected_state(double t, std::span<const double> y);
  /// Whether states are projected onto closures.
  bool projects() const { return solver_ && setup_.project_loops; }
  /// Closes the loops in y itself after a step; see LoopSolver::project.
  ProjectionResult project(double t, std::span<double> y, double negligible = 0);
  /// The largest loop defect of y.
  ClosureDefect loop_defect(double t, std::span<const double> y);
  /// The solver of the loops after the last evaluation; null without closures and couplings.
  const LoopSolver* loops() const { return solver_ ? &*solver_ : nullptr; }
  /// A basis of the loop multipliers that change no motion, after the last evaluation; including those of stuck joints,
  /// although efforts() has chosen one of them.
  Eigen::MatrixXd open_stresses() const { return open_stresses_ ? *open_stresses_ : solver_->self_stresses(); }
  /// Why the last dy/dt was not finite, if closures could not be satisfied; empty otherwise.
  std::string loop_failure() const;
  /// The correction by recovered root velocities: the largest deviation, over the trees, of the momentum of the
  /// integrated velocities in y. Zero if they are not recovered.
  MomentumDefect momentum_corrected(std::span<const double> y);
  PhaseIntegrals integrals(std::span<const double> y) const;
  /// Motor effort and friction of every joint (per Model::joints()) at this instant. If closed loops leave the friction
  /// of stuck joints undetermined, it is the minimum-norm admissible one, with matching multipliers.
  void efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction);
  /// From the last evaluation (efforts() or dy/dt): its state, its accelerations, and the external wrenches on bodies
  /// except gravity.
  const State& evaluated_state() const { return now_; }
  std::span<const double> acceleration() const { return vdot_; }
  std::span<const ExternalWrench> external_wrenches() const { return wrenches_; }
  const Vector3d& gravity() const { return setup_.gravity; }
  /// The friction of the slipping grasps in the last evaluation.
  std::span<const SlipState> slips() const { return slips_; }
  /// The forces last passed to a controller as acting besides its own (ControlInput::force).
  std::span<const double> force_beside() const { return beside_; }
  /// The torque of attitude control or of the controller, on the root's body, in its axes; zero without any [N m]. With
  /// wheels: the torque that their motors give; with thrusters: theirs, about the base's centre of mass.
  Vector3d control_torque() const { return base_.given(); }
  /// Tensions of the tendons in the last evaluation [N].
  std::span<const double> tensions() const { return tensions_; }
  /// The actuation of the base after the last evaluation.
  const BaseActuation& base() const { return base_; }

 private:
  int integral_count() const {
    using namespace phase_integral;
    return kWholeCount + (has_external_ ? kTreeCount * static_cast<int>(trees_.size()) : 0) + slip_integral_count() +
           joint_integral_count() + damper_integral_count() + contact_integral_count() + exchange_count();
  }
  int slip_integral_count() const { return phase_integral::kSlipCount * static_cast<int>(setup_.slips.size()); }
  int contact_integral_count() const {
    if (!setup_.contacts) return 0;
    return phase_integral::kContactCount * static_cast<int>(setup_.contacts->groups()) + stick_count();
  }
  int stick_count() const { return setup_.contacts ? static_cast<int>(setup_.contacts->stick_count()) : 0; }
  int exchange_count() const { return phase_integral::kExchangeCount * static_cast<int>(trees_.size()); }
  int damper_integral_count() const { return has_dampers_ ? static_cast<int>(trees_.size()) : 0; }
  int joint_integral_count() const { return phase_integral::kJointCount * static_cast<int>(measured_.size()); }
  /// Whether nothing acts from outside, since contacts, the only external effect, are apart.
  bool is_left_alone() const { return only_contacts_ && !setup_.contacts->touches(); }
  bool recovers() const { return setup_.recover_roots && !has_external_ && !momenta_.empty(); }
  void check_and_classify();
  void check_control();
  void check_effectors();
  void check_tendons();
  /// Whether laws are evaluated now; otherwise the held commands act.
  bool laws_command() const { return !setup_.clock || sampling_; }
  double law_output(std::size_t joint) const;
  void pull_tendons(double t, std::span<double> effort);
  void gather_beside(double t);
  void call_controller(double t);
  void refuse_runaway(double t) const;
  void drive_root(double t);
  const ActuatorCommands& commands() const;
  void hold_joints();
  void choose_joint_modes(double t, std::span<const double> y);
  JointModes::OpenEfforts open_efforts() const;
  JointModes::Response held_response();
  JointModes::Mobility mobility_of(std::span<const int> velocities);
  Eigen::VectorXd accelerations_released(std::span<const int> velocities);
  void settle_friction();
  JointModes::ImpulseResponse respond_to(std::span<const JointModes::RateChange> changes, bool friction_holds,
                                         std::span<const Wrenchd> link_impulse = {});
  void book_impulses(std::span<double> y, bool of_contacts = false);
  std::vector<HeldRate> rates_in_contact_impact() const;
  void stop_braked_joints(std::span<const HeldRate> held, std::span<double> y);
  template <class Call>
  auto in_contact_impact(std::span<const HeldRate> held, Call&& call);
  bool join_references(double t, std::span<double> y);
  bool jump(double t, std::span<const int> velocities, std::span<double> y);
  void add_loop_impulses();
  void respond_to_contacts(std::span<const HardPoint> points, std::span<const Vector3d> impulses,
                           std::span<const HeldRate> held);
  std::vector<HardPointImpact> book_contacts(std::span<const HardPoint> points, std::span<const Vector3d> impulses,
                                             const ImpactSolution& solution, std::span<double> y);
  double friction_of(std::size_t joint) const;
  double output_of_motor(std::size_t joint, double commanded);
  template <class Add>
  void add_ground(Add&& add) const;
  void add_joint_integrals(std::span<double> integrals);
  void add_contact_integrals(std::span<double> integrals);
  void add_slip_integrals(std::span<double> integrals) const;
  Vector3d arms_ahead();
  std::span<const double> accelerations_in(double t, std::span<const double> y);
  void load(double t, std::span<const double> y);
  void load_integrated(double t, std::span<const double> y);
  void place_bodies_now();
  double arm_of(int joint_body, bool reacts) const;
  double prescribed_travel(double t, double duration);
  void recover(double t);
  void follow(double t);
  ProjectionResult close_loops(double t);
  void act_from_outside(double t);
  void act_on_orbit(const OrbitPoint& at);
  ExternalWrench wrench_of(const ExternalLoad& load, double t, const OrbitPoint& at) const;
  void actuate();
  void solve(std::span<const std::uint8_t> prescribed);
  const std::vector<double>& commanded_forces();
  void read_sensors(double t, std::span<const double> y);
  const Model& law_model() const { return setup_.law_model ? *setup_.law_model : model_; }
  void accelerate(double t);
  void find_pushed_trees();
  void measure_trees();
  void add_external(std::span<double> integrals);

  const Model& model_;
  PhaseSetup setup_;
  Workspace workspace_;
  State now_;                                 // state at the evaluation
  std::optional<double> inside_;              // a time of the smooth interval
  std::vector<JointPoint> reference_;         // per joint, less the sensor error
  std::vector<JointPoint> desired_, sensed_;  // per joint, for the controller
  std::vector<double> commanded_effort_;      // per joint, by the controller
  std::vector<double> beside_;                // per velocity: forces besides the controller's
  Vector3d commanded_torque_ = Vector3d::zero();
  ActuatorCommands commanded_actuators_;
  std::vector<int> channel_of_;                    // per joint, of the clock; -1: none
  bool has_controller_ = false;                    // for a joint or a root
  bool sampling_ = false;                          // at a tick of the clock
  double same_time_ = 0;                           // times that differ by less are equal [s]
  std::vector<double> motor_, friction_, spring_;  // efforts per joint
  std::vector<double> force_;                      // generalized forces given
  std::vector<std::uint8_t> prescribed_;
  std::vector<std::uint8_t> commanded_;  // prescribed, or by computed torque
  std::vector<double> acceleration_;     // of these
  std::vector<double> vdot_;
  /// Of the loads; then of an orbit's field, one per body; of slipping grasps, two each; of the base's effectors; then
  /// of contacts.
  std::vector<ExternalWrench> wrenches_;
  std::size_t first_slip_ = 0;       // number before those of slipping grasps
  std::size_t steady_wrenches_ = 0;  // number without those of contacts
  std::vector<SlipState> slips_;     // of setup_.slips
  std::vector<double> tensions_;     // per tendon
  BaseActuation base_;
  std::vector<double> known_acceleration_;  // scratch of arms_ahead()
  std::vector<std::uint8_t> is_idle_;
  JointModes modes_;
  std::vector<std::size_t> measured_;             // joints with their own integrals
  std::vector<double> rounding_;                  // of holding efforts, per joint
  std::optional<Eigen::MatrixXd> open_stresses_;  // before the friction of stuck joints was chosen
  std::vector<double> smooth_effort_;             // per joint: its motor's effort without ripple
  std::vector<double> at_rest_;                   // zero velocities
  std::optional<HardImpact> hard_impact_;         // the last one
  double momenta_time_ = 0;                       // when the momenta were taken
  std::vector<RootMomentum<double>> momenta_;     // per free root, at the start of the phase
  std::vector<RootMomentum<double>> drifted_;     // by contacts' impulses; scratch of momentum_corrected
  bool any_computed_ = false;
  std::vector<phase_integral::TreeMotion<double>> trees_;  // current trees, in the order of the roots
  std::vector<std::size_t> tree_of_;                       // per body
  std::vector<std::uint8_t> pushed_;                       // per tree: its motion is measured
  std::optional<LoopSolver> solver_;                       // with closures or couplings
  // Of the laws' model, if they have a separate one:
  std::optional<Workspace> law_workspace_;
  std::optional<LoopSolver> law_solver_;
  std::vector<double> law_vdot_;
  struct LoopFailure {
    double time;
    double contradiction;
    int rank;
    double min_pivot;
    std::string row;
  };
  std::optional<LoopFailure> loop_failure_;
  std::vector<double> loaded_;   // scratch of project() and recover(): q and v before
  std::vector<double> reaches_;  // per body, of the shapes of its contacts: ContactSet::reach_of()
  bool placed_ = false;          // whether recover() left the joint transforms of now_ in the workspace
  bool has_dampers_ = false;     // at joints with springs
  bool has_friction_ = false;    // in a joint that is not prescribed
  bool only_contacts_ = false;   // no external effects but contacts
  bool has_external_ = false;    // gravity, an orbit, loads, contacts, slips, attitude control, a held or fixed root
};

}  // namespace grapnel
