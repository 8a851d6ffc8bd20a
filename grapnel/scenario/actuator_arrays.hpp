#pragma once

/// @file
/// Usual arrangements of reaction wheels and control moment gyros, by a few numbers in place of a list.

#include <limits>
#include <string>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// Three along the base's axes, or four whose axes lean alike from one of them.
enum class ArrayConfiguration { orthogonal, pyramid };
enum class BaseAxis { x, y, z };

/// Where the axes of an array are. Of a pyramid with the axis a, every axis is turned by `skew` from a; seen along a,
/// the first leans towards the base's next axis (from z towards x, from x towards y), turned by `azimuth` about a, and
/// each by a quarter of a turn from the one before.
struct ArrayLayout {
  ArrayConfiguration configuration = ArrayConfiguration::pyramid;
  BaseAxis axis = BaseAxis::z;
  double skew = 0.95531661812450927;  // acos(1/sqrt(3)): the array can do as much along all three axes [rad]
  double azimuth = 0;                 // [rad]
};

struct WheelArraySetup {
  ArrayLayout layout;
  WheelSetup each;  // its name is what the wheels' names begin with
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
