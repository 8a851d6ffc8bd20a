#pragma once

/// @file
/// Simultaneous integration of many cases of one phase, one per SIMD lane. Intended for campaigns, whose cases share
/// one structure and differ in their numbers. Corresponds to simulate_phase() for single cases. lane_phase_setup.hpp
/// creates structures and cases from models and phase setups.
///
/// The result of a case depends on this case alone, bit for bit: not on other cases, their order or number, nor on the
/// instruction set among those with fused products. Thread safety: run_lanes() is re-entrant. Each call has its own
/// memory, which does not grow with the number of cases.

#include <cstdint>
#include <exception>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/phase_integrals.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::lanes {

/// The structure that all cases of a phase share.
struct LaneStructure {
  std::vector<LinkTable> links;
  int coordinates = 0;
  int velocities = 0;
  std::vector<int> quaternions;  // offsets among the coordinates
  int block_size = 0;            // size of a block: segments of all driven links and all loads
  int noise_numbers = 0;
  OutsideTable outside{false, false, false, -1, 0, 0, false, false, false};
  std::vector<LoadTable> loads;
  int outside_numbers() const {
    if (!outside.has_numbers()) return 0;
    return kLoads + kLoadNumbers * static_cast<int>(loads.size()) + kWheelNumbers * outside.wheel_count;
  }
  std::vector<LoopTable> loops;
  bool recover_roots = true;
  ControlTable control{false, 0, 0, false, false, 0};
  IntegrationSetup integration;  // tolerances, max_step, max_steps; method automatic or adaptive_8: explicit steps
  bool operator==(const LaneStructure&) const = default;
};

/// The driven joints' trajectories and the loads between two times, in the stepper's format; cases may share one.
struct LaneMotion {
  double start_time = 0;
  double end_time = 0;
  std::vector<LaneInterval> intervals;
  std::vector<double> blocks;  // of block_size each, see lane_phase_tables.hpp
};

/// One case.
struct LaneCase {
  std::uint64_t id = 0;       // copied to the outcome
  std::vector<double> links;  // kLinkNumbers each, in the order of lane_phase_tables.hpp
  std::vector<double> noise;
  std::vector<double> outside;  // format in lane_phase_tables.hpp
  std::vector<double> loops;    // likewise
  std::vector<double> q, v;     // initial state
  /// ControlTable::command_numbers() each: the command active at the start, then the delayed ones. Empty with by_case.
  std::vector<double> commands;
  std::shared_ptr<const LaneMotion> motion;
  /// Maximum step, in addition to that of the structure [s].
  double max_step = std::numeric_limits<double>::infinity();
};

/// A case at its start or at the end of an accepted step.
struct LaneView {
  std::uint64_t id = 0;
  double time = 0;  // [s]
  std::vector<double> q, v;
  std::vector<double> motor;  // effort per link of the tree [N m or N]; zero where no joint is driven
};

/// A case at the begin of an interval, or at an edge inside it (ControlTable::by_case).
struct LaneTurn {
  std::uint64_t id = 0;
  bool is_first = false;  // first turn of the case
  double time = 0;        // [s]
  double end = 0;         // of the interval [s]
  double phase_end = 0;   // of the case's motion [s]
  std::vector<double> q, v;
  std::vector<double> integrals;  // in the order of phase_integral: works of motors and friction, or all
};

/// Outcome of a case. On failure, q, v and the other members are those of the last accepted step. If the next step was
/// not accepted (LaneStatus::step_refused, at_largest_rate), they contain everything required to resume.
struct LaneOutcome {
  std::uint64_t id = 0;
  LaneStatus status = LaneStatus::finished;
  double time = 0;           // time reached [s]
  std::vector<double> q, v;  // state at that time
  PhaseIntegrals integrals;
  std::int64_t steps = 0, rejected = 0, evaluations = 0;
  double next_step = 0;               // step size to try next, or already tried, from there [s]
  double quaternion_defect = 0;       // maximum | |q| - 1 | before renormalization
  std::vector<LaneTreeRecord> trees;  // in the order of their roots
  LaneLoopRecord loops{};
  std::vector<double> commands;    // final commands, in the format of LaneCase::commands
  std::size_t command_wheels = 0;  // ControlTable::wheels
  std::exception_ptr error;        // broken_off: the exception of the case's control

  bool finished() const { return status == LaneStatus::finished; }
};
/// One sentence that describes the failure and its time, in the wording of the scalar stepper.
std::string explanation(const LaneOutcome& outcome);

/// Writes the next case; false if there is none.
using LaneSource = std::function<bool(LaneCase&)>;
/// Receives an outcome with its case, in the order in which cases end, which depends on the width of the instruction
/// set.
using LaneSink = std::function<void(const LaneCase&, const LaneOutcome&)>;
/// Receives the states of cases during integration, each case's in order of time; at trajectory breaks with the values
/// of the following segment.
using LaneWatch = std::function<void(const LaneView&)>;
/// Decides at the case's start and at the end of every step whether the step is accepted. On false the case ends at the
/// step's begin with LaneStatus::step_refused. The view has no motor efforts; at a step's end it precedes the changes
/// at a break and the update of sampled control. The decision must depend on the case alone.
using LaneGate = std::function<bool(const LaneView&)>;

/// Computes the command of a case from now on, in order of time for each case: writes a command of
/// ControlTable::command_numbers(). Returns its end: the interval's end or an earlier edge. An exception ends this case
/// only.
using LaneControl = std::function<double(const LaneTurn&, std::span<double> command)>;

/// The functions of a caller of run_lanes(). Exceptions from them pass through.
struct LaneCaller {
  LaneSource source;
  LaneSink sink;
  LaneWatch watch = {};      // may be absent
  LaneGate gate = {};        // may be absent
  LaneControl control = {};  // may be absent without ControlTable::by_case
};

/// Integrates all cases of `caller`, each from its motion's start to its end or to a step that the gate rejects.
/// @throws std::invalid_argument if a case's sizes do not match the structure, its end precedes its start, its maximum
/// step is not positive, the structure's tolerances are invalid, the control is missing with ControlTable::by_case, or
/// the set is not supported here.
void run_lanes(const LaneStructure& structure, const LaneCaller& caller, InstructionSet set);

}  // namespace grapnel::lanes
