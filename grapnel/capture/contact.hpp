#pragma once

/// @file
/// The instant of contact: distances of end-effectors from their grasp points, whether the grippers can close, and the
/// resulting grasps.

#include <optional>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// One end-effector relative to its grasp point.
struct GraspGap {
  Posed X_WE;           // end-effector
  Posed X_WG;           // grasp point on the target, before any displacement
  Twistd V_WE;          // at the end-effector's origin
  Twistd V_WG;          // of the target at the grasp point
  double distance = 0;  // [m]
  double angle = 0;     // between the frames [rad]
};
/// `system` may be before or after the capture. One entry per grasp of the problem.
std::vector<GraspGap> grasp_gaps(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics);

struct Contact {
  std::string refused;                 // why there is no contact, by contact.gap: refuse
  State state;                         // targets moved by translate_target, everything else unchanged
  std::vector<GraspGap> gaps;          // before targets were moved
  std::vector<Vector3d> displacement;  // of the grasp's target [m]
  std::vector<Grasp> grasps;           // common points are the end-effectors' origins
};

/// Applies the rule contact.gap to the closing grasps. `held`: targets (in the problem's order) that other grasps
/// already hold, which are not moved; empty: none. A target with several closing grasps moves by the mean of its gaps.
Contact make_contact(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                     const std::vector<bool>& held = {});

/// Fraction of the arm's reach (arm_reach): the maximum gap of a grasp without a position in its envelope.
constexpr double kLargestGapOfReach = 0.1;
/// Describes a gap beyond the limit of a capture, ContactSetup::largest_gap: the remaining distance between
/// end-effector and grasp point after contact.gap has moved the target by `displacement`; empty: within the limit.
std::string gap_too_wide(const CaptureProblem& problem, const GraspSetup& grasp, const CaptureSystem& system,
                         const GraspGap& gap, const Vector3d& displacement);

/// Deviations of an end-effector from its grasp point, in the terms of a CaptureEnvelope.
struct GraspDeviation {
  double position = 0;          // [m]
  double angle = 0;             // from the grasp's required orientation; 0 if it is free [rad]
  double velocity = 0;          // [m/s]
  double angular_velocity = 0;  // [rad/s]
};

/// Deviations of all grasps. @throws nothing.
std::vector<GraspDeviation> grasp_deviations(const CaptureProblem& problem, const CaptureSystem& system,
                                             const Kinematics& kinematics);

/// The maximum of deviation over tolerance, less one: negative inside, -1 without an envelope.
double envelope_excess(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation);

/// Whether an envelope limits the position: otherwise the capture is not evaluated.
bool judges_position(const std::optional<CaptureEnvelope>& envelope);

/// Whether each grasp closes, with the reason as text.
struct GraspDecision {
  bool captured = false;
  bool judged = false;   // by an envelope with a position
  std::string reason;    // the evaluation of the envelope
  std::string limiting;  // the key exceeded by the largest factor: position, angle, velocity, angular_velocity
  GraspDeviation deviation;
};
std::vector<GraspDecision> decide_grasps(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& kinematics);

/// The excess of every grasp, for grasps that close when their envelopes are met.
std::vector<double> envelope_excesses(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics);

/// contact_normal() of a grasp's target at its current pose, in W. @throws CaptureProblemError if there is none.
Vector3d contact_normal_in_world(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics, const GraspSetup& grasp);

/// The system at an instant, before or after the capture.
PhaseEnd describe(const CaptureProblem& problem, const CaptureSystem& system, const State& state, double time);

/// The motion of the targets.
std::vector<BodyMotion> describe_targets(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& kinematics);

}  // namespace grapnel
