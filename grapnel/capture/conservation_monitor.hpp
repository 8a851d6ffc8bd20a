#pragma once

/// @file
/// Checks of conservation. In motion: momentum and energy of each group of bodies that touch, at each sample, relative
/// to the initial values of the group and all inputs since. A group is the servicer with the targets it holds, or a
/// free target; during an impact the bodies that meet are one group. At impacts: the residuals of the equations that
/// define their solutions.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/capture/impact_report.hpp"
#include "grapnel/capture/ledger_scale.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

// Momentum and energy of a system at one instant, body by body from poses and twists.

/// One group of touching bodies, in W: one or more trees of the model.
struct GroupQuantities {
  Vector3d com = Vector3d::zero();
  Momentumd h = Momentumd::zero();  // [angular about the group's centre of mass; linear]
  GroupSize<double> size = {};
};
/// Combines several groups into one.
GroupQuantities together(std::span<const GroupQuantities> groups);

struct ConservedQuantities {
  Vector3d com;                        // of everything
  Momentumd about_com;                 // total, about it
  double kinetic_energy = 0;           // [J]
  double elastic_energy = 0;           // of the springs at joints [J]
  double linear_scale = 0;             // sum |m v|
  double angular_scale = 0;            // sum (|I w| + |r x m v|), r from the system's centre of mass
  std::vector<GroupQuantities> trees;  // in the order of their roots
};
ConservedQuantities conserved_quantities(const Model& model, const Kinematics& kinematics, const State& state);

/// Momentum of some bodies, angular about `p_W`, in W: also of a target that hangs on an arm.
Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W);

/// Per body, the index of its tree, in the order of the roots.
std::vector<int> trees_of_bodies(const Model& model);

/// The origin of the largest deviations of momentum.
struct DriftCause {
  bool in_impact = false;   // at an instant, not during motion
  bool integrated = false;  // in a phase whose momentum is integrated instead of recovered
  double distance = 0;      // maximum distance of a group's centre of mass from the origin of the computation [m]
};

/// Sets LedgerEntry::advice of each failed conservation row.
void advise(const CaptureProblem& problem, const DriftCause& drift, Ledger& ledger);

/// Measures of one tree in a phase that was integrated and observed elsewhere.
struct TreeMeasures {
  GroupQuantities start;         // at the start of the phase
  double linear_deviation = 0;   // largest |p(t) - p(start)| [N s]
  double angular_deviation = 0;  // likewise of the angular momentum about the tree's centre of mass [N m s]
  double energy_deviation = 0;   // largest |U(t) - U(start) - work|, U: GroupSize::inner_energy [J]
  GroupScale<double> scale{};    // largest in the phase
  TreeExchange exchanged = {};   // in the phase
  GroupReach reach = {};         // largest in the phase
};
struct PhaseMeasures {
  std::vector<TreeMeasures> trees;  // in the order of their roots
  LedgerScale scale;                // of everything; largest in the phase
  ClosureDefect closures;           // maximum of closed loops, from poses and twists
};

/// Checks momentum and energy of groups of bodies in motion and across impacts.
class ConservationMonitor {
 public:
  ConservationMonitor(const CaptureProblem& problem, const CaptureSystem& system);
  /// Sets a new model, with its trees.
  void set_system(const CaptureSystem& system);

  /// Begins a phase: groups are the trees of the model. In a controlled phase motors are active and the work-energy
  /// balance is checked; otherwise the energy itself. `integrated`: momentum is integrated with the state, not
  /// recovered.
  void begin_phase(bool controlled, bool integrated);
  /// Adds one sample; the first of a group defines its conserved values.
  void sample(const ConservedQuantities& quantities, const PhaseIntegrals& integrals);
  /// The measures of a phase, or of its first part, instead of samples. Deviations add to those at its start.
  void take(const PhaseMeasures& measures);
  /// Stores the phase's final integrals, from which the next phase continues.
  void end_phase(const PhaseIntegrals& integrals);

  /// An instant between phases: momentum is checked, energy may jump.
  void instant(const ConservedQuantities& quantities);
  /// From the last instant to the beginning of the next phase, the servicer and these targets are one group.
  void touch(std::span<const std::size_t> targets);
  /// Adds an impulse of the ground on the servicer, about the world's origin.
  void enter(const Momentumd& momentum);

  /// Writes the rows that every run has.
  void write(Ledger& ledger) const;
  DriftCause cause() const;

 private:
  struct Drift {
    double linear = 0, angular = 0;
  };
  struct Group {
    std::vector<int> parts;                  // 0: the servicer; 1 + t: target t. Increasing
    std::vector<std::size_t> trees;          // of the current model
    bool known = false;                      // it has been sampled
    GroupQuantities now;                     // at the last sample
    Momentumd expected = Momentumd::zero();  // [angular about the centre of mass; linear]
    Momentumd entered = Momentumd::zero();   // since the last sample, about the world's origin
    Drift largest, at_phase_start, jump, growth;
    double work_energy = 0, energy = 0;
    double phase_energy = 0;
    bool in_phase = false;              // sampled in the current phase
    GroupScale<double> scale{0, 0, 0};  // of its motion
    GroupReach reach;
    TreeExchange exchanged, before;  // since the group exists; up to the current phase
    double earlier_energy = 0;       // [J] maximum scale of the previous groups of its parts
  };
  /// The worst group of a row.
  struct Worst {
    double value = 0, scale = 0;
    std::vector<int> parts;
  };

  static bool holds_servicer(const Group& group) { return group.parts.front() == 0; }
  void find_trees();
  static void inherit(Group& group, const Group& before);
  void merge(const std::vector<bool>& which);
  void retire(const Group& group);
  GroupScale<double> scale_of(const Group& group) const;
  void judge(const Group& group, std::vector<Worst>& rows) const;
  Drift update_group(Group& group, const GroupQuantities& now, const Momentumd& impulse);
  void add_scale(const LedgerScale& scale);

  std::vector<std::string> names_;            // of the parts
  std::vector<std::vector<int>> tree_parts_;  // per tree of the current model
  std::vector<Group> groups_;
  bool bends_ = false;            // springs store energy, which the absolute tolerance bounds
  std::vector<Worst> rows_;       // of former groups: the four rows in their order
  double jump_ = 0, growth_ = 0;  // of former groups, relative
  double farthest_ = 0;           // likewise [m]
  SlowestMotion slowest_;
  bool started_ = false;
  bool controlled_ = false;
  bool any_controlled_ = false, any_uncontrolled_ = false, any_integrated_ = false;
  LedgerScale scale_;  // of everything
  double mass_ = 0;
};

/// The largest residuals of a run's impacts, as rows of the ledger.
class ImpactMonitor {
 public:
  void note(const ImpactResiduals& residuals);
  /// Writes nothing without an impact.
  void write(Ledger& ledger) const;

 private:
  ImpactResiduals largest_;
};

}  // namespace grapnel
