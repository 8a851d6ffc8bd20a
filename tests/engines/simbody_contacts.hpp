#pragma once

/// @file
/// A Grapnel model with compliant contacts in Simbody, with a plain-data interface (simbody_bridge.hpp): Simbody's
/// multibody dynamics, its integrator and its geometry, with its own contact forces or with user forces.

#include <array>
#include <memory>
#include <vector>

#include "engines/simbody_bridge.hpp"

namespace grapnel::testing {

/// A sphere, the half-space z <= 0 of its frame, or a closed surface of triangles with normals outwards.
struct SimbodySurface {
  enum class Kind { sphere, half_space, triangles };
  int body;  // -1: ground
  Kind kind;
  std::array<double, 9> R_BG;
  std::array<double, 3> p_BG;
  double radius = 0;
  std::vector<std::array<double, 3>> vertices;  // in the shape's frame
  std::vector<std::array<int, 3>> faces;
};

/// Hertz's law with the dissipation of Hunt and Crossley, F = 4/3 E* sqrt(R) d^(3/2) (1 + a d').
struct SimbodyContactLaw {
  double modulus = 0;      // E* [Pa]
  double dissipation = 0;  // a [s/m]
  double friction = 0;     // Coulomb's coefficient; of Simbody's own forces only
};

struct SimbodyContactPair {
  int a, b;  // surfaces
  SimbodyContactLaw law;
  /// Simbody's CompliantContactSubsystem, for spheres and half-spaces; otherwise a user force of a sphere `a` at the
  /// nearest point of the triangles of `b`.
  bool by_simbody;
};

struct SimbodySpring {
  int body;                         // of whose joint
  double stiffness, damping, rest;  // [N m/rad, N m s/rad, rad]
};

/// Pose and twist of a body in W; `twist`: angular, linear velocity of its origin.
struct SimbodyMotion {
  std::array<double, 9> R_WB;
  std::array<double, 3> p_WB;
  std::array<double, 6> twist;
};

class SimbodyContacts {
 public:
  /// Surfaces of Simbody's own pairs touch only in these pairs if no others of them come near.
  SimbodyContacts(const std::vector<SimbodyBody>& bodies, const std::vector<SimbodySurface>& surfaces,
                  const std::vector<SimbodyContactPair>& pairs, const std::vector<SimbodySpring>& springs,
                  double transition_speed);
  ~SimbodyContacts();
  SimbodyContacts(const SimbodyContacts&) = delete;
  SimbodyContacts& operator=(const SimbodyContacts&) = delete;

  /// The motion of all bodies at the end of `duration`, by the Runge-Kutta-Merson method with this accuracy.
  std::vector<SimbodyMotion> run(const std::vector<double>& q, const std::vector<double>& v, double duration,
                                 double accuracy);
  /// Evaluations of the dynamics in the last run().
  long evaluations() const { return evaluations_; }

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
  long evaluations_ = 0;
};

}  // namespace grapnel::testing
