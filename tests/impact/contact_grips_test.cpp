/// Contacts while grips hold and rates are held.

#include <gtest/gtest.h>

#include "impact/contact_case.hpp"

namespace grapnel::testing {
namespace {

// Two bodies that a rigid grip holds together take a blow as the one body they are.
TEST(ContactGrips, ClosedGripMakesACompositeBody) {
  for (RestitutionHypothesis h : kHypotheses) {
    const Lump striker{"striker", 1.5, {0.2, 0.3, 0.1}, {0.4, 0.1, 0.6}, {{0.3, -0.2, 0.1}, {0.2, 0.1, -1}}};
    ContactCase two =
        lumps({striker, {"left", 2, {0.3, 0.4, 0.5}, {-0.5, 0, -0.5}}, {"right", 2, {0.3, 0.4, 0.5}, {0.5, 0, -0.5}}});
    two.contacts = {{0, 2, {0.3, 0.2, 0}, {0, 0, 1}, 0.5, 0.3, 1}};
    const Grasp grip{1, 2, GraspModel::rigid, {0, 0, -0.5}, {0, 0, 1}};
    const ContactImpactSolution held = contact_impact(two.model, two.state, two.contacts, h, {&grip, 1});
    // Parallel axes: 2 kg at 0.5 m either side along x.
    ContactCase one = lumps({striker, {"both", 4, {0.6, 0.8 + 1, 1.0 + 1}, {0, 0, -0.5}}});
    one.contacts = {{0, 1, {0.3, 0.2, 0}, {0, 0, 1}, 0.5, 0.3, 1}};
    const ContactImpactSolution composite = one.solve(h);
    ASSERT_EQ(held.status, ContactImpactSolution::Status::solved) << held.message;
    EXPECT_NEAR(norm(held.contacts[0].P_WC.linear - composite.contacts[0].P_WC.linear), 0, 1e-11);
    EXPECT_NEAR(held.kinetic_energy_after, composite.kinetic_energy_after, 1e-11);
  }
}

}  // namespace
}  // namespace grapnel::testing
