// Inertia from closed meshes: against formulas, and which meshes give none.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/import/mjcf_model.hpp"
#include "import/mjcf_files.hpp"
#include "support/eigen_values.hpp"

namespace grapnel {
namespace mjcf_mesh_test {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

struct Surface {
  std::vector<Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;

  void add_box(const Vector3d& center, const Vector3d& size) {
    const int v = static_cast<int>(vertices.size());
    for (int k = 0; k < 8; ++k)
      vertices.push_back(
          center + Vector3d{((k & 1) - 0.5) * size[0], ((k >> 1 & 1) - 0.5) * size[1], ((k >> 2 & 1) - 0.5) * size[2]});
    static constexpr int kQuads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                         {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : kQuads) {
      triangles.push_back({v + q[0], v + q[1], v + q[2]});
      triangles.push_back({v + q[0], v + q[2], v + q[3]});
    }
  }
  std::shared_ptr<const TriangleMesh> mesh() const { return make_triangle_mesh("mesh", vertices, triangles); }
};

Surface box() {
  Surface surface;
  surface.add_box({1, 2, 3}, {2, 3, 4});
  return surface;
}
Surface tetrahedron(double a, double b, double c) {
  return {{{0, 0, 0}, {a, 0, 0}, {0, b, 0}, {0, 0, c}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}
Surface two_boxes() {
  Surface surface;
  surface.add_box({-2, 0, 0}, {1, 1, 1});
  surface.add_box({2, 0, 0}, {1, 1, 1});
  return surface;
}

void expect_solid(const std::optional<MeshSolid>& solid, double volume, const Vector3d& com,
                  const Symmetric3d& inertia) {
  ASSERT_TRUE(solid.has_value());
  EXPECT_NEAR(solid->volume, volume, 1e-14 * volume);
  EXPECT_LT(norm(solid->com - com), 1e-14);
  EXPECT_LT((eigen(solid->inertia) - eigen(inertia)).norm(), 1e-14 * eigen(inertia).norm());
}

TEST(MeshSolid, OfABoxAndATetrahedron) {
  const Symmetric3d of_box = Symmetric3d::diagonal(50, 40, 26);  // 24 (9 + 16) / 12, ...
  expect_solid(solid_within(*box().mesh(), {1, 1, 1}), 24, {1, 2, 3}, of_box);
  EXPECT_TRUE(solid_within(*box().mesh(), {1, 1, 1})->is_star);
  // With the corner at 0 and edges a, b, c: centre (a, b, c) / 4, second moments about it 3/80 V a^2 and -1/80 V a b.
  const double a = 1, b = 2, c = 3, V = a * b * c / 6;
  const Symmetric3d of_tetrahedron{3 * V / 80 * (b * b + c * c),
                                   3 * V / 80 * (a * a + c * c),
                                   3 * V / 80 * (a * a + b * b),
                                   V / 80 * a * b,
                                   V / 80 * a * c,
                                   V / 80 * b * c};
  expect_solid(solid_within(*tetrahedron(a, b, c).mesh(), {1, 1, 1}), V, {a / 4, b / 4, c / 4}, of_tetrahedron);
  // The same scaled by axis, and as its own mirror image turned inside out.
  expect_solid(solid_within(*tetrahedron(10, 4, 1).mesh(), {0.1, 0.5, 3}), V, {a / 4, b / 4, c / 4}, of_tetrahedron);
  expect_solid(solid_within(*tetrahedron(-a, b, c).mesh(), {-1, 1, 1}), V, {a / 4, b / 4, c / 4}, of_tetrahedron);
  Surface inside_out = box();
  for (auto& t : inside_out.triangles) std::swap(t[1], t[2]);
  expect_solid(solid_within(*inside_out.mesh(), {1, 1, 1}), 24, {1, 2, 3}, of_box);
}

TEST(MeshSolid, OfPartsApartIsExactThoughNoStar) {
  const auto solid = solid_within(*two_boxes().mesh(), {1, 1, 1});
  expect_solid(solid, 2, {0, 0, 0}, Symmetric3d::diagonal(2.0 / 6, 2.0 / 6 + 8, 2.0 / 6 + 8));
  EXPECT_FALSE(solid->is_star);
}

TEST(MeshSolid, NeedsAClosedSurfaceOfOneSide) {
  Surface open = box(), turned = box(), twice = box();
  open.triangles.pop_back();
  EXPECT_FALSE(solid_within(*open.mesh(), {1, 1, 1}));
  std::swap(turned.triangles[0][0], turned.triangles[0][1]);
  EXPECT_FALSE(solid_within(*turned.mesh(), {1, 1, 1}));
  twice.triangles.push_back(twice.triangles[0]);
  EXPECT_FALSE(solid_within(*twice.mesh(), {1, 1, 1}));
  EXPECT_FALSE(solid_within(*box().mesh(), {1, 1, 0}));
}

// A base and an arm whose mass is that of a mesh with the density 10.
ReadMjcf read_arm(const Surface& surface, const std::string& compiler = "", const std::string& of_mesh = "") {
  const ModelFolder folder;
  const auto file = folder.write(
      "robot.xml", "<mujoco><compiler " + compiler + "/><asset><mesh file='m.stl' " + of_mesh +
                       "/></asset><worldbody><body name='bus'><freejoint/><geom size='1'/><body name='arm'>\n<joint/>"
                       "<geom type='mesh' mesh='m' density='10' pos='0 0 1'/></body></body></worldbody></mujoco>");
  const std::filesystem::path expected = folder.path() / "m.stl";
  return read_mjcf_at(file, [&](const std::filesystem::path& path, std::string& why_not) {
    EXPECT_EQ(path, expected);
    if (surface.triangles.empty()) why_not = "there is no such file";
    return surface.triangles.empty() ? nullptr : surface.mesh();
  });
}

TEST(MjcfMeshInertia, IsThatOfTheEnclosedVolume) {
  const ReadMjcf robot = read_arm(box(), "", "scale='1 2 0.5' refpos='0 0 1'");
  ASSERT_THAT(robot.faults, IsEmpty());
  const SourceInertia& inertia = *robot.link("arm").inertia;
  EXPECT_NEAR(inertia.mass, 240, 1e-12);
  EXPECT_LT(norm(inertia.com - Vector3d{1, 4, 2}), 1e-14);  // 0.5 (3 - 1) + 1
  EXPECT_NEAR(inertia.inertia.xx, 20 * (36 + 4), 1e-11);
}

TEST(MjcfMeshInertia, IsRefusedWhereMujocoHasAnother) {
  const auto fault = [](const std::string& words) {
    return ElementsAre(AllOf(HasSubstr("2:27: the inertia of body 'arm' would come from a mesh, "), HasSubstr(words)));
  };
  EXPECT_THAT(read_arm(two_boxes()).faults, fault("whose hollows count as mass in MuJoCo"));
  EXPECT_THAT(read_arm(two_boxes(), "exactmeshinertia='true'").faults, IsEmpty());
  EXPECT_THAT(read_arm(two_boxes(), "", "inertia='exact'").faults, IsEmpty());
  EXPECT_THAT(read_arm(box(), "", "inertia='shell'").faults, fault("as of inertia=\"shell\", which is not supported"));
  Surface open = box();
  open.triangles.pop_back();
  EXPECT_THAT(read_arm(open).faults, fault("whose triangles do not close a volume"));
  EXPECT_THAT(read_arm({}).faults, fault("but there is no such file"));
}

}  // namespace mjcf_mesh_test
}  // namespace grapnel
