/// Frequencies and effective masses of beams as segments on springs, against numerically solved transcendental
/// equations, and static deflections in closed form.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"

namespace grapnel::testing {
namespace beam_modes_test {

constexpr double kTwoPi = 2 * std::numbers::pi;

// A root of f between a and b, where its sign changes.
double root_between(const std::function<double(double)>& f, double a, double b) {
  for (int i = 0; i < 200; ++i) {
    const double middle = 0.5 * (a + b);
    ((f(a) > 0) == (f(middle) > 0) ? a : b) = middle;
  }
  return 0.5 * (a + b);
}

// The first roots of f above `from`, bracketed in steps.
std::vector<double> first_roots(const std::function<double(double)>& f, double from, double step, std::size_t count) {
  std::vector<double> roots;
  for (double x = from; roots.size() < count && x < 1e6 * step; x += step) {
    if ((f(x) > 0) != (f(x + step) > 0)) roots.push_back(root_between(f, x, x + step));
  }
  return roots;
}

std::vector<double> frequencies(const std::vector<ElasticMode>& modes) {
  std::vector<double> f;
  for (const ElasticMode& mode : modes) f.push_back(mode.frequency);
  return f;
}

struct BeamData {
  double length, mass_per_length, EI;
  // omega of a wave number times length.
  double omega(double beta_L) const { return beta_L * beta_L * std::sqrt(EI / mass_per_length) / (length * length); }
};
const BeamData kBeam{4, 2.5, 500};

// Root force and moment of a beam whose free end is at x = L, for deflection and slope one at the root: the beam's
// dynamic stiffness there, from w = A cos + B sin + C cosh + D sinh of beta x.
Eigen::Matrix2d root_stiffness(const BeamData& b, double omega) {
  const double k = std::pow(b.mass_per_length * omega * omega / b.EI, 0.25), x = k * b.length;
  Eigen::Matrix4d rows;
  rows << 1, 0, 1, 0,                                          // w(0)
      0, k, 0, k,                                              // w'(0)
      -std::cos(x), -std::sin(x), std::cosh(x), std::sinh(x),  // w''(L) / k^2
      std::sin(x), -std::cos(x), std::sinh(x), std::cosh(x);   // w'''(L) / k^3
  const Eigen::Matrix4d inverse = rows.inverse();
  Eigen::Matrix2d K;
  for (int c = 0; c < 2; ++c) {
    const Eigen::Vector4d w = inverse.col(c);
    K(0, c) = b.EI * k * k * k * (-w[1] + w[3]);  // E I w'''(0): the force that the root needs
    K(1, c) = -b.EI * k * k * (-w[0] + w[2]);     // -E I w''(0): the moment
  }
  return K;
}

TEST(BeamModes, OfAClampedBeamConvergeWithTheFourthPower) {
  const auto exact = first_roots([](double b) { return 1 + std::cos(b) * std::cosh(b); }, 1, 0.1, 3);
  std::vector<std::vector<double>> errors;
  for (int segments : {2, 4, 8, 16}) {
    RobotSetup robot = only_base(100, 20);
    robot.bodies.push_back(
        slender_link("beam", "base", JointType::fixed, kBeam.length, kBeam.mass_per_length, kBeam.EI, segments));
    const Model model = model_of(robot);
    const auto modes = elastic_modes(model, zero_state(model), velocities_of(model, "base"));
    ASSERT_EQ(modes.size(), static_cast<std::size_t>(2 * segments));
    errors.emplace_back();
    for (std::size_t i = 0; i < 3; ++i)
      errors.back().push_back(std::abs(kTwoPi * modes[i].frequency / kBeam.omega(exact[i]) - 1));
  }
  EXPECT_LT(errors[1][0], 2e-5);
  EXPECT_LT(errors[2][1], 1e-4);
  EXPECT_LT(errors[3][0], 1e-7);
  EXPECT_LT(errors[3][2], 1e-4);
  for (std::size_t i = 0; i < 3; ++i) {
    const double order = std::log2(errors[2][i] / errors[3][i]);
    EXPECT_GT(order, 3.8) << "mode " << i + 1;
    EXPECT_LT(order, 4.8) << "mode " << i + 1;
  }
}

TEST(BeamModes, HaveTheEffectiveMassesOfAClampedBeam) {
  RobotSetup robot = only_base(100, 20);
  robot.bodies.push_back(
      slender_link("beam", "base", JointType::fixed, kBeam.length, kBeam.mass_per_length, kBeam.EI, 16));
  const Model model = model_of(robot);
  const State state = zero_state(model);
  const auto modes = elastic_modes(model, state, velocities_of(model, "base"));
  const double mass = kBeam.length * kBeam.mass_per_length;
  const double share[] = {0.613076, 0.188300, 0.064732};
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::VectorXd p = participation(model, state, modes[i], 0);
    EXPECT_NEAR(p[4] * p[4] / mass, share[i], 2e-5);
  }
}

TEST(BeamModes, OfABeamOnAHingeAndOnABaseThatMoves) {
  // Pinned and free: tan b = tanh b; the hinge is free, and its rigid-body motion at frequency zero is not a mode.
  RobotSetup robot = only_base(100, 20);
  BodyDescription link =
      slender_link("beam", "base", JointType::revolute, kBeam.length, kBeam.mass_per_length, kBeam.EI, 12);
  robot.bodies.push_back(link);
  Model model = model_of(robot);
  auto f = frequencies(elastic_modes(model, zero_state(model), velocities_of(model, "base")));
  const auto pinned = first_roots([](double b) { return std::tan(b) - std::tanh(b); }, 3.2, 0.01, 1);
  EXPECT_NEAR(kTwoPi * f[0] / kBeam.omega(pinned[0]), 1, 2e-6);

  // A base of 100 kg and 20 kg m^2 with one beam at 0.5 m, and with two.
  robot.bodies.pop_back();
  link.joint.type = JointType::fixed, link.X_PF.p = {0.5, 0, 0};
  robot.bodies.push_back(link);
  model = model_of(robot);
  f = frequencies(elastic_modes(model, zero_state(model), {}));
  const auto base_determinant = [&](int beams, bool symmetric) {
    return [=](double hz) {
      const double w = kTwoPi * hz;
      const Eigen::Matrix2d K = root_stiffness(kBeam, w);
      Eigen::Matrix2d A;  // maps deflection and rotation of the base to those of the root
      A << 1, 0.5, 0, 1;
      const Eigen::Matrix2d total = A.transpose() * K * A;
      const double x = std::pow(kBeam.mass_per_length * w * w / kBeam.EI, 0.25) * kBeam.length;
      const double poles = 1 + std::cos(x) * std::cosh(x);  // of K, at the clamped beam's frequencies
      if (beams == 1)
        return poles * (total - w * w * Eigen::Matrix2d(Eigen::Vector2d(100, 20).asDiagonal())).determinant();
      return poles * (symmetric ? 2 * total(0, 0) - w * w * 100 : 2 * total(1, 1) - w * w * 20);
    };
  };
  const auto one = first_roots(base_determinant(1, true), 0.2, 0.01, 3);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(f[i] / one[i], 1, 5e-5) << i;
  EXPECT_NEAR(one[0], 0.969768, 1e-6);  // published value for this case
  EXPECT_NEAR(one[1], 3.373344, 1e-6);

  BodyDescription other = link;
  other.name = "beam-2", other.joint.name = "beam-2-joint";
  other.X_PF = {rotation_about({0, 0, 1}, std::numbers::pi), {-0.5, 0, 0}};
  robot.bodies.push_back(other);
  model = model_of(robot);
  f = frequencies(elastic_modes(model, zero_state(model), {}));
  const auto even = first_roots(base_determinant(2, true), 0.2, 0.01, 2);
  const auto odd = first_roots(base_determinant(2, false), 0.2, 0.01, 2);
  std::vector<double> both{even[0], even[1], odd[0], odd[1]};
  std::sort(both.begin(), both.end());
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(f[i] / both[i], 1, 5e-5) << i;
}

// The links of De Luca and Siciliano's arm (1991), each clamped, with their payloads: 0.5 m, 0.2 kg/m, E I = 1 N m^2.
// The first link carries the elbow's hub of 1 kg and 0.1 kg m^2 and, concentrated at the elbow as in the paper, the
// second link with its payload of 0.1 kg and 0.0005 kg m^2. The second link carries the payload.
TEST(BeamModes, OfLinksThatCarrySomething) {
  const auto modes_with = [](double mass, double inertia) {
    RobotSetup robot = only_base(1, 1, true);
    robot.bodies.push_back(slender_link("link", "base", JointType::fixed, 0.5, 0.2, 1, 8));
    BodyDescription load;
    load.name = "load", load.parent = "link", load.joint.name = "mount", load.joint.type = JointType::fixed;
    load.X_PF.p = {0.5, 0, 0};
    load.mass = mass, load.inertia = Symmetric3d::diagonal(inertia, inertia, inertia);
    robot.bodies.push_back(load);
    const Model model = model_of(robot);
    return frequencies(elastic_modes(model, zero_state(model), {}));
  };
  const auto first = modes_with(1 + 0.1 + 0.1, 0.1 + 0.2 * 0.125 / 3 + 0.0005 + 0.1 * 0.25),
             second = modes_with(0.1, 0.0005);
  EXPECT_NEAR(first[0], 0.47969, 1e-5);
  EXPECT_NEAR(first[1], 1.79659, 2e-5);
  EXPECT_NEAR(second[0], 2.17833, 2e-5);
  EXPECT_NEAR(second[1], 15.91451, 1e-3);
}

TEST(BeamModes, DeflectInClosedForm) {
  // P at the tip: P L^3 / 3 E I and P L^2 / 2 E I; the Gauss points make both exact, with one segment already.
  for (int segments : {1, 3}) {
    RobotSetup robot = only_base(1, 1, true);
    robot.bodies.push_back(slender_link("beam", "base", JointType::fixed, 2, 3, 70, segments));
    const Model model = model_of(robot);
    const double P = 5;
    double deflection = 0, slope = 0;
    for (const int body : model.springs()) {
      const double s = forward_kinematics(model, zero_state(model)).X_WB[body].p[0];
      const double angle = P * (2 - s) / model.bodies()[body].description.joint.spring->stiffness;
      deflection += angle * (2 - s), slope += angle;
    }
    EXPECT_NEAR(deflection, P * 8 / (3 * 70), 1e-14);
    EXPECT_NEAR(slope, P * 4 / (2 * 70), 1e-14);
  }
}

// Clamped and free, GJ = 200, rho I_p = 0.02 per metre: omega = (pi / 2 L) sqrt(GJ / rho I_p). Segments are rigid in
// torsion, so the error decreases with the square of the segment length.
TEST(BeamModes, OfTorsion) {
  std::vector<double> errors;
  for (int segments : {4, 8}) {
    RobotSetup robot = only_base(1, 1, true);
    BodyDescription link = slender_link("beam", "base", JointType::fixed, 2, 3, 70, segments);
    link.inertia.xx = 0.02 * 2, link.inertia.yy = link.inertia.zz = 2.0 + 0.02;
    link.beam->bending_stiffness_z.reset();
    link.beam->torsional_stiffness = 200;
    robot.bodies.push_back(link);
    const Model model = model_of(robot);
    const auto modes = elastic_modes(model, zero_state(model), {});
    errors.push_back(std::abs(kTwoPi * modes[0].frequency / (std::numbers::pi / 4 * std::sqrt(200 / 0.02)) - 1));
  }
  EXPECT_LT(errors[1], 5e-4);
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.1);
}

// An axially elastic bar: (pi / 2 L) sqrt(E A / rho A), 3 (pi / 2 L) and so on, and its damping ratio; E A is stated,
// or follows from section and material.
TEST(BeamModes, OfStretching) {
  std::vector<double> errors;
  for (int segments : {4, 8}) {
    RobotSetup robot = only_base(1, 1, true);
    BodyDescription link = slender_link("beam", "base", JointType::fixed, 2, 3, 70, segments);
    link.beam->bending_stiffness_z.reset();
    link.beam->axial_stiffness = 3e5;
    link.beam->damping_ratio = 0.01;
    robot.bodies.push_back(link);
    const Model model = model_of(robot);
    const auto modes = elastic_modes(model, zero_state(model), {});
    ASSERT_EQ(modes.size(), static_cast<std::size_t>(2 * segments));
    errors.push_back(std::abs(kTwoPi * modes[0].frequency / (std::numbers::pi / 4 * std::sqrt(3e5 / 3)) - 1));
    EXPECT_NEAR(modes[0].damping_ratio, 0.01, 1e-4);
    EXPECT_NEAR(modes[1].frequency / modes[0].frequency, 3, 0.1);
  }
  EXPECT_LT(errors[1], 5e-4);
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.1);

  RobotSetup robot = only_base(1, 1, true);
  BodyDescription link = slender_link("beam", "base", JointType::fixed, 2, 2700 * 0.01 * 0.02, 70, 4);
  link.inertia.xx = 2700 * (0.01 * 8e-6 + 0.02 * 1e-6) / 12 * 2 * 1.0001;
  link.inertia.yy += 1e-3, link.inertia.zz += 1e-3;
  link.beam->bending_stiffness_z.reset();
  link.beam->material = BeamMaterial{70e9, 26e9, 2700};
  link.beam->section = BeamSection{};
  link.beam->section->width = 0.01, link.beam->section->height = 0.02;
  link.beam->stretches = true;
  robot.bodies.push_back(link);
  const Model model = model_of(robot);
  int sliding = 0;
  for (const int body : model.springs()) {
    const JointDescription& joint = model.bodies()[body].description.joint;
    if (joint.type != JointType::prismatic) continue;
    ++sliding;
    EXPECT_NEAR(joint.spring->stiffness, 70e9 * 0.01 * 0.02 / 0.25, 1e-3);
  }
  EXPECT_EQ(sliding, 8);
}

// omega^2 = k (1 / J_r + 1 / J_l): k = 5000 N m/rad, 1 and 2 kg m^2; and with the rotor braked.
TEST(GearModes, InClosedForm) {
  RobotSetup robot = only_base(1, 1, true);
  BodyDescription link;
  link.name = "link", link.parent = "base";
  link.joint.name = "joint", link.joint.type = JointType::revolute;
  link.joint.rotor_inertia = 1e-4, link.joint.gear_ratio = 100;
  link.joint.elasticity = JointElasticity{5000, 8};
  link.mass = 1, link.inertia = Symmetric3d::diagonal(2, 2, 2);
  robot.bodies.push_back(link);
  const Model model = model_of(robot);
  auto modes = elastic_modes(model, zero_state(model), {});
  ASSERT_EQ(modes.size(), 1u);
  EXPECT_NEAR(kTwoPi * modes[0].frequency, std::sqrt(5000 * 1.5), 1e-9);
  EXPECT_NEAR(modes[0].frequency, 13.783, 5e-4);
  EXPECT_NEAR(modes[0].damping_ratio, 0.5 * 8 / 5000 * std::sqrt(5000 * 1.5), 1e-12);  // c / k omega / 2
  const Body& driven = model.bodies()[model.body_index("drive:link")];
  modes = elastic_modes(model, zero_state(model), std::vector<int>{driven.v});
  EXPECT_NEAR(modes[0].frequency, 7.958, 5e-4);
}

}  // namespace beam_modes_test
}  // namespace grapnel::testing
