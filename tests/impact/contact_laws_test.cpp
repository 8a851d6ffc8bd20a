/// Symmetries and special cases of contact_impact().

#include <gtest/gtest.h>

#include "grapnel/dynamics/momentum.hpp"
#include "impact/contact_case.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace contact_laws_test {

using Status = ImpactSolution::Status;

// Difference of velocities, relative to the largest change by the impact.
double difference(const ContactCase& c, const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, change = 1e-300;
  for (std::size_t i = 0; i < a.size(); ++i) {
    most = std::max(most, std::abs(a[i] - b[i])), change = std::max(change, std::abs(b[i] - c.state.v[i]));
  }
  return most / change;
}

TEST(ContactLaws, CentralSpheres) {
  const double m1 = 3, m2 = 2, e = 0.7, v1 = -1.2, v2 = 0.4;
  for (RestitutionHypothesis h : kHypotheses) {
    ContactCase c = lumps({{"a", m1, {1, 1, 1}, {0, 0, 0.5}, {Vector3d::zero(), {0, 0, v1}}},
                           {"b", m2, {1, 1, 1}, {0, 0, -0.5}, {Vector3d::zero(), {0, 0, v2}}}});
    c.contacts = {{c.model.body_index("a"), c.model.body_index("b"), Vector3d::zero(), {0, 0, 1}, e, 0.4, 1}};
    const ImpactSolution s = c.solve(h);
    EXPECT_NEAR(s.points[0].normal, (1 + e) * m1 * m2 / (m1 + m2) * (v2 - v1), 1e-12);
    EXPECT_NEAR(norm(s.points[0].tangential), 0, 1e-12);
    EXPECT_FALSE(s.energy_created);
  }
}

// One contact without friction: Newton's, Poisson's and Stronge's hypotheses give equal velocities; with e = 1 they
// conserve energy.
TEST(ContactLaws, WithoutFrictionHypothesesCoincide) {
  Worst worst("hypotheses without friction"), conserved("energy with e = 1, over T-");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    ContactCase c = random_contacts(i, 1);
    c.contacts[0].friction = 0;
    const std::vector<double> newton = c.solve(RestitutionHypothesis::newton).velocity;
    for (RestitutionHypothesis h : kHypotheses) {
      EXPECT_LT(worst.note(difference(c, c.solve(h).velocity, newton), i), 1e-10);  // measured 5e-15
    }
    c.contacts[0].restitution = 1;
    const ImpactSolution s = c.solve(RestitutionHypothesis::stronge);
    EXPECT_LT(conserved.note(std::abs(s.kinetic_energy_after / s.kinetic_energy_before - 1), i), 1e-11);
  }
}

// Twice the velocities give twice the impulses. A common velocity of all free bodies does not change the impulses.
TEST(ContactLaws, ScalingAndMotionInvariance) {
  Worst scaled("velocities scaled"), moved("moved along");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    ContactCase c = random_contacts(i, 1);
    for (RestitutionHypothesis h : kHypotheses) {
      const ImpactSolution s = c.solve(h);
      ContactCase twice = c;
      for (double& v : twice.state.v) v *= 2;
      std::vector<double> half = twice.solve(h).velocity;
      for (double& v : half) v /= 2;
      EXPECT_LT(scaled.note(difference(c, half, s.velocity), i), 1e-9);
      ContactCase along = c;
      for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
        if (c.model.bodies()[b].description.joint.type != JointType::free) continue;
        const Kinematics k = forward_kinematics(c.model, c.state);
        const Twistd V = k.V_WB[static_cast<int>(b)];
        set_root_twist(along.model, static_cast<int>(b), {V.angular, V.linear + Vector3d{0.3, -0.7, 0.5}}, along.state);
      }
      const ImpactSolution t = along.solve(h);
      EXPECT_LT(moved.note(norm(t.contacts[0].P_WC.linear - s.contacts[0].P_WC.linear) / s.points[0].normal, i), 1e-9);
    }
  }
}

// The reflection x -> -x of the system gives the reflected impulses.
TEST(ContactLaws, MirrorSymmetry) {
  Worst worst("mirrored impulse");
  int compared = 0;
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(70000 + i);
    const auto polar = [](const Vector3d& a) { return Vector3d{-a[0], a[1], a[2]}; };
    const auto axial = [](const Vector3d& a) { return Vector3d{a[0], -a[1], -a[2]}; };
    std::vector<Lump> bodies, mirrored;
    for (const char* name : {"a", "b"}) {
      Lump l{name, random.uniform(1, 5), {0.3, 0.4, 0.5}, random.vector(0.5), {random.vector(1), random.vector(1)}};
      bodies.push_back(l);
      l.position = polar(l.position), l.V_WB = {axial(l.V_WB.angular), polar(l.V_WB.linear)};
      mirrored.push_back(l);
    }
    ContactCase c = lumps(bodies), m = lumps(mirrored);
    c.contacts = {{0, 1, random.vector(0.3), random.direction(), 0.6, 0.5, 1}};
    m.contacts = c.contacts;
    m.contacts[0].p_WC = polar(c.contacts[0].p_WC), m.contacts[0].n_W = polar(c.contacts[0].n_W);
    for (RestitutionHypothesis h : kHypotheses) {
      const ImpactSolution p = c.solve(h), q = m.solve(h);
      if (p.points[0].normal == 0) continue;
      ++compared;
      const Vector3d off = polar(p.contacts[0].P_WC.linear) - q.contacts[0].P_WC.linear;
      EXPECT_LT(worst.note(norm(off) / p.points[0].normal, i), 1e-9);
    }
  }
  EXPECT_GT(compared, 100);
}

// Three balls in a line, the first one moving: rigid-body data do not determine the distribution between the two
// contacts. Two separate pairs do not interact.
TEST(ContactLaws, NonuniqueImpulsesReported) {
  const auto ball = [](const char* name, double x, double z, double v) {
    return Lump{name, 1, {0.1, 0.1, 0.1}, {x, 0, z}, {Vector3d::zero(), {0, 0, v}}};
  };
  ContactCase line = lumps({ball("a", 0, 0, -1), ball("b", 0, -1, 0), ball("c", 0, -2, 0)});
  line.contacts = {{0, 1, {0, 0, -0.5}, {0, 0, 1}, 1, 0, 1}, {1, 2, {0, 0, -1.5}, {0, 0, 1}, 1, 0, 1}};
  const ImpactSolution s = line.solve(RestitutionHypothesis::stronge);
  ASSERT_EQ(s.status, Status::solved);
  EXPECT_FALSE(s.unique);
  EXPECT_GT(s.points[0].spread, 1e-3);
  EXPECT_NEAR(s.kinetic_energy_after, s.kinetic_energy_before, 1e-11);
  ContactCase pairs = lumps({ball("a", 0, 0, -1), ball("b", 0, -1, 0), ball("c", 5, 0, -1), ball("d", 5, -1, 0)});
  pairs.contacts = {{0, 1, {0, 0, -0.5}, {0, 0, 1}, 0.5, 0, 1}, {2, 3, {5, 0, -0.5}, {0, 0, 1}, 0.5, 0, 1}};
  const ImpactSolution apart = pairs.solve(RestitutionHypothesis::stronge);
  ASSERT_EQ(apart.status, Status::solved);
  EXPECT_TRUE(apart.unique);
  EXPECT_NEAR(apart.points[0].normal, 0.75, 1e-11);
  EXPECT_NEAR(apart.points[1].normal, 0.75, 1e-11);
}

}  // namespace contact_laws_test
}  // namespace grapnel::testing
