#pragma once

/// @file
/// Seeded random branched robots, states and forces. The environment variable GRAPNEL_TEST_SEED sets the seed (default:
/// fixed). Robot number i of a seed is always the same, regardless of earlier draws.

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::testing {

/// GRAPNEL_TEST_SEED, or 20231 if it is not set.
std::uint64_t test_seed();
/// "GRAPNEL_TEST_SEED=… robot 17": for SCOPED_TRACE, so that a failure can be repeated.
std::string seed_note(int index);

/// Numbers from one stream; equal on every platform (no std distributions).
class Random {
 public:
  /// Stream `index` of test_seed().
  explicit Random(int index);

  double uniform(double lower, double upper);
  double log_uniform(double lower, double upper);
  int integer(int lower, int upper);  // both ends included
  bool chance(double probability) { return uniform(0, 1) < probability; }
  Vector3d vector(double size);  // components within +-size
  Vector3d direction();          // unit vector, uniform on the sphere
  Rotationd rotation();          // uniform
  std::vector<double> values(int count, double size);

 private:
  std::mt19937_64 generator_;
};

struct RobotOptions {
  int min_bodies = 2;
  int max_bodies = 20;
  bool free_root = true;
  bool rotors = true;        // some joints have rotor inertia behind a gear
  bool fixed_joints = true;  // some bodies are welded to their parents
  bool prismatic_joints = true;
  bool spherical_joints = false;
  int targets = 0;  // further trees of one free body each
};

/// Bodies "b0" (the root), "b1", …, targets "t0", …, given to the builder in random order; a frame "e<i>" on about a
/// third of them and at least on the last body. Mounts are identities, exact or rounded quarter turns, and general
/// rotations; axes are coordinate axes of either sign or tilted.
Model random_model(const RobotOptions& options, Random& random);
/// Any pose of the roots (within 10 m), joint angles within +-pi, rates and twists within +-`rate`.
State random_state(const Model& model, Random& random, double rate = 1.5);
/// Joint and base forces, one to three external wrenches at points near their bodies, gravity.
Forces random_forces(const Model& model, const State& state, Random& random);
/// A body's random inertia tensor about its centre of mass: triaxial, rotated, physically possible.
Symmetric3d random_inertia(double mass, double size, Random& random);

}  // namespace grapnel::testing
