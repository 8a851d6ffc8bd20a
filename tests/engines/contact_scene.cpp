#include "engines/contact_scene.hpp"

#include <algorithm>
#include <numbers>

namespace grapnel::testing {
namespace {

using Shape = Geometry::Shape;

Geometry shape(Shape kind, const Vector3d& size, const Posed& X_BG = Posed::identity()) {
  Geometry g;
  g.shape = kind, g.size = size, g.X_BG = X_BG;
  return g;
}

BodyDescription free_body(const std::string& name, double mass, const Vector3d& moments) {
  BodyDescription d;
  d.name = name, d.mass = mass, d.inertia = Symmetric3d::diagonal(moments[0], moments[1], moments[2]);
  d.joint.type = JointType::free, d.joint.name = name + "_root";
  return d;
}

// A link of 0.5 m along x, with an elastic joint.
BodyDescription link(const std::string& name, const std::string& parent, const Vector3d& at, const Vector3d& axis) {
  BodyDescription d = free_body(name, 2, {0.01, 0.05, 0.05});
  d.parent = parent, d.X_PF.p = at, d.com = {0.25, 0, 0};
  d.joint.type = JointType::revolute, d.joint.axis = axis;
  d.joint.spring = JointSpring{6, 0.3, 0};
  return d;
}

// An irregular hull of about 0.2 m.
Geometry hull() {
  const std::vector<Vector3d> points = {{0.21, 0.01, 0.02},  {-0.19, 0.03, -0.02}, {0.02, 0.18, 0.01},
                                        {-0.02, -0.2, 0.03}, {0.01, 0.02, 0.22},   {0.03, -0.01, -0.2},
                                        {0.14, 0.12, 0.1},   {-0.12, -0.13, -0.1}};
  Geometry g = shape(Shape::mesh, {1, 1, 1});
  g.mesh = make_triangle_mesh("rock", points, {{0, 1, 2}});
  return g;
}

ContactLaw law(bool hertz, double elastic, double dissipation) {
  ContactMaterial m;
  if (hertz)
    m.modulus = 2 * elastic;
  else
    m.stiffness = 2 * elastic;
  m.dissipation = dissipation;
  return combine(m, m);
}

enum SceneBody { kBase, kLeft, kLeftTip, kRight, kRightTip, kBox, kRock, kBall, kMarble, kPebble, kRod };

Model make_model(bool only_capture = false) {
  ModelBuilder builder;
  builder.add(free_body("base", 40, {3, 3, 4}));
  builder.add(link("left", "base", {0.3, 0.25, 0}, {0, 0, 1})),
      builder.add(link("left-tip", "left", {0.5, 0, 0}, {0, 1, 0}));
  builder.add(link("right", "base", {0.3, -0.25, 0}, {0, 0, 1}));
  builder.add(link("right-tip", "right", {0.5, 0, 0}, {0, 1, 0}));
  builder.add(free_body("box", 6, {0.1, 0.12, 0.09}));
  if (only_capture) return builder.build();
  builder.add(free_body("rock", 3, {0.03, 0.04, 0.05}));
  builder.add(free_body("ball", 4, {0.02, 0.02, 0.02}));
  builder.add(free_body("marble", 1.5, {0.005, 0.005, 0.005}));
  builder.add(free_body("pebble", 1, {0.002, 0.002, 0.002}));
  builder.add(free_body("rod", 1, {0.02, 0.02, 0.002}));
  return builder.build();
}

}  // namespace

ContactSet ContactScene::contacts() const {
  std::vector<ContactSurface> ours;
  for (const EngineSurface& s : surfaces) ours.push_back(s.grapnel());
  return {ours, pairs, static_cast<int>(pairs.size())};
}

ContactScene two_arm_scene(bool linear) {
  ContactScene s{make_model(), {}, {}, {}};
  s.state = zero_state(s.model);
  const auto place = [&](int body, const Vector3d& p, const Twistd& V) {
    set_root_pose(s.model, body, {rotation_about({0.6, 0, 0.8}, 0.1 * body), p}, s.state);
    set_root_twist(s.model, body, V, s.state);
  };
  place(kBase, {0, 0, 0}, Twistd::zero());
  place(kBox, {1.25, 0.01, 0.03}, {{0.1, -0.2, 0.3}, {0, 0, 0}});
  place(kRock, {0.12, 1.6, 0.08}, {{0.3, 0.2, -0.4}, {0, -0.3, 0}});
  place(kBall, {0.02, 0.75, 0.05}, {{0, 0, 1}, {0, -0.8, 0}});
  place(kMarble, {-0.8, 0, 0.6}, {{0, 2, 0}, {-0.6, 0, 0}});
  place(kPebble, {-0.3, 0.01, 0.61}, {{0, 0, 0.5}, {0, 0, 0}});
  place(kRod, {-0.15, 0.02, 0.62}, {{0.4, 0.1, 0}, {0, 0, 0}});
  s.state.v[s.model.bodies()[kLeft].v] = -0.5, s.state.v[s.model.bodies()[kRight].v] = 0.5;

  const Posed along_x{rotation_about({0, 1, 0}, 0.5 * std::numbers::pi), {0.35, 0, 0}};
  s.surfaces = {{kLeftTip, shape(Shape::sphere, {0.06, 0, 0}, {Rotationd::identity(), {0.4, 0, 0}})},
                {kRightTip,
                 linear ? shape(Shape::sphere, {0.07, 0, 0}, along_x) : shape(Shape::capsule, {0.05, 0.2, 0}, along_x)},
                {kBox, shape(Shape::box, {0.3, 0.28, 0.32})},
                {kRock, linear ? shape(Shape::box, {0.3, 0.25, 0.28}) : hull()},
                {kBall, shape(Shape::sphere, {0.1, 0, 0})},
                {kBase, shape(Shape::cylinder, {0.3, 0.4, 0})},
                {kMarble, shape(Shape::sphere, {0.08, 0, 0})},
                {kPebble, shape(Shape::sphere, {0.05, 0, 0})},
                {kRod, shape(Shape::capsule, {0.04, 0.3, 0})},
                {-1, shape(Shape::none, {}, {rotation_about({0, 1, 0}, 0.5 * std::numbers::pi), {-1, 0, 0}}), true}};
  const auto pair = [&](int a, int b, const ContactLaw& used) {
    s.pairs.push_back({a, b, used, static_cast<int>(s.pairs.size())});
  };
  const ContactLaw spring = law(false, 2e3, 0), lossy = law(!linear, linear ? 1.5e3 : 5e4, linear ? 0 : 0.7);
  pair(0, 2, lossy), pair(1, 2, law(false, 800, 0));  // fingers and box
  pair(4, 3, spring), pair(4, 5, lossy);              // ball with hull and cylinder
  pair(6, 9, law(false, 3e3, linear ? 0 : 0.4));      // marble and wall
  pair(6, 7, lossy), pair(7, 8, lossy);               // spheres, and a sphere and a capsule
  return s;
}

ContactScene dual_arm_capture() {
  const ContactScene whole = two_arm_scene(true);
  ContactScene s{make_model(true), {}, {}, {}};
  s.state = zero_state(s.model);
  std::copy_n(whole.state.q.begin(), s.state.q.size(), s.state.q.begin());
  std::copy_n(whole.state.v.begin(), s.state.v.size(), s.state.v.begin());
  s.surfaces.assign(whole.surfaces.begin(), whole.surfaces.begin() + 3);  // fingers and box
  s.pairs.assign(whole.pairs.begin(), whole.pairs.begin() + 2);
  return s;
}

ContactScene sphere_scene() {
  ContactScene s = two_arm_scene(false);
  s.surfaces[1].geometry = shape(Shape::sphere, {0.07, 0, 0}, {Rotationd::identity(), {0.35, 0, 0}});
  s.surfaces[5].geometry = shape(Shape::box, {0.6, 0.6, 0.4});
  s.surfaces[8].geometry = shape(Shape::sphere, {0.06, 0, 0});
  for (SurfacePair& pair : s.pairs) pair.law = law(true, 5e4, 0.7);
  return s;
}

ContactScene sliding_balls(double stiction_displacement) {
  ModelBuilder builder;
  for (const char* name : {"first", "second", "third"}) builder.add(free_body(name, 0.5, {5e-4, 5e-4, 5e-4}));
  ContactScene s{builder.build(), {}, {}, {}};
  s.state = zero_state(s.model);
  const auto place = [&](int body, const Vector3d& p, const Twistd& V) {
    set_root_pose(s.model, body, {Rotationd::identity(), p}, s.state);
    set_root_twist(s.model, body, V, s.state);
  };
  place(0, {0, 0, 0.06}, {{3, 60, 25}, {0.8, 0.3, -0.5}});
  place(1, {2, 0, 1}, {{30, 0, 40}, {1, 0, 0}});
  place(2, {2.2, 0, 1}, {{0, 10, 60}, {-0.5, 0, 0}});
  const Geometry ball = shape(Shape::sphere, {0.05, 0, 0});
  s.surfaces = {{0, ball}, {1, ball}, {2, ball}, {-1, shape(Shape::none, {}), true}};
  ContactMaterial m;
  m.modulus = 2e6, m.dissipation = 0.3, m.static_friction = m.kinetic_friction = 0.2;
  m.stiction_speed = 0.1, m.stiction_displacement = stiction_displacement;
  s.pairs = {{0, 3, combine(m, m), 0}, {1, 2, combine(m, m), 1}};
  return s;
}

}  // namespace grapnel::testing
