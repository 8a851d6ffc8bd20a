#pragma once

/// @file
/// Random servicers with several arms, and one moving target for all their end-effectors, placed at the result of an
/// integrated motion.

#include "plan/plan_case.hpp"

namespace grapnel::testing {

struct ManyArms {
  int arms = 2;
  bool planar = false;  // three or four joints about z per arm; else six or seven about alternating axes
  bool torso = false;   // all arms share one more joint
};

/// A servicer with these arms; random mounts, lengths, masses and joint values; end-effectors "hand-1", ...; its base
/// at the world's origin with a small twist (in the plane for planar arms).
Servicer random_servicer_with(const ManyArms& kind, int index);

/// A segment that brings all end-effectors to one target with a random twist. The grasp points "point-1", ... of
/// "target" are at the end-effector positions after an integration to final values `reached`, up to `turn` [rad] from
/// the start, so that a solution is known.
struct SharedTarget {
  Servicer servicer;
  ReachProblem problem;
  std::vector<double> reached;
};
SharedTarget random_shared_target(const ManyArms& kind, Goal::Orientation orientation, RateDemand demand, double turn,
                                  int index);

}  // namespace grapnel::testing
