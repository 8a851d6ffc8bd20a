#pragma once

/// @file
/// Simbody with a plain-data interface: its headers do not compile as C++20, Grapnel's not as C++17. Quantities and
/// coordinates are Grapnel's (file comment of Model); Simbody's own functions convert them.

#include <array>
#include <memory>
#include <vector>

namespace grapnel::testing {

enum class SimbodyJoint { free, ball, pin, slider, weld };

struct SimbodyBody {
  int parent;  // -1: ground
  SimbodyJoint joint;
  std::array<double, 9> R_PF;  // row-major
  std::array<double, 3> p_PF, axis, com;
  double mass;
  std::array<double, 6> inertia;  // about the centre of mass: xx, yy, zz, xy, xz, yz
  int q, v;                       // offsets of the joint's coordinates and velocities
};

struct SimbodyWrench {
  int body;
  std::array<double, 3> point, moment, force;  // in W
};

enum class SimbodyClosureKind { weld, hinge, ball };

/// Constrains frame C on body a to frame D on body b; poses as in SimbodyBody.
struct SimbodyClosure {
  int a, b;
  SimbodyClosureKind kind;
  std::array<double, 9> R_AC, R_BD;
  std::array<double, 3> p_AC, p_BD;
  std::array<double, 3> axis_C;  // of a hinge, and two directions normal to it
  std::array<double, 3> normals_C[2];
};

class SimbodyBridge {
 public:
  explicit SimbodyBridge(std::vector<SimbodyBody> bodies, const std::vector<SimbodyClosure>& closures = {});
  ~SimbodyBridge();
  SimbodyBridge(const SimbodyBridge&) = delete;
  SimbodyBridge& operator=(const SimbodyBridge&) = delete;

  std::vector<double> acceleration(const std::vector<double>& q, const std::vector<double>& v,
                                   const std::vector<double>& force, const std::vector<SimbodyWrench>& wrenches,
                                   const std::array<double, 3>& gravity);

  /// The velocity after the impulses that close all loops: v - M^-1 G^T (G M^-1 G^T)^+ G v.
  std::vector<double> closed_velocity(const std::vector<double>& q, const std::vector<double>& v);

 private:
  void place(const std::vector<double>& q, const std::vector<double>& v);
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace grapnel::testing
