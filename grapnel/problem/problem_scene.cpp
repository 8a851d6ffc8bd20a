#include "grapnel/problem/problem_scene.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/problem/flexible_bodies.hpp"

namespace grapnel {
namespace {

SceneMesh scene_mesh(const TriangleMesh& mesh) {
  SceneMesh copy;
  copy.name = mesh.name;
  for (const Vector3d& v : mesh.vertices) copy.vertices.insert(copy.vertices.end(), {v[0], v[1], v[2]});
  for (const auto& t : mesh.triangles) copy.triangles.insert(copy.triangles.end(), t.begin(), t.end());
  return copy;
}

// --- The scene, body by body ---

class SceneBuilder {
 public:
  explicit SceneBuilder(const CaptureProblem& problem) : problem_(problem) {}

  Scene build() {
    add_robot();
    for (const TargetSetup& t : problem_.targets) add_target(t);
    for (const TargetSetup& t : problem_.targets) add_panels(t);
    for (const GraspSetup& g : problem_.grasps) {
      scene_.grasps.push_back({g.end_effector, g.target, g.grasp_point, g.contact ? "contact" : name_of(g.model)});
    }
    for (const ObstacleSetup& o : problem_.obstacles) {
      SceneObstacle obstacle{o.name, o.X_WO, o.geometry.empty(), {}};
      add_shapes(o.geometry, obstacle.shapes);
      scene_.obstacles.push_back(std::move(obstacle));
    }
    return std::move(scene_);
  }

 private:
  // The base, then links in the order of the file, but none before its parent.
  void add_robot() {
    const std::vector<BodyDescription>& bodies = problem_.robot.bodies;
    std::set<std::string> added;
    const auto add_where = [&](auto condition) {
      for (const BodyDescription& b : bodies) {
        if (added.contains(b.name) || !condition(b)) continue;
        add_robot_body(b);
        added.insert(b.name);
      }
    };
    add_where([&](const BodyDescription& b) { return b.name == problem_.robot.base; });
    // Each pass adds at least one link: the model has been built, so there are no cycles.
    while (added.size() < bodies.size()) {
      add_where([&](const BodyDescription& b) { return added.contains(b.parent); });
    }
    for (const EndEffectorSetup& e : problem_.robot.end_effectors) {
      scene_.end_effectors.push_back({e.name, e.body, e.X_BE});
    }
  }

  void add_robot_body(const BodyDescription& description) {
    if (is_unseen(description)) return;
    const bool base = description.name == problem_.robot.base;
    SceneBody body;
    body.name = description.name;
    body.kind = base ? "base" : "link";
    body.series = base ? "base" : "links/" + description.name;
    if (!base) {
      // On its own joint, or on the first of several at one place.
      const BodyDescription* carried = &description;
      Posed X_PF = description.X_PF;
      for (const BodyDescription* below = body_named(carried->parent); below && is_unseen(*below);
           below = body_named(carried->parent)) {
        carried = below, X_PF = below->X_PF * X_PF;
      }
      body.parent = carried->parent;
      body.joint = SceneJoint{carried->joint.name, traits_of(carried->joint.type).name, carried->joint.axis, X_PF};
    }
    body.mass = description.mass, body.com = description.com, body.inertia = description.inertia;
    add_shapes(shapes_of(problem_.robot, description.name), body.shapes);
    scene_.bodies.push_back(std::move(body));
  }

  const BodyDescription* body_named(const std::string& name) const {
    for (const BodyDescription& b : problem_.robot.bodies) {
      if (b.name == name) return &b;
    }
    return nullptr;
  }

  void add_target(const TargetSetup& target) {
    SceneBody body;
    body.name = target.name;
    body.kind = "target";
    body.series = "targets/" + target.name;
    const BodyDescription rest = target_bodies(target).bodies.front();  // without its panels, which are separate bodies
    body.mass = rest.mass, body.com = rest.com, body.inertia = rest.inertia;
    add_shapes(target.geometry, body.shapes);
    scene_.bodies.push_back(std::move(body));
    for (const GraspPoint& g : target.grasp_points) {
      scene_.grasp_points.push_back({target.name, g.name, g.X_TG.p, g.approach_direction});
    }
  }

  // The pieces of a target's panels, as separate bodies.
  void add_panels(const TargetSetup& target) {
    const TargetBodies all = target_bodies(target);
    const std::size_t prefix = target_body_name("").size();
    for (std::size_t i = 1; i < all.bodies.size(); ++i) {
      const BodyDescription& piece = all.bodies[i];
      if (is_unseen(piece)) continue;
      SceneBody body;
      body.name = piece.name.substr(prefix);
      body.kind = "part";
      body.parent = target.name;
      body.series = "links/" + body.name;
      body.mass = piece.mass, body.com = piece.com, body.inertia = piece.inertia;
      for (const auto& [name, shape] : all.geometry) {
        if (name == piece.name) add_shapes({shape}, body.shapes);
      }
      scene_.bodies.push_back(std::move(body));
    }
  }

  void add_shapes(const std::vector<Geometry>& geometry, std::vector<SceneShape>& shapes) {
    for (const Geometry& one : geometry) {
      if (one.shape != Geometry::Shape::none) shapes.push_back(scene_shape(one));
    }
  }

  SceneShape scene_shape(const Geometry& geometry) {
    SceneShape shape{name_of(geometry.shape), geometry.size, geometry.X_BG, -1};
    if (!geometry.mesh) return shape;
    // Bodies that share a mesh share it in the scene, too.
    const auto known = std::find(meshes_.begin(), meshes_.end(), geometry.mesh.get());
    shape.mesh = static_cast<int>(known - meshes_.begin());
    if (known == meshes_.end()) {
      meshes_.push_back(geometry.mesh.get());
      scene_.meshes.push_back(scene_mesh(*geometry.mesh));
    }
    return shape;
  }

  const CaptureProblem& problem_;
  Scene scene_;
  std::vector<const TriangleMesh*> meshes_;  // of scene_.meshes
};

// --- Whether everything moves in the plane z = 0 ---

// Collects whether all given quantities belong to a motion in the plane.
class PlaneCheck {
 public:
  bool planar() const { return planar_; }

  void zero(double x) { planar_ = planar_ && std::abs(x) < kSmall; }
  // A force, velocity, position or direction.
  void in_plane(const Vector3d& v) { zero(v[2]); }
  // A torque, an angular velocity.
  void along_normal(const Vector3d& v) { zero(v[0]), zero(v[1]); }
  // An axis that reflection in the plane maps onto itself.
  void mirrored(const Vector3d& axis) { planar_ = planar_ && (lies_in(axis) || stands_on(axis)); }
  void twist(const Twistd& V) { in_plane(V.linear), along_normal(V.angular); }
  // A rigid body, in W: its centre of mass is in the plane, which is a principal plane.
  void body(const RigidBodyInertiad& I_W) {
    if (!(I_W.mass > 0)) return;
    in_plane(I_W.com());
    const Symmetric3d I = I_W.rotational_about_com();
    const double size = std::abs(I.xx) + std::abs(I.yy) + std::abs(I.zz);
    if (size > 0) zero(I.xz / size), zero(I.yz / size);
  }

 private:
  static constexpr double kSmall = 1e-9;
  static bool lies_in(const Vector3d& v) { return std::abs(v[2]) < kSmall; }
  static bool stands_on(const Vector3d& v) { return std::abs(v[0]) < kSmall && std::abs(v[1]) < kSmall; }

  bool planar_ = true;
};

// Bodies fixed to each other move as one body: its parts may be above and below the plane.
void check_servicer(const CaptureProblem& problem, const CaptureSystem& system, const Kinematics& k,
                    PlaneCheck& check) {
  const Model& model = system.model;
  std::map<int, RigidBodyInertiad> rigid;  // by the body that carries it
  std::vector<int> carrier(model.bodies().size());
  for (int i = 0; i < static_cast<int>(carrier.size()); ++i) {
    const Body& body = model.bodies()[i];
    const BodyDescription& b = body.description;
    const bool moves = body.parent < 0 || b.joint.type != JointType::fixed;
    carrier[i] = moves ? i : carrier[body.parent];
    rigid.emplace(carrier[i], RigidBodyInertiad::zero()).first->second +=
        k.X_WB[i] * RigidBodyInertiad::about_com(b.mass, b.com, b.inertia);
    if (body.parent < 0) continue;
    const Vector3d axis = k.X_WB[i].R * b.joint.axis;  // the joint's motion leaves its axis unchanged
    if (slides_along_axis(b.joint.type)) check.in_plane(axis);
    if (turns_about_axis(b.joint.type)) check.along_normal(axis);
  }
  for (const auto& [body, inertia] : rigid) check.body(inertia);
  for (const EndEffectorSetup& e : problem.robot.end_effectors) {
    check.in_plane((k.X_WB[model.body_index(e.body)] * e.X_BE).p);
  }
  if (problem.V_WB) check.twist(*problem.V_WB);
  if (problem.momentum) {
    check.in_plane(problem.momentum->linear);
    check.along_normal(problem.momentum->angular);
  }
}

void check_targets(const CaptureProblem& problem, PlaneCheck& check) {
  for (const TargetSetup& t : problem.targets) {
    check.body(t.X_WT * RigidBodyInertiad::about_com(t.mass, t.com, t.inertia));
    check.twist(t.V_WT);
    for (const GraspPoint& g : t.grasp_points) {
      check.in_plane((t.X_WT * g.X_TG).p);
      if (g.normal) check.in_plane(t.X_WT.R * *g.normal);
      if (g.approach_direction) check.in_plane(t.X_WT.R * *g.approach_direction);
    }
  }
}

// Grasps and external loads, at the initial pose: motion in the plane preserves the symmetry.
void check_actions(const CaptureProblem& problem, const CaptureSystem& system, const Kinematics& k, PlaneCheck& check) {
  const Model& model = system.model;
  check.in_plane(problem.gravity);
  if (problem.orbit) {
    const OrbitSetup& orbit = *problem.orbit;
    for (const Vector3d& v : {orbit.radial, orbit.along_track, orbit.position, orbit.velocity}) check.in_plane(v);
  }
  for (const GraspSetup& g : problem.grasps) {
    check.in_plane(g.relative_velocity);
    check.along_normal(g.relative_angular_velocity);
    const int frame = model.frame_index(g.end_effector);
    if (g.model == GraspModel::hinge) check.mirrored(frame_pose(model, k, frame).R * g.hinge_axis);
  }
  for (const LoadSetup& load : problem.loads) {
    const Posed& X_WB =
        load.body.target ? problem.targets[*load.body.target].X_WT : k.X_WB[model.body_index(load.body.name)];
    const Rotationd R = load.frame == LoadFrame::body    ? X_WB.R
                        : load.frame == LoadFrame::orbit ? orbit_point(reference_orbit(*problem.orbit), 0).R_WO
                                                         : Rotationd::identity();
    check.in_plane(X_WB * load.p_BP);
    check.in_plane(R * load.amplitude.linear);
    check.along_normal(R * load.amplitude.angular);
    if (!load.stream) continue;
    check.in_plane(R * load.stream->direction);
    check.in_plane(X_WB.R * load.stream->normal);
  }
}

bool is_planar(const CaptureProblem& stated) {
  make_capture_system(stated);                 // checks the problem
  if (!stated.contacts.empty()) return false;  // contact forces depend on shapes, which may not be symmetric
  const CaptureProblem problem = rigid_problem(stated);
  const CaptureSystem system = make_servicer(problem);
  const Kinematics k = forward_kinematics(system.model, initial_servicer_state(problem, system));
  PlaneCheck check;
  check_servicer(problem, system, k, check);
  check_targets(problem, check);
  check_actions(problem, system, k, check);
  return check.planar();
}

void add_joint_limits(const CaptureProblem& problem, Scene& scene) {
  std::set<std::string> drawn;
  for (const SceneBody& body : scene.bodies) {
    if (body.joint) drawn.insert(body.joint->name);
  }
  for (const BodyDescription& body : problem.robot.bodies) {
    const JointLimits& limits = body.joint.limits;
    const bool any = std::isfinite(limits.lower) || std::isfinite(limits.upper) || std::isfinite(limits.rate) ||
                     std::isfinite(limits.effort);
    if (any && drawn.contains(body.joint.name))
      scene.limits.joints.push_back({body.joint.name, limits.lower, limits.upper, limits.rate, limits.effort});
  }
}

void add_actuators(const RobotSetup& robot, Scene& scene) {
  for (const WheelSetup& w : robot.wheels)
    scene.actuators.push_back({w.name, "wheel", std::nullopt, w.axis, std::nullopt, w.rate});
  for (const MomentGyroSetup& g : robot.gyros)
    scene.actuators.push_back({g.name, "gyro", std::nullopt, g.gimbal_axis, g.spin_axis, g.rate});
  for (const ThrusterSetup& t : robot.thrusters)
    scene.actuators.push_back({t.name, "thruster", t.position, t.direction, std::nullopt, t.force});
}

}  // namespace

Scene scene_of(const CaptureProblem& stated) {
  const CaptureProblem problem = flexible_problem(stated);
  const bool planar = is_planar(stated);  // first, since it checks the problem
  Scene scene = SceneBuilder(problem).build();
  scene.planar = planar;
  for (const EndEffectorSetup& e : problem.robot.end_effectors) {
    if (e.envelope) scene.limits.grasps.push_back({e.name, e.envelope->position, e.envelope->velocity});
  }
  if (problem.clearance.enabled) scene.limits.clearance = problem.clearance.required;
  add_joint_limits(problem, scene);
  add_actuators(problem.robot, scene);
  if (problem.orbit) {
    const OrbitSetup& orbit = *problem.orbit;
    scene.central_body = SceneCentralBody{name_of(orbit.body), std::nullopt};
    if (!orbit.mu) scene.central_body->radius = central_body(orbit.body).radius;
  }
  return scene;
}

}  // namespace grapnel
