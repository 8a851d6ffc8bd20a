#include "grapnel/approach/reach_bound.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace grapnel {

// Model and frame => bound of the distance between the frame's origin and the centre of mass, or the base's mount of
// the arm, for any joints: the sum of |v_k| of (6.18), from the tips to the root.
ReachBound reach_bound(const Model& model, int root, int frame, bool floats) {
  const std::vector<Body>& bodies = model.bodies();
  const std::size_t n = bodies.size();
  std::vector<double> carried(n, 0.0);  // share of the mass
  std::vector<bool> on_the_way(n, false);
  std::vector<Vector3d> v(n, Vector3d::zero());
  const Frame& hand = model.frames()[frame];
  for (int b = hand.body; b >= 0; b = bodies[b].parent) on_the_way[b] = true;
  // Parents precede their children.
  for (std::size_t b = n; b-- > 0;) {
    if (bodies[b].root != root) continue;
    carried[b] += bodies[b].description.mass;
    if (bodies[b].parent >= 0) carried[bodies[b].parent] += carried[b];
  }
  const double mass = carried[root];
  ReachBound bound;
  for (std::size_t b = n; b-- > 0;) {
    if (bodies[b].root != root) continue;
    const BodyDescription& body = bodies[b].description;
    if (static_cast<int>(b) == hand.body) v[b] += hand.X_BE.p;
    if (floats) v[b] -= (body.mass / mass) * body.com;
    if (static_cast<int>(b) == root) break;
    const double share = (on_the_way[b] ? 1.0 : 0.0) - (floats ? carried[b] / mass : 0.0);
    Vector3d& parent = v[bodies[b].parent];
    parent += share * body.X_PF.p;
    if (velocity_count(body.joint.type) == 0) {
      parent += body.X_PF.R * v[b];  // rigidly attached
      continue;
    }
    bound.length += norm(v[b]);
    if (slides_along_axis(body.joint.type) && share != 0)
      bound.length += std::abs(share) * std::max(std::abs(body.joint.limits.lower), std::abs(body.joint.limits.upper));
  }
  if (floats)
    bound.length += norm(v[root]);
  else
    bound.from = v[root];
  return bound;
}

}  // namespace grapnel
