#include "grapnel/contact/contact_set.hpp"

#include <stdexcept>

#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel {

namespace {

MovingBody motion_of(int body, const Kinematics& kinematics) {
  if (body < 0) return {Posed::identity(), Twistd::zero()};
  return {kinematics.X_WB[body], kinematics.V_WB[body]};
}
Posed pose_of(int body, const Kinematics& kinematics) { return body < 0 ? Posed::identity() : kinematics.X_WB[body]; }

}  // namespace

ContactSet::ContactSet(const std::vector<ContactSurface>& surfaces, const std::vector<std::pair<int, int>>& pairs) {
  const int count = static_cast<int>(surfaces.size());
  for (const auto& [i, j] : pairs) {
    if (i < 0 || j < 0 || i >= count || j >= count)
      throw std::invalid_argument("ContactSet: no surface has this index");
    const ContactSurface &a = surfaces[i], &b = surfaces[j];
    if (a.body == b.body) throw std::invalid_argument("ContactSet: both surfaces of a pair are on one body");
    pairs_.push_back({a.body, b.body, PairContact(a.shape, b.shape, combine(a.material, b.material))});
  }
}

ContactTotals ContactSet::evaluate(const Kinematics& kinematics, std::vector<ExternalWrench>& wrenches) {
  ContactTotals totals;
  for (Pair& pair : pairs_) {
    const ContactForce& force =
        pair.contact.evaluate(motion_of(pair.body_a, kinematics), motion_of(pair.body_b, kinematics));
    if (!force.touches) continue;
    ++totals.touching;
    totals.damping_power += force.damping_power, totals.friction_power += force.friction_power;
    if (pair.body_a >= 0) wrenches.push_back({pair.body_a, force.p_WC, force.on_a});
    if (pair.body_b >= 0) wrenches.push_back({pair.body_b, force.p_WC, force.on_b});
  }
  return totals;
}

double ContactSet::elastic_energy(std::size_t pair, const Kinematics& kinematics) {
  Pair& p = pairs_[pair];
  return p.contact.elastic_energy(pose_of(p.body_a, kinematics), pose_of(p.body_b, kinematics));
}

ShapeSeparation ContactSet::separation(std::size_t pair, const Kinematics& kinematics) const {
  const Pair& p = pairs_[pair];
  return p.contact.separation(pose_of(p.body_a, kinematics), pose_of(p.body_b, kinematics));
}

}  // namespace grapnel
