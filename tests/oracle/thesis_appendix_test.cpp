// Differences between the thesis's printed Appendices A to C and the derived planar robot, one test per typo. Each test
// states the printed term and shows that the difference is exactly the typo. The structure (B.9) is correct.
#include <gtest/gtest.h>

#include <cmath>

#include "oracle/random_planar.hpp"

namespace grapnel {
namespace thesis_appendix_test {

using namespace oracle;
using testing::Random;
using testing::seed_note;

class ThesisAppendix : public ::testing::TestWithParam<int> {
 protected:
  ThesisAppendix() {
    trace_ = std::make_unique<::testing::ScopedTrace>(__FILE__, __LINE__, seed_note(GetParam()));
    Random random(GetParam());
    a0 = random.uniform(0.5, 1.5);
    r = random_planar_robot(random);
    for (double* a : {&r.a1, &r.a2, &r.a3}) *a = random.uniform(0.5, 1.5);
    r.b1 = a0 / 2, r.b2 = a0 / 2;
    r.d1 = r.a1 / 2, r.d2 = r.a2 / 2, r.d3 = r.a3 / 2;
    s = random_planar_state(random);
    b = r;
    b.b2 = -a0 / 2, b.a3 = -r.a3, b.d3 = -r.d3;
  }
  double sine(std::initializer_list<int> angles) const {
    double sum = 0;
    for (int i : angles) sum += s.q[2 + i];
    return std::sin(sum);
  }
  double cosine(std::initializer_list<int> angles) const {
    double sum = 0;
    for (int i : angles) sum += s.q[2 + i];
    return std::cos(sum);
  }
  double w(int i) const { return s.rate[2 + i]; }  // rate of angle i

  double a0;
  PlanarDualArm r;  // as in Appendix A and C
  PlanarDualArm b;  // as in Appendix B
  PlanarState s;
  std::unique_ptr<::testing::ScopedTrace> trace_;
};

constexpr double kRounding = 1e-12;

// A and B describe different robots: (A.1)'s second tip is the derived one for +a0/2, B's I_b13 the derived one for
// -a0/2.
TEST_P(ThesisAppendix, A_MountsArm2OnTheOtherSideThanB) {
  const Eigen::Vector3d tip_in_A{s.q[0] + a0 / 2 * cosine({0}) + r.a3 * cosine({0, 3}),
                                 s.q[1] + a0 / 2 * sine({0}) + r.a3 * sine({0, 3}), s.q[2] + s.q[5]};
  EXPECT_LT((tip(r, s.q, 2) - tip_in_A).norm(), kRounding);
  EXPECT_GT((tip(b, s.q, 2) - tip_in_A).norm(), 1e-3);
  const double arm1 =
      -(r.m2 * r.a1 + r.m1 * r.d1) * sine({0, 1}) - (r.m1 + r.m2) * a0 / 2 * sine({0}) - r.m2 * r.d2 * sine({0, 1, 2});
  const double arm2_in_B = a0 * r.m3 * sine({0}) / 2 + r.d3 * r.m3 * sine({0, 3});
  EXPECT_NEAR(mass_matrix(b, s.q)(0, 2), arm1 + arm2_in_B, kRounding * 100);
  EXPECT_NEAR(mass_matrix(r, s.q)(0, 2), arm1 - arm2_in_B, kRounding * 100);
}

// B: I_bm14 carries an acceleration, theta1'', which no inertia can.
TEST_P(ThesisAppendix, B_Ibm14HasAStrayAcceleration) {
  const double stray = 2.5;  // any value of theta1''
  const double printed =
      -r.m2 * r.a1 * sine({0, 1}) - r.m1 * r.d1 * stray * sine({0, 1}) - r.m2 * r.d2 * sine({0, 1, 2});
  EXPECT_NEAR(printed - mass_matrix(b, s.q)(0, 3), r.m1 * r.d1 * sine({0, 1}) * (1 - stray), kRounding * 100);
}

// B: in I_b33 and I_bm34 the term 2 a1 d2 c2 lacks its m2. Twice the masses and inertias must give twice the matrix.
TEST_P(ThesisAppendix, B_Ib33AndIbm34LackAMass) {
  const auto printed = [&](const PlanarDualArm& x) {
    const double c1 = cosine({1}), c2 = cosine({2}), c12 = cosine({1, 2}), c3 = cosine({3});
    const double I_bm34 = x.I1 + x.I2 + x.m2 * x.a1 * x.a1 + x.m1 * x.d1 * x.d1 + x.m2 * x.d2 * x.d2 +
                          x.m2 * a0 * x.d2 * c12 / 2 + x.m2 * a0 * x.a1 * c1 / 2 + x.m1 * a0 * x.d1 * c1 / 2 +
                          2 * x.a1 * x.d2 * c2;
    const double I_b33 = I_bm34 + x.I0 + (x.m1 + x.m2) * a0 * a0 / 4 + x.m2 * a0 * x.d2 * c12 / 2 +
                         x.m2 * a0 * x.a1 * c1 / 2 + x.m1 * a0 * x.d1 * c1 / 2 + x.I3 + x.d3 * x.d3 * x.m3 +
                         a0 * x.d3 * x.m3 * c3;
    return Eigen::Vector2d(I_b33, I_bm34);
  };
  const Matrix6 M = mass_matrix(b, s.q);
  const double slip = 2 * r.a1 * r.d2 * cosine({2}) * (1 - r.m2);
  // In I_b33 arm 2's m3 a0^2/4 is missing as well.
  EXPECT_NEAR(printed(r)[0] - M(2, 2), slip - r.m3 * a0 * a0 / 4, kRounding * 1000);
  EXPECT_NEAR(printed(r)[1] - M(2, 3), slip, kRounding * 1000);
  PlanarDualArm heavy = b;
  for (double* x : {&heavy.m0, &heavy.m1, &heavy.m2, &heavy.m3, &heavy.I0, &heavy.I1, &heavy.I2, &heavy.I3}) *x *= 2;
  EXPECT_LT((mass_matrix(heavy, s.q) - 2 * M).norm(), kRounding * 100);
}

// B: c_b3, c_1, c_2, c_3 contain products of the base's velocity with rates. They are one of the two cancelling halves
// of Lagrange's equation ((7) in the oracle's header), in c_b3 with theta013 written for theta012 and, once, c0 for s0.
// A frame drifting at constant velocity u must see the same forces: the derived bias does, the printed one changes by u
// times a rate.
TEST_P(ThesisAppendix, B_VelocityTermsAreSpurious) {
  const auto printed_part = [&](double vx, double vy, bool corrected) {
    const double rate1 = w(0) + w(1), rate2 = rate1 + w(2), rate3 = w(0) + w(3);
    const double c = corrected ? cosine({0, 1, 2}) : cosine({0, 1, 3}),
                 sn = corrected ? sine({0, 1, 2}) : sine({0, 1, 3});
    const double x = (r.m1 + r.m2) * a0 / 2 * w(0) * cosine({0}) +
                     (r.d1 * r.m1 + r.a1 * r.m2) * rate1 * cosine({0, 1}) + r.d2 * r.m2 * rate2 * c -
                     r.m3 * (a0 / 2 * w(0) * cosine({0}) + r.d3 * rate3 * cosine({0, 3}));
    const double y = (r.m1 + r.m2) * a0 / 2 * w(0) * sine({0}) + (r.d1 * r.m1 + r.a1 * r.m2) * rate1 * sine({0, 1}) +
                     r.d2 * r.m2 * rate2 * sn -
                     r.m3 * (a0 / 2 * w(0) * (corrected ? sine({0}) : cosine({0})) + r.d3 * rate3 * sine({0, 3}));
    return x * vx + y * vy;
  };
  // What -dT/dtheta0 has of the base's velocity: T's middle term (3) turned by a quarter.
  const double h = 1e-3;
  const auto T = [&](double turn, double scale) {
    PlanarState moved = s;
    moved.q[2] += turn;
    moved.rate.head(2) *= scale;
    return kinetic_energy(b, moved);
  };
  const auto mixed = [&](double turn) { return (T(turn, 1) - T(turn, -1)) / 2; };
  const double half = -(8 * (mixed(h) - mixed(-h)) - (mixed(2 * h) - mixed(-2 * h))) / (12 * h);
  const double printed = printed_part(s.rate[0], s.rate[1], true);
  EXPECT_NEAR(printed, half, 1e-8 * (1 + std::abs(half)));
  // As printed it is not even that half.
  EXPECT_GT(std::abs(printed_part(s.rate[0], s.rate[1], false) - printed), 1e-6);

  PlanarState drifting = s;
  drifting.rate[0] += 0.7, drifting.rate[1] -= 0.4;
  EXPECT_LT((bias(b, drifting) - bias(b, s)).norm(), kRounding * 10);
  const double change =
      printed_part(drifting.rate[0], drifting.rate[1], false) - printed_part(s.rate[0], s.rate[1], false);
  EXPECT_GT(std::abs(change), 1e-3) << "the printed term depends on the frame";
}

// B: in c_b3 arm 2's product of rates has the wrong sign.
TEST_P(ThesisAppendix, B_Cb3HasAWrongSign) {
  const double K03 = a0 * r.d3 * r.m3 / 2;
  const double printed = -K03 * w(3) * w(3) * sine({3}) + 2 * K03 * w(0) * w(3) * sine({3});
  // Arm 2's part of the derived c_b3: what remains when the other links weigh nothing and do not turn on their own.
  PlanarDualArm arm2 = b;
  arm2.m1 = arm2.m2 = 0;
  EXPECT_NEAR(printed - bias(arm2, s)[2], 4 * K03 * w(0) * w(3) * sine({3}), kRounding * 100);
}

// B: c_1 and c_2 have only products of two different rates or theta2'^2. With the base alone turning, the printed ones
// vanish (except for the velocity terms), though the links are thrown outwards.
TEST_P(ThesisAppendix, B_C1AndC2LackTheCentrifugalTerms) {
  PlanarState base_only = s;
  base_only.rate << 0, 0, 1.3, 0, 0, 0;
  const Vector6 c = bias(b, base_only);
  const double outward = a0 / 2 * 1.3 * 1.3;
  EXPECT_NEAR(c[3], outward * ((r.m1 * r.d1 + r.m2 * r.a1) * sine({1}) + r.m2 * r.d2 * sine({1, 2})), kRounding * 100);
  // c_2 has besides what link 1's turning with the base throws out.
  EXPECT_NEAR(c[4], outward * r.m2 * r.d2 * sine({1, 2}) + 1.3 * 1.3 * r.m2 * r.a1 * r.d2 * sine({2}), kRounding * 100);
}

// C: J_Tg's first entry lacks a minus; its two columns cannot serve three joints: arm 2 is added to the column of
// joint 2.
TEST_P(ThesisAppendix, C_JTgHasASignAndAColumnTooFew) {
  Eigen::Matrix2d printed;
  printed << r.m1 * r.a1 / 2 * sine({0, 1}) - r.m2 * r.a1 * sine({0, 1}) - r.m2 * r.a2 / 2 * sine({0, 1, 2}),
      -r.m2 * r.a2 / 2 * sine({0, 1, 2}) - r.m3 * r.a3 / 2 * sine({0, 3}),
      (r.m1 * r.a1 / 2 + r.m2 * r.a1) * cosine({0, 1}) + r.m2 * r.a2 / 2 * cosine({0, 1, 2}),
      r.m2 * r.a2 / 2 * cosine({0, 1, 2}) + r.m3 * r.a3 / 2 * cosine({0, 3});
  const Eigen::Matrix<double, 2, 3> J = joint_momentum(r, s.q);
  EXPECT_NEAR(printed(0, 0) - J(0, 0), r.m1 * r.a1 * sine({0, 1}), kRounding * 100);
  EXPECT_NEAR(printed(1, 0), J(1, 0), kRounding * 100);
  EXPECT_LT((printed.col(1) - J.col(1) - J.col(2)).norm(), kRounding * 100);
}

// C: r3 is for the other mount than B's inertias: m r_0g is the derived k0 e(f0) + ... for Appendix A's robot only.
TEST_P(ThesisAppendix, C_R3UsesTheOtherMount) {
  const Eigen::Vector2d r3{a0 / 2 * cosine({0}) + r.a3 / 2 * cosine({0, 3}),
                           a0 / 2 * sine({0}) + r.a3 / 2 * sine({0, 3})};
  // By (6) and (7) the first moment about the base is the base rate's column of the momentum, turned back by a quarter.
  const auto first_moment = [&](PlanarDualArm x) {
    x.m1 = x.m2 = 0;
    const Matrix6 M = mass_matrix(x, s.q);
    return Eigen::Vector2d(M(1, 2), -M(0, 2));
  };
  EXPECT_LT((first_moment(r) - r.m3 * r3).norm(), kRounding * 100);
  EXPECT_LT((first_moment(b) + r.m3 * r3).norm(), kRounding * 100) << "B's robot carries it on the opposite side";
}

// C: I_w, the inertia about the origin, leaves out the base's own I0.
TEST_P(ThesisAppendix, C_IwLeavesOutTheBase) {
  const Eigen::Vector2d e0{cosine({0}), sine({0})}, e1{cosine({0, 1}), sine({0, 1})},
      e2{cosine({0, 1, 2}), sine({0, 1, 2})}, e3{cosine({0, 3}), sine({0, 3})};
  const Eigen::Vector2d r1 = a0 / 2 * e0 + r.d1 * e1, r2 = a0 / 2 * e0 + r.a1 * e1 + r.d2 * e2,
                        r3 = a0 / 2 * e0 + r.d3 * e3;
  const double printed =
      r.I1 + r.I2 + r.I3 + r.m1 * r1.squaredNorm() + r.m2 * r2.squaredNorm() + r.m3 * r3.squaredNorm();
  EXPECT_NEAR(mass_matrix(r, s.q)(2, 2) - printed, r.I0, kRounding * 1000);
}

INSTANTIATE_TEST_SUITE_P(RandomStates, ThesisAppendix, ::testing::Range(0, 20));

}  // namespace thesis_appendix_test
}  // namespace grapnel
