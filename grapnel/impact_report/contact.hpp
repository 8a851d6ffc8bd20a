#pragma once

/// @file
/// The instant of contact: how far end-effectors are from their grasp points, whether the grippers can close on them,
/// and what is grasped where.

#include <optional>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/capture_result.hpp"

namespace grapnel {

/// One end-effector against its grasp point.
struct GraspGap {
  Posed X_WE;           // end-effector
  Posed X_WG;           // grasp point on the target, before anything is moved
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
  State state;                         // targets moved by translate_target, everything else as it was
  std::vector<GraspGap> gaps;          // as found, before targets were moved
  std::vector<Vector3d> displacement;  // of the grasp's target [m]
  std::vector<Grasp> grasps;           // common points are the end-effectors' origins
};

/// Applies the rule contact.gap to the grasps that close now. `held`: targets (in the problem's order) that other
/// grasps hold already, which stay where they are; empty: none. A target that several arms grasp moves by the mean of
/// its gaps.
Contact make_contact(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                     const std::vector<bool>& held = {});

/// Of the arm's reach (arm_reach): what a grasp may bridge of which no envelope says what its end-effector can close
/// on.
constexpr double kLargestGapOfReach = 0.1;
/// Whether a grasp would hold across a gap too wide to be called a capture, ContactSetup::largest_gap: what is left
/// between end-effector and grasp point after contact.gap has moved the target by `displacement`. In words; empty: no.
std::string gap_too_wide(const CaptureProblem& problem, const GraspSetup& grasp, const CaptureSystem& system,
                         const GraspGap& gap, const Vector3d& displacement);

/// How an end-effector stands to its grasp point, in the terms of a CaptureEnvelope.
struct GraspDeviation {
  double position = 0;          // [m]
  double angle = 0;             // of what the grasp's orientation asks for; 0 if it is free [rad]
  double velocity = 0;          // [m/s]
  double angular_velocity = 0;  // [rad/s]
};

/// Deviations of all grasps. @throws nothing.
std::vector<GraspDeviation> grasp_deviations(const CaptureProblem& problem, const CaptureSystem& system,
                                             const Kinematics& kinematics);

/// The largest of deviation over tolerance, less one: negative inside, -1 without an envelope.
double envelope_excess(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation);

/// Whether an envelope says how far the end-effector may be: without that nobody can judge a capture.
bool judges_position(const std::optional<CaptureEnvelope>& envelope);

/// Whether each grasp closes, with the reason in words.
struct GraspDecision {
  bool captured = false;
  bool judged = false;   // by an envelope with a position
  std::string reason;    // what the envelope says
  std::string limiting;  // its key that is missed by the largest factor: position, angle, velocity, angular_velocity
  GraspDeviation deviation;
};
std::vector<GraspDecision> decide_grasps(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& kinematics);

/// The excess of every grasp, for grasps that close when their envelopes are met.
std::vector<double> envelope_excesses(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics);

/// contact_normal() of a grasp's target where it is now, in W. @throws CaptureProblemError if there is none.
Vector3d contact_normal_in_world(const CaptureProblem& problem, const CaptureSystem& system,
                                 const Kinematics& kinematics, const GraspSetup& grasp);

/// The system at an instant, before or after the capture.
PhaseEnd describe(const CaptureProblem& problem, const CaptureSystem& system, const State& state, double time);

/// The targets alone.
std::vector<BodyMotion> describe_targets(const CaptureProblem& problem, const CaptureSystem& system,
                                         const Kinematics& kinematics);

}  // namespace grapnel
