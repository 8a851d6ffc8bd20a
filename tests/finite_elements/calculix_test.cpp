/// CalculiX: a panel of solid elements, clamped, and free together with a base; the same by the matrices that it
/// stores.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>

#include "finite_elements/frame_model.hpp"
#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/finite_elements/component_modes.hpp"

namespace grapnel::testing {
namespace calculix_test {

// A plate of 20-node bricks with reduced integration, from x = `begin` on: [m, kg, s].
constexpr double kWidth = 0.6, kThickness = 0.03, kLength = 2, kBase = 0.5;
constexpr int kAlong = 10, kAcross = 3, kBaseAlong = 3;

class Mesh {
 public:
  explicit Mesh(bool with_base) : first_(with_base ? -2 * kBaseAlong : 0) {}

  // A node of the grid of half elements, made when it is asked for.
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
    // Rigid, nearly, and of ten times the density.
    return text + "*ELEMENT,TYPE=C3D20R,ELSET=BASE\n" + base +
           "*MATERIAL,NAME=STIFF\n*ELASTIC\n7e15,0.33\n*DENSITY\n27000\n*SOLID SECTION,ELSET=BASE,MATERIAL=STIFF\n";
  }
  // Of the face at x = 0.
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

// Frequencies that CalculiX finds [Hz], all of them.
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

TEST(CalculiX, AgreesOnAPanelAloneAndWithABase) {
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
  std::size_t k = 0;                                                // of a mode that participates
  for (const double f : fixed) {
    if (k < modes->modes.size() && std::abs(modes->modes[k].frequency / f - 1) < 1e-3) {
      EXPECT_NEAR(modes->modes[k].frequency, f, 2e-6 * f);
      ++k;
    }
  }
  EXPECT_GE(k, 7u);  // the plate's symmetries may leave one without participation

  // Free, with a base: CalculiX's is the whole, and its six slowest frequencies are nothing.
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

}  // namespace calculix_test
}  // namespace grapnel::testing
