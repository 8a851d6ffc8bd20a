/// CalculiX: a panel of solid elements, clamped, and free together with a base; compared with the modes from the
/// matrices that CalculiX stores.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>

#include "finite_elements/frame_model.hpp"
#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/import/component_modes.hpp"

namespace grapnel::testing {
namespace calculix_test {

// A plate of 20-node bricks with reduced integration, starting at x = `begin`: [m, kg, s].
constexpr double kWidth = 0.6, kThickness = 0.03, kLength = 2, kBase = 0.5;
constexpr int kAlong = 10, kAcross = 3, kBaseAlong = 3;

class Mesh {
 public:
  explicit Mesh(bool with_base) : first_(with_base ? -2 * kBaseAlong : 0) {}

  // A node of the grid of half elements, created on first use.
  int node(int i, int j, int k) {
    const auto [at, is_new] = nodes_.emplace(std::array{i, j, k}, static_cast<int>(nodes_.size()) + 1);
    return at->second;
  }
  static std::array<double, 3> place(const std::array<int, 3>& at) {
    return {at[0] * (at[0] < 0 ? kBase / (2 * kBaseAlong) : kLength / (2 * kAlong)), at[1] * kWidth / (2 * kAcross),
            at[2] * kThickness / 2};
  }
  // The deck: nodes, elements, materials.
  std::string deck() {
    std::string panel, base;
    int number = 0;
    static constexpr int kCorners[20][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}, {0, 0, 2}, {2, 0, 2}, {2, 2, 2},
                                            {0, 2, 2}, {1, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 1, 0}, {1, 0, 2}, {2, 1, 2},
                                            {1, 2, 2}, {0, 1, 2}, {0, 0, 1}, {2, 0, 1}, {2, 2, 1}, {0, 2, 1}};
    for (int i = first_; i < 2 * kAlong; i += 2) {
      for (int j = 0; j < 2 * kAcross; j += 2) {
        std::string& element = i < 0 ? base : panel;
        element += std::to_string(++number);
        for (int c = 0; c < 20; ++c)
          element +=
              fmt::format(",{}{}", c == 10 ? "\n" : "", node(i + kCorners[c][0], j + kCorners[c][1], kCorners[c][2]));
        element += "\n";
      }
    }
    std::string text = "*NODE,NSET=ALL\n";
    for (const auto& [at, n] : nodes_) {
      const auto p = place(at);
      text += fmt::format("{},{},{},{}\n", n, p[0], p[1], p[2]);
    }
    text += "*ELEMENT,TYPE=C3D20R,ELSET=PANEL\n" + panel;
    text += "*MATERIAL,NAME=ALUMINIUM\n*ELASTIC\n7e10,0.33\n*DENSITY\n2700\n";
    text += "*SOLID SECTION,ELSET=PANEL,MATERIAL=ALUMINIUM\n";
    if (base.empty()) return text;
    // Nearly rigid, with ten times the density.
    return text + "*ELEMENT,TYPE=C3D20R,ELSET=BASE\n" + base +
           "*MATERIAL,NAME=STIFF\n*ELASTIC\n7e15,0.33\n*DENSITY\n27000\n*SOLID SECTION,ELSET=BASE,MATERIAL=STIFF\n";
  }
  // The nodes of the face at x = 0.
  std::map<std::array<int, 3>, int> face() const {
    std::map<std::array<int, 3>, int> found;
    for (const auto& [at, n] : nodes_) {
      if (at[0] == 0) found.emplace(at, n);
    }
    return found;
  }

 private:
  int first_;
  std::map<std::array<int, 3>, int> nodes_;
};

// All frequencies computed by CalculiX [Hz].
std::vector<double> run(const TemporaryFolder& folder, const std::string& name, const std::string& deck) {
  write_text(folder / (name + ".inp"), deck);
  const std::string command =
      fmt::format("cd '{}' && '{}' {} > {}.log 2>&1", (folder / "").string(), GRAPNEL_CALCULIX, name, name);
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  std::ifstream file(folder / (name + ".dat"));
  std::vector<double> frequencies;
  bool begun = false;
  for (std::string line; std::getline(file, line);) {
    if (line.find("E I G E N V A L U E   O U T P U T") != std::string::npos) begun = true;
    if (line.find("P A R T I C I P A T I O N") != std::string::npos) break;
    std::istringstream words(line);
    int mode = 0;
    double eigenvalue = 0, radians = 0, hertz = 0;
    if (begun && words >> mode >> eigenvalue >> radians >> hertz) frequencies.push_back(hertz);
  }
  return frequencies;
}

TEST(CalculiX, PanelAloneAndWithBase) {
  const TemporaryFolder folder;
  Mesh panel(false);
  const std::string deck = panel.deck();
  run(folder, "panel", deck + "*STEP\n*FREQUENCY,SOLVER=MATRIXSTORAGE\n1\n*END STEP\n");
  std::string clamped = deck + "*NSET,NSET=FACE\n", nodes;
  for (const auto& [at, n] : panel.face()) {
    const auto p = Mesh::place(at);
    clamped += fmt::format("{}\n", n);
    nodes += fmt::format("{}, {}, {}, {}\n", n, p[0], p[1] - kWidth / 2, p[2] - kThickness / 2);
  }
  const std::vector<double> fixed =
      run(folder, "clamped", clamped + "*BOUNDARY\nFACE,1,3\n*STEP\n*FREQUENCY\n8\n*END STEP\n");
  ASSERT_EQ(fixed.size(), 8u);

  FaultList faults;
  auto mass = read_element_matrix(folder / "panel.mas", "", 'M', faults);
  auto stiffness = read_element_matrix(folder / "panel.sti", "", 'K', faults);
  write_text(folder / "face.csv", nodes);
  ElementInterface face;
  face.nodes = read_node_places(folder / "face.csv", faults);
  ASSERT_TRUE(mass && stiffness) << faults.all()[0].text();
  ComponentModeSettings settings;
  settings.modes = 40, settings.below = 1e6;
  const auto modes = component_modes(std::move(*mass), std::move(*stiffness), face, {}, settings, faults);
  ASSERT_TRUE(modes) << faults.all()[0].text();
  EXPECT_NEAR(modes->mass, 2700 * kLength * kWidth * kThickness, 1e-4);
  EXPECT_LT(norm(modes->com - Vector3d{kLength / 2, 0, 0}), 1e-5);  // 14 digits are printed
  std::size_t k = 0;                                                // index of a participating mode
  for (const double f : fixed) {
    if (k < modes->modes.size() && std::abs(modes->modes[k].frequency / f - 1) < 1e-3) {
      EXPECT_NEAR(modes->modes[k].frequency, f, 2e-6 * f);
      ++k;
    }
  }
  EXPECT_GE(k, 7u);  // by symmetry of the plate, one mode may have no participation

  // Free, with a base: CalculiX computes the whole system; its six lowest frequencies are zero.
  Mesh whole(true);
  const std::vector<double> free = run(folder, "whole", whole.deck() + "*STEP\n*FREQUENCY\n12\n*END STEP\n");
  ASSERT_EQ(free.size(), 12u);
  const double base_mass = 27000 * kBase * kWidth * kThickness;
  RobotSetup robot = only_base(base_mass, 1);
  robot.bodies[0].inertia = Symmetric3d::diagonal(base_mass / 12 * (kWidth * kWidth + kThickness * kThickness),
                                                  base_mass / 12 * (kBase * kBase + kThickness * kThickness),
                                                  base_mass / 12 * (kBase * kBase + kWidth * kWidth));
  BodyDescription body;
  body.name = "panel", body.parent = "base", body.joint.name = "mount", body.X_PF.p = {kBase / 2, 0, 0};
  body.mass = modes->mass, body.com = modes->com, body.inertia = modes->inertia, body.modes = modes->modes;
  ASSERT_EQ(modes_fault(body), "");
  robot.bodies.push_back(body);
  const Model model = model_of(robot);
  const auto vibrations = elastic_modes(model, zero_state(model), {});
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(vibrations[i].frequency, free[i + 6], 2e-4 * free[i + 6]) << i;
}

// --- Shells and beams, which CalculiX expands to solids ---

struct Reduced {
  std::optional<ComponentModes> modes;
  std::string fault;
};

// The model of the deck NAME, constrained at `nodes`, lines NODE, X, Y, Z.
Reduced reduce(const TemporaryFolder& folder, const std::string& name, const std::string& nodes,
               const std::string& others = {}) {
  FaultList faults;
  auto mass = read_element_matrix(folder / (name + ".mas"), "", 'M', faults);
  auto stiffness = read_element_matrix(folder / (name + ".sti"), "", 'K', faults);
  write_text(folder / "tied.csv", nodes);
  write_text(folder / "others.csv", others);
  ElementInterface tied;
  tied.nodes = read_node_places(folder / "tied.csv", faults);
  if (!others.empty()) tied.others = read_node_places(folder / "others.csv", faults);
  ComponentModeSettings settings;
  settings.modes = 12, settings.below = 1e6;
  Reduced result;
  if (faults.empty())
    result.modes = component_modes(std::move(*mass), std::move(*stiffness), tied, {}, settings, faults);
  if (!faults.empty()) result.fault = faults.all()[0].text();
  return result;
}

TEST(CalculiX, ExpandedShells) {
  // A plate of 8-node shells in the plane z = 0.2, 4 by 2 elements, constrained along x = 0: one straight line of
  // nodes.
  const TemporaryFolder folder;
  constexpr double kSide = 0.6, kDepth = 0.01, kHeight = 0.2;
  const auto number = [](int i, int j) { return 1 + i * 5 + j; };
  std::string nodes = "*NODE,NSET=ALL\n", elements = "*ELEMENT,TYPE=S8R,ELSET=PLATE\n", edge, tied;
  for (int i = 0; i <= 8; ++i) {
    for (int j = 0; j <= 4; ++j) {
      if (i % 2 == 1 && j % 2 == 1) continue;
      nodes += fmt::format("{},{},{},{}\n", number(i, j), i * 0.15, j * kSide / 4, kHeight);
      if (i == 0) tied += fmt::format("{},0,{},{}\n", number(i, j), j * kSide / 4, kHeight);
      if (i == 0) edge += fmt::format("{}\n", number(i, j));
    }
  }
  for (int i = 0; i < 8; i += 2) {
    for (int j = 0; j < 4; j += 2)
      elements += fmt::format("{},{},{},{},{},{},{},{},{}\n", 100 + i * 5 + j, number(i, j), number(i + 2, j),
                              number(i + 2, j + 2), number(i, j + 2), number(i + 1, j), number(i + 2, j + 1),
                              number(i + 1, j + 2), number(i, j + 1));
  }
  const std::string deck = nodes + elements +
                           fmt::format(
                               "*MATERIAL,NAME=A\n*ELASTIC\n7e10,0.33\n*DENSITY\n2700\n*SHELL "
                               "SECTION,ELSET=PLATE,MATERIAL=A\n{}\n*NSET,NSET=EDGE\n{}",
                               kDepth, edge);
  run(folder, "plate", deck + "*STEP\n*FREQUENCY,SOLVER=MATRIXSTORAGE\n1\n*END STEP\n");
  const auto clamped = run(folder, "clamped", deck + "*BOUNDARY\nEDGE,1,6\n*STEP\n*FREQUENCY\n6\n*END STEP\n");
  ASSERT_EQ(clamped.size(), 6u);
  const Reduced r = reduce(folder, "plate", tied);
  ASSERT_TRUE(r.modes) << r.fault;
  // A thin plate of solids is nearly singular: errors of 1e-5 in mass and lengths.
  EXPECT_NEAR(r.modes->mass, 2700 * 1.2 * kSide * kDepth, 1e-3);            // measured 2.4e-4
  EXPECT_LT(norm(r.modes->com - Vector3d{0.6, kSide / 2, kHeight}), 3e-5);  // measured 9e-6
  const double m = r.modes->mass;
  EXPECT_NEAR(r.modes->inertia.xx, m / 12 * (kSide * kSide + kDepth * kDepth), 5e-5 * m);  // measured 1.9e-6
  EXPECT_NEAR(r.modes->inertia.yy, m / 12 * (1.44 + kDepth * kDepth), 5e-5 * m);           // measured 1.2e-5
  EXPECT_NEAR(r.modes->inertia.zz, m / 12 * (1.44 + kSide * kSide), 5e-5 * m);             // measured 1.9e-5
  for (std::size_t k = 0; k < 6; ++k)
    EXPECT_NEAR(r.modes->modes[k].frequency, clamped[k], 1e-4 * clamped[k]) << k;  // measured 1.5e-5
  // One node does not determine the extent of the expanded solids, which leads to wrong node positions. A single node
  // of a plate would not constrain the plate either, since its solids are on a line.
  const std::string one = fmt::format("3,0,{},{}\n", kSide / 2, kHeight);
  EXPECT_NE(reduce(folder, "plate", one).fault.find("do not determine those of the expanded solids"),
            std::string::npos);
  EXPECT_NE(reduce(folder, "plate", "1,0,0,0\n2,0,0.15,0.03\n5,0,0.6,0\n").fault.find("do not match the matrices"),
            std::string::npos);
}

TEST(CalculiX, ExpandedBeams) {
  const TemporaryFolder folder;
  std::string deck = "*NODE,NSET=ALL\n";
  for (int i = 0; i <= 12; ++i) deck += fmt::format("{},{},0,0\n", i + 1, i * 0.1);
  deck += "*ELEMENT,TYPE=B32,ELSET=BEAM\n";
  for (int i = 0; i < 6; ++i) deck += fmt::format("{},{},{},{}\n", i + 1, 2 * i + 1, 2 * i + 2, 2 * i + 3);
  deck +=
      "*MATERIAL,NAME=A\n*ELASTIC\n7e10,0.33\n*DENSITY\n2700\n*BEAM "
      "SECTION,ELSET=BEAM,MATERIAL=A,SECTION=RECT\n0.05,0.03\n0,1,0\n";
  run(folder, "beam", deck + "*STEP\n*FREQUENCY,SOLVER=MATRIXSTORAGE\n1\n*END STEP\n");
  const auto clamped = run(folder, "clamped", deck + "*BOUNDARY\n1,1,6\n*STEP\n*FREQUENCY\n6\n*END STEP\n");
  const Reduced r = reduce(folder, "beam", "1,0,0,0\n", "13,1.2,0,0\n");
  ASSERT_TRUE(r.modes) << r.fault;
  const double m = 2700 * 1.2 * 0.05 * 0.03;
  EXPECT_NEAR(r.modes->mass, m, 1e-6);
  EXPECT_LT(norm(r.modes->com - Vector3d{0.6, 0, 0}), 1e-6);
  EXPECT_NEAR(r.modes->inertia.xx, m / 12 * (0.05 * 0.05 + 0.03 * 0.03), 1e-6 * m);
  EXPECT_NEAR(r.modes->inertia.yy, m / 12 * (1.44 + 0.03 * 0.03), 1e-5 * m);
  ASSERT_EQ(clamped.size(), 6u);
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(r.modes->modes[k].frequency, clamped[k], 1e-2 * clamped[k]) << k;
}

}  // namespace calculix_test
}  // namespace grapnel::testing
