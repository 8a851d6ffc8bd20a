// Central impacts of two free bodies in closed form.
#include "grapnel/impact/compliant_impact.hpp"

#include <gtest/gtest.h>

#include <numbers>

#include "impact/compliant_case.hpp"

namespace grapnel::testing {
namespace compliant_impact_test {

using Status = ImpactSolution::Status;

ImpactSolution run(const CentralPair& c, const CompliantSetup& setup = {}) {
  return compliant_impact(c.model, c.state, {&c.contact, 1}, {}, setup);
}

// Separation speed relative to the approach speed.
double rebound(const CentralPair& c, const ImpactSolution& o) {
  return dot(relative_velocity(c.model, o.after, 0, 1, c.contact.p_WC), c.contact.n_W) / CentralPair::speed;
}

double off(const char* what, double value, double exact) {
  const double error = std::abs(value / exact - 1);
  std::printf("[ measured ] %s: %.3g\n", what, error);
  return error;
}

// Checks for every contact law: momentum, energy, and the impulse as integral of the force and as change of momentum.
void expect_balanced(const CentralPair& c, const ImpactSolution& o) {
  ASSERT_EQ(o.status, Status::separated) << o.message;
  const ForceHistory& h = o.forces[0];
  EXPECT_LT(momentum_error(c.model, c.state, o.after), 1e-13);  // measured 3e-16
  const double residual = o.energy_residual * o.kinetic_energy_before;
  const double at_stake = 0.5 * CentralPair::m_eff * CentralPair::speed * CentralPair::speed;
  std::printf("[ measured ] energy residual / energy of the relative motion: %.3g, steps %ld, rhs %ld\n",
              residual / at_stake, o.steps, o.rhs_evaluations);
  EXPECT_LT(residual / at_stake, 1e-8);  // measured 1.6e-9
  EXPECT_EQ(h.touches, 1);
  const double P = dot(h.impulse.linear, c.contact.n_W);
  EXPECT_GT(P, 0);
  EXPECT_LT(norm(h.impulse.linear - P * c.contact.n_W), 1e-9 * P);
  const Vector3d sampled = integral(o.times, h.force);
  EXPECT_LT(norm(sampled - h.impulse.linear), 1e-4 * P);  // measured 5e-5, by the trapezoidal rule
  const double gained = (1 + rebound(c, o)) * CentralPair::m_eff * CentralPair::speed;
  EXPECT_NEAR(P, gained, 1e-11 * gained);
  EXPECT_GE(o.times.size(), 400u);
  EXPECT_EQ(h.force.size(), o.times.size());
  EXPECT_EQ(o.times.back(), o.duration);
}

TEST(CompliantImpact, LinearSpringInClosedForm) {
  const CentralPair c = central_pair();
  const ImpactSolution o = run(c);
  expect_balanced(c, o);
  const double k = c.contact.stiffness, m = CentralPair::m_eff, v = CentralPair::speed;
  const ForceHistory& h = o.forces[0];
  EXPECT_LT(off("duration", o.duration, std::numbers::pi * std::sqrt(m / k)), 1e-9);  // measured 1.4e-11
  EXPECT_LT(off("touch", h.duration, o.duration), 1e-12);
  EXPECT_LT(off("peak force", h.peak_force, v * std::sqrt(k * m)), 2e-9);            // measured 1.4e-10
  EXPECT_LT(off("time of it", h.peak_force_time, 0.5 * o.duration), 1e-6);           // measured 1.0e-8
  EXPECT_LT(off("deformation", h.largest_deformation, v * std::sqrt(m / k)), 2e-9);  // measured 1.4e-10
  EXPECT_LT(off("impulse", norm(h.impulse.linear), 2 * m * v), 2e-9);                // measured 1.5e-10
  EXPECT_LT(off("rebound", rebound(c, o), 1), 4e-9);                                 // measured 3.0e-10
  EXPECT_EQ(h.energy_lost, 0);
  EXPECT_LT(o.elastic_energy_after, 1e-12 * m * v * v);
  EXPECT_EQ(h.peak_moment, 0);
}

TEST(CompliantImpact, HertzInClosedForm) {
  CentralPair c = central_pair();
  c.contact.model = ContactForceModel::hertz;
  c.contact.stiffness = 3e7;
  const ImpactSolution o = run(c);
  expect_balanced(c, o);
  const double k = c.contact.stiffness, m = CentralPair::m_eff, v = CentralPair::speed;
  const ForceHistory& h = o.forces[0];
  // m v^2 / 2 = 2/5 k d^(5/2); duration 2 d / v times the integral of (1 - x^(5/2))^(-1/2) over 0 to 1, which is
  // sqrt(pi) Gamma(7/5) / Gamma(9/10).
  const double d = std::pow(1.25 * m * v * v / k, 0.4);
  const double duration = 2 * d / v * std::sqrt(std::numbers::pi) * std::tgamma(1.4) / std::tgamma(0.9);
  EXPECT_NEAR(duration, 2.943 * d / v, 1e-3 * duration);
  EXPECT_LT(off("deformation", h.largest_deformation, d), 2e-9);           // measured 1.2e-10
  EXPECT_LT(off("peak force", h.peak_force, k * std::pow(d, 1.5)), 2e-9);  // measured 1.8e-10
  EXPECT_LT(off("duration", o.duration, duration), 1e-9);                  // measured 2e-13
  EXPECT_LT(off("impulse", norm(h.impulse.linear), 2 * m * v), 2e-9);      // measured 1.5e-10
  EXPECT_LT(off("rebound", rebound(c, o), 1), 4e-9);                       // measured 3.0e-10
}

// m d'' + c d' + k d = 0 until the force k d + c d' reaches zero at nonzero deformation: with z = c / (2 sqrt(k m)), w
// = sqrt(k/m), at sqrt(1 - z^2) w t = pi - atan2(2 z sqrt(1 - z^2), 1 - 2 z^2), when d' is -v exp(-z w t).
TEST(CompliantImpact, KelvinVoigtsRestitutionInClosedForm) {
  for (double z : {0.05, 0.3, 0.7, 0.95}) {
    SCOPED_TRACE(z);
    CentralPair c = central_pair();
    const double k = c.contact.stiffness, m = CentralPair::m_eff, v = CentralPair::speed, w = std::sqrt(k / m);
    c.contact.damping = 2 * z * std::sqrt(k * m);
    const ImpactSolution o = run(c);
    expect_balanced(c, o);
    const double s = std::sqrt(1 - z * z);
    const double t = (std::numbers::pi - std::atan2(2 * z * s, 1 - 2 * z * z)) / (s * w), e = std::exp(-z * w * t);
    const ForceHistory& h = o.forces[0];
    EXPECT_LT(off("duration", o.duration, t), 1e-9);                             // measured 4.9e-11
    EXPECT_LT(off("rebound", rebound(c, o), e), 4e-9);                           // measured 2.2e-10
    EXPECT_LT(off("lost", h.energy_lost, 0.5 * m * v * v * (1 - e * e)), 1e-8);  // measured 7.3e-10
    // The damper acts immediately: for z >= 1/2 the initial force is the maximum.
    const double peak = z > 0.5 ? 0 : std::atan2(s * (1 - 4 * z * z), z * (3 - 4 * z * z)) / (s * w);
    const double force =
        std::exp(-z * w * peak) * (2 * z * std::cos(s * w * peak) + (1 - 2 * z * z) / s * std::sin(s * w * peak));
    EXPECT_LT(off("peak force", h.peak_force, force * v * std::sqrt(k * m)), 2e-9);  // measured 8.6e-11
    EXPECT_NEAR(h.peak_force_time, peak, 1e-6 * t);
    EXPECT_LT(norm(h.force.back()), 1e-8 * h.peak_force);
  }
}

// d' dd' / (1 + a d') = -(k/m) d^n dd, so a v - ln(1 + a v) is equal at both ends: for any k, n and m.
TEST(CompliantImpact, HuntAndCrossleysRestitutionInClosedForm) {
  for (double n : {1.0, 1.5, 2.2}) {
    for (double a : {0.2, 2.0, 20.0}) {
      SCOPED_TRACE(n * 1000 + a);
      CentralPair c = central_pair();
      c.contact.model = ContactForceModel::hunt_crossley;
      c.contact.stiffness = n < 1.2 ? 1e5 : n < 2 ? 3e7 : 1e9;
      c.contact.exponent = n;
      c.contact.damping = a;
      const ImpactSolution o = run(c);
      expect_balanced(c, o);
      const double v = CentralPair::speed, whole = a * v - std::log1p(a * v);
      double low = 0, high = std::min(1.0, 1 / (a * v));  // bisection for e
      for (int i = 0; i < 100; ++i) {
        const double e = 0.5 * (low + high);
        (-a * e * v - std::log1p(-a * e * v) < whole ? low : high) = e;
      }
      const double e = 0.5 * (low + high);
      EXPECT_LT(off("rebound", rebound(c, o), e), 1e-8);  // measured 8.3e-10
      const double lost = 0.5 * CentralPair::m_eff * v * v * (1 - e * e);
      EXPECT_LT(off("lost", o.forces[0].energy_lost, lost), 4e-8);  // measured 3.3e-9
    }
  }
}

}  // namespace compliant_impact_test
}  // namespace grapnel::testing
