// Contact detection and force: 20 watched pairs, of which none or four touch, to compare with forward dynamics of robot
// (b); and single pairs that touch. Poses change from one evaluation to the next.
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "bench/dynamics_bench.hpp"
#include "grapnel/contact/contact_set.hpp"
#include "grapnel/dynamics/kinematics.hpp"

namespace grapnel::bench {
namespace {

using Shape = Geometry::Shape;

ContactShape shape(Shape kind, const Vector3d& size) {
  Geometry g;
  g.shape = kind, g.size = size;
  return ContactShape(g);
}
// 1,000 points spread on a sphere of 0.1 m.
ContactShape round_hull() {
  std::vector<Vector3d> points;
  for (int i = 0; i < 1000; ++i) {
    const double z = 1 - (2 * i + 1.0) / 1000, r = 0.1 * std::sqrt(1 - z * z), angle = 2.399963229728653 * i;
    points.push_back({r * std::cos(angle), r * std::sin(angle), 0.1 * z});
  }
  Geometry g;
  g.shape = Shape::mesh, g.size = {1, 1, 1};
  g.mesh = make_triangle_mesh("points", points, {{0, 1, 2}});
  return ContactShape(g);
}

struct Scene {
  std::vector<ContactSurface> surfaces;
  std::vector<SurfacePair> pairs;
  Kinematics kinematics, moved;  // two states between which the benchmarks alternate

  // The second one of the pair at a distance along x from the first, slightly turned about x.
  void add(const ContactShape& a, const ContactShape& b, double distance) {
    ContactMaterial m;
    m.modulus = 1e8, m.dissipation = 0.1, m.static_friction = 0.4, m.kinetic_friction = 0.3;
    const int i = static_cast<int>(surfaces.size());
    const Vector3d p{0, static_cast<double>(i), 0};
    surfaces.push_back({i, a}), surfaces.push_back({i + 1, b});
    pairs.push_back({i, i + 1, combine(m, m)});
    kinematics.X_WB.push_back({Rotationd::identity(), p});
    kinematics.X_WB.push_back({rotation_about({1, 0, 0}, 0.2), p + Vector3d{distance, 0, 0}});
    kinematics.V_WB.push_back({{0.1, 0.2, 0.3}, {0.01, 0.02, 0.03}});
    kinematics.V_WB.push_back({{0.3, 0.2, 0.1}, {0.03, 0.01, 0.02}});
    moved = kinematics;
    for (Posed& X : moved.X_WB) X = X * Posed{rotation_about({0.6, 0, 0.8}, 1e-5), {1e-6, 2e-6, -1e-6}};
  }
};

void add(const char* name, const Scene& scene) {
  benchmark::RegisterBenchmark(name, [scene](benchmark::State& loop) {
    ContactSet set(scene.surfaces, scene.pairs, 1);
    set.begin(0, scene.kinematics);
    std::vector<ExternalWrench> wrenches;
    wrenches.reserve(2 * set.size());
    bool moved = false;
    for (auto _ : loop) {
      moved = !moved;
      const Kinematics& kinematics = moved ? scene.moved : scene.kinematics;
      wrenches.clear();
      benchmark::DoNotOptimize(set.margin(0, kinematics));
      set.evaluate(kinematics, wrenches);
      benchmark::DoNotOptimize(wrenches.data());
      benchmark::ClobberMemory();
    }
  });
}

}  // namespace

void register_contact() {
  const ContactShape ball = shape(Shape::sphere, {0.1, 0, 0}), box = shape(Shape::box, {0.2, 0.2, 0.2});
  const ContactShape capsule = shape(Shape::capsule, {0.1, 0.3, 0}), cylinder = shape(Shape::cylinder, {0.1, 0.3, 0});
  const ContactShape hull = round_hull();
  // Solid towards +x.
  const ContactShape plane =
      ContactShape::half_space({rotation_about({0, 1, 0}, -0.5 * std::numbers::pi), Vector3d::zero()});
  const auto pair = [](const ContactShape& a, const ContactShape& b, double distance) {
    Scene scene;
    scene.add(a, b, distance);
    return scene;
  };
  add("contact/sphere_plane", pair(ball, plane, 0.0999));
  add("contact/capsule_capsule", pair(capsule, capsule, 0.1999));
  add("contact/capsule_box", pair(capsule, box, 0.1999));
  add("contact/cylinder_plane", pair(cylinder, plane, 0.0999));
  add("contact/box_plane", pair(box, plane, 0.0999));
  add("contact/box_box", pair(box, box, 0.1999));
  // The hulls are inside of their sphere; they overlap at these distances.
  add("contact/hull1000_plane", pair(hull, plane, 0.0995));
  add("contact/hull1000_hull1000", pair(hull, hull, 0.1985));
  for (const bool four_touch : {false, true}) {
    Scene scene;
    const auto distance = [&](double touching) { return four_touch ? touching : 0.5; };
    scene.add(ball, capsule, distance(0.1999)), scene.add(capsule, capsule, distance(0.1999));
    scene.add(capsule, box, distance(0.1999)), scene.add(box, box, distance(0.1999));
    for (int i = 0; i < 8; ++i) scene.add(capsule, box, 0.8), scene.add(capsule, capsule, 0.7);
    add(four_touch ? "contact20/four_touch" : "contact20/apart", scene);
  }
}

}  // namespace grapnel::bench
