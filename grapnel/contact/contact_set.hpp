#pragma once

/// @file
/// The contacts of a system: shapes on bodies, their materials, and the pairs that may touch.

#include <utility>
#include <vector>

#include "grapnel/contact/pair_contact.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel {

struct Kinematics;

/// A surface of a body of a model; body -1: fixed in W.
struct ContactSurface {
  int body;
  ContactShape shape;
  ContactMaterial material;
};

/// Sums over all pairs.
struct ContactTotals {
  double damping_power = 0;   // dissipated [W]
  double friction_power = 0;  // dissipated [W]
  int touching = 0;           // pairs
};

/// Thread safety: one thread at a time (it owns scratch memory). No result depends on an earlier call.
class ContactSet {
 public:
  /// `pairs`: indices of surfaces. @throws std::invalid_argument if an index is invalid, if both surfaces of a pair are
  /// on one body, or as PairContact and combine().
  ContactSet(const std::vector<ContactSurface>& surfaces, const std::vector<std::pair<int, int>>& pairs);

  std::size_t size() const { return pairs_.size(); }
  /// Appends the wrenches on all bodies in contact, those on one pair's bodies after each other. Does not allocate if
  /// `wrenches` has room for two per pair.
  ContactTotals evaluate(const Kinematics& kinematics, std::vector<ExternalWrench>& wrenches);
  /// Forces of a pair at the last evaluate().
  const ContactForce& force(std::size_t pair) const { return pairs_[pair].contact.last(); }
  /// The elastic energy of a pair [J].
  double elastic_energy(std::size_t pair, const Kinematics& kinematics);
  ShapeSeparation separation(std::size_t pair, const Kinematics& kinematics) const;

 private:
  struct Pair {
    int body_a, body_b;
    PairContact contact;
  };
  std::vector<Pair> pairs_;
};

}  // namespace grapnel
