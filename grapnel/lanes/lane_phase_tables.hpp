#pragma once

/// @file
/// Input and output of the lane stepper: plain tables of numbers. Only these pass between portable code and the
/// translation units of the instruction sets. They contain no containers, since the code that those units compile must
/// not be linked into portable code. run_lanes() fills the tables; the numbers are documented in lane_phase.hpp.

#include <cstdint>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/phase_integrals.hpp"

namespace grapnel::lanes {

/// A link of the tree, common to all cases.
struct LinkTable {
  int parent;
  JointType joint;
  std::uint8_t axis;
  bool rotated;
  bool has_armature;
  JointControl control;
  ControlOutput output;     // of the control law
  bool reads_acceleration;  // likewise
  bool is_viscous;
  bool has_coulomb;
  bool has_spring;
  bool has_damper;    // has a damper parallel to the spring
  bool is_massless;   // between two coincident joints
  bool is_grounded;   // a fixed root, or one held at its pose
  bool is_cycloidal;  // some segment of its trajectory is cycloidal
  int q;
  int v;
  double sign;
  int block_offset;  // offset of its part of an interval's block; -1: not driven
  int series;        // number of coefficients in it
  int tones;         // offset of its part of the noise block; -1: no noise
  int channel;       // index among the efforts of a sampled command; -1: none
  int wheel;         // index among the wheels that produce the base's torque; -1: none
  bool operator==(const LinkTable&) const = default;
};

/// A link's numbers in a record: mass, first moment (3), rotational inertia xx yy zz xy xz yz, X_PF.p (3), X_PF.R (9,
/// row by row), armature, kp, kd, effort, viscous, coulomb, 1/transition rate, its spring's stiffness, damping and
/// rest.
inline constexpr int kLinkMass = 0, kLinkFirstMoment = 1, kLinkRotational = 4, kLinkPosition = 10, kLinkRotation = 13,
                     kLinkArmature = 22, kLinkKp = 23, kLinkKd = 24, kLinkEffort = 25, kLinkViscous = 26,
                     kLinkCoulomb = 27, kLinkInverseTransition = 28, kLinkStiffness = 29, kLinkDamping = 30,
                     kLinkRest = 31, kLinkNumbers = 32;

/// A smooth interval of a case: its end, its block, and the clock's actions at its begin, in this order: the number of
/// delayed commands that become active; sensor reading and evaluation of the laws; activation of an undelayed command.
struct LaneInterval {
  double end;  // [s]
  int block;
  std::uint8_t due;
  bool samples;
  bool acts_at_once;
};

/// A block. For every driven link its segment: middle and inverse half length [s, 1/s], rate added to that of the
/// series (beyond a trajectory's ends), travel of a cycloid, then the series' coefficients.
inline constexpr int kSegmentMiddle = 0, kSegmentInverseHalf = 1, kSegmentRate = 2, kSegmentTravel = 3,
                     kSegmentSeries = 4;

/// Tones of a joint's noise: amplitude, then pairs of angular frequency and phase.
inline constexpr int kTones = 24;
inline constexpr int kNoiseNumbers = 1 + 2 * kTones;

/// An external load, common to all cases.
struct LoadTable {
  /// Variation within an interval: none, a sine (also half sines), or a line of a table.
  enum class Kind : std::uint8_t { constant, sine, line };
  int link;
  Kind kind;
  LoadFrame frame;
  bool has_stream;
  bool both_sides;   // the stream acts on both sides of the plate
  int block_offset;  // offset of its part of a block
  bool operator==(const LoadTable&) const = default;
};
/// The load's part of a block. constant: 1 while active, else 0. sine: the same, then start, angular frequency and
/// phase. line: initial time, wrench at that time and its rate (6 each, moment before force).
inline constexpr int kLoadActs = 0, kLoadStart = 1, kLoadFrequency = 2, kLoadPhase = 3, kLoadLineStart = 0,
                     kLoadLineWrench = 1, kLoadLineRate = 7;
inline constexpr int kLoadBlockNumbers[] = {1, 4, 13};  // by kind

/// External loads, common to all cases.
struct OutsideTable {
  bool has_gravity;
  bool has_orbit;
  bool is_circular;   // the orbit is circular in all cases
  int attitude_link;  // free root under attitude control or a controller; -1: none
  int load_count;
  int wheel_count;        // wheels that produce the torque
  bool has_outer_torque;  // an external torque acts
  bool has_thrusters;     // thrusters act
  bool has_ground;        // the ground holds a root
  bool operator==(const OutsideTable&) const = default;
  constexpr bool acts() const {
    return has_gravity || has_orbit || has_outer_torque || has_thrusters || load_count > 0 || has_ground;
  }
  constexpr bool has_numbers() const { return acts() || attitude_link >= 0; }
};
/// A case's numbers for external loads: gravity; the orbit's constants in the order of OrbitConstants; attitude
/// control's q_WD, kp, kd, limit. Then for every load: point of application in the link's frame, amplitude (in the
/// link's axes for body-fixed loads), the stream's direction, normal (in the link's axes), pressure times area,
/// specular share, diffuse share. Then for every wheel: its row of A^+ (WheelArray), maximum torque and rate. Features
/// that the structure lacks are zero.
inline constexpr int kGravity = 0, kOrbit = 3, kOrbitNumbers = 20, kAttitude = kOrbit + kOrbitNumbers,
                     kLoads = kAttitude + 13, kLoadPoint = 0, kLoadAmplitude = 3, kLoadDirection = 9, kLoadNormal = 12,
                     kLoadReach = 15, kLoadSpecular = 16, kLoadDiffuse = 17, kLoadNumbers = 18;
inline constexpr int kWheelRow = 0, kWheelTorque = 3, kWheelRate = 4, kWheelNumbers = 5;

/// A loop closure, common to all cases: the constraints of constraint/loop_closure.hpp as rows. Directions in which no
/// joint of the loop moves C relative to D have no rows (loop_tables()).
struct LoopTable {
  int link_a, link_b;  // in one tree
  int turns;           // number of constrained rotations: 3 for a rigid grasp, 2 for a hinge, 0 for a point
  int turn_rows;       // number of these with a row
  int push_rows;       // number of linear rows: along the first axes of C
  constexpr int rows() const { return turn_rows + push_rows; }
  constexpr int forbidden() const { return turns + 3; }
  bool operator==(const LoopTable&) const = default;
};
/// A closure's numbers in a case: X_aC and X_bD (p, then R row by row), the hinge, directions of the angular rows (row
/// by row), both in C, and the scales of angular and linear rows. As in LoopPath, except that for loops with planar
/// motion the axes of C and D are rotated such that z is the plane's normal.
inline constexpr int kLoopAC = 0, kLoopBD = 12, kLoopHinge = 24, kLoopTurns = 27, kLoopAngularScale = 36,
                     kLoopLinearScale = 37, kLoopNumbers = 38;

/// Sampled control, common to all cases. A command has an effort per channel, an external torque on the base (3) and,
/// with thrusters, a wrench on the base with its rate of change, in the format of a load along a line of a table
/// (kLoadLine...).
struct ControlTable {
  bool is_sampled;
  int channels;
  int max_delayed_count;  // maximum number of delayed commands
  /// Each case computes its own commands at the begin of intervals (CaseExchange::turn): no laws are evaluated in
  /// packs, and no commands are delayed here.
  bool by_case;
  bool has_thrusters;
  int wheels;  // number of wheels whose rates at the tick are part of a command, for later use; NaN: unknown
  bool operator==(const ControlTable&) const = default;
  constexpr int command_numbers() const {
    const int thrust = has_thrusters ? kLoadBlockNumbers[static_cast<int>(LoadTable::Kind::line)] : 0;
    return is_sampled ? channels + 3 + thrust + wheels : 0;
  }
};

/// The data that all cases of a run share.
struct PhaseTables {
  const LinkTable* links;
  int link_count;
  const int* tree_of;  // per link
  int tree_count;
  int driven_tree;  // tree in which motors and friction do work
  int coordinates;
  int velocities;
  const int* quaternions;  // offsets of the coordinates' quaternions
  int quaternion_count;
  int block_size;  // size of a block
  int noise_numbers;
  OutsideTable outside;
  const LoadTable* loads;
  int outside_numbers;  // per case; 0 without external loads
  int integral_count;   // number of integrals: works of motors and friction, or all of phase_integral
  int dimension;        // of the error norm
  bool recovers;        // roots are recomputed from conserved momenta
  const LoopTable* loops;
  int loop_count;
  ControlTable control;
  double runaway;  // a rate above it indicates unstable sampled control [rad/s or m/s]
  double relative_tolerance;
  double absolute_tolerance;
  double max_step;
  std::int64_t max_steps;
  bool predictive;
};

/// One case.
struct CaseRecord {
  double start_time;
  double end_time;
  double max_step;      // in addition to that of the tables
  const double* links;  // kLinkNumbers each
  const double* q;      // coordinates
  const double* v;      // velocities
  const LaneInterval* intervals;
  const double* blocks;  // of block_size each
  const double* noise;
  const double* outside;   // PhaseTables::outside_numbers
  const double* loops;     // kLoopNumbers each
  const double* commands;  // ControlTable::command_numbers() each: the command active before the first interval,
  int delayed_count;       // number of delayed commands after it
};

/// broken_off: the case's control failed at the begin of an interval. step_refused: CaseExchange::counts rejected a
/// step. at_largest_rate: a wheel approaches its maximum rate, at which modes change by events, which lanes do not
/// support; the step that may reach it is not accepted. In both cases the case ends at the begin of that step, to be
/// continued by a single run. loops_in_doubt: closed loops approach a configuration in which their rows change rank, or
/// they cannot be closed; the case must be integrated by a single run.
enum class LaneStatus : std::uint8_t {
  finished,
  step_too_small,
  too_many_steps,
  non_finite,
  unstable_control,
  broken_off,
  step_refused,
  at_largest_rate,
  loops_in_doubt
};

/// One tree of the system at one instant, as in capture/conservation_monitor.hpp.
struct LaneTree {
  double com[3];      // in W
  double linear[3];   // momentum, in W
  double angular[3];  // about the tree's centre of mass, in W
  GroupSize<double> size;
};

/// One tree over a phase: maxima over the start and all accepted steps.
struct LaneTreeRecord {
  LaneTree start, end;
  double linear_deviation;   // |p - p(start) - external impulse| [N s]
  double angular_deviation;  // likewise for the angular momentum about the tree's centre of mass [N m s]
  double energy_deviation;   // |U - U(start) - work of motors, friction and external loads|, U the internal energy [J]
  double linear_scale, angular_scale, energy_scale;        // group_scale()
  double largest_linear, largest_angular, largest_energy;  // maxima of GroupSize, without lower bounds
  double exchanged[phase_integral::kExchangeCount];        // as TreeExchange
  double radius,
      distance;  // maximum radius of gyration, and maximum distance of the centre of mass from the origin [m]
};

/// Maximum defects over all closures; see ClosureDefect.
struct LaneLoopDefect {
  double position, angle, velocity, angular_velocity;
};
/// Quality of the loop closure over a phase; zero without loops.
struct LaneLoopRecord {
  double rank;                 // independent rows at the phase's begin
  LaneLoopDefect unprojected;  // maximum after one step, before projection
  LaneLoopDefect largest;      // maximum over the start and all accepted steps, from poses and twists
  // In the error norm of the steps:
  double corrections;      // sum over the projections
  double error_estimates;  // sum of the steps' error estimates
};

/// A case at its start, or after an accepted step.
struct CaseView {
  double time;
  const double* q;
  const double* v;
  const double* motor;  // effort per link [N m or N]; zero where none is driven
};

/// A case at the begin of an interval, or at an edge inside it.
struct CaseTurn {
  bool is_first;  // first turn of the case
  double time;
  double end;        // of the interval
  double phase_end;  // of the case's motion
  const double* q;
  const double* v;
  const double* integrals;  // PhaseTables::integral_count
};

/// Outcome of a case.
struct CaseResult {
  LaneStatus status;
  double time;      // time reached
  const double* q;  // state at that time
  const double* v;
  const double* integrals;  // PhaseTables::integral_count, in the order of phase_integral
  std::int64_t steps;
  std::int64_t rejected;
  std::int64_t evaluations;
  double next_step;  // step size to try next, or already tried, from here
  double quaternion_defect;
  const LaneTreeRecord* trees;  // PhaseTables::tree_count of them, in the order of their roots
  LaneLoopRecord loops;
  const double* commands;  // final commands, in the format of a record
  int delayed_count;
};

/// Source of cases and sink of results; called from the stepper, in lane order.
struct CaseExchange {
  void* context;
  /// Provides the next case for a lane, valid until the lane's result has been taken; false if there is none.
  bool (*next)(void* context, int lane, CaseRecord& record);
  void (*done)(void* context, int lane, const CaseResult& result);
  /// Receives a lane's case at its start and after every accepted step; may be null.
  void (*observe)(void* context, int lane, const CaseView& view);
  /// ControlTable::by_case: writes the active command of a lane's case. Returns the end of its validity: the interval's
  /// end or an earlier edge; NaN: the case is broken off.
  double (*turn)(void* context, int lane, const CaseTurn& turn, double* command);
  /// Called before `observe`: whether an accepted step counts, with the state at its end, or whether a case may begin,
  /// with its initial state; null: always true.
  bool (*counts)(void* context, int lane, double time, const double* q, const double* v);
};

/// Integrates all cases of an exchange. The lane stepper of an instruction set, defined in lane_phase_set.cpp.
template <class Set>
void run_lane_phase_of(const PhaseTables& tables, CaseExchange& exchange);

}  // namespace grapnel::lanes
