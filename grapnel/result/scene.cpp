#include "grapnel/result/scene.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <stdexcept>

#include "grapnel/describe/json.hpp"
#include "grapnel/result/json_document.hpp"
#include "grapnel/result/result_documents.hpp"

namespace grapnel {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSceneSchema = "grapnel-scene/2";

// A value of the document and its location: "bodies[2].joint".
class Entry {
 public:
  Entry(const std::filesystem::path& file, const Json& json, std::string where)
      : file_(file), json_(json), where_(std::move(where)) {}

  [[noreturn]] void fail(const std::string& fault) const {
    throw std::runtime_error(fmt::format("{}: {}{}{}", file_.string(), where_, where_.empty() ? "" : ": ", fault));
  }

  Entry operator[](const char* key) const {
    if (!json_.is_object()) fail("not an object");
    const auto found = json_.find(key);
    if (found == json_.end()) fail(fmt::format("'{}' is missing", key));
    return {file_, *found, where_.empty() ? key : where_ + "." + key};
  }
  std::size_t size() const {
    if (!json_.is_array()) fail("not a list");
    return json_.size();
  }
  bool has(const char* key) const { return json_.is_object() && json_.contains(key); }
  Entry item(std::size_t i) const { return {file_, json_[i], fmt::format("{}[{}]", where_, i)}; }
  std::vector<Entry> items() const {
    std::vector<Entry> entries;
    for (std::size_t i = 0; i < size(); ++i) entries.push_back(item(i));
    return entries;
  }
  bool is_null() const { return json_.is_null(); }

  bool flag() const {
    if (!json_.is_boolean()) fail("not true or false");
    return json_.get<bool>();
  }
  std::string text() const {
    if (!json_.is_string()) fail("not a text");
    return json_.get<std::string>();
  }
  std::string one_of(std::initializer_list<const char*> words) const {
    const std::string is = text();
    if (std::find(words.begin(), words.end(), is) == words.end()) {
      fail(fmt::format("'{}' is not one of {}", is, fmt::join(words, ", ")));
    }
    return is;
  }
  double number() const {
    if (!json_.is_number()) fail("not a number");
    const double x = json_.get<double>();
    if (!std::isfinite(x)) fail("not a finite number");
    return x;
  }
  // A whole number from 0 to below `end`.
  int index(std::size_t end) const {
    if (!json_.is_number_unsigned()) fail("not a whole number, at least 0");
    const auto i = json_.get<std::uint64_t>();
    if (i >= end) fail(fmt::format("{} is out of range: at most {} entries", i, end));
    return static_cast<int>(i);
  }
  // `count` numbers; any number of them if it is 0. Lists of meshes are long: only errors name the index of an item.
  std::vector<double> numbers(std::size_t count) const {
    if (count > 0 && size() != count) fail(fmt::format("{} numbers instead of {}", size(), count));
    std::vector<double> values;
    values.reserve(size());
    for (std::size_t i = 0; i < json_.size(); ++i) {
      values.push_back(json_[i].is_number_float() ? json_[i].get<double>() : item(i).number());
    }
    return values;
  }
  std::vector<int> indices(std::size_t end) const {
    std::vector<int> values;
    values.reserve(size());
    for (std::size_t i = 0; i < json_.size(); ++i) {
      const bool fits = json_[i].is_number_unsigned() && json_[i].get<std::uint64_t>() < end;
      values.push_back(fits ? json_[i].get<int>() : item(i).index(end));
    }
    return values;
  }
  Vector3d vector() const {
    const std::vector<double> v = numbers(3);
    return {v[0], v[1], v[2]};
  }
  Vector3d direction() const {
    const Vector3d v = vector();
    if (!(std::abs(norm(v) - 1) < 1e-6)) fail("not a unit vector");
    return v;
  }
  Rotationd rotation() const {
    const std::vector<double> q = numbers(4);
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(std::abs(length - 1) < 1e-6)) fail("not a unit quaternion");
    return rotation_matrix(Quaterniond{q[0] / length, q[1] / length, q[2] / length, q[3] / length});
  }
  Posed pose() const { return {(*this)["quaternion_wxyz"].rotation(), (*this)["position"].vector()}; }

 private:
  const std::filesystem::path& file_;
  const Json& json_;
  std::string where_;
};

SceneMesh read_mesh(const Entry& entry) {
  SceneMesh mesh;
  mesh.name = entry["name"].text();
  mesh.vertices = entry["vertices"].numbers(0);
  if (mesh.vertices.size() % 3 != 0) entry["vertices"].fail("not three numbers per vertex");
  mesh.triangles = entry["triangles"].indices(mesh.vertices.size() / 3);
  if (mesh.triangles.size() % 3 != 0) entry["triangles"].fail("not three vertices per triangle");
  return mesh;
}

SceneShape read_shape(const Entry& entry, std::size_t meshes) {
  SceneShape shape;
  shape.shape = entry["shape"].one_of({"box", "cylinder", "capsule", "sphere", "mesh"});
  shape.size = entry["size"].vector();
  shape.X_BG = entry.pose();
  if (shape.shape == "mesh") shape.mesh = entry["mesh"].index(meshes);
  return shape;
}

// Names of the bodies read so far: base and links, and targets.
struct Names {
  std::set<std::string> robot, targets;
};

SceneJoint read_joint(const Entry& entry) {
  SceneJoint joint;
  joint.name = entry["name"].text();
  joint.type = entry["type"].one_of({"revolute", "continuous", "prismatic", "fixed"});
  joint.axis = entry["axis"].direction();
  joint.X_PF = entry.pose();
  return joint;
}

SceneBody read_body(const Entry& entry, std::size_t meshes, Names& names) {
  SceneBody body;
  body.name = entry["name"].text();
  body.kind = entry["kind"].one_of({"base", "link", "target", "part"});
  if ((body.kind == "base") != names.robot.empty()) entry["kind"].fail("exactly the first body must be the base");
  if (body.kind == "link") {
    if (!names.targets.empty()) entry["kind"].fail("a link after a target");
    body.parent = entry["parent"].text();
    if (!names.robot.contains(body.parent)) {
      entry["parent"].fail(fmt::format("no body '{}' before this one", body.parent));
    }
    body.joint = read_joint(entry["joint"]);
  }
  if (body.kind == "part") {
    body.parent = entry["parent"].text();
    if (!names.targets.contains(body.parent))
      entry["parent"].fail(fmt::format("no target '{}' before this part of it", body.parent));
  }
  if (!(body.kind == "target" || body.kind == "part" ? names.targets : names.robot).insert(body.name).second) {
    entry["name"].fail(fmt::format("duplicate body '{}'", body.name));
  }
  body.series = entry["series"].text();
  body.mass = entry["mass"].number();
  body.com = entry["com"].vector();
  const std::vector<double> I = entry["inertia"].numbers(6);
  body.inertia = {I[0], I[1], I[2], I[3], I[4], I[5]};
  for (const Entry& shape : entry["geometry"].items()) body.shapes.push_back(read_shape(shape, meshes));
  return body;
}

SceneObstacle read_obstacle(const Entry& entry, std::size_t meshes) {
  SceneObstacle obstacle{entry["name"].text(), entry.pose(), entry["half_space"].flag(), {}};
  for (const Entry& shape : entry["geometry"].items()) obstacle.shapes.push_back(read_shape(shape, meshes));
  return obstacle;
}

// A name that must refer to a body already read.
std::string known(const Entry& entry, const std::set<std::string>& names) {
  std::string name = entry.text();
  if (!names.contains(name)) entry.fail(fmt::format("there is no '{}'", name));
  return name;
}

}  // namespace

std::string scene_json(const Scene& scene, std::string_view scenario_name, std::string_view scenario_sha256,
                       std::string_view version) {
  return json_text(
      json_of(SceneDocument{&scene, std::string(scenario_name), std::string(scenario_sha256), std::string(version)}));
}

Scene read_scene(const std::filesystem::path& path) {
  const Json json = read_json_document(path, kSceneSchema);
  const Entry document(path, json, "");
  Scene scene;
  scene.planar = document["planar"].flag();
  for (const Entry& e : document["meshes"].items()) scene.meshes.push_back(read_mesh(e));
  Names names;
  for (const Entry& e : document["bodies"].items()) {
    scene.bodies.push_back(read_body(e, scene.meshes.size(), names));
  }
  if (scene.bodies.empty()) document["bodies"].fail("the list is empty");
  std::set<std::string> end_effectors, grasp_points;
  for (const Entry& e : document["end_effectors"].items()) {
    scene.end_effectors.push_back({e["name"].text(), known(e["body"], names.robot), e.pose()});
    end_effectors.insert(scene.end_effectors.back().name);
  }
  for (const Entry& e : document["grasp_points"].items()) {
    SceneGraspPoint point{known(e["target"], names.targets), e["name"].text(), e["position"].vector(), {}};
    if (const Entry d = e["approach_direction"]; !d.is_null()) point.approach_direction = d.direction();
    grasp_points.insert(point.target + "\n" + point.name);
    scene.grasp_points.push_back(std::move(point));
  }
  for (const Entry& e : document["grasps"].items()) {
    SceneGrasp grasp{known(e["end_effector"], end_effectors), known(e["target"], names.targets),
                     e["grasp_point"].text(), e["model"].one_of({"rigid", "hinge", "point", "contact"})};
    if (!grasp_points.contains(grasp.target + "\n" + grasp.grasp_point)) {
      e["grasp_point"].fail(fmt::format("'{}' has no grasp point '{}'", grasp.target, grasp.grasp_point));
    }
    scene.grasps.push_back(std::move(grasp));
  }
  if (!document.has("obstacles")) return scene;  // results of earlier versions
  for (const Entry& e : document["obstacles"].items()) scene.obstacles.push_back(read_obstacle(e, scene.meshes.size()));
  return scene;
}

namespace {

enum class SceneFormat { second };

struct OfScenario {
  std::string name, sha256;
};

}  // namespace

template <>
const Type& type_of<SceneFormat>() {
  static constexpr Choice choices[] = {choice(SceneFormat::second, "grapnel-scene/2")};
  static constexpr Type type = enumeration<SceneFormat>("SceneFormat", choices);
  return type;
}

template <>
const Type& type_of<OfScenario>() {
  static constexpr Field fields[] = {
      field<&OfScenario::name>("name", "name of the scenario"),
      field<&OfScenario::sha256>("sha256", "as in summary.json"),
  };
  static constexpr Type type = structure<OfScenario>("SceneScenario", "the simulated scenario.", fields);
  return type;
}

template <>
const Type& type_of<SceneMesh>() {
  static constexpr Field fields[] = {
      field<&SceneMesh::name>("name", "name of the mesh file"),
      field<&SceneMesh::vertices>("vertices", "1",
                                  "x, y, z of each vertex, in the file's unit; the size of a shape converts to metres"),
      field<&SceneMesh::triangles>("triangles", "1", "three vertex indices per triangle, from 0"),
  };
  static constexpr Type type = structure<SceneMesh>("SceneMesh", "a triangle mesh in its own frame.", fields);
  return type;
}

template <>
const Type& type_of<SceneShape>() {
  using S = SceneShape;
  static constexpr Field fields[] = {
      field<&S::shape>("shape", "`box`, `cylinder`, `capsule`, `sphere`, `mesh`"),
      field<&S::size>("size", "m", "dimensions by shape, see below; for a mesh the scale factors of its vertices"),
      derived<[](const S& s) { return s.X_BG.p; }>("position", "m", "origin of the shape's frame in the body's frame"),
      derived<[](const S& s) { return quaternion_from(s.X_BG.R); }>(
          "quaternion_wxyz", "1", "orientation of the shape's frame in the body's frame"),
      field<&S::mesh>("mesh", "1", "index into `meshes`, for shape `mesh`")
          .when<[](const S& s) { return s.shape == "mesh"; }>(),
  };
  static constexpr Type type = structure<S>("SceneShape", "a shape on a body.", fields);
  return type;
}

template <>
const Type& type_of<SceneJoint>() {
  using J = SceneJoint;
  static constexpr Field fields[] = {
      field<&J::name>("name", "name of the joint"),
      field<&J::type>("type", "`revolute`, `continuous`, `prismatic`, `fixed`"),
      field<&J::axis>("axis", "1", "unit axis in the joint's frame"),
      derived<[](const J& j) { return j.X_PF.p; }>("position", "m",
                                                   "of the joint's frame in the parent's at joint value 0"),
      derived<[](const J& j) { return quaternion_from(j.X_PF.R); }>("quaternion_wxyz", "1", "likewise"),
  };
  static constexpr Type type = structure<J>("SceneJoint", "the joint between a link and its parent.", fields);
  return type;
}

template <>
const Type& type_of<SceneBody>() {
  using B = SceneBody;
  static constexpr Field fields[] = {
      field<&B::name>("name",
                      "name, unique among base and links, and among targets; a target may have the name of a link"),
      field<&B::kind>("kind", "`base`, `link`, `target`, `part` (of a target: a panel, or a segment of one)"),
      derived<[](const B& b) { return b.parent.empty() ? std::nullopt : std::optional(b.parent); }>(
          "parent", "", "for links: base or an earlier link; for parts: their target; else null")
          .or_null(),
      field<&B::joint>("joint", "joint of a link; else null").or_null(),
      field<&B::series>("series",
                        "name of its motion in the time series: SERIES/position and SERIES/quaternion_wxyz are the "
                        "pose of its frame in W. `base`, `links/NAME` (for parts too), `targets/NAME`"),
      field<&B::mass>("mass", "kg", "mass of the body"),
      field<&B::com>("com", "m", "centre of mass in the body's frame"),
      derived<[](const B& b) {
        const Symmetric3d& m = b.inertia;
        return std::array{m.xx, m.yy, m.zz, m.xy, m.xz, m.yz};
      }>("inertia", "kg m^2", "xx, yy, zz, xy, xz, yz about the centre of mass, its axes"),
      field<&B::shapes>("geometry", "shapes of the body"),
  };
  static constexpr Type type = structure<B>("SceneBody", "a rigid body.", fields);
  return type;
}

template <>
const Type& type_of<SceneFrame>() {
  using F = SceneFrame;
  static constexpr Field fields[] = {
      field<&F::name>("name", "name of the end-effector"),
      field<&F::body>("body", "body of the robot"),
      derived<[](const F& f) { return f.X_BE.p; }>("position", "m", "position in that body's frame"),
      derived<[](const F& f) { return quaternion_from(f.X_BE.R); }>("quaternion_wxyz", "1",
                                                                    "orientation in that body's frame"),
  };
  static constexpr Type type = structure<F>("SceneEndEffector", "an end-effector on a body of the robot.", fields);
  return type;
}

template <>
const Type& type_of<SceneGraspPoint>() {
  using P = SceneGraspPoint;
  static constexpr Field fields[] = {
      field<&P::target>("target", "target of the grasp point"),
      field<&P::name>("name", "name of the grasp point"),
      field<&P::position>("position", "m", "position in the target's frame"),
      field<&P::approach_direction>("approach_direction", "1", "unit vector in the target's frame; null: not given")
          .or_null(),
  };
  static constexpr Type type = structure<P>("SceneGraspPoint", "a grasp point of a target.", fields);
  return type;
}

template <>
const Type& type_of<SceneGrasp>() {
  using G = SceneGrasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "end-effector of the grasp"),
      field<&G::target>("target", "target of the grasp"),
      field<&G::grasp_point>("grasp_point", "grasp point on the target"),
      field<&G::model>("model", "`rigid`, `hinge`, `point`, or `contact` for a contact without a grasp"),
  };
  static constexpr Type type = structure<G>("SceneGrasp", "a grasp or contact of the scenario.", fields);
  return type;
}

template <>
const Type& type_of<SceneObstacle>() {
  using O = SceneObstacle;
  static constexpr Field fields[] = {
      field<&O::name>("name", "name of the obstacle"),
      derived<[](const O& o) { return o.X_WO.p; }>("position", "m", "origin of its frame in W"),
      derived<[](const O& o) { return quaternion_from(o.X_WO.R); }>("quaternion_wxyz", "1",
                                                                    "orientation of its frame in W"),
      field<&O::half_space>("half_space", "true: all points with z <= 0 in its frame"),
      field<&O::shapes>("geometry", "its shapes, in its frame; empty for a half-space"),
  };
  static constexpr Type type = structure<O>("SceneObstacle", "a body fixed in W that others may touch.", fields);
  return type;
}

template <>
const Type& type_of<SceneLimits::Grasp>() {
  using G = SceneLimits::Grasp;
  static constexpr Field fields[] = {
      field<&G::end_effector>("end_effector", "end-effector with the envelope"),
      field<&G::position>("position", "m", "largest distance from the grasp point; null: no limit").or_null(),
      field<&G::velocity>("velocity", "m/s", "largest relative speed; null: no limit").or_null(),
  };
  static constexpr Type type = structure<G>("SceneGraspLimits", "envelope of a grasp.", fields);
  return type;
}

template <>
const Type& type_of<SceneLimits::Joint>() {
  using J = SceneLimits::Joint;
  static constexpr Field fields[] = {
      field<&J::joint>("joint", "name of the joint"),
      field<&J::lower>("lower", "rad or m", "smallest position; null: no limit").or_null(),
      field<&J::upper>("upper", "rad or m", "largest position; null: no limit").or_null(),
      field<&J::rate>("rate", "rad/s or m/s", "largest rate in both directions; null: no limit").or_null(),
      field<&J::effort>("effort", "N m or N", "largest effort in both directions; null: no limit").or_null(),
  };
  static constexpr Type type = structure<J>("SceneJointLimits", "limits of a joint.", fields);
  return type;
}

template <>
const Type& type_of<SceneActuator>() {
  using A = SceneActuator;
  static constexpr Field fields[] = {
      field<&A::name>("name", "name of the actuator"),
      field<&A::kind>("kind", "`wheel`, `gyro`, `thruster`"),
      field<&A::position>("position", "m", "of a thruster, in the base's frame; null: a wheel or gyro").or_null(),
      field<&A::axis>("axis", "1", "unit axis of a wheel, of a gimbal, or of a thruster's force, in the base's frame"),
      field<&A::spin_axis>("spin_axis", "1", "of a gyro: unit axis of the rotor with the gimbal at zero; else null")
          .or_null(),
      field<&A::limit>("limit", "rad/s or N", "largest rate of a wheel or gimbal, force of a thruster; null: no limit")
          .or_null(),
  };
  static constexpr Type type = structure<A>("SceneActuator", "a wheel, gyro or thruster of the base.", fields);
  return type;
}

template <>
const Type& type_of<SceneCentralBody>() {
  using B = SceneCentralBody;
  static constexpr Field fields[] = {
      field<&B::name>("name", "`earth`, `moon`, `mars`"),
      field<&B::radius>("radius", "m", "equatorial radius; null: the scenario states a gravitational parameter")
          .or_null(),
  };
  static constexpr Type type = structure<B>("SceneCentralBody", "the body whose orbit the frame W follows.", fields);
  return type;
}

template <>
const Type& type_of<SceneLimits>() {
  using L = SceneLimits;
  static constexpr Field fields[] = {
      field<&L::grasps>("grasps", "limits of end-effectors with an envelope"),
      field<&L::clearance>("clearance", "m", "required clearance between bodies; null: not monitored").or_null(),
      field<&L::joints>("joints", "limits of the joints that have any; absent in results of earlier versions"),
  };
  static constexpr Type type = structure<L>("SceneLimits", "limits shown in plots.", fields);
  return type;
}

template <>
const Type& type_of<SceneDocument>() {
  using S = SceneDocument;
  static constexpr Field fields[] = {
      derived<[](const S&) { return SceneFormat::second; }>("schema", "", "format of this file"),
      field<&S::version>("version", "version of Grapnel"),
      derived<[](const S& s) {
        return OfScenario{s.scenario_name, s.scenario_sha256};
      }>("scenario", "", "the simulated scenario"),
      derived<[](const S& s) { return s.scene->planar; }>(
          "planar", "",
          "true if all motion stays in the plane z = 0: all joints turn about z or slide in the plane; the plane "
          "contains the centre of mass of every body (with what is fixed to it) and is a principal plane of that body; "
          "end-effectors and grasp points lie in it; initial velocities, momentum, gravity, orbit and loads lie in it "
          "(all to "
          "1e-9)"),
      part<&S::scene, &Scene::bodies>("bodies", "", "base first, then links (parents before children), then targets"),
      part<&S::scene, &Scene::end_effectors>("end_effectors", "", "end-effectors of the robot"),
      part<&S::scene, &Scene::grasp_points>("grasp_points", "", "grasp points of all targets"),
      part<&S::scene, &Scene::grasps>("grasps", "", "grasps of the scenario"),
      part<&S::scene, &Scene::meshes>("meshes", "", "meshes that shapes refer to"),
      part<&S::scene, &Scene::limits>("limits", "", "absent in results of earlier versions"),
      part<&S::scene, &Scene::obstacles>("obstacles", "", "bodies fixed in W; absent in results of earlier versions"),
      part<&S::scene, &Scene::actuators>("actuators", "",
                                         "wheels, gyros and thrusters; absent in results of earlier versions"),
      part<&S::scene, &Scene::central_body>(
          "central_body", "", "whose orbit W follows; null: no orbit. Absent in results of earlier versions")
          .or_null(),
  };
  static constexpr Type type = structure<S>("Scene", "bodies of the scenario, their tree, and their shapes.", fields);
  return type;
}

}  // namespace grapnel
