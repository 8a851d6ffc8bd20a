// Materials and force laws.

#include <gtest/gtest.h>

#include <limits>

#include "grapnel/contact/contact_law.hpp"
#include "grapnel/contact/contact_material.hpp"

namespace grapnel::testing::contact_law_test {
namespace {

ContactMaterial elastic(double modulus, double nu) {
  ContactMaterial m;
  m.modulus = modulus, m.poisson_ratio = nu;
  return m;
}

TEST(ContactLaw, CombinesElasticityInSeriesAndFrictionByGeometricMeans) {
  ContactMaterial a = elastic(70e9, 0.33), b = elastic(2e6, 0.5);
  a.static_friction = 1.0, b.static_friction = 0.25;
  a.dissipation = 0.1, b.dissipation = 0.5;
  const ContactLaw law = combine(a, b), back = combine(b, a);
  EXPECT_NEAR(law.elastic, 1 / ((1 - 0.33 * 0.33) / 70e9 + (1 - 0.25) / 2e6), 1e-6);
  EXPECT_DOUBLE_EQ(law.static_friction, 0.5);
  EXPECT_NEAR(law.dissipation, 0.5, 1e-4);  // nearly all deformation is the softer body's
  EXPECT_DOUBLE_EQ(law.elastic, back.elastic);
  EXPECT_DOUBLE_EQ(law.dissipation, back.dissipation);
}

TEST(ContactLaw, RefusesMaterialsThatDoNotFit) {
  ContactMaterial linear;
  linear.stiffness = 1e5;
  EXPECT_THROW(combine(linear, elastic(1e9, 0.3)), std::invalid_argument);
  EXPECT_THROW(combine(elastic(1e9, 0.6), elastic(1e9, 0.3)), std::invalid_argument);
  EXPECT_THROW(combine(ContactMaterial{}, ContactMaterial{}), std::invalid_argument);
  ContactMaterial negative = linear;
  negative.kinetic_friction = -0.1;
  EXPECT_THROW(combine(negative, linear), std::invalid_argument);
  ContactMaterial nan = linear;
  nan.damping = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(combine(linear, nan), std::invalid_argument);
  EXPECT_THROW(dissipation_for(0, 1), std::invalid_argument);
  EXPECT_THROW(dissipation_for(0.5, 0), std::invalid_argument);
}

TEST(ContactLaw, NormalForceIsNeverTensileAndStartsAtZero) {
  for (const double speed : {-100.0, -1.0, 0.0, 1.0}) {
    EXPECT_GE(contact_law::normal_force(5.0, 0.5, 10.0, 0.3, speed), 0);
    EXPECT_EQ(contact_law::normal_force(0.0, 0.5, 10.0, 0.0, speed), 0);
  }
}

TEST(ContactLaw, FrictionFallsFromStaticToKinetic) {
  const double mu_s = 0.6, mu_k = 0.4, vs = 1e-3;
  const auto mu = [&](double v) { return contact_law::friction_coefficient(mu_s, mu_k, vs, v); };
  EXPECT_EQ(mu(0), mu_s);
  EXPECT_NEAR(mu(vs), 0.5 * (mu_s + mu_k), 1e-15);
  EXPECT_NEAR(mu(1), mu_k, 1e-6);
  for (double v = 0; v < 1; v += 1e-2) EXPECT_GT(mu(v), mu(v + 1e-2));
}

TEST(ContactLaw, RollingCoupleRisesToItsLengthAndStays) {
  const double rate = 1e-3;
  const auto couple = [&](double w) { return w * contact_law::rolling_ratio(rate, w); };
  EXPECT_EQ(couple(0), 0);
  EXPECT_NEAR(couple(rate), 1, 1e-15);
  EXPECT_NEAR(couple(10 * rate), 1, 1e-15);
  const double h = 1e-9;
  EXPECT_NEAR(couple(rate - h), 1 - h * h / (rate * rate), 1e-14);
}

TEST(ContactLaw, PublishedMaterialsAreValidAndStateTheirSources) {
  EXPECT_EQ(published_materials().size(), 5u);
  for (const PublishedMaterial& m : published_materials()) {
    EXPECT_FALSE(m.source.empty());
    EXPECT_EQ(m.states_friction, m.material.static_friction > 0) << m.name;
    EXPECT_NO_THROW(combine(m.material, m.material)) << m.name;
    EXPECT_EQ(published_material(m.name), &m);
  }
  EXPECT_EQ(published_material("cheese"), nullptr);
}

}  // namespace
}  // namespace grapnel::testing::contact_law_test
