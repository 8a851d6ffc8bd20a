#pragma once

/// @file
/// Random servicers with several arms, and one moving target for all their hands, placed where a flight has brought
/// them.

#include "plan/plan_case.hpp"

namespace grapnel::testing {

struct ManyArms {
  int arms = 2;
  bool planar = false;  // three or four joints about z an arm; else six or seven about changing axes
  bool torso = false;   // all arms hang on one more joint
};

/// A servicer with these arms, mounts, lengths, masses and joint values random, hands "hand-1", ..., its base at the
/// world's origin with a small twist (in the plane for planar arms).
Servicer random_servicer_with(const ManyArms& kind, int index);

/// A segment that brings all hands to one target with a random twist: grasp points "point-1", ... of "target" where a
/// flight to final values `reached`, up to `turn` [rad] from the start, has brought the hands, so that a solution is
/// known.
struct SharedTarget {
  Servicer servicer;
  ReachProblem problem;
  std::vector<double> reached;
};
SharedTarget random_shared_target(const ManyArms& kind, Goal::Orientation orientation, RateDemand demand, double turn,
                                  int index);

}  // namespace grapnel::testing
