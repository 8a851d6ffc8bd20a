#pragma once

/// @file
/// A free-floating robot of two arms, six bodies that meet it and each other, and a wall: several simultaneous
/// contacts, for comparisons with other engines.

#include <string>
#include <vector>

#include "engines/mujoco_contacts.hpp"

namespace grapnel::testing {

struct ContactScene {
  Model model;
  State state;
  std::vector<EngineSurface> surfaces;
  std::vector<SurfacePair> pairs;  // each in its own group

  ContactSet contacts() const;
};

/// Both fingers, a sphere and a capsule, close on a box that turns; balls meet a hull, the cylinder of the base, a
/// capsule, the wall and each other. Some laws are those of Hertz, with dissipation. With `linear`, all laws are linear
/// and without dissipation, the second finger is a sphere and the hull is a box.
ContactScene two_arm_scene(bool linear);

/// The robot of two_arm_scene(true) and the box alone.
ContactScene dual_arm_capture();

/// two_arm_scene(false) with a sphere as the first shape of each pair, and with a sphere, a half-space, a box or the
/// hull as the second. All laws are those of Hertz, with dissipation.
ContactScene sphere_scene();
/// Free balls that spin about all axes and slide throughout their contacts, with friction: one
/// strikes a wall at an angle, two strike each other.
ContactScene sliding_balls(double stiction_displacement);

}  // namespace grapnel::testing
