#pragma once

/// @file
/// Many cases of one phase integrated at once, one in every SIMD lane: for campaigns, whose cases have one structure
/// and differ in their numbers. What simulate_phase() does for one case; lane_phase_setup.hpp makes structures and
/// cases of models and phase setups.
///
/// A case's numbers depend on the case alone, bit for bit: not on the cases beside it, their order or number, nor on
/// the instruction set among those with fused products. Thread safety: run_lanes() is re-entrant; each call has its own
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
#include "grapnel/pack/dispatch.hpp"
#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/phase_integrals.hpp"

namespace grapnel::lanes {

/// What all cases of a phase share.
struct LaneStructure {
  std::vector<LinkTable> links;
  int coordinates = 0;
  int velocities = 0;
  std::vector<int> quaternions;  // offsets among the coordinates
  int piece_numbers = 0;         // of all driven links' pieces and all loads: a block
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
  IntegrationSetup integration;  // tolerances, max_step, max_steps; method adaptive_8
  bool operator==(const LaneStructure&) const = default;
};

/// The driven joints' trajectories and the loads between two times, as the stepper reads them; cases may share one.
struct LaneMotion {
  double start_time = 0;
  double end_time = 0;
  std::vector<LaneInterval> intervals;
  std::vector<double> blocks;  // of piece_numbers each, see lane_phase_tables.hpp
};

/// One case.
struct LaneCase {
  std::uint64_t id = 0;       // handed on to the outcome
  std::vector<double> links;  // kLinkNumbers each, in the order of lane_phase_tables.hpp
  std::vector<double> noise;
  std::vector<double> outside;  // as there
  std::vector<double> loops;    // as there
  std::vector<double> q, v;     // the start
  /// ControlTable::command_numbers() each: what acts at the start, and what is on its way. Empty where cases say it.
  std::vector<double> commands;
  std::shared_ptr<const LaneMotion> motion;
  /// The longest step, beside the structure's [s].
  double max_step = std::numeric_limits<double>::infinity();
};

/// A case at its start, or where a step of it has ended.
struct LaneView {
  std::uint64_t id = 0;
  double time = 0;  // [s]
  std::vector<double> q, v;
  std::vector<double> motor;  // effort per link of the tree [N m or N]; zero where no joint is driven
};

/// A case where an interval of it begins, or goes on after an edge inside it (ControlTable::by_case).
struct LaneTurn {
  std::uint64_t id = 0;
  bool is_first = false;  // of the case
  double time = 0;        // [s]
  double end = 0;         // of the interval [s]
  double phase_end = 0;   // of the case's motion [s]
  std::vector<double> q, v;
  std::vector<double> integrals;  // in the order of phase_integral: works of motors and friction, or all
};

/// What became of a case. On failure q, v and the rest are those of the last accepted step, and where the next did not
/// count (LaneStatus::handed_back, at_largest_rate) they are all that it takes to go on.
struct LaneOutcome {
  std::uint64_t id = 0;
  LaneStatus status = LaneStatus::finished;
  double time = 0;           // reached [s]
  std::vector<double> q, v;  // there
  PhaseIntegrals integrals;
  std::int64_t steps = 0, rejected = 0, evaluations = 0;
  double next_step = 0;               // that it tries, or has tried, first from there [s]
  double quaternion_defect = 0;       // largest | |q| - 1 | before renormalization
  std::vector<LaneTreeRecord> trees;  // in the order of their roots
  LaneLoopRecord loops{};
  std::vector<double> commands;    // as in a case, as they are at the end
  std::size_t command_wheels = 0;  // ControlTable::wheels
  std::exception_ptr error;        // broken_off: what the case's turn threw

  bool finished() const { return status == LaneStatus::finished; }
};
/// One sentence about what happened when, as the scalar stepper says it.
std::string explanation(const LaneOutcome& outcome);

/// Fills in the next case; false: there is none.
using LaneSource = std::function<bool(LaneCase&)>;
/// Takes an outcome with its case, in the order in which cases end, which depends on the set's width.
using LaneSink = std::function<void(const LaneCase&, const LaneOutcome&)>;
/// Looks at cases while they move, a case's times in their order: at breaks of trajectories as what follows has it.
using LaneWatch = std::function<void(const LaneView&)>;
/// Asked with a case's state at its start, and at the end of every step before that counts: false: the case ends where
/// the step began, with LaneStatus::handed_back. The view has no motor efforts; at the end of a step
/// nothing of what follows at a break, nor of what sampled control says there, has happened. What it says must follow
/// from the case alone.
using LaneGate = std::function<bool(const LaneView&)>;

/// Says what acts in a case from now on, a case's turns in their order: fills in a command, of
/// ControlTable::command_numbers(). Until when: the interval's end, or an edge before. What it throws breaks the case
/// off, and no other.
using LaneControl = std::function<double(const LaneTurn&, std::span<double> command)>;

/// Integrates all cases from `source`, each from its motion's start to its end or to a step that does not pass `gate`,
/// shows every state on the way to `watch`, and hands what became of them to `sink`; without a gate or a watch nobody
/// asks or looks. What any of them throws passes through.
/// @throws std::invalid_argument if a case's sizes do not fit the structure, its end lies before its start, its longest
/// step is not positive, the structure's tolerances are unusable, cases are to say what acts and there is no `control`,
/// or the set is not supported here.
void run_lanes(const LaneStructure& structure, const LaneSource& source, const LaneSink& sink, InstructionSet set,
               const LaneWatch& watch = {}, const LaneGate& gate = {}, const LaneControl& control = {});

}  // namespace grapnel::lanes
