#include "grapnel/simulate/orbit.hpp"

#include <cmath>
#include <numbers>

namespace grapnel {
namespace {

constexpr double kSquare = 1e-9;  // tolerance of unit lengths and right angles

// The eccentric anomaly E of M = E - e sin E, for M in [-pi, pi] (14.1), by Newton's method. From the chosen start, the
// first or second iterate is beyond the solution, and later ones converge monotonically.
double eccentric_anomaly(double M, double e) {
  if (e == 0) return M;
  double E = e < 0.8 ? M + e * std::sin(M) : std::copysign(std::numbers::pi, M);
  constexpr int kMost = 30;  // 5 suffice up to e = 0.8
  for (int i = 0; i < kMost; ++i) {
    const double step = (E - e * std::sin(E) - M) / (1 - e * std::cos(E));
    E -= step;
    if (!(std::abs(step) > 1e-15)) break;
  }
  return E;
}

}  // namespace

double mean_motion(const ReferenceOrbit& orbit) {
  const double a = orbit.semi_major_axis;
  return std::sqrt(orbit.mu / a) / a;
}

// Orbit => constants of (14.1): mean motion, mean anomaly at t = 0 from the true anomaly by Kepler's equation, axes.
OrbitConstants<double> orbit_constants(const ReferenceOrbit& orbit) {
  const double e = orbit.eccentricity, root = std::sqrt(1 - e * e);
  const double cos_0 = std::cos(orbit.true_anomaly), sin_0 = std::sin(orbit.true_anomaly);
  const double E_0 = std::atan2(root * sin_0, e + cos_0), M_0 = E_0 - e * std::sin(E_0);
  return {orbit.mu,
          orbit.semi_major_axis,
          e,
          root,
          mean_motion(orbit),
          M_0,
          cos_0,
          sin_0,
          orbit.radial,
          orbit.along_track,
          orbit.position,
          orbit.velocity};
}

OrbitPoint orbit_point(const ReferenceOrbit& orbit, double t) {
  const OrbitConstants<double> constants = orbit_constants(orbit);
  const double M = std::remainder(constants.mean_anomaly + constants.mean_motion * t, 2 * std::numbers::pi);
  const double E = eccentric_anomaly(M, orbit.eccentricity);
  return orbit_point(constants, t, SineCosine<double>{std::sin(E), std::cos(E)});
}

OrbitalMotion orbital_motion(const ReferenceOrbit& orbit, const OrbitPoint& at, const Vector3d& p_W,
                             const Vector3d& v_W) {
  const Vector3d r = transposed_times(at.R_WO, p_W - at.position);
  const Vector3d v = transposed_times(at.R_WO, v_W - orbit.velocity);
  return {r, v - cross(Vector3d{0, 0, at.rate}, r)};
}

// Orbit => first error in its numbers as the end of a sentence; empty if it is valid (closed, axes orthonormal).
std::string fault_of(const ReferenceOrbit& orbit) {
  const auto is_finite = [](const Vector3d& v) { return std::isfinite(dot(v, v)); };
  if (!(orbit.mu > 0) || !std::isfinite(orbit.mu)) return "its gravitational parameter must be positive and finite";
  if (!(orbit.semi_major_axis > 0) || !std::isfinite(orbit.semi_major_axis))
    return "its semi-major axis must be positive and finite";
  if (!(orbit.eccentricity >= 0 && orbit.eccentricity < 1))
    return "its eccentricity must be at least 0 and less than 1: the orbit is closed";
  if (!std::isfinite(orbit.true_anomaly) || !is_finite(orbit.position) || !is_finite(orbit.velocity))
    return "a number is not finite";
  if (!(std::abs(norm(orbit.radial) - 1) < kSquare && std::abs(norm(orbit.along_track) - 1) < kSquare))
    return "radial and along_track must be unit vectors";
  if (!(std::abs(dot(orbit.radial, orbit.along_track)) < kSquare))
    return "radial and along_track must be perpendicular to each other";
  return {};
}

}  // namespace grapnel
