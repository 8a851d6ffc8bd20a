/// Nonuniform beams and sections with a material: against closed forms and Kirchhoff's tapered beams.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/problem/beam.hpp"

namespace grapnel::testing {
namespace tapered_beam_test {

using ::testing::HasSubstr;

constexpr double kTwoPi = 2 * std::numbers::pi;
const BeamMaterial kAluminium{70e9, 26e9, 2700};

BeamSection round(double diameter, std::optional<double> wall = {}) {
  BeamSection s;
  s.diameter = diameter, s.wall_thickness = wall;
  return s;
}
BeamSection flat(double width, double height, std::optional<double> wall = {}) {
  BeamSection s;
  s.width = width, s.height = height, s.wall_thickness = wall;
  return s;
}
BeamStation station(double at, const BeamSection& section) {
  BeamStation s;
  s.at = at, s.section = section;
  return s;
}

// A link consisting of a beam, from one section to another.
BodyDescription tapered(double length, const BeamSection& first, const BeamSection& last, int segments) {
  BodyDescription link = slender_link("beam", "base", JointType::fixed, length, 1, 1, segments);
  link.beam->bending_stiffness_z.reset();
  link.beam->material = kAluminium;
  link.beam->stations = {station(0, first), station(length, last)};
  link.mass = 1e6;  // the beam is a part of it
  const Beam beam(link);
  const RigidBodyInertiad whole = beam.inertia();
  link.mass = whole.mass, link.com = whole.com(), link.inertia = whole.rotational_about_com();
  return link;
}

std::vector<ElasticMode> modes_of(const BodyDescription& link) {
  RobotSetup robot = only_base(1, 1, true);
  robot.bodies.push_back(link);
  EXPECT_EQ(beam_fault(link), "");
  const Model model = model_of(robot);
  return elastic_modes(model, zero_state(model), {});
}

TEST(Sections, HaveTheirClosedForms) {
  const BeamProperties tube = section_properties(round(0.1, 0.002), kAluminium);
  const double I = std::numbers::pi / 64 * (std::pow(0.1, 4) - std::pow(0.096, 4));
  EXPECT_NEAR(tube.bending_stiffness_y, 70e9 * I, 1e-6);
  EXPECT_NEAR(tube.bending_stiffness_z, 70e9 * I, 1e-6);
  EXPECT_NEAR(tube.torsional_stiffness, 26e9 * 2 * I, 1e-6);
  EXPECT_NEAR(tube.rotary_inertia, 2700 * 2 * I, 1e-15);
  EXPECT_NEAR(tube.mass_per_length, 2700 * std::numbers::pi / 4 * (0.01 - 0.096 * 0.096), 1e-12);
  const BeamProperties bar = section_properties(flat(0.02, 0.05), kAluminium);
  EXPECT_NEAR(bar.bending_stiffness_y, 70e9 * 0.02 * std::pow(0.05, 3) / 12, 1e-8);
  EXPECT_NEAR(bar.bending_stiffness_z, 70e9 * 0.05 * std::pow(0.02, 3) / 12, 1e-8);
  EXPECT_NEAR(bar.rotary_inertia_y, 2700 * 0.02 * std::pow(0.05, 3) / 12, 1e-15);
  EXPECT_NEAR(bar.rotary_inertia_z, 2700 * 0.05 * std::pow(0.02, 3) / 12, 1e-15);
  // Torsion of a square, 0.140577 a^4, and of 1 by 2.5, 0.249 a b^3 (Timoshenko & Goodier 1970, table of section 109).
  EXPECT_NEAR(section_properties(flat(0.1, 0.1), kAluminium).torsional_stiffness, 26e9 * 0.1405770 * 1e-4, 1);
  EXPECT_NEAR(bar.torsional_stiffness / (26e9 * 0.05 * std::pow(0.02, 3)), 0.2494, 2e-4);
  // A thin square box: 4 A^2 t / length of its wall.
  const double a = 0.1 - 0.002;
  EXPECT_NEAR(section_properties(flat(0.1, 0.1, 0.002), kAluminium).torsional_stiffness, 26e9 * a * a * a * 0.002,
              1e-6);
}

// P L^3 / 3 E I_0 times D_0 / D_1 at the tip of a truncated cone, with order four.
TEST(TaperedBeam, DeflectsInClosedForm) {
  std::vector<double> errors;
  for (int segments : {2, 4, 8}) {
    RobotSetup robot = only_base(1, 1, true);
    robot.bodies.push_back(tapered(2, round(0.04), round(0.02), segments));
    const Model model = model_of(robot);
    const Kinematics k = forward_kinematics(model, zero_state(model));
    double deflection = 0;
    for (const int body : model.springs()) {
      const JointDescription& joint = model.bodies()[body].description.joint;
      if (std::abs(joint.axis[2]) < 0.5) continue;
      const double s = k.X_WB[body].p[0];
      deflection += 5 * (2 - s) / joint.spring->stiffness * (2 - s);
    }
    const double EI = 70e9 * std::numbers::pi / 64 * std::pow(0.04, 4);
    errors.push_back(std::abs(deflection / (5 * 8 / (3 * EI) * 2) - 1));
  }
  EXPECT_LT(errors[2], 1e-4);                             // measured 3.1e-5
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), 4, 0.4);  // measured 3.81
}

// First frequencies of a full cone and of a full wedge, in sqrt(E I_0 / rho A_0) / L^2: 8.7192 and 5.3151 (Kirchhoff
// 1879), with the length of the full bodies: the tips here are a thousandth of the roots.
TEST(TaperedBeam, VibratesAsKirchhoffFound) {
  const double E_rho = std::sqrt(70e9 / 2700), L = 3;
  const auto cone = modes_of(tapered(L, round(0.06), round(0.06e-3), 50));
  const double of_cone = 0.06 / 4 * E_rho / (L * L);                                // sqrt(I / A) of a circle: D / 4
  EXPECT_NEAR(kTwoPi * cone[0].frequency / of_cone, 8.7192 * 0.999 * 0.999, 1e-3);  // measured 3e-4
  const auto wedge = modes_of(tapered(L, flat(0.2, 0.06), flat(0.2, 0.06e-3), 50));
  const double of_wedge = 0.06 / std::sqrt(12.0) * E_rho / (L * L);
  EXPECT_NEAR(kTwoPi * wedge[0].frequency / of_wedge, 5.3151 * 0.999 * 0.999, 1e-3);  // measured 1e-4
}

TEST(TaperedBeam, HasTheStatedMassAndDamping) {
  BodyDescription link = slender_link("beam", "base", JointType::fixed, 2, 1, 1, 12);
  link.beam->bending_stiffness_z.reset();
  for (const auto& [at, m, EI] :
       {std::tuple{0.0, 3.0, 900.0}, std::tuple{0.7, 2.0, 500.0}, std::tuple{2.0, 1.0, 100.0}}) {
    BeamStation s;
    s.at = at, s.mass_per_length = m, s.bending_stiffness_z = EI;
    link.beam->stations.push_back(s);
  }
  link.beam->damping_ratio = 0.02;
  link.mass = 0.7 * 2.5 + 1.3 * 1.5;
  const double first = 0.7 * 0.7 / 6 * (3 + 2 * 2) + 1.3 * 1.5 * 0.7 + 1.3 * 1.3 / 6 * (2 + 2 * 1);
  link.com = {first / link.mass, 0, 0};
  const Beam beam(link);
  EXPECT_NEAR(beam.mass(), link.mass, 1e-14);
  EXPECT_NEAR(beam.com()[0], first / link.mass, 1e-14);
  link.inertia = beam.inertia().rotational_about_com();
  const auto modes = modes_of(link);
  EXPECT_NEAR(modes[0].damping_ratio, 0.02, 2e-5);  // measured 2e-6, of Stodola's midpoints
  RigidBodyInertiad sum{0, Vector3d::zero(), Symmetric3d::zero()};
  for (int piece = 0; piece <= beam.hinges(); ++piece) {
    Posed X = Posed::identity();
    X.p = beam.origin(piece);
    sum += X * beam.piece_inertia(piece);
  }
  EXPECT_NEAR(sum.mass, link.mass, 1e-13);
  EXPECT_NEAR(sum.rotational_about_com().zz, link.inertia.zz, 1e-13);
  EXPECT_NEAR(sum.com()[0], link.com[0], 1e-13);
}

// Equal stations: same result as without stations.
TEST(TaperedBeam, EqualSectionsAreUniform) {
  const BeamSection tube = round(0.08, 0.003);
  BodyDescription link = tapered(2.5, tube, tube, 5);
  link.beam->damping_ratio = 0.03;
  const auto by_stations = modes_of(link);
  link.beam->stations.clear(), link.beam->section = tube;
  const auto by_section = modes_of(link);
  link.beam->section.reset(), link.beam->material.reset();
  const BeamProperties p = section_properties(tube, kAluminium);
  link.beam->bending_stiffness_y = p.bending_stiffness_y, link.beam->bending_stiffness_z = p.bending_stiffness_z;
  link.beam->torsional_stiffness = p.torsional_stiffness, link.beam->rotary_inertia = p.rotary_inertia;
  const auto by_numbers = modes_of(link);
  ASSERT_EQ(by_stations.size(), 30u);  // two bending directions and torsion, at ten places
  ASSERT_EQ(by_numbers.size(), 30u);
  for (std::size_t i = 0; i < 30; ++i) {
    EXPECT_NEAR(by_section[i].frequency / by_numbers[i].frequency, 1, 1e-12);
    EXPECT_NEAR(by_stations[i].frequency / by_numbers[i].frequency, 1, 1e-12);
    EXPECT_NEAR(by_stations[i].damping_ratio / by_numbers[i].damping_ratio, 1, 2e-4);  // Stodola's midpoints
  }
}

TEST(TaperedBeam, RejectsInvalidBeams) {
  const auto fault = [](auto change) {
    BodyDescription link = tapered(2, round(0.04), round(0.02), 4);
    change(*link.beam);
    return beam_fault(link);
  };
  EXPECT_EQ(fault([](BeamDescription&) {}), "");
  EXPECT_THAT(fault([](BeamDescription& b) { b.material.reset(); }), HasSubstr("a section needs a material"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations.clear(); }), HasSubstr("a material needs a section"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.section = round(0.1); }), HasSubstr("not by both"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.bending_stiffness_y = 3; }), HasSubstr("follows from the section"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations.pop_back(); }), HasSubstr("at both of its ends"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[1].at = 1.9; }), HasSubstr("the last at the beam's end, 2 m"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[1].at = 0; }), HasSubstr("must be in order"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[1].section = flat(0.1, 0.1); }), HasSubstr("same kind"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[1].section->wall_thickness = 0.01; }),
              HasSubstr("fills the section"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[0].section->width = 0.01; }),
              HasSubstr("a diameter, or a width"));
  EXPECT_THAT(fault([](BeamDescription& b) { b.stations[0].section.reset(); }),
              HasSubstr("every station states a section"));
  EXPECT_THAT(fault([](BeamDescription& b) {
                b.material.reset(), b.stations[0].section.reset(), b.stations[1].section.reset();
                b.stations[0].bending_stiffness_y = 2;
              }),
              HasSubstr("station 2, at 2 m: either every station states bending_stiffness_y or none does"));
}

}  // namespace tapered_beam_test
}  // namespace grapnel::testing
