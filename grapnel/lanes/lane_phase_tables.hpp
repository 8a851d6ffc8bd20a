#pragma once

/// @file
/// What the lane stepper reads and writes: plain tables of numbers, the only thing that passes between portable code
/// and the translation units of the instruction sets (no containers: what those units compile must not be linked into
/// portable code). Everything here is filled by run_lanes(); see lane_phase.hpp for what the numbers mean.

#include <cstdint>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/simulate/external_load.hpp"
#include "grapnel/simulate/joint_control.hpp"
#include "grapnel/simulate/phase_integrals.hpp"

namespace grapnel::lanes {

/// A link of the tree, as all cases have it.
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
  bool has_damper;    // beside it
  bool is_massless;   // what lies between two joints of one place
  bool is_grounded;   // a root that is fixed, or held at its pose
  bool is_cycloidal;  // some piece of its trajectory is
  int q;
  int v;
  double sign;
  int piece;    // where its part of an interval's block begins; -1: not driven
  int series;   // coefficients in it
  int tones;    // where its part of the noise block begins; -1: silent
  int channel;  // among the efforts of a command of sampled control; -1: none
  int wheel;    // among the wheels that give the base's torque; -1: none
  bool operator==(const LinkTable&) const = default;
};

/// A link's numbers in a record: mass, first moment (3), rotational inertia xx yy zz xy xz yz, X_PF.p (3), X_PF.R (9,
/// row by row), armature, kp, kd, effort, viscous, coulomb, 1/transition rate, its spring's stiffness, damping and
/// rest.
inline constexpr int kLinkMass = 0, kLinkFirstMoment = 1, kLinkRotational = 4, kLinkPosition = 10, kLinkRotation = 13,
                     kLinkArmature = 22, kLinkKp = 23, kLinkKd = 24, kLinkEffort = 25, kLinkViscous = 26,
                     kLinkCoulomb = 27, kLinkInverseTransition = 28, kLinkStiffness = 29, kLinkDamping = 30,
                     kLinkRest = 31, kLinkNumbers = 32;

/// A smooth interval of a case: its end, the block that speaks in it, and what sampled control does as it begins: so
/// many commands that were on their way begin to act, one after the other; sensors are read and laws speak; and then,
/// without delay, that command acts too.
struct LaneInterval {
  double end;  // [s]
  int block;
  std::uint8_t due;
  bool samples;
  bool acts_at_once;
};

/// A block: for every driven link its piece: middle and inverse half length [s, 1/s], rate beside the series' (beyond a
/// trajectory's ends), travel of a cycloid, then the series' coefficients.
inline constexpr int kPieceMiddle = 0, kPieceInverseHalf = 1, kPieceRate = 2, kPieceTravel = 3, kPieceSeries = 4;

/// Tones of a joint's noise: amplitude, then pairs of angular frequency and phase.
inline constexpr int kTones = 24;
inline constexpr int kNoiseNumbers = 1 + 2 * kTones;

/// A load from outside, as all cases have it.
struct LoadTable {
  /// How it varies within an interval: not, as a sine (half sines too), or along a line of a table.
  enum class Kind : std::uint8_t { constant, sine, line };
  int link;
  Kind kind;
  LoadFrame frame;
  bool has_stream;
  bool both_sides;  // of the stream's plate
  int piece;        // where its part of a block begins
  bool operator==(const LoadTable&) const = default;
};
/// That part. constant: 1 where it acts, else 0. sine: the same, then start, angular frequency and phase. line: the
/// time at which it begins, the wrench then and its rate (6 each, moment before force).
inline constexpr int kLoadActs = 0, kLoadStart = 1, kLoadFrequency = 2, kLoadPhase = 3, kLoadLineStart = 0,
                     kLoadLineWrench = 1, kLoadLineRate = 7;
inline constexpr int kLoadPieceNumbers[] = {1, 4, 13};  // by kind

/// What acts from outside, as all cases have it.
struct OutsideTable {
  bool has_gravity;
  bool has_orbit;
  bool is_circular;   // the orbit, in all cases
  int attitude_link;  // free root under attitude control, or a controller's; -1: none
  int load_count;
  int wheel_count;        // that give its torque
  bool has_outer_torque;  // it acts from outside
  bool has_thrusters;     // push it
  bool has_ground;        // which keeps a root where it is
  bool operator==(const OutsideTable&) const = default;
  constexpr bool acts() const {
    return has_gravity || has_orbit || has_outer_torque || has_thrusters || load_count > 0 || has_ground;
  }
  constexpr bool has_numbers() const { return acts() || attitude_link >= 0; }
};
/// A case's numbers of what acts from outside: gravity; the orbit's constants in the order of OrbitConstants; attitude
/// control's q_WD, kp, kd, limit; then of every load its point of attack in the link's frame, the amplitude (in the
/// link's axes where it turns with the body), the stream's direction, normal (in the link's axes), pressure times area,
/// share mirrored, share scattered; then of every wheel its row of A^+ (WheelArray), the largest torque and rate. What
/// a structure does not have is zero.
inline constexpr int kGravity = 0, kOrbit = 3, kOrbitNumbers = 20, kAttitude = kOrbit + kOrbitNumbers,
                     kLoads = kAttitude + 13, kLoadPoint = 0, kLoadAmplitude = 3, kLoadDirection = 9, kLoadNormal = 12,
                     kLoadReach = 15, kLoadSpecular = 16, kLoadDiffuse = 17, kLoadNumbers = 18;
inline constexpr int kWheelRow = 0, kWheelTorque = 3, kWheelRate = 4, kWheelNumbers = 5;

/// A loop closure, as all cases have it: what constraint/loop_closure.hpp keeps together, as rows. Directions in which
/// none of the loop's joints can move C against D have no rows (loop_tables()).
struct LoopTable {
  int link_a, link_b;  // in one tree
  int turns;           // directions in which the grasp forbids to turn: 3 of a rigid one, 2 of a hinge, none of a point
  int turn_rows;       // of them those with a row
  int push_rows;       // linear rows: along the first axes of C
  constexpr int rows() const { return turn_rows + push_rows; }
  constexpr int forbidden() const { return turns + 3; }
  bool operator==(const LoopTable&) const = default;
};
/// A closure's numbers in a case: X_aC and X_bD (p, then R row by row), the hinge, directions of the angular rows (row
/// by row), both in C, and what scales angular and linear rows. As LoopPath has them, but that the axes of C and D are
/// turned where the loop's joints move in a plane: z is its normal.
inline constexpr int kLoopAC = 0, kLoopBD = 12, kLoopHinge = 24, kLoopTurns = 27, kLoopAngularScale = 36,
                     kLoopLinearScale = 37, kLoopNumbers = 38;

/// Sampled control, as all cases have it. A command has an effort per channel, a torque on the base from outside (3)
/// and, of thrusters, a wrench on it with its rate of change, as a load has them along a line of a table
/// (kLoadLine...).
struct ControlTable {
  bool is_sampled;
  int channels;
  int most_on_their_way;  // commands
  /// What acts is said by each case itself wherever an interval begins (CaseExchange::turn): no laws speak in packs,
  /// and nothing is on its way here.
  bool by_case;
  bool has_thrusters;
  int wheels;  // whose rates at the tick a command carries, for what may be asked of them later; NaN: nobody knows them
  bool operator==(const ControlTable&) const = default;
  constexpr int command_numbers() const {
    const int thrust = has_thrusters ? kLoadPieceNumbers[static_cast<int>(LoadTable::Kind::line)] : 0;
    return is_sampled ? channels + 3 + thrust + wheels : 0;
  }
};

/// What all cases of a run share.
struct PhaseTables {
  const LinkTable* links;
  int link_count;
  const int* tree_of;  // per link
  int tree_count;
  int driven_tree;  // in which motors and friction work
  int coordinates;
  int velocities;
  const int* quaternions;  // offsets of the coordinates' quaternions
  int quaternion_count;
  int piece_numbers;  // of a block
  int noise_numbers;
  OutsideTable outside;
  const LoadTable* loads;
  int outside_numbers;  // of a case; none where nothing acts
  int integral_count;   // among the numbers that are integrated: works of motors and friction, or all of phase_integral
  int dimension;        // of the error norm
  bool recovers;        // roots from conserved momenta
  const LoopTable* loops;
  int loop_count;
  ControlTable control;
  double runaway;  // a rate beyond which sampled control is unstable [rad/s or m/s]
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
  double max_step;      // beside the tables'
  const double* links;  // kLinkNumbers each
  const double* q;      // coordinates
  const double* v;      // velocities
  const LaneInterval* intervals;
  const double* blocks;  // of piece_numbers each
  const double* noise;
  const double* outside;   // PhaseTables::outside_numbers
  const double* loops;     // kLoopNumbers each
  const double* commands;  // ControlTable::command_numbers() each: what acts before the first interval, and what is on
  int on_their_way;        // its way then
};

/// broken_off: what was asked where an interval begins could not go on. handed_back: a step does not count, so who was
/// asked has said (CaseExchange::counts). at_largest_rate: a wheel comes near its largest rate, where modes change at
/// events, which lanes do not have; the step in which it may get there does not count. In these two the case has ended
/// where that step began, to go on alone. loops_in_doubt: closed loops come near a configuration in which their rows
/// change rank, or they cannot be closed: the case is to be integrated alone.
enum class LaneStatus : std::uint8_t {
  finished,
  step_too_small,
  too_many_steps,
  non_finite,
  unstable_control,
  broken_off,
  handed_back,
  at_largest_rate,
  loops_in_doubt
};

/// One tree of the system at one instant, as capture/conservation_monitor.hpp has it.
struct LaneTree {
  double com[3];      // in W
  double linear[3];   // momentum, in W
  double angular[3];  // about the tree's centre of mass, in W
  GroupSize<double> size;
};

/// One tree over a phase: largest over the start and all accepted steps.
struct LaneTreeRecord {
  LaneTree start, end;
  double linear_deviation;   // |p - p(start) - impulse from outside| [N s]
  double angular_deviation;  // the same of the angular momentum about the tree's centre of mass [N m s]
  double energy_deviation;   // |U - U(start) - work of motors, friction and from outside|, U the inner energy [J]
  double linear_scale, angular_scale, energy_scale;        // group_scale()
  double largest_linear, largest_angular, largest_energy;  // of GroupSize: without floors
  double exchanged[phase_integral::kExchangeCount];        // as TreeExchange
  double radius, distance;  // largest radius of gyration, and distance of the centre of mass from the origin [m]
};

/// How far closures are open, at the largest over them; see ClosureDefect.
struct LaneLoopDefect {
  double position, angle, velocity, angular_velocity;
};
/// How loops were kept closed over a phase; zero without any.
struct LaneLoopRecord {
  double rank;                 // independent rows as the phase began
  LaneLoopDefect unprojected;  // largest that one step left
  LaneLoopDefect largest;      // over the start and all accepted steps, from poses and twists
  // In the norm that judges steps:
  double corrections;      // sum of the projections
  double error_estimates;  // sum of the steps'
};

/// A case at its start, or after an accepted step.
struct CaseLook {
  double time;
  const double* q;
  const double* v;
  const double* motor;  // effort per link [N m or N]; zero where none is driven
};

/// A case where an interval of it begins, or goes on after an edge inside it.
struct CaseTurn {
  bool is_first;  // of the case
  double time;
  double end;        // of the interval
  double phase_end;  // of the case's motion
  const double* q;
  const double* v;
  const double* integrals;  // PhaseTables::integral_count
};

/// What became of a case.
struct CaseResult {
  LaneStatus status;
  double time;      // reached
  const double* q;  // there
  const double* v;
  const double* integrals;  // PhaseTables::integral_count, in the order of phase_integral
  std::int64_t steps;
  std::int64_t rejected;
  std::int64_t evaluations;
  double next_step;  // that the case tries, or has tried, first from here
  double quaternion_defect;
  const LaneTreeRecord* trees;  // PhaseTables::tree_count of them, in the order of their roots
  LaneLoopRecord loops;
  const double* commands;  // as in a record, as they are at the end
  int on_their_way;
};

/// Where cases come from and results go; called from the stepper, in lane order.
struct CaseExchange {
  void* context;
  /// The next case for a lane, valid until the lane's result has been taken; false: there is none.
  bool (*next)(void* context, int lane, CaseRecord& record);
  void (*done)(void* context, int lane, const CaseResult& result);
  /// Shows a lane's case at its start and after every accepted step; null: nobody looks.
  void (*look)(void* context, int lane, const CaseLook& look);
  /// ControlTable::by_case: writes the command that acts in a lane's case from now on. Until when: the interval's end,
  /// or an edge before; NaN: the case is broken off.
  double (*turn)(void* context, int lane, const CaseTurn& turn, double* command);
  /// Asks, before that, whether a step that has been accepted counts, with the state at its end, or whether a case may
  /// begin, with that at its start; null: all do.
  bool (*counts)(void* context, int lane, double time, const double* q, const double* v);
};

// The lane stepper, once per instruction set; each is defined where it is compiled for its set.
/// Integrates all cases of an exchange.
void run_lane_phase_one_lane(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_sse2(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_avx2(const PhaseTables& tables, CaseExchange& exchange);
void run_lane_phase_avx512(const PhaseTables& tables, CaseExchange& exchange);

}  // namespace grapnel::lanes
