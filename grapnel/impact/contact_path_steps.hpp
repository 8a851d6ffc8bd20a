#pragma once

/// @file
/// Explicit steps of several paths of contact_path.hpp at once, a path in every lane, each with a step size, phases and
/// holds of its own. Portable code fills numbers in and takes them out; what computes is compiled once per instruction
/// set (contact_path_kernel.hpp).

#include <memory>
#include <optional>

#include "grapnel/pack/dispatch.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

/// Where the numbers that define the equations of one path of n contacts are in its table. What contacts do is numbers
/// too, so that lanes in which they do different things need no branches.
struct PathTable {
  int n;

  /// What one contact is doing, in this order: f' = pull + pace (u_n - released); `loading` is 1 or 0; `friction` is 0
  /// where it does not touch; two components of the tangential velocity that counts as none; two of the direction of
  /// sliding up to `slow`, the speed from which on the velocity itself has one. A contact that sticks is never so fast,
  /// and its direction is that of its share, reversed.
  enum Spring { pace, pull, released, loading, friction, offset, along = 7, slow = 9, spring_numbers };

  GRAPNEL_INLINE int mobility() const { return 0; }              // W, 3 n x 3 n, row by row
  GRAPNEL_INLINE int before() const { return 9 * n * n; }        // 3 n: velocities
  GRAPNEL_INLINE int scale() const { return before() + 3 * n; }  // 3 n: square roots of W's diagonal
  GRAPNEL_INLINE int spring(int i) const { return scale() + 3 * n + spring_numbers * i; }
  GRAPNEL_INLINE int undo() const { return spring(n); }  // 2 n x 2 n: 0 where contacts do not stick
  GRAPNEL_INLINE int size() const { return undo() + 4 * n * n; }
  GRAPNEL_INLINE int state() const { return 8 * n; }
};
/// `slow` of contacts that slide, without a direction of their own and with one; without friction; that stick.
inline constexpr double kAnySpeed = -1, kSlow = 1e-13, kFrictionless = 1e200, kSticks = 1e300;

/// The numbers of all lanes: number i of lane l is at i * width + l.
struct PathLanes {
  int width = 0;
  double* table = nullptr;     // PathTable
  double* size = nullptr;      // 1: of the step
  double* y = nullptr;         // 8 n: where it begins
  double* rate = nullptr;      // 8 n: of y
  double* end = nullptr;       // 8 n: where it ends
  double* end_u = nullptr;     // 3 n: velocities there
  double* end_rate = nullptr;  // 8 n: of y there
  double* error = nullptr;     // 2: sizes of the estimates of order 5 and 3
};

class PathSteps {
 public:
  PathSteps() = default;
  PathSteps(const PathSteps&) = delete;
  PathSteps& operator=(const PathSteps&) = delete;
  virtual ~PathSteps();
  /// Of every lane from y to end. A lane's bits do not depend on the others', nor on the set among those with fused
  /// products.
  virtual void try_all() = 0;

  PathLanes lanes;
};

/// Steps of `paths` paths of `contacts` contacts, of which as many have a lane as the set has. Without a set: one lane,
/// in doubles.
std::unique_ptr<PathSteps> make_path_steps(std::optional<lanes::InstructionSet> set, int contacts, int paths);

/// Once per instruction set; each is defined where it is compiled for its set.
PathSteps* make_path_steps_one_lane(int contacts);
PathSteps* make_path_steps_sse2(int contacts);
PathSteps* make_path_steps_avx2(int contacts);
PathSteps* make_path_steps_avx512(int contacts);

}  // namespace grapnel
