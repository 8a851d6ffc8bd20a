#pragma once

/// @file
/// A model under joint controllers and gravity, or the field near an orbit, as a differential equation, with the
/// integrals that its conservation checks need.
///
/// State vector y = [q; v; integrals]. The integrals are the work of motors, of friction and of external forces, and
/// the external impulse; and these of each tree, where anything acts from outside. They are under error control: where
/// joints move as prescribed, little else limits the step. The magnitudes exchanged (TreeExchange) are carried along.
/// Joints are free, driven by a controller, or move as prescribed; a root may be held by an ideal wrench or be under
/// attitude control; loads may act on any body; closures keep loops of the tree closed. Thread safety: one thread at a
/// time (it owns a workspace).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/root_velocity.hpp"
#include "grapnel/integrate/manifold.hpp"
#include "grapnel/simulate/attitude_control.hpp"
#include "grapnel/simulate/base_actuation.hpp"
#include "grapnel/simulate/controller.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/joint_modes.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"
#include "grapnel/simulate/orbit.hpp"
#include "grapnel/simulate/phase_integrals.hpp"
#include "grapnel/simulate/reaction_wheels.hpp"
#include "grapnel/simulate/sensor_reader.hpp"
#include "grapnel/simulate/tracking_noise.hpp"

namespace grapnel {

/// How one joint is driven along its trajectory.
struct JointDrive {
  JointControl control = JointControl::free;
  JointTrajectory trajectory = {};  // in absolute time; not read by free joints
  double kp = 0;                    // pd [N m/rad or N/m]; computed_torque [1/s^2]
  double kd = 0;                    // pd [N m s/rad or N s/m]; computed_torque [1/s]
  NoiseSignal noise = {};           // n
};

struct PhaseSetup {
  std::vector<JointDrive> drives;  // per entry of Model::joints(); empty: all free
  int held_root = -1;              // body index of a free root that is held at its pose; -1: none
  Vector3d gravity = Vector3d::zero();
  std::vector<ExternalLoad> loads;
  std::optional<ReferenceOrbit> orbit = {};  // whose field acts on every body; absent: none
  std::optional<AttitudeControl> attitude;
  /// Says the efforts of joints under JointControl::controller, and the torque on commanded_root.
  std::shared_ptr<Controller> controller = {};
  int commanded_root = -1;  // body index of a free root, not under attitude control; -1: none
  /// Through which attitude control's or the controller's torque on its root is given; empty: from outside. Their
  /// joints are free.
  std::vector<ReactionWheel> wheels = {};
  /// Control moment gyros, all there are: their motors work in every phase. Their joints are free.
  std::vector<MomentGyro> gyros = {};
  /// Thrusters, how gyros are steered, and how wheels and thrusters work together.
  BaseActuators actuators = {};
  /// Samples all laws, attitude control's too; null: they act continuously. Controller and clock have a state that
  /// lasts beyond a phase: two phases that run at the same time must not share them.
  std::shared_ptr<ControlClock> clock = {};
  /// Of the clock: positions in Model::joints(), none of a robot without driven joints; absent: all joints, in their
  /// order.
  std::optional<std::vector<int>> channels = {};
  /// Reads at the clock's ticks what laws and controller see; null: they see the truth. It has a state, as the clock.
  std::shared_ptr<SensorReader> sensors = {};
  /// What laws that know the model, and the controller, take it for: of the same structure, with other inertia; null:
  /// the model itself.
  std::shared_ptr<const Model> law_model = {};
  /// Take the velocities of free roots from the momentum that initial() saw (2.3), and their positions from the uniform
  /// motion of the centre of mass, where no gravity, ground or holding wrench changes them; else they are integrated.
  bool recover_roots = true;
  std::vector<LoopClosure> closures;  // loops that are closed
  bool project_loops = true;          // bring states back onto the closures
  double loop_feedback = 0;           // Baumgarte's rate [1/s]; 0: none
};

/// The integrals as they stand among the numbers that are integrated (phase_integral): of the whole, and of each tree
/// if there are more.
PhaseIntegrals phase_integrals(std::span<const double> numbers);

/// Times strictly between t0 and t1 at which a phase's dy/dt may jump or bend: ends of trajectories' pieces, breaks of
/// loads, the clock's ticks and the times at which its commands begin to act, in the order from t0 to t1. Those that
/// rounding alone separates count once.
std::vector<double> phase_breaks(const PhaseSetup& setup, double t0, double t1);
/// Those that are nearer count as one [s].
double break_resolution(double t0, double t1);

/// Sizes of a momentum's two parts.
struct MomentumDefect {
  double linear = 0;   // [N s]
  double angular = 0;  // about a tree's centre of mass [N m s]
};

class PhaseDynamics {
 public:
  /// @throws std::invalid_argument if drives do not match the model's joints, held_root is no free root, the root under
  /// attitude control or a controller's torque is none, is held or is under both, joints have a controller that is not
  /// there, the clock has other channels, a trajectory or a load is invalid (see validate) or on no body, an orbit is
  /// faulty (see fault_of), or a load is in the axes of one that is not there.
  PhaseDynamics(const Model& model, PhaseSetup setup);

  const Model& model() const { return model_; }
  const PhaseSetup& setup() const { return setup_; }
  /// Whether anything acts from outside: gravity, an orbit's field, loads, attitude control, the ground under a fixed
  /// or held root.
  bool is_disturbed() const { return has_external_; }
  int size() const { return model_.coordinates() + model_.velocities() + integral_count(); }
  Manifold manifold() const;
  /// y for a state at time t, with zero integrals; remembers its momenta.
  std::vector<double> initial(const State& state, double t);
  /// The same of a phase that goes on: with what has been put into the system since it began.
  /// @throws std::invalid_argument if these are the integrals of another phase.
  std::vector<double> initial(const State& state, double t, const PhaseIntegrals& integrals);

  /// See phase_breaks().
  std::vector<double> breaks(double t0, double t1) const { return phase_breaks(setup_, t0, t1); }
  /// From now on trajectories and loads are the smooth ones that hold between the neighbouring breaks `begin` and `end`
  /// (in any order), also at these times themselves: what is evaluated at an end is the limit from inside.
  void enter_interval(double begin, double end) { inside_ = 0.5 * (begin + end); }
  /// From now on the later side speaks at a break.
  void leave_interval() { inside_.reset(); }
  /// A phase from t to `end` begins: tells the controller. @throws std::logic_error if a clock would run backwards.
  void begin_control(double t, double end);
  /// It has ended at t.
  void end_control(double t) { base_.reach(t); }
  /// The first time after t, and before `end`, at which an actuator switches by the time alone; else `end`.
  double next_edge(double t, double end) const { return base_.next_edge(t, end); }
  /// A smooth piece begins, in y, between the neighbouring breaks `begin` and `end`: enter_interval(), tick() and
  /// choose_modes(). When it ends: at `end`, or at an actuator's edge before. @throws ControllerError as tick().
  double begin_smooth_piece(double begin, double end, std::span<const double> y);
  /// The time is t, in y: at a tick of the clock sensors are read and laws speak, and commands that are due act. Does
  /// nothing without a clock. @throws ControllerError, also where the control is unstable: something has come to speeds
  /// that nothing in space has.
  void tick(double t, std::span<const double> y);

  /// What drives the system under a clock, whatever its state, from begin_smooth_piece() to that piece's end; beside it
  /// the thrusters' wrench (BaseActuation::thrust_at). Joints with a JointMotor, and wheels at their largest rates,
  /// give what their rates let them instead. Valid until the next evaluation.
  struct HeldDrive {
    std::span<const double> motor;  // efforts per Model::joints(), of wheels too; zero of prescribed joints [N m or N]
    Vector3d outer_torque;          // on the root's body from outside, in its axes; zero without any [N m]
  };
  HeldDrive held_drive();

  /// Joints that have run into their stops are thrown back, in y at t, which changes. Where nothing can stop, nothing.
  void meet_stops(double t, std::span<double> y);
  /// Joints that stick and joints that meet stops.
  const JointModes& joint_modes() const { return modes_; }
  /// Whether modes of the base's actuators or of joints can change: then choose_modes() speaks wherever a smooth piece
  /// begins.
  bool switches() const { return base_.switches() || !modes_.empty(); }
  /// Positive while the modes may stay: of wheels distances from largest rates, and how fast held wheels would go on,
  /// of thrusters distances from their levels; of joints JointModes' margins.
  double switch_margin(double t, std::span<const double> y);
  /// The modes of joints and actuators from now on, in y at t; nothing where none can change.
  void choose_modes(double t, std::span<const double> y);

  /// dy/dt.
  void operator()(double t, std::span<const double> y, std::span<double> dydt);

  /// The state in y; prescribed joints are put exactly where they are prescribed, roots' velocities are those of the
  /// conserved momenta, and loops are closed by projection (if setup.project_loops). Valid until the next call.
  const State& state(double t, std::span<const double> y);
  /// The same without closing loops.
  const State& unprojected_state(double t, std::span<const double> y);
  /// Whether states are brought back onto closures.
  bool projects() const { return solver_ && setup_.project_loops; }
  /// Closes the loops in y itself, after a step; see LoopSolver::project.
  ProjectionResult project(double t, std::span<double> y, double negligible = 0);
  /// How far the loops of y are open, at the largest.
  ClosureDefect loop_defect(double t, std::span<const double> y);
  /// The solver of the loops, as of the last evaluation; null without closures.
  const LoopSolver* loops() const { return solver_ ? &*solver_ : nullptr; }
  /// Multipliers of the loops that change no motion, a basis, as of the last evaluation; those that stuck joints take
  /// count, though efforts() has chosen one of them.
  Eigen::MatrixXd open_stresses() const { return open_stresses_ ? *open_stresses_ : solver_->self_stresses(); }
  /// Why dy/dt was last not finite, if closures could not be kept; empty otherwise.
  std::string trouble() const;
  /// What recovering roots' velocities has mended: the largest deviation, over the trees, of the momentum that the
  /// integrated velocities in y have. Zero where they are not recovered.
  MomentumDefect momentum_mended(std::span<const double> y);
  PhaseIntegrals integrals(std::span<const double> y) const;
  /// Motor effort of every joint (per Model::joints()) at this instant, the friction beside it. Where closed loops
  /// leave the friction of stuck joints open it is the admissible one of least norm, and multipliers belong to it.
  void efforts(double t, std::span<const double> y, std::span<double> motor, std::span<double> friction);
  /// Of the last evaluation (efforts() or dy/dt): its state, its accelerations, and what acted on bodies from outside
  /// beside gravity.
  const State& evaluated_state() const { return now_; }
  std::span<const double> acceleration() const { return vdot_; }
  std::span<const ExternalWrench> external_wrenches() const { return wrenches_; }
  const Vector3d& gravity() const { return setup_.gravity; }
  /// What a controller was told last that acts beside it (ControlInput::force).
  std::span<const double> force_beside() const { return beside_; }
  /// The torque of attitude control or of the controller, on the root's body, in its axes; zero without any [N m].
  /// Through wheels: what their motors give of it; by thrusters: theirs, about the base's centre of mass.
  const Vector3d& control_torque() const { return base_.given(); }
  /// What drives the base, as of the last evaluation.
  const BaseActuation& base() const { return base_; }

 private:
  int integral_count() const {
    using namespace phase_integral;
    return kWholeCount + (has_external_ ? kTreeCount * static_cast<int>(trees_.size()) : 0) + joint_integral_count() +
           damper_integral_count() + exchange_count();
  }
  int exchange_count() const { return phase_integral::kExchangeCount * static_cast<int>(trees_.size()); }
  int damper_integral_count() const { return has_dampers_ ? static_cast<int>(trees_.size()) : 0; }
  int joint_integral_count() const { return phase_integral::kJointCount * static_cast<int>(measured_.size()); }
  bool recovers() const { return setup_.recover_roots && !has_external_ && !momenta_.empty(); }
  void check_and_classify();
  void check_control();
  void check_wheels();
  void check_gyros();
  /// Whether laws say what acts, now; else what the clock holds acts.
  bool laws_speak() const { return !setup_.clock || sampling_; }
  double said_by_law(std::size_t joint) const;
  void gather_beside(double t);
  void ask_controller(double t);
  void refuse_runaway(double t) const;
  void drive_root();
  const ActuatorCommands& commands() const;
  void hold_joints();
  void choose_joint_modes(double t, std::span<const double> y);
  JointModes::OpenEfforts open_efforts() const;
  JointModes::Response held_response();
  JointModes::Mobility mobility_of(std::span<const int> velocities);
  Eigen::VectorXd accelerations_released(std::span<const int> velocities);
  void settle_friction();
  JointModes::ImpulseResponse respond_to(std::span<const JointModes::RateChange> changes, bool friction_holds);
  void book_impulses(std::span<double> y);
  double friction_of(std::size_t joint) const;
  double output_of_motor(std::size_t joint, double told);
  template <class Add>
  void add_ground(Add&& add) const;
  void add_joint_integrals(std::span<double> integrals);
  Vector3d arms_ahead();
  std::span<const double> accelerations_in(double t, std::span<const double> y);
  void load(double t, std::span<const double> y);
  void recover(double t);
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
  void measure_trees();
  void add_external(std::span<double> integrals);

  const Model& model_;
  PhaseSetup setup_;
  Workspace workspace_;
  State now_;                                 // state at the evaluation
  std::optional<double> inside_;              // a time of the smooth interval
  std::vector<JointPoint> reference_;         // per joint, less what its sensor misreads
  std::vector<JointPoint> desired_, sensed_;  // per joint, for the controller
  std::vector<double> commanded_effort_;      // per joint, by the controller
  std::vector<double> beside_;                // per velocity: what acts beside the controller
  Vector3d commanded_torque_ = Vector3d::zero();
  ActuatorCommands commanded_actuators_;
  std::vector<int> channel_of_;                    // per joint, of the clock; -1: none
  bool has_controller_ = false;                    // for a joint or a root
  bool sampling_ = false;                          // at a tick of the clock
  double same_time_ = 0;                           // times nearer than this are one [s]
  std::vector<double> motor_, friction_, spring_;  // efforts per joint
  std::vector<double> force_;                      // generalized forces given
  std::vector<std::uint8_t> prescribed_;
  std::vector<std::uint8_t> commanded_;  // prescribed, or by computed torque
  std::vector<double> acceleration_;     // of these
  std::vector<double> vdot_;
  /// Of the loads, now; then of an orbit's field, one per body; then of the thrusters.
  std::vector<ExternalWrench> wrenches_;
  BaseActuation base_;
  std::vector<double> known_acceleration_;  // scratch of arms_ahead()
  std::vector<std::uint8_t> is_idle_;
  JointModes modes_;
  std::vector<std::size_t> measured_;             // joints with integrals of their own
  std::vector<double> rounding_;                  // of holding efforts, per joint
  std::optional<Eigen::MatrixXd> open_stresses_;  // before stuck joints were given their friction
  std::vector<double> told_;                      // per joint: its motor's effort without ripple
  std::vector<double> at_rest_;                   // zero velocities
  double momenta_time_ = 0;                       // when the momenta were taken
  std::vector<RootMomentum<double>> momenta_;     // per free root, as the phase began
  std::vector<RootMomentum<double>> drifted_;     // scratch of momentum_mended
  bool any_computed_ = false;
  std::vector<phase_integral::TreeMotion<double>> trees_;  // as bodies now are, in the order of the roots
  std::vector<std::size_t> tree_of_;                       // per body
  std::optional<LoopSolver> solver_;                       // with closures
  // Of the laws' model, where they have their own:
  std::optional<Workspace> law_workspace_;
  std::optional<LoopSolver> law_solver_;
  std::vector<double> law_vdot_;
  struct Trouble {
    double time;
    double contradiction;
    int rank;
    double least_pivot;
    std::string row;
  };
  std::optional<Trouble> trouble_;
  std::vector<double> loaded_;  // scratch of project(): q and v before
  bool has_dampers_ = false;    // at joints with springs
  bool has_friction_ = false;   // in a joint that is not prescribed
  bool has_external_ = false;   // gravity, an orbit, loads, attitude control, a held root or a fixed one
};

}  // namespace grapnel
