#pragma once

/// @file
/// Systems with contacts for the tests of contact_impact(): random robots in contact with random targets, and free
/// bodies from given data.

#include <string>
#include <vector>

#include "grapnel/impact/contact_impact.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel::testing {

struct ContactCase {
  Model model;
  State state;
  std::vector<ContactPoint> contacts;

  ImpactSolution solve(RestitutionHypothesis hypothesis) const {
    return contact_impact(model, state, contacts, hypothesis);
  }
};

inline constexpr RestitutionHypothesis kHypotheses[] = {RestitutionHypothesis::newton, RestitutionHypothesis::poisson,
                                                        RestitutionHypothesis::stronge};

/// Case `index`: a free-floating branched robot and one to three targets with `contacts` points (0: one to three).
/// Restitution is between 0 and 1 inclusive, friction may be 0. The first contact approaches.
ContactCase random_contacts(int index, int contacts = 0);

/// A free rigid body, or with `mass` zero a fixed one.
struct Lump {
  std::string name;
  double mass;
  Vector3d moments;  // principal moments of inertia along the body's axes [kg m^2]
  Vector3d position;
  Twistd V_WB{Vector3d::zero(), Vector3d::zero()};
};
/// A system of separate bodies, with indices in the given order.
ContactCase lumps(const std::vector<Lump>& bodies);

/// Checks the laws that Stronge's hypothesis satisfies, on every `stride`-th random case in [begin, end).
void check_stronge(int begin, int end, int stride);

double kinetic_energy_of(const ContactCase& c, const std::vector<double>& velocity);
inline State with_rates(State state, const std::vector<double>& v) {
  state.v = v;
  return state;
}

}  // namespace grapnel::testing
