#pragma once

/// @file
/// The gripper: whether an end-effector is where it can close on its grasp point. Thread safety: pure functions.

#include "grapnel/capture/contact.hpp"

namespace grapnel {

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

/// Whether each grip closes, with the reason in words.
struct GripDecision {
  bool captured = false;
  bool judged = false;   // by an envelope with a position
  std::string reason;    // what the envelope says
  std::string limiting;  // its key that is missed by the largest factor: position, angle, velocity, angular_velocity
  GraspDeviation deviation;
};
std::vector<GripDecision> decide_grips(const CaptureProblem& problem, const CaptureSystem& system,
                                       const Kinematics& kinematics);

/// The excess of every grasp, for grips that close when their envelopes are met.
std::vector<double> envelope_excesses(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics);

}  // namespace grapnel
