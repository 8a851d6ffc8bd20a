/// Modes of vibration from finite-element matrices: against closed forms, and together with a base against the matrices
/// of the whole.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "finite_elements/frame_model.hpp"
#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/import/component_modes.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel::testing {
namespace component_modes_test {

using Eigen::MatrixXd;
using ::testing::HasSubstr;

constexpr double kTwoPi = 2 * std::numbers::pi;

ElementInterface at_node(long long node) {
  ElementInterface interface;
  interface.node = node;
  return interface;
}

ComponentModeSettings settings(int modes, double below = 1e9, double damping = 0) {
  ComponentModeSettings s;
  s.modes = modes, s.below = below, s.damping_ratio = damping;
  return s;
}

ComponentModes modes_of(const FrameModel& model, const ComponentModeSettings& s, const ElementUnits& units = {}) {
  FaultList faults;
  auto result = component_modes(model.mass(), model.stiffness(), at_node(101), units, s, faults);
  for (const Fault& fault : faults.all()) ADD_FAILURE() << fault.text();
  return result.value_or(ComponentModes());
}

BodyDescription panel_of(const ComponentModes& modes) {
  BodyDescription panel;
  panel.name = "panel", panel.parent = "base", panel.joint.name = "mount";
  panel.mass = modes.mass, panel.com = modes.com, panel.inertia = modes.inertia, panel.modes = modes.modes;
  return panel;
}

std::string fault_of(const FrameModel& model, const ElementInterface& interface, int modes = 5) {
  FaultList faults;
  EXPECT_FALSE(component_modes(model.mass(), model.stiffness(), interface, {}, settings(modes), faults));
  return faults.empty() ? std::string() : faults.all()[0].message;
}

TEST(ComponentModes, ClampedBeam) {
  const double length = 3;
  const FrameSection section;
  // 40 elements use dense matrices; 150 elements, with 900 degrees of freedom, use sparse ones.
  for (const int elements : {40, 150}) {
    const ComponentModes r = modes_of(straight_beam(length, elements), settings(8, 1e9, 0.01));
    EXPECT_NEAR(r.mass, 6, 1e-7);
    EXPECT_NEAR(r.com[0], 1.5, 1e-7);
    EXPECT_NEAR(r.inertia.yy, 6 * 9.0 / 12, 1e-6);
    EXPECT_NEAR(r.inertia.xx, 0.003 * 3, 1e-9);
    EXPECT_EQ(r.degrees_of_freedom, 6 * (elements + 1));
    EXPECT_LT(r.grounding, 1e-3);
    const auto omega = [&](double a, double EI) { return a * a / (length * length) * std::sqrt(EI / 2); };
    ASSERT_EQ(r.modes.size(), 8u);
    const double a = 1.8751040687, b = 4.6940911330;
    EXPECT_NEAR(kTwoPi * r.modes[0].frequency, omega(a, section.EIz), 1e-6 * omega(a, section.EIz));
    EXPECT_NEAR(kTwoPi * r.modes[1].frequency, omega(a, section.EIy), 1e-6 * omega(a, section.EIy));
    EXPECT_NEAR(kTwoPi * r.modes[2].frequency, omega(b, section.EIz), 2e-6 * omega(b, section.EIz));
    EXPECT_NEAR(kTwoPi * r.modes[3].frequency, omega(b, section.EIy), 2e-6 * omega(b, section.EIy));
    // 61.3 % of the mass; the share 4 / a^4 of m L^2.
    EXPECT_NEAR(r.modes[0].translation[1] * r.modes[0].translation[1], 0.613077 * 6, 1e-5);
    EXPECT_NEAR(r.modes[0].rotation[2] * r.modes[0].rotation[2], 4 / std::pow(a, 4) * 6 * 9, 1e-4);
    EXPECT_GT(r.modes[0].translation[1] * r.modes[0].rotation[2], 0);
    EXPECT_LT(r.modes[1].translation[2] * r.modes[1].rotation[1], 0);
    EXPECT_EQ(r.modes[0].damping_ratio, 0.01);
    ASSERT_TRUE(r.next.has_value());
    EXPECT_GT(*r.next, r.modes.back().frequency);
  }
}

// With all its modes the mast is equivalent to its matrices. Attached to a base, both free, it has the frequencies of
// the matrices with the base's inertia added. The base's frame has another origin and orientation.
TEST(ComponentModes, WithBaseEqualWholeModel) {
  const FrameModel mast = bent_mast(6);
  const ComponentModes all = modes_of(mast, settings(1000));
  EXPECT_EQ(all.modes.size() + static_cast<std::size_t>(all.without_participation), 72u);
  RobotSetup robot = only_base(40, 1);
  robot.bodies[0].inertia = {6, 9, 7, 0.4, -0.3, 0.2};
  BodyDescription panel = panel_of(all);
  panel.X_PF = {rotation_about({0.6, 0, 0.8}, 0.7), {0.4, -0.3, 0.6}};
  EXPECT_EQ(modes_fault(panel), "");
  const auto frequencies = [&](const BodyDescription& body) {
    robot.bodies.resize(1);
    robot.bodies.push_back(body);
    const Model model = model_of(robot);
    std::vector<double> f;
    for (const ElasticMode& mode : elastic_modes(model, zero_state(model), {})) f.push_back(mode.frequency);
    return f;
  };
  const std::vector<double> found = frequencies(panel);

  // The inertia of the base about the mast's root, in the mast's axes, [translation; rotation].
  const Posed X_PF = panel.X_PF;
  const RigidBodyInertiad base =
      inverse(X_PF) * RigidBodyInertiad::about_com(40, Vector3d::zero(), robot.bodies[0].inertia);
  MatrixXd M = mast.M;
  const Vector3d& h = base.first_moment;
  const double cross[3][3] = {{0, -h[2], h[1]}, {h[2], 0, -h[0]}, {-h[1], h[0], 0}};
  for (int i = 0; i < 3; ++i) {
    M(i, i) += base.mass;
    for (int j = 0; j < 3; ++j)
      M(3 + i, 3 + j) += base.rotational(i, j), M(3 + i, j) += cross[i][j], M(j, 3 + i) += cross[i][j];
  }
  const Eigen::MatrixXd L = Cholesky(M).matrixL();
  const MatrixXd half = L.triangularView<Eigen::Lower>().solve(mast.K);
  const MatrixXd A = L.triangularView<Eigen::Lower>().solve(MatrixXd(half.transpose()));
  const Eigen::SelfAdjointEigenSolver<MatrixXd> whole(MatrixXd(0.5 * (A + A.transpose())));
  ASSERT_EQ(found.size(), all.modes.size());
  for (std::size_t k = 0; k < 30; ++k) {
    const double exact = std::sqrt(whole.eigenvalues()[static_cast<Eigen::Index>(k) + 6]) / kTwoPi;
    EXPECT_NEAR(found[k], exact, 1e-8 * exact) << k;
  }
  // Ten modes suffice for the lowest frequencies.
  const std::vector<double> some = frequencies([&] {
    BodyDescription p = panel_of(modes_of(mast, settings(10)));
    p.X_PF = panel.X_PF;
    return p;
  }());
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(some[k], found[k], 2e-3 * found[k]) << k;
}

TEST(ComponentModes, IndependentOfUnits) {
  const FrameModel model = bent_mast(4);
  const ComponentModes si = modes_of(model, settings(6));
  // Millimetres and tonnes: rows of rotations in t mm^2, stiffness in N/mm, N and N mm.
  FrameModel small = model;
  for (int r = 0; r < small.M.rows(); ++r) {
    for (int c = 0; c < small.M.cols(); ++c) {
      const double scale = 1e-3 * (r % 6 < 3 ? 1 : 1e3) * (c % 6 < 3 ? 1 : 1e3);
      small.M(r, c) *= scale, small.K(r, c) *= scale;
    }
  }
  const ComponentModes mm = modes_of(small, settings(6), {0.001, 1000});
  EXPECT_NEAR(mm.mass, si.mass, 1e-9);
  EXPECT_LT(norm(mm.com - si.com), 1e-9);
  EXPECT_NEAR(mm.inertia.zz, si.inertia.zz, 1e-8);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(mm.modes[k].frequency, si.modes[k].frequency, 1e-7);
    EXPECT_LT(norm(mm.modes[k].translation - si.modes[k].translation), 1e-6);
    EXPECT_LT(norm(mm.modes[k].rotation - si.modes[k].rotation), 1e-6);
  }
}

// A rigidly connected face of nodes is equivalent to one node with rotations, at the stated frame.
TEST(ComponentModes, RigidInterfaceNodes) {
  FrameModel model = bent_mast(4);
  // Three stiff arms at the root, whose ends are the interface: the root moves with them.
  const std::vector<Eigen::Vector3d> ends{{0, 0.1, 0}, {0, -0.1, 0}, {0, 0, 0.1}};
  std::vector<Eigen::Vector3d> places = model.nodes;
  places.insert(places.end(), ends.begin(), ends.end());
  FrameModel with_arms(places);
  const auto n = model.M.rows();
  with_arms.M.topLeftCorner(n, n) = model.M, with_arms.K.topLeftCorner(n, n) = model.K;
  FrameSection stiff;
  stiff.EA = 1e11, stiff.EIy = stiff.EIz = stiff.GJ = 1e9, stiff.mass_per_length = 1e-6, stiff.polar = 1e-9;
  for (int k = 0; k < 3; ++k) with_arms.add_beam(0, static_cast<int>(model.nodes.size()) + k, stiff);
  ElementInterface tied;
  for (std::size_t k = 0; k < 3; ++k) {
    const Eigen::Vector3d& p = ends[k];
    tied.nodes.push_back({101 + static_cast<long long>(model.nodes.size() + k), p[0], p[1], p[2], {}});
  }
  FaultList faults;
  const auto r = component_modes(with_arms.mass(), with_arms.stiffness(), tied, {}, settings(4), faults);
  ASSERT_TRUE(r.has_value()) << faults.all()[0].text();
  const ComponentModes direct = modes_of(model, settings(4));
  EXPECT_NEAR(r->mass, direct.mass, 1e-5);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(r->modes[k].frequency, direct.modes[k].frequency, 1e-4 * direct.modes[k].frequency);
    EXPECT_LT(norm(r->modes[k].rotation - direct.modes[k].rotation), 1e-3 * norm(direct.modes[k].rotation));
  }
  // Nodes without rotations on one line do not constrain the rotation about it.
  auto mass = with_arms.mass();
  const auto drop_rotations = [](ElementMatrix m) {
    Eigen::MatrixXd dense(m.A);
    std::vector<ElementDof> dofs;
    std::vector<int> retained;
    for (std::size_t i = 0; i < m.dofs.size(); ++i) {
      if (m.dofs[i].component <= 3) retained.push_back(static_cast<int>(i)), dofs.push_back(m.dofs[i]);
    }
    Eigen::MatrixXd part(retained.size(), retained.size());
    for (std::size_t i = 0; i < retained.size(); ++i) {
      for (std::size_t j = 0; j < retained.size(); ++j)
        part(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = dense(retained[i], retained[j]);
    }
    return ElementMatrix{m.name, part.sparseView(), dofs};
  };
  tied.nodes.pop_back();
  EXPECT_FALSE(
      component_modes(drop_rotations(mass), drop_rotations(with_arms.stiffness()), tied, {}, settings(4), faults));
  EXPECT_THAT(faults.all().back().message, HasSubstr("three nodes that are not on one line"));
}

// Nastran may express displacements along the axes of other coordinate systems; only the interface nodes must use the
// model's.
TEST(ComponentModes, NameRotatedNodesOfTheInterface) {
  const FrameModel model = bent_mast(2);
  TemporaryFolder folder;
  const auto fault = [&](const std::string& grids) {
    write_text(folder / "m.bdf", grids + dmig("MAAX", model.M, DmigFields::free) +
                                     dmig("KAAX", 0.5 * (model.K + model.K.transpose()), DmigFields::free));
    FaultList faults;
    auto mass = read_element_matrix(folder / "m.bdf", "", 'M', faults),
         stiffness = read_element_matrix(folder / "m.bdf", "", 'K', faults);
    EXPECT_TRUE(mass && stiffness);
    if (component_modes(std::move(*mass), std::move(*stiffness), at_node(101), {}, settings(3), faults))
      return std::string();
    return faults.all().back().message;
  };
  EXPECT_EQ(fault(""), "");
  EXPECT_EQ(fault("GRID,101,5,0.,0.,0.,0\nGRID,102,,1.,0.,0.,7\n"), "");  // CD of another node; CP has no effect
  EXPECT_THAT(fault("GRID,101,,0.,0.,0.,7\n"), HasSubstr("node 101 has displacements in coordinate system 7"));
  EXPECT_THAT(fault("GRID         101              0.      0.      0.       7\n"), HasSubstr("coordinate system 7"));
  EXPECT_THAT(fault("GRID*                101                              0.              0.\n"
                    "*                     0.               7\n"),
              HasSubstr("coordinate system 7"));
  EXPECT_THAT(fault("GRDSET,,,,,,3\nGRID,101,,0.,0.,0.\n"), HasSubstr("coordinate system 3"));
  EXPECT_EQ(fault("GRDSET,,,,,,3\nGRID,101,,0.,0.,0.,0\n"), "");
}

TEST(ComponentModes, ReportErrors) {
  const FrameModel good = bent_mast(3);
  EXPECT_THAT(fault_of(good, at_node(99)), HasSubstr("node 99, is not in the matrices; their nodes are 101, 102"));
  EXPECT_THAT(fault_of(good, {}), HasSubstr("the interface is missing"));
  ElementInterface rows;
  rows.rows = {0, 1, 2, 3, 4, 5};
  EXPECT_THAT(fault_of(good, rows), HasSubstr("state the interface by nodes"));
  ElementInterface nodes;
  nodes.nodes = {{101, 0, 0, 0, {}}, {7, 1, 0, 0, {}}};
  EXPECT_THAT(fault_of(good, nodes), HasSubstr("node 7 is not in the matrices"));

  FrameModel held = good;  // a spring to the ground
  held.K(20, 20) += 100;
  EXPECT_THAT(fault_of(held, at_node(101)), HasSubstr("has supports besides the interface"));
  FrameModel apart(good.nodes);  // the arm is disconnected
  for (int i = 0; i < 6; ++i) {
    if (i != 3) apart.add_beam(i, i + 1, {});
  }
  EXPECT_THAT(fault_of(apart, at_node(101)), HasSubstr("can move without stiffness"));
  FrameModel soft = good;  // indefinite
  soft.K(13, 13) -= 1e6;
  EXPECT_THAT(fault_of(soft, at_node(101)), HasSubstr("can move without stiffness, for example at node"));
  FrameModel light = good;
  light.M(14, 14) -= 5;
  EXPECT_THAT(fault_of(light, at_node(101)), HasSubstr("mass"));
  FrameModel unequal = good;  // more mass along x than along y
  for (int i = 0; i < unequal.M.rows(); i += 6) unequal.M(i, i) *= 1.5;
  EXPECT_THAT(fault_of(unequal, at_node(101)), HasSubstr("equal in all directions"));
}

}  // namespace component_modes_test
}  // namespace grapnel::testing
