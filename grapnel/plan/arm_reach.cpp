#include "grapnel/plan/arm_reach.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {

ArmReach arm_reach(const Model& model, int frame) {
  const Frame& f = model.frames()[frame];
  ArmReach reach{-1, norm(f.X_BE.p)};
  for (int b = f.body; b >= 0 && model.bodies()[b].parent >= 0; b = model.bodies()[b].parent) {
    const JointDescription& joint = model.bodies()[b].description.joint;
    if (slides_along_axis(joint.type)) {
      reach.length += std::max(std::abs(joint.limits.lower), std::abs(joint.limits.upper));
    }
    if (velocity_count(joint.type) == 0) {
      reach.length += norm(model.bodies()[b].description.X_PF.p);
      continue;
    }
    reach.first_body = b;
    // The way from this joint down to its parent's joint belongs to the chain only if there is another joint below.
    bool another = false;
    for (int a = model.bodies()[b].parent; a >= 0; a = model.bodies()[a].parent) {
      another =
          another || (model.bodies()[a].parent >= 0 && velocity_count(model.bodies()[a].description.joint.type) > 0);
    }
    if (!another) break;
    reach.length += norm(model.bodies()[b].description.X_PF.p);
  }
  return reach;
}

}  // namespace grapnel
