#pragma once

/// @file
/// Tendons of a robot and their commands, as plain data. docs/theory, section 19, Tendons.
/// Public, kept stable.

#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// The action of a tendon on one joint.
struct TendonArm {
  std::string joint;
  double arm = 0;  // effort per tension: moment arm of a turning joint [m], 1 or a pulley's factor of a sliding one [1]
};

/// A tendon that pulls several joints with one tension. It only pulls.
struct TendonSetup {
  std::string name;
  std::vector<TendonArm> joints;
  std::optional<double> stiffness;  // of the tendon and its drive [N/m]; needed by commands with a speed
};

/// The command of a tendon in a phase of motion.
struct TendonCommand {
  std::string tendon;
  double tension = 0;           // with a speed: maximum [N]
  std::optional<double> speed;  // at which the drive winds the tendon up, from the start of the phase [m/s]
};

}  // namespace grapnel
