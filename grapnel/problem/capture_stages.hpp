#pragma once

/// @file
/// The stages of a capture by contacts, as plain data: what a run observes between a target and its gripper.
/// Public, kept stable.

#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// Search of an escape path from a gripper (search_cage()).
struct CageSearchSetup {
  double resolution = 0;  // [m]; 0: CageSearch::resolution
  int poses = 50'000;     // evaluated at most
};

/// Stages of the capture of one target, without effect on the motion except by grasps that close when it is settled.
struct StagesSetup {
  std::string target;                // empty: the only one
  std::vector<std::string> gripper;  // links; empty: all links that may touch the target (CaptureProblem::contacts)
  std::string closing;               // name of the phase of motion in which the gripper closes; empty: the first
  std::string relative_to;           // link to which the target's motion is relative; empty: the base

  /// The target is settled once the gripper has touched it and it has moved less than this, relative to the link, for a
  /// time.
  double speed = 0;  // of its centre of mass [m/s]
  double rate = 0;   // [rad/s]
  double time = 0;   // [s]

  /// Distance of gripper and target beyond which it is pushed away [m]; 0: the radius of the target's shapes about its
  /// frame.
  double away = 0;

  /// At the end of closing and when the target is settled.
  std::optional<CageSearchSetup> cage;  // absent: no search
};

}  // namespace grapnel
