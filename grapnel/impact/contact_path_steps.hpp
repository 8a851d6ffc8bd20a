#pragma once

/// @file
/// Explicit steps of several paths of contact_path.hpp in parallel, one path per lane, with individual step sizes,
/// phases and holds. Portable code writes inputs and reads results; the computation is compiled once per instruction
/// set (contact_path_kernel.hpp).

#include <memory>
#include <optional>

#include "grapnel/spatial/dispatch.hpp"
#include "grapnel/spatial/scalar.hpp"

namespace grapnel {

/// The layout of a path's table for n contacts: the numbers that define its equations. The contacts' states are
/// numbers, too, so that lanes with different states need no branches.
struct PathTable {
  int n;

  /// The state of one contact, in this order: f' = pull + pace (u_n - released); `loading` is 1 or 0; `friction` is 0
  /// without contact; two components of the tangential velocity that counts as zero; two of the direction of sliding up
  /// to the speed `slow`, from which on the velocity itself determines it. A sticking contact never reaches that speed,
  /// and its direction is that of its share, reversed.
  enum Spring { pace, pull, released, loading, friction, offset, along = 7, slow = 9, spring_numbers };

  GRAPNEL_INLINE int mobility() const { return 0; }              // W, 3 n x 3 n, row by row
  GRAPNEL_INLINE int before() const { return 9 * n * n; }        // 3 n: velocities
  GRAPNEL_INLINE int scale() const { return before() + 3 * n; }  // 3 n: square roots of W's diagonal
  GRAPNEL_INLINE int spring(int i) const { return scale() + 3 * n + spring_numbers * i; }
  GRAPNEL_INLINE int undo() const { return spring(n); }  // 2 n x 2 n: 0 for contacts that do not stick
  GRAPNEL_INLINE int size() const { return undo() + 4 * n * n; }
  GRAPNEL_INLINE int state() const { return 8 * n; }
};
/// `slow` of sliding contacts without and with an initial direction; without friction; of sticking contacts.
inline constexpr double kAnySpeed = -1, kSlow = 1e-13, kFrictionless = 1e200, kSticks = 1e300;

/// The numbers of all lanes: number i of lane l is at i * width + l.
struct PathLanes {
  int width = 0;
  double* table = nullptr;     // PathTable
  double* size = nullptr;      // 1: of the step
  double* y = nullptr;         // 8 n: at the beginning
  double* rate = nullptr;      // 8 n: of y
  double* end = nullptr;       // 8 n: at the end
  double* end_u = nullptr;     // 3 n: velocities at the end
  double* end_rate = nullptr;  // 8 n: of y at the end
  double* error = nullptr;     // 2: norms of the estimates of order 5 and 3
};

class PathSteps {
 public:
  PathSteps() = default;
  PathSteps(const PathSteps&) = delete;
  PathSteps& operator=(const PathSteps&) = delete;
  virtual ~PathSteps();
  /// Advances every lane from y to end. A lane's bits are independent of other lanes and of the set among those with
  /// fused products.
  virtual void try_all() = 0;

  PathLanes lanes;
};

/// Steps of `paths` paths of `contacts` contacts, as many in parallel as the set has lanes. Without a set: one lane, in
/// doubles.
std::unique_ptr<PathSteps> make_path_steps(std::optional<lanes::InstructionSet> set, int contacts, int paths);

/// The steps of an instruction set, defined in contact_path_packs_set.cpp. The caller deletes the result.
template <class Set>
PathSteps* make_path_steps_of(int contacts);

}  // namespace grapnel
