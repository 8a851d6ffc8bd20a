#pragma once

/// @file
/// Results of contacts between shapes, as plain values.
/// Public, kept stable.

#include <optional>
#include <string>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// Two bodies that may touch, over the whole run. All shapes of a body together.
struct ContactPairReport {
  std::string body_a, body_b;
  int touches = 0;                         // times that contact began
  bool touches_at_end = false;             // contact lasts at the end of the run
  std::optional<double> first_time;        // begin of the first contact [s]; absent: no contact
  double duration = 0;                     // with contact, in total [s]
  double impulse = 0;                      // of the normal forces: their magnitude over time [N s]
  double peak_force = 0;                   // maximum of the normal forces' sum [N]
  double peak_time = 0;                    // its time [s]
  Vector3d peak_point = Vector3d::zero();  // centre of the normal forces then, in W [m]
  double largest_depth = 0;                // maximum penetration of both surfaces together [m]
  double slip_distance = 0;                // path of the largest slip velocity, in contact [m]
  double damping_loss = 0;                 // dissipated by the normal forces [J]
  double friction_loss = 0;                // dissipated by friction [J]
  double elastic_energy = 0;               // stored at the end of the run [J]
  bool beyond_model = false;               // some overlap was too deep for the model (theory, section 23)
};

}  // namespace grapnel
