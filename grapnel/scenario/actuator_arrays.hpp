#pragma once

/// @file
/// Standard arrangements of reaction wheels and control moment gyros, by a few parameters in place of a list.

#include <limits>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Three along the base's axes, or four with equal inclination to one of these axes.
enum class ArrayConfiguration { orthogonal, pyramid };
enum class BaseAxis { x, y, z };

/// The axes of an array. In a pyramid with the axis a, `skew` is the angle between every axis and a. In the view along
/// a, the first axis points towards the base's next axis (from z towards x, from x towards y), rotated by `azimuth`
/// about a; each further axis is rotated by a quarter turn.
struct ArrayLayout {
  ArrayConfiguration configuration = ArrayConfiguration::pyramid;
  BaseAxis axis = BaseAxis::z;
  double skew = 0.95531661812450927;  // acos(1/sqrt(3)): equal capacity along all three axes [rad]
  double azimuth = 0;                 // [rad]
};

struct WheelArraySetup {
  ArrayLayout layout;
  WheelSetup each;  // its name is the prefix of the wheels' names
  WheelArraySetup() { each.name = "wheel"; }
};

struct GyroArraySetup {
  ArrayLayout layout;
  MomentGyroSetup each;
  GyroArraySetup() { each.name = "gyro"; }
};

/// Wheels NAME-1, NAME-2, ... about the axes of the layout.
std::vector<WheelSetup> wheels_of(const WheelArraySetup& array);
/// Gyros likewise, with the gimbals' axes so; with the gimbals at their zeros the rotors' axes of a pyramid are
/// perpendicular to its axis, right-handed about it, so that their momenta add up to none; of an orthogonal array they
/// are along the base's y, z and x.
std::vector<MomentGyroSetup> gyros_of(const GyroArraySetup& array);

}  // namespace grapnel
