/// Laws of every impact with contacts, on random robots and targets.

#include "grapnel/impact/contact_impact.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "impact/contact_case.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace contact_impact_test {

using Status = ImpactSolution::Status;

// Every seventh of the first cases of contact_thousands_test.cpp.
TEST(ContactImpact, StrongeDissipatesAndSatisfiesCone) { check_stronge(0, test::repetitions(3500), 7); }

// One contact: the solution satisfies each hypothesis.
TEST(ContactImpact, OneContactObeysItsHypothesis) {
  Worst newton("newton: u_n+ + e u_n-"), poisson("poisson: P_n - (1 + e) P_c"), stronge("stronge: W_r + e^2 W_c");
  for (int i = 0; i < 300; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ContactCase c = random_contacts(i, 1);
    const ContactPoint& p = c.contacts[0];
    const double e = p.restitution;
    for (RestitutionHypothesis h : kHypotheses) {
      const ImpactSolution s = c.solve(h);
      ASSERT_EQ(s.status, Status::solved) << s.message;
      const ContactPointImpulse& x = s.points[0];
      const double before = dot(x.velocity_before, p.n_W), after = dot(x.velocity_after, p.n_W);
      if (h == RestitutionHypothesis::newton) {
        ASSERT_LT(newton.note(std::abs(after + e * before) / -before, i), 1e-11);
      } else if (h == RestitutionHypothesis::poisson) {
        ASSERT_LT(poisson.note(std::abs(x.normal - (1 + e) * x.compression) / x.normal, i), 1e-11);
      } else {
        const double given = x.normal_work - x.compression_work;
        ASSERT_LT(stronge.note(std::abs(given + e * e * x.compression_work) / -x.compression_work, i), 1e-11);
      }
    }
  }
}

// A solid sphere on a fixed plane: it slides throughout, or rolls afterwards and loses 2/7 of its tangential momentum.
TEST(ContactImpact, ObliqueSphereSlidesOrRolls) {
  const double m = 3, r = 0.2, e = 0.6, I = 0.4 * m * r * r, v_n = 2, v_t = 1.5;
  for (const double mu : {0.05, 0.5}) {
    for (RestitutionHypothesis h : kHypotheses) {
      ContactCase c = lumps({{"ground", 0, {}, {0, 0, -1}}, {"ball", m, {I, I, I}, {0, 0, r}}});
      const int ball = c.model.body_index("ball");
      set_root_twist(c.model, ball, {Vector3d::zero(), {v_t, 0, -v_n}}, c.state);
      c.contacts = {{ball, c.model.body_index("ground"), Vector3d::zero(), {0, 0, 1}, e, mu, 1}};
      const ImpactSolution s = c.solve(h);
      ASSERT_EQ(s.status, Status::solved);
      const double normal = (1 + e) * m * v_n, stop = m * v_t * 2 / 7;
      const bool slides = mu * normal < stop;
      EXPECT_NEAR(s.points[0].normal, normal, 1e-11);
      EXPECT_NEAR(s.points[0].tangential[0], slides ? -mu * normal : -stop, 1e-11);
      if (slides) {
        EXPECT_THAT(s.points[0].modes, ::testing::ElementsAre(ContactMode::sliding));
      } else {
        EXPECT_THAT(s.points[0].modes, ::testing::ElementsAre(ContactMode::sliding, ContactMode::sticking));
      }
    }
  }
}

}  // namespace contact_impact_test
}  // namespace grapnel::testing
