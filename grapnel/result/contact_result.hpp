#pragma once

/// @file
/// Results of contacts between shapes, as plain values.
/// Public, kept stable.

#include <optional>
#include <string>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// Impacts of two hard bodies in an instant, over the whole run.
struct HardContactReport {
  int impacts = 0;
  double fastest_impact = 0;               // largest approach speed [m/s]
  std::optional<double> last_time;         // of the last impact [s]; absent: none
  double impulse = 0;                      // sum of the normal impulses [N s]
  double restitution_loss = 0;             // lost by normal impulses [J]
  double friction_loss = 0;                // lost by tangential impulses [J]
  std::optional<double> persistent_since;  // begin of the first persistent contact [s]; absent: none
};

/// Two bodies that may touch, over the whole run. All shapes of a body together.
struct ContactPairReport {
  std::string body_a, body_b;
  int touches = 0;                             // times that contact began
  bool touches_at_end = false;                 // contact lasts at the end of the run
  std::optional<double> first_time;            // begin of the first contact [s]; absent: no contact
  double duration = 0;                         // with contact, in total [s]
  double impulse = 0;                          // of the normal forces: their magnitude over time, and of impacts [N s]
  double peak_force = 0;                       // maximum of the normal forces' sum [N]
  double peak_time = 0;                        // its time [s]
  Vector3d peak_point = Vector3d::zero();      // centre of the normal forces then, in W [m]
  double largest_depth = 0;                    // maximum penetration of both surfaces together [m]
  double slip_distance = 0;                    // path of the largest slip velocity, in contact [m]
  double damping_loss = 0;                     // dissipated by the normal forces [J]
  double friction_loss = 0;                    // dissipated by friction [J]
  double elastic_energy = 0;                   // stored at the end of the run [J]
  bool beyond_model = false;                   // some overlap was too deep for the model (theory, section 23)
  std::optional<double> beyond_model_since;    // begin of the first one [s]; absent: none
  std::optional<double> beyond_model_depth;    // penetration at that time [m]; absent: none
  std::optional<HardContactReport> hard = {};  // absent: the contact is compliant
};

/// The stages of the capture of one target by contacts (StagesSetup), over the whole run. Times are absent for stages
/// that were not reached [s].
struct StagesReport {
  std::string target;
  enum class Stage { approach, contact, closed, caged, settled, latched };
  Stage reached = Stage::approach;     // the last one, in this order
  std::optional<double> contact_time;  // first contact of gripper and target
  std::optional<double> closing_time;  // begin of closing
  std::optional<double> closed_time;   // end of closing, if the gripper touches the target then
  std::optional<double> settled_time;  // at the end of the stated time
  std::optional<double> latched_time;  // a grasp has closed
  /// Result of the last search of an escape path (CageAnswer).
  enum class Cage { not_searched, caged, can_leave, undecided };
  Cage cage = Cage::not_searched;
  std::optional<double> cage_time;   // of this search
  std::optional<double> caged_time;  // of the first search that showed a cage
  double cage_allowance = 0;         // overlap that counts as free in it [m]
  long cage_poses = 0;               // evaluated in it
  /// Why the capture failed. no_contact: the gripper never touched the target. closed_on_nothing: likewise, and it
  /// closed. pushed_away: after contact the target moved away. not_settled: the target is near, but moves.
  /// jammed: the target is settled, but an escape path from the gripper was found. slipped: the target was settled and
  /// moved again, lost: or lost contact.
  enum class Failure { none, no_contact, closed_on_nothing, pushed_away, not_settled, jammed, slipped, lost };
  Failure failure = Failure::none;
  std::optional<double> failure_time;           // [s]; absent without one
  double grip_force = 0;                        // sum of the gripper's normal forces at the end, or when latched [N]
  std::optional<double> least_friction_margin;  // after settling: 1 less the largest ContactForce::friction_use
};

/// The time [s] at which a stage was reached; absent: it was not. The approach has no time.
std::optional<double> stage_time(const StagesReport& report, StagesReport::Stage stage);

}  // namespace grapnel
