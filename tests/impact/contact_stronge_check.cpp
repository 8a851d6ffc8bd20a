/// Laws of every impact by Stronge's hypothesis, on random robots and targets.

#include <gtest/gtest.h>

#include <algorithm>

#include "impact/contact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {

void check_stronge(int begin, int end, int stride) {
  using Status = ImpactSolution::Status;
  Worst gain("energy gained over T-"), cone("friction beyond the cone over P_n"), press("u_n+ below zero over u-"),
      identity("energy identity"), momentum("generalized momentum"),
      energy("works at the contacts against dT, over T-");
  Worst steps("steps");
  int cases = 0, several = 0, again = 0;
  for (int i = begin; i < end; i += stride, ++cases) {
    SCOPED_TRACE(seed_note(i));
    const ContactCase c = random_contacts(i);
    const ImpactSolution s = c.solve(RestitutionHypothesis::stronge);
    ASSERT_EQ(s.status, Status::solved) << s.message;
    const double before = kinetic_energy_of(c, c.state.v), after = kinetic_energy_of(c, s.velocity);
    ASSERT_LE(gain.note((after - before) / before, i), 1e-12);            // measured 1.0e-15
    ASSERT_LE(cone.note(s.cone_residual, i), 1e-11);                      // measured 0
    ASSERT_LT(identity.note(s.energy_identity_residual, i), 1e-11);       // measured 7e-16
    ASSERT_LT(momentum.note(s.generalized_momentum_residual, i), 1e-11);  // measured 3e-15
    ASSERT_FALSE(s.energy_created);
    double fastest = 0, work = 0;
    for (const ContactPointImpulse& p : s.points) fastest = std::max(fastest, norm(p.velocity_before));
    for (std::size_t k = 0; k < c.contacts.size(); ++k) {
      const ContactPointImpulse& p = s.points[k];
      ASSERT_GE(p.normal, 0);
      // Measured 2.4e-10, for a path that ends after 8e4 steps; 7e-11 for the first thousand cases.
      ASSERT_LE(press.note(-dot(p.velocity_after, c.contacts[k].n_W) / fastest, i), 1e-9);
      ASSERT_LE(p.friction_work, 1e-12 * before);
      work += p.normal_work + p.friction_work;
    }
    ASSERT_LT(energy.note(std::abs(after - before - work) / before, i), 1e-11);  // measured 2.8e-14
    steps.note(static_cast<double>(s.steps), i);
    several += s.points.size() > 1;
    again += !s.unique;
  }
  EXPECT_GT(2 * several, cases);
  EXPECT_GT(10 * again, cases);
}

}  // namespace grapnel::testing
