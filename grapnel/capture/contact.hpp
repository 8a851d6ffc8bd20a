#pragma once

/// @file
/// The instant of contact: how far end-effectors are from their grasp points, and what is gripped where.
/// Thread safety: pure functions.

#include "grapnel/capture/capture_system.hpp"
#include "grapnel/constraint/grasp.hpp"

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

/// Applies the rule contact.gap to the grasps that close now. `held`: targets (in the problem's order) that other grips
/// hold already, which stay where they are; empty: none. A target that several arms grip moves by the mean of its gaps.
Contact make_contact(const CaptureProblem& problem, const CaptureSystem& system, const State& state,
                     const std::vector<bool>& held = {});

/// Of the arm's reach (arm_reach): what a grasp may bridge of which no envelope says what its hand can close on.
constexpr double kLargestGapOfReach = 0.1;
/// Which grasps would hold across gaps too wide to be called a capture, ContactSetup::largest_gap: what is left between
/// end-effector and grasp point after contact.gap. In words; empty: none.
std::string gaps_too_wide(const CaptureProblem& problem, const CaptureSystem& system, const Contact& contact);

}  // namespace grapnel
