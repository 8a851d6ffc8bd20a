#pragma once

/// @file
/// A wrench on a body as a given function of time: thruster plumes, the spring of a docking mechanism, a disturbance
/// test; and the pressure of a stream of air or light, which depends on the body's attitude.

#include <limits>
#include <optional>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Time history of a load. Zero outside [start, end).
struct LoadProfile {
  /// constant: 1. half_sine: sin(pi (t - start) / (end - start)). sine: sin(2 pi frequency (t - start) + phase).
  /// table: the wrench itself, linear between samples; zero before the first and after the last.
  enum class Shape { constant, half_sine, sine, table };
  Shape shape = Shape::constant;
  double start = 0;                                      // [s]
  double end = std::numeric_limits<double>::infinity();  // [s]; finite for half_sine
  double frequency = 0;                                  // sine [Hz]
  double phase = 0;                                      // sine [rad]
  std::vector<double> times;                             // table [s], strictly increasing
  std::vector<Wrenchd> values;                           // table
};

/// The axes of the components: those of W, of the loaded body, or radial, along-track, cross-track of the orbit
/// (OrbitPoint).
enum class LoadFrame { world, body, orbit };

/// A stream of air or light on a flat plate, (14.7), that absorbs, reflects or scatters it.
struct Stream {
  Vector3d direction{1, 0, 0};  // unit, direction of flow, in the load's frame
  double pressure = 0;          // on an absorbing plate perpendicular to the stream [N/m^2]; of air rho v^2 C_D / 2
  double area = 0;              // [m^2]
  Vector3d normal{1, 0, 0};     // unit, outward, in the body's frame
  bool both_sides = false;      // the stream also acts on the plate's back; otherwise only on its front
  double specular = 0;          // fraction that is reflected
  double diffuse = 0;           // fraction that is scattered by Lambert's law; the rest is absorbed
};
/// Its force on the plate [N]; `direction` and `normal` in one frame, which is that of the force.
Vector3d stream_force(const Stream& stream, const Vector3d& direction, const Vector3d& normal);
/// The same (14.7) on the side that faces the stream, with the unit normal `n` of that side and the cosine `facing` of
/// the angle of incidence; `reach`: pressure times area [N]. S: double, or packs of SIMD lanes.
template <class S>
GRAPNEL_INLINE Vector3<S> force_on_facing_side(const S& reach, const S& specular, const S& diffuse, const S& facing,
                                               const Vector3<S>& direction, const Vector3<S>& n) {
  const S along_normal = S(2.0) * S(specular * facing + diffuse / S(3.0));
  return S(reach * facing) * (S(S(1.0) - specular) * direction - along_normal * n);
}

/// See the file comment.
struct ExternalLoad {
  int body = 0;                         // index in the model
  Vector3d p_BP = Vector3d::zero();     // point of application, in the body's frame [m]
  LoadFrame frame = LoadFrame::world;   // of the components
  Wrenchd amplitude = Wrenchd::zero();  // about P [N m; N]; not used with a table
  LoadProfile profile;
  std::optional<Stream> stream = {};  // its force at P, times the profile, is added; not with a table
};

/// The wrench at time t, in the load's own components. At a start or a sample the value is the later limit; at the last
/// sample of a table, that sample.
Wrenchd wrench_at(const ExternalLoad& load, double t);
/// The same by the part of the profile (zero, the shape, one line of the table) that is valid at the time `inside`: at
/// the ends of that part, where the load may jump, the limit from inside.
Wrenchd wrench_at(const ExternalLoad& load, double t, double inside);
/// The factor of the profile, which is not a table, at the time t; `inside` as above.
double factor_at(const LoadProfile& profile, double t, double inside);

/// Times at which the load is not smooth (start, end, samples of a table), increasing, finite ones only.
std::vector<double> break_times(const ExternalLoad& load);

/// @throws std::invalid_argument if the end is not after the start, a half sine has infinite ends, a number is not
/// finite, a table has fewer than two samples, different numbers of times and values, or times that do not increase, or
/// a stream has directions that are not unit vectors, a sum of fractions above 1, a table or the body's frame.
void validate(const ExternalLoad& load);

}  // namespace grapnel
