#pragma once

/// @file
/// The magnetic field of the Earth as a tilted dipole that rotates with it (docs/theory, section 14, Magnetic field).
/// Thread safety: free functions; no state. Public, kept stable.

#include <string>

#include "grapnel/simulate/orbit.hpp"

namespace grapnel {

/// Orientation of the Earth in W, which does not rotate.
struct MagneticField {
  Vector3d axis{0, 0, 1};       // unit: rotation axis of the Earth, to the north pole
  Vector3d greenwich{1, 0, 0};  // unit, perpendicular to it: to the meridian of Greenwich, at t = 0
};

/// The first three Gauss coefficients of IGRF-14 for the epoch 2025.0, g11, h11 and g10 [T], as a vector in the axes of
/// the Earth (to Greenwich, to 90 deg east, to the north pole), and its reference radius [m]. Source: IAGA, IGRF-14,
/// doi:10.5281/zenodo.14012302.
inline constexpr double kDipole[3] = {-1410.3e-9, 4545.5e-9, -29350.0e-9};
inline constexpr double kDipoleRadius = 6371.2e3;
/// Rotation rate of the Earth relative to the stars [rad/s].
inline constexpr double kEarthRate = 7.2921158553e-5;

/// (14.8): the field at p, from the Earth's centre in W [m], at the time t [s]; in W [T].
Vector3d magnetic_field(const MagneticField& field, const Vector3d& p, double t);
/// The field at the orbit's reference point.
Vector3d magnetic_field(const MagneticField& field, const ReferenceOrbit& orbit, double t);

/// The error in the orientation, as the end of a sentence that begins with it; empty: none.
std::string fault_of(const MagneticField& field);

}  // namespace grapnel
