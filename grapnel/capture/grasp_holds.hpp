#pragma once

/// @file
/// Loads of grasps relative to the limits of what they hold (GraspLimits), during a motion and in impacts, and the ends
/// of their slips; docs/theory, sections 8.6 and 8.7.

#include <span>
#include <vector>

#include "grapnel/capture/compliant_run.hpp"
#include "grapnel/integrate/peak_search.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/impact_result.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel {

/// Force and moment magnitudes of a grasp's load, relative to its limits: 1 at the limit (8.15).
double share_of_limits(const GraspLimits& limits, double force, double moment);

/// The load of a grasp with limits.
struct HoldLoad {
  std::size_t grasp = 0;          // of the problem
  double force = 0;               // [N]
  double moment = 0;              // about the grasp point [N m]
  double share = 0;               // of its limits
  double time = 0;                // [s]
  Wrenchd F_C = Wrenchd::zero();  // on the robot, in the grasp's axes; during a motion
};

/// The parts that slip beyond a load at the limits: both with common limits, otherwise those at their limits.
SlipParts parts_beyond(const GraspLimits& limits, const HoldLoad& load);

/// Parts of a slipping grasp that came to rest.
struct RestingSlip {
  std::size_t slip = 0;  // in CaptureSystem::slips
  SlipParts parts;
};

/// Watches the loads of the grasps of a system that have limits, and its slipping grasps, in one motion segment.
class HoldWatch {
 public:
  /// `problem` and `system` outlive it. `moved`: per entry of system.slips, whether it has moved; see moved().
  HoldWatch(const CaptureProblem& problem, const CaptureSystem& system, std::vector<SlipParts> moved);

  /// Whether any grasp that holds has limits, or slips.
  bool any() const { return !watched_.empty() || !system_.slips.empty(); }
  /// The smallest margin at a sample (LoadCondition): one less the share of a grasp that holds, or of the part of a
  /// slipping grasp that holds; of a slip the distance of its speed from that at which it ends, and one less its share
  /// of the limits of the slip.
  double margin(const PhaseSample& sample);
  /// The result of the last margin(); one if there was none.
  double last_margin() const;
  /// The loads at the last margin() of the grasps, and held parts of grasps, that have reached their limits: the
  /// largest, and all within rounding of it.
  std::vector<HoldLoad> at_limit() const;
  /// Slips that came to rest, in all parts or in one, at the last margin(), likewise.
  std::vector<RestingSlip> at_rest() const;
  /// Entries of system.slips that reached the limits of the slip, likewise.
  std::vector<std::size_t> slipped_out() const;
  /// Per entry of system.slips the parts whose speed has exceeded twice the slip resolution.
  const std::vector<SlipParts>& moved() const { return moved_; }
  /// Adds a step to the search for the largest shares.
  void step(const PhaseStep& step);
  /// Per grasp with limits the largest share in all steps, and its time; force and moment are not filled.
  std::vector<HoldLoad> largest() const;

 private:
  // Margins of a slip: of its parts from rest, infinite of a part that does not slip, and from its limits.
  struct SlipMargins {
    double force, moment, out;
  };

  void evaluate(const PhaseSample& sample);
  void evaluate_slips();
  void add_held_parts(const PhaseSample& sample);
  double reached() const;

  const CaptureProblem& problem_;
  const CaptureSystem& system_;
  std::vector<std::size_t> watched_;  // entries of system.grasps with limits
  std::vector<HoldLoad> loads_;       // of these, at the last evaluation
  std::vector<HoldLoad> stop_;        // at the last margin(), then those of held parts of slipping grasps
  std::vector<SlipMargins> slips_;    // at the last margin()
  std::vector<SlipParts> moved_;      // per slip
  Kinematics kinematics_;
  PeakSearch search_;
};

/// The loads of grasps with limits in an impact, per grasp of its report: the means over its duration, or the peaks of
/// a compliant impact, whose force and moment need not be simultaneous. `time` is not filled.
std::vector<HoldLoad> loads_in_impact(const CaptureProblem& problem, const ImpactReport& report);

/// Displacement [m] and rotation [rad] of the gripper relative to the target since a slipping grasp closed; of a hinge
/// the rotation of its axis, of a point none.
struct SlipDisplacement {
  double distance = 0, angle = 0;
};
SlipDisplacement displacement_of(const GraspSlip& slip, const Kinematics& kinematics);

/// Sample of a compliant impact => the largest loads so far of the grasps with limits that already hold.
void raise_held_loads(const CaptureProblem& problem, const CaptureSystem& system, const CompliantSample& sample,
                      std::vector<HoldLoad>& largest);

}  // namespace grapnel
