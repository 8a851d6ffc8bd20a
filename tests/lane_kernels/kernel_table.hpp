#pragma once

/// @file
/// The individual recursive kernels in lanes, for tests and benchmarks. The interface consists of function pointers and
/// plain arrays without containers, so that portable code and the translation units of instruction sets share no
/// functions.
///
/// Arrays are structures of arrays: entry i of lane l is at [i * width + l], the first one aligned to kLaneAlignment.

#include <cstddef>
#include <cstdint>

#include "grapnel/lanes/lane_phase_tables.hpp"
#include "grapnel/model/tree.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::lanes {

inline constexpr std::size_t kLaneAlignment = 64;

/// Trees of equal structure, one per lane: equal parents, joints, axes and offsets; the numbers may differ. A link's
/// frame counts as rotated, and its joint as having a rotor, if this applies in any lane.
struct LaneTrees {
  const TreeLink<double>* const* links;  // per lane
  int link_count;
  int coordinates;
  int velocities;
  // Closed loops, equal in all lanes; their numbers (kLoopNumbers each) per lane.
  const LoopTable* loops = nullptr;
  int loop_count = 0;
  const double* const* loop_numbers = nullptr;
};

/// Input of the kernels, as DynamicsInput; null pointers mean zero (or nothing prescribed).
struct LaneInput {
  const double* q;                 // coordinates
  const double* v;                 // velocities
  const double* force;             // generalized forces; not read by inverse dynamics
  const double* link_wrench;       // per link six entries [moment; force]; may be null
  const std::uint8_t* prescribed;  // per velocity, the same in all lanes; may be null
  const double* acceleration;      // may be null
  const double* gravity;           // three entries, in W; may be null
};

/// Numbers per root in the arrays of momenta: angular and linear momentum, centre of mass, mass.
inline constexpr int kRootNumbers = 10;

/// One instruction set's kernels.
struct KernelTable {
  int width;
  /// A model and its workspace; `destroy` frees it.
  void* (*create)(const LaneTrees& trees);
  void (*destroy)(void* model);
  /// articulated_body(): writes vdot and force, one entry per velocity.
  void (*forward_dynamics)(void* model, const LaneInput& in, double* vdot, double* force);
  /// LaneLoops::accelerate(): as forward_dynamics, with constraint forces of the closures; prescribed velocities are
  /// not supported.
  void (*loop_dynamics)(void* model, const LaneInput& in, double* vdot, double* force);
  /// newton_euler(): writes force.
  void (*inverse_dynamics)(void* model, const LaneInput& in, double* force);
  /// root_momenta(): writes kRootNumbers per free root.
  void (*root_momenta)(void* model, const double* q, const double* v, double* momenta);
  /// recover_roots(): `elapsed` has one entry; overwrites the roots' part of q and v.
  void (*recover_roots)(void* model, const double* momenta, const double* elapsed, double* q, double* v);
  /// link_motion(): twelve entries per link for the pose in W, R row by row and then p, and six for the twist.
  void (*link_motion)(void* model, const double* q, const double* v, double* motion);
  /// `count` entries each.
  void (*sine_cosine)(const double* angle, double* sine, double* cosine, int count);
};

/// The table of an instruction set, defined in kernels_set.cpp. It may be read on any machine; its functions may be
/// called only if is_supported().
template <class Set>
const KernelTable& kernels_of();

/// The kernels of a supported set.
const KernelTable& kernels(InstructionSet set);

}  // namespace grapnel::lanes
