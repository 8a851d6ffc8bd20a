#pragma once

/// @file
/// Checks of conservation. In motion: momentum and energy of every group of bodies that touch, at every sample, against
/// what was there when the group came to be and what has been put in since; a group is the servicer with the targets it
/// holds, or a free target; while an impact is under way, what meets in it is one. At impacts: how far their solutions
/// are from what defines them.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/capture/ledger_scale.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/impact_report/impact_report.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/ledger.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"

namespace grapnel {

// Momentum and energy of a system at one instant, body by body from poses and twists.

/// One group of bodies that touch, in W: a tree of the model, or several.
struct GroupQuantities {
  Vector3d com = Vector3d::zero();
  Momentumd h = Momentumd::zero();  // [angular about the group's centre of mass; linear]
  GroupSize<double> size = {};
};
/// Several groups as one.
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

/// Momentum of some bodies, angular about `p_W`, in W: a target that hangs on an arm still has its own.
Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W);

/// Per body, which tree it is in, counted in the order of the roots.
std::vector<int> trees_of_bodies(const Model& model);

/// Where the largest deviations of momentum came in.
struct DriftCause {
  bool in_impact = false;   // at an instant, not in motion
  bool integrated = false;  // in a phase whose momentum is integrated instead of recovered
  double distance = 0;      // largest of a group's centre of mass from the origin of the computation [m]
};

/// Fills in LedgerEntry::advice of every row of conservation that fails.
void advise(const CaptureProblem& problem, const DriftCause& drift, Ledger& ledger);

/// What the checks need of one tree in a phase that somebody else has looked at, as closely as it deserves.
struct TreeMeasures {
  GroupQuantities start;         // as the phase began
  double linear_deviation = 0;   // largest |p(t) - p(start)| [N s]
  double angular_deviation = 0;  // the same of the angular momentum about the tree's centre of mass [N m s]
  double energy_deviation = 0;   // largest |U(t) - U(start) - work|, U: GroupSize::inner_energy [J]
  GroupScale<double> scale{};    // largest in the phase
  TreeExchange exchanged = {};   // in the phase
  GroupReach reach = {};         // largest in the phase
};
struct PhaseMeasures {
  std::vector<TreeMeasures> trees;  // in the order of their roots
  LedgerScale scale;                // of everything; largest in the phase
  ClosureDefect closures;           // largest of closed loops, from poses and twists
};

/// Checks momentum and energy of groups of bodies in motion and across impacts.
class ConservationMonitor {
 public:
  ConservationMonitor(const CaptureProblem& problem, const CaptureSystem& system);
  /// The model has changed: what hangs together in it.
  void set_system(const CaptureSystem& system);

  /// A phase begins: groups are the trees of the model. In a controlled phase motors work and the work-energy balance
  /// is kept; in another the energy itself. `integrated`: momentum is integrated with the rest, not recovered.
  void begin_phase(bool controlled, bool integrated);
  /// One sample; the first of a group defines what it conserves.
  void sample(const ConservedQuantities& quantities, const PhaseIntegrals& integrals);
  /// Instead of all samples of a phase, or of its first part: its measures. Deviations add to those that there were at
  /// its start.
  void take(const PhaseMeasures& measures);
  /// The phase's last integrals, so that the next phase goes on from there.
  void end_phase(const PhaseIntegrals& integrals);

  /// An instant between phases: momentum is checked, energy may jump.
  void instant(const ConservedQuantities& quantities);
  /// From the last instant on, until the next phase begins, the servicer and these targets are one group.
  void touch(std::span<const std::size_t> targets);
  /// Momentum that the ground puts into the servicer at once. About the world's origin.
  void enter(const Momentumd& momentum);

  /// The rows every run has.
  void write(Ledger& ledger) const;
  DriftCause cause() const;

 private:
  struct Drift {
    double linear = 0, angular = 0;
  };
  struct Group {
    std::vector<int> parts;                  // 0: the servicer; 1 + t: target t. Increasing
    std::vector<std::size_t> trees;          // of the model at hand
    bool known = false;                      // it has been looked at
    GroupQuantities now;                     // at the last look
    Momentumd expected = Momentumd::zero();  // [angular about the centre of mass; linear]
    Momentumd entered = Momentumd::zero();   // since the last look, about the world's origin
    Drift largest, at_phase_start, jump, growth;
    double work_energy = 0, energy = 0;
    double phase_energy = 0;
    bool in_phase = false;              // the phase has been looked at
    GroupScale<double> scale{0, 0, 0};  // of its motion
    GroupReach reach;
    TreeExchange exchanged, before;  // since it came to be; until the present phase began
    double earlier_energy = 0;       // [J] largest scale of the groups that its parts were in before
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
  Drift look(Group& group, const GroupQuantities& now, const Momentumd& impulse);
  void add_scale(const LedgerScale& scale);

  std::vector<std::string> names_;            // of the parts
  std::vector<std::vector<int>> tree_parts_;  // per tree of the model at hand
  std::vector<Group> groups_;
  bool bends_ = false;            // springs store energy, which the absolute tolerance bounds
  std::vector<Worst> rows_;       // of groups that are no more: the four rows in their order
  double jump_ = 0, growth_ = 0;  // of groups that are no more, relative
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
  /// Of an impact that took time: the residual of its balance of energy.
  void note_compliant(double energy_residual);
  /// Of an impulse that locks joints.
  void note_brake(double energy_identity_residual);
  /// Nothing where there was no impact.
  void write(Ledger& ledger) const;

 private:
  std::optional<ImpactResiduals> residuals_;
  std::optional<double> compliant_, brake_;
};

}  // namespace grapnel
