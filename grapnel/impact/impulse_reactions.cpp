#include "grapnel/impact/impulse_reactions.hpp"

#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {

std::vector<Impulsed> joint_impulses(const Model& model, const State& before, const State& after,
                                     std::span<const ExternalImpulse> external) {
  const Kinematics k_before = forward_kinematics(model, before), k_after = forward_kinematics(model, after);
  const std::size_t count = model.bodies().size();
  // What each body receives, about its own frame's origin.
  std::vector<Impulsed> needed(count);
  for (std::size_t i = 0; i < count; ++i) {
    const BodyMomentum m0 = body_momentum(model, k_before, static_cast<int>(i));
    const BodyMomentum m1 = body_momentum(model, k_after, static_cast<int>(i));
    const Momentumd change = shift(m1.h - m0.h, k_before.X_WB[i].p - m0.p_WC);
    needed[i] = {change.angular, change.linear};
  }
  for (const ExternalImpulse& e : external) needed[e.body] -= shift(e.P_WC, k_before.X_WB[e.body].p - e.p_WC);
  // From the tips in: a joint passes on what its body and all beyond it still need.
  for (std::size_t i = count; i-- > 0;) {
    const int parent = model.bodies()[i].parent;
    if (parent >= 0) needed[parent] += shift(needed[i], k_before.X_WB[parent].p - k_before.X_WB[i].p);
  }
  return needed;
}

}  // namespace grapnel
