#pragma once

/// @file
/// Simbody behind plain data: its headers do not compile as C++20, Grapnel's not as C++17. Quantities and coordinates
/// are Grapnel's (Model's file comment); the conversion to Simbody's is done with Simbody's own algebra. Thread safety:
/// one thread per object.

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

class SimbodyBridge {
 public:
  explicit SimbodyBridge(std::vector<SimbodyBody> bodies);
  ~SimbodyBridge();
  SimbodyBridge(const SimbodyBridge&) = delete;
  SimbodyBridge& operator=(const SimbodyBridge&) = delete;

  std::vector<double> acceleration(const std::vector<double>& q, const std::vector<double>& v,
                                   const std::vector<double>& force, const std::vector<SimbodyWrench>& wrenches,
                                   const std::array<double, 3>& gravity);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace grapnel::testing
