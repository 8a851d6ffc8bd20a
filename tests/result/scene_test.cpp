#include "grapnel/result/scene.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "grapnel/describe/contract.hpp"
#include "grapnel/result/result_documents.hpp"
#include "result/sample_result.hpp"
#include "support/schema_check.hpp"

namespace grapnel {
namespace scene_test {

using Json = nlohmann::ordered_json;
using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

Posed pose(double angle, const Vector3d& p) { return {rotation_about({0.6, 0, 0.8}, angle), p}; }

// Every field has a distinct value, so that interchanged fields are detected.
Scene sample_scene() {
  Scene scene;
  scene.planar = true;
  SceneBody base;
  base.name = "bus", base.kind = "base", base.series = "base";
  base.mass = 1 / 3.0, base.com = {0.1, -0.2, 0.3}, base.inertia = {1.1, 1.2, 1.3, 0.01, 0.02, 0.03};
  base.shapes = {{"mesh", {0.001, 0.002, 0.003}, pose(0.3, {1, 2, 3}), 0},
                 {"box", {0.4, 0.5, 0.6}, pose(0.7, {-1, -2, -3}), -1}};
  SceneBody link;
  link.name = "upper \"arm\" <b>", link.kind = "link", link.parent = "bus", link.series = "links/upper";
  link.joint = SceneJoint{"shoulder", "continuous", {0, 0.6, -0.8}, pose(-2, {4, 5, 6})};
  link.mass = 7, link.com = {8, 9, 10};
  SceneBody target;
  target.name = "bus", target.kind = "target", target.series = "targets/bus";  // like the base
  target.shapes = {{"cylinder", {0.5, 1.5, 0}, pose(3.1, {0, 0, 1e-300}), -1}};
  scene.bodies = {base, link, target};
  scene.end_effectors = {{"hand", link.name, pose(1, {0.25, 0, 0})}};
  scene.grasp_points = {{"bus", "ring", {0, 1, 0}, {}}, {"bus", "bar", {0, 2, 0}, Vector3d{0, 0.8, 0.6}}};
  scene.grasps = {{"hand", "bus", "bar", "hinge"}};
  scene.meshes = {{"part.stl", {0, 0, 0, 1, 0, 0, 0, 0.1, 0, 0, 0, 1}, {0, 1, 2, 0, 3, 1}}};
  scene.limits.grasps = {{"hand", 0.02, std::numeric_limits<double>::infinity()}};
  scene.limits.clearance = 0.05;
  scene.limits.joints = {{"shoulder", -1.5, 2.5, 0.75, std::numeric_limits<double>::infinity()}};
  scene.actuators = {{"fast", "wheel", {}, {0, 0.6, 0.8}, {}, 400},
                     {"jet", "thruster", Vector3d{0.5, 0, 1}, {0, -1, 0}, {}, 22},
                     {"turner", "gyro", {}, {0, 0, 1}, Vector3d{1, 0, 0}, std::numeric_limits<double>::infinity()}};
  scene.central_body = SceneCentralBody{"mars", 3396190};
  scene.obstacles = {{"floor", pose(0.4, {0.5, 0.25, -1}), true, {}},
                     {"post", pose(-0.2, {3, 2, 1}), false, {{"capsule", {0.2, 0.9, 0}, pose(0.1, {0, 0, 2}), -1}}}};
  return scene;
}

std::string sample_text() { return scene_json(sample_scene(), "case \"1\"", "abc", "1.2.3"); }

void expect_same(const Vector3d& a, const Vector3d& b) { EXPECT_THAT(a.e, ElementsAre(b[0], b[1], b[2])); }
void expect_same(const Posed& a, const Posed& b) {
  expect_same(a.p, b.p);
  EXPECT_LT(rotation_angle(transpose(a.R) * b.R), 1e-15);  // measured 4e-16: by a quaternion and back
}

class SceneFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) {
    test::put_bytes(folder_ / "scene.json", text);
    return folder_ / "scene.json";
  }
  // The error for a sample with one value replaced, without the path, which must come first.
  std::string fault(const std::string& pointer, const Json& value) {
    Json json = Json::parse(sample_text());
    json[Json::json_pointer(pointer)] = value;
    return fault_of(json.dump());
  }
  std::string fault_of(const std::string& text) {
    const std::filesystem::path path = write(text);
    const std::string message = message_of([&] { read_scene(path); });
    if (message.empty()) return "";
    EXPECT_THAT(message, StartsWith(path.string() + ": "));
    return message.substr(std::min(message.size(), path.string().size() + 2));
  }

  test::TemporaryFolder folder_;
};

TEST_F(SceneFile, ReadsBackWhatWasWritten) {
  const Scene a = sample_scene(), b = read_scene(write(sample_text()));
  EXPECT_EQ(b.planar, a.planar);
  ASSERT_EQ(b.bodies.size(), a.bodies.size());
  for (std::size_t i = 0; i < a.bodies.size(); ++i) {
    const SceneBody &x = a.bodies[i], &y = b.bodies[i];
    EXPECT_EQ(y.name, x.name);
    EXPECT_EQ(y.kind, x.kind);
    EXPECT_EQ(y.parent, x.parent);
    EXPECT_EQ(y.series, x.series);
    EXPECT_EQ(y.mass, x.mass);
    expect_same(y.com, x.com);
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) EXPECT_EQ(y.inertia(r, c), x.inertia(r, c));
    }
    ASSERT_EQ(y.joint.has_value(), x.joint.has_value());
    if (x.joint) {
      EXPECT_EQ(y.joint->name, x.joint->name);
      EXPECT_EQ(y.joint->type, x.joint->type);
      expect_same(y.joint->axis, x.joint->axis);
      expect_same(y.joint->X_PF, x.joint->X_PF);
    }
    ASSERT_EQ(y.shapes.size(), x.shapes.size());
    for (std::size_t k = 0; k < x.shapes.size(); ++k) {
      EXPECT_EQ(y.shapes[k].shape, x.shapes[k].shape);
      expect_same(y.shapes[k].size, x.shapes[k].size);
      expect_same(y.shapes[k].X_BG, x.shapes[k].X_BG);
      EXPECT_EQ(y.shapes[k].mesh, x.shapes[k].mesh);
    }
  }
  ASSERT_EQ(b.end_effectors.size(), 1u);
  EXPECT_EQ(b.end_effectors[0].name, "hand");
  EXPECT_EQ(b.end_effectors[0].body, a.bodies[1].name);
  expect_same(b.end_effectors[0].X_BE, a.end_effectors[0].X_BE);
  ASSERT_EQ(b.grasp_points.size(), 2u);
  EXPECT_FALSE(b.grasp_points[0].approach_direction);
  EXPECT_EQ(b.grasp_points[1].target + "/" + b.grasp_points[1].name, "bus/bar");
  expect_same(b.grasp_points[1].position, {0, 2, 0});
  expect_same(*b.grasp_points[1].approach_direction, {0, 0.8, 0.6});
  ASSERT_EQ(b.grasps.size(), 1u);
  EXPECT_EQ(b.grasps[0].end_effector + b.grasps[0].target + b.grasps[0].grasp_point + b.grasps[0].model,
            "handbusbarhinge");
  ASSERT_EQ(b.meshes.size(), 1u);
  EXPECT_EQ(b.meshes[0].name, "part.stl");
  EXPECT_EQ(b.meshes[0].vertices, a.meshes[0].vertices);
  EXPECT_EQ(b.meshes[0].triangles, a.meshes[0].triangles);
  ASSERT_EQ(b.obstacles.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(b.obstacles[i].name, a.obstacles[i].name);
    EXPECT_EQ(b.obstacles[i].half_space, i == 0);
    expect_same(b.obstacles[i].X_WO, a.obstacles[i].X_WO);
    EXPECT_EQ(b.obstacles[i].shapes.size(), i);
  }
  EXPECT_EQ(b.obstacles[1].shapes[0].shape, "capsule");
  expect_same(b.obstacles[1].shapes[0].X_BG, a.obstacles[1].shapes[0].X_BG);
}

TEST_F(SceneFile, OfAnEarlierVersionHasNoObstacles) {
  Json json = Json::parse(sample_text());
  json.erase("obstacles");
  EXPECT_TRUE(read_scene(write(json.dump())).obstacles.empty());
}

// web/src/data.ts and docs/formats/scene.md use these keys.
TEST_F(SceneFile, HasTheContractsKeysInOrder) {
  const auto keys = [](const Json& object) {
    std::string text;
    for (const auto& [key, value] : object.items()) text += key + " ";
    return text;
  };
  const Json json = Json::parse(sample_text());
  EXPECT_EQ(keys(json),
            "schema version scenario planar bodies end_effectors grasp_points grasps meshes limits obstacles actuators "
            "central_body ");
  EXPECT_EQ(json["schema"], "grapnel-scene/2");
  EXPECT_EQ(json["version"], "1.2.3");
  EXPECT_EQ(keys(json["scenario"]), "name sha256 ");
  EXPECT_EQ(json["scenario"]["name"], "case \"1\"");
  EXPECT_EQ(json["scenario"]["sha256"], "abc");
  for (const Json& body : json["bodies"])
    EXPECT_EQ(keys(body), "name kind parent joint series mass com inertia geometry ");
  EXPECT_TRUE(json["bodies"][0]["parent"].is_null());
  EXPECT_TRUE(json["bodies"][0]["joint"].is_null());
  EXPECT_EQ(json["bodies"][1]["geometry"], Json::array());
  EXPECT_EQ(keys(json["bodies"][1]["joint"]), "name type axis position quaternion_wxyz ");
  EXPECT_EQ(keys(json["bodies"][0]["geometry"][0]), "shape size position quaternion_wxyz mesh ");
  EXPECT_EQ(keys(json["bodies"][0]["geometry"][1]), "shape size position quaternion_wxyz ");
  EXPECT_THAT(json["bodies"][0]["inertia"], ElementsAre(1.1, 1.2, 1.3, 0.01, 0.02, 0.03));
  EXPECT_EQ(keys(json["end_effectors"][0]), "name body position quaternion_wxyz ");
  EXPECT_EQ(keys(json["grasp_points"][0]), "target name position approach_direction ");
  EXPECT_TRUE(json["grasp_points"][0]["approach_direction"].is_null());
  EXPECT_EQ(keys(json["grasps"][0]), "end_effector target grasp_point model ");
  EXPECT_EQ(keys(json["meshes"][0]), "name vertices triangles ");
  EXPECT_EQ(keys(json["limits"]), "grasps clearance joints ");
  EXPECT_EQ(json["limits"]["grasps"][0],
            (Json{{"end_effector", "hand"}, {"position", 0.02}, {"velocity", nullptr}}));  // infinite: any
  EXPECT_EQ(json["limits"]["clearance"], 0.05);
  EXPECT_EQ(json["limits"]["joints"][0],
            (Json{{"joint", "shoulder"}, {"lower", -1.5}, {"upper", 2.5}, {"rate", 0.75}, {"effort", nullptr}}));
  EXPECT_EQ(json["actuators"][0], Json::parse(R"({"name": "fast", "kind": "wheel", "position": null,
      "axis": [0.0, 0.6, 0.8], "spin_axis": null, "limit": 400.0})"));
  EXPECT_EQ(json["actuators"][1]["position"], Json::parse("[0.5, 0.0, 1.0]"));
  EXPECT_EQ(json["actuators"][2]["spin_axis"], Json::parse("[1.0, 0.0, 0.0]"));
  EXPECT_TRUE(json["actuators"][2]["limit"].is_null());
  EXPECT_EQ(json["central_body"], (Json{{"name", "mars"}, {"radius", 3396190}}));
  EXPECT_EQ(sample_text().back(), '\n');
}

TEST_F(SceneFile, ReportsLocationAndKindOfDamage) {
  EXPECT_EQ(fault("/schema", "grapnel-summary/1"), "schema is 'grapnel-summary/1', not grapnel-scene/2");
  EXPECT_EQ(fault("/planar", 1), "planar: not true or false");
  EXPECT_EQ(fault("/bodies", Json::array()), "bodies: the list is empty");
  EXPECT_EQ(fault("/bodies", "none"), "bodies: not a list");
  EXPECT_EQ(fault("/bodies/0", 3), "bodies[0]: not an object");
  EXPECT_EQ(fault("/bodies/0/kind", "link"), "bodies[0].kind: exactly the first body must be the base");
  EXPECT_EQ(fault("/bodies/1/kind", "base"), "bodies[1].kind: exactly the first body must be the base");
  EXPECT_EQ(fault("/bodies/1/kind", "arm"), "bodies[1].kind: 'arm' is not one of base, link, target, part");
  EXPECT_EQ(fault("/bodies/2/kind", "link"), "bodies[2].parent: not a text");
  EXPECT_EQ(fault("/bodies/1/name", "bus"), "bodies[1].name: duplicate body 'bus'");
  EXPECT_EQ(fault("/bodies/1/parent", "nobody"), "bodies[1].parent: no body 'nobody' before this one");
  EXPECT_EQ(fault("/bodies/1/joint", nullptr), "bodies[1].joint: not an object");
  EXPECT_EQ(fault("/bodies/1/joint/axis", {0, 0, 2}), "bodies[1].joint.axis: not a unit vector");
  EXPECT_EQ(fault("/bodies/1/joint/axis", {0, 0}), "bodies[1].joint.axis: 2 numbers instead of 3");
  EXPECT_EQ(fault("/bodies/1/joint/quaternion_wxyz", {0, 0, 0, 0}),
            "bodies[1].joint.quaternion_wxyz: not a unit quaternion");
  EXPECT_EQ(fault("/bodies/1/mass", nullptr), "bodies[1].mass: not a number");
  EXPECT_EQ(fault("/schema", "grapnel-scene/1"), "schema is 'grapnel-scene/1', not grapnel-scene/2");
  EXPECT_EQ(fault("/bodies/1/geometry", nullptr), "bodies[1].geometry: not a list");
  EXPECT_EQ(fault("/bodies/0/geometry/1/shape", "torus"),
            "bodies[0].geometry[1].shape: 'torus' is not one of box, cylinder, capsule, sphere, mesh");
  EXPECT_EQ(fault("/bodies/0/geometry/0/mesh", 1), "bodies[0].geometry[0].mesh: 1 is out of range: at most 1 entries");
  EXPECT_EQ(fault("/bodies/0/geometry/0/mesh", -1), "bodies[0].geometry[0].mesh: not a whole number, at least 0");
  EXPECT_EQ(fault("/end_effectors/0/body", "segment"), "end_effectors[0].body: there is no 'segment'");
  EXPECT_EQ(fault("/grasp_points/1/target", "moon"), "grasp_points[1].target: there is no 'moon'");
  EXPECT_EQ(fault("/grasps/0/end_effector", "foot"), "grasps[0].end_effector: there is no 'foot'");
  EXPECT_EQ(fault("/grasps/0/grasp_point", "rod"), "grasps[0].grasp_point: 'bus' has no grasp point 'rod'");
  EXPECT_EQ(fault("/grasps/0/model", "glue"), "grasps[0].model: 'glue' is not one of rigid, hinge, point, contact");
  EXPECT_EQ(fault("/meshes/0/vertices", {1, 2}), "meshes[0].vertices: not three numbers per vertex");
  EXPECT_EQ(fault("/meshes/0/vertices", {1, 2, "3"}), "meshes[0].vertices[2]: not a number");
  EXPECT_EQ(fault("/meshes/0/vertices/1", nullptr), "meshes[0].vertices[1]: not a number");
  EXPECT_EQ(fault("/meshes/0/triangles/0", 18446744073709551615u),
            "meshes[0].triangles[0]: 18446744073709551615 is out of range: at most 4 entries");
  EXPECT_EQ(fault("/meshes/0/triangles", {0, 1}), "meshes[0].triangles: not three vertices per triangle");
  EXPECT_EQ(fault("/meshes/0/triangles/5", 4), "meshes[0].triangles[5]: 4 is out of range: at most 4 entries");
  EXPECT_EQ(fault("/obstacles/0/half_space", 1), "obstacles[0].half_space: not true or false");
  EXPECT_EQ(fault("/obstacles/1/geometry/0/shape", "torus"),
            "obstacles[1].geometry[0].shape: 'torus' is not one of box, cylinder, capsule, sphere, mesh");
  EXPECT_EQ(fault("/planar", true), "");
}

TEST_F(SceneFile, MissesNothing) {
  const Json whole = Json::parse(sample_text());
  for (const auto& [key, value] : whole.items()) {
    if (key == "version" || key == "scenario" || key == "limits" || key == "obstacles" || key == "actuators" ||
        key == "central_body")
      continue;  // not used by bodies
    Json json = whole;
    json.erase(key);
    EXPECT_THAT(fault_of(json.dump()), HasSubstr("'" + key + "' is missing"));
  }
}

TEST_F(SceneFile, IsNoJson) {
  const std::string text = sample_text();
  EXPECT_THAT(fault_of(""), HasSubstr("not JSON: parse error at line 1, column 1"));
  EXPECT_THAT(fault_of("[1, 2]"), HasSubstr("not a JSON object"));
  // Truncated anywhere it is rejected with a message; without its last newline it is complete.
  for (std::size_t n = 0; n + 1 < text.size(); n += 7) {
    EXPECT_THAT(fault_of(text.substr(0, n)), HasSubstr("not JSON: ")) << n;
  }
  EXPECT_EQ(message_of([&] { read_scene(folder_ / "none.json"); }),
            (folder_ / "none.json: No such file or directory").string());
  EXPECT_EQ(message_of([&] { read_scene(folder_.path()); }), folder_.path().string() + ": not a file");
  // Deep nesting exhausts no memory, and reading does not block on a pipe.
  EXPECT_EQ(fault_of(std::string(100'000, '[')), "damaged: nested deeper than 64 levels");
  ASSERT_EQ(::mkfifo((folder_ / "pipe.json").c_str(), 0600), 0);
  EXPECT_EQ(message_of([&] { read_scene(folder_ / "pipe.json"); }), (folder_ / "pipe.json: not a file").string());
}

TEST_F(SceneFile, NumbersThatJsonLacksAreRefusedWhenRead) {
  Scene scene = sample_scene();
  scene.bodies[0].mass = NAN;
  EXPECT_EQ(fault_of(scene_json(scene, "", "", "")), "bodies[0].mass: not a number");
}

TEST(Scene, FollowsSchema) {
  const test::SchemaCheck schema(json_schema(type_of<SceneDocument>(), "scene"));
  EXPECT_THAT(schema.faults_of(nlohmann::json::parse(sample_text())), testing::IsEmpty());
  EXPECT_THAT(schema.faults_of(nlohmann::json::parse(scene_json({}, "", "", ""))), testing::IsEmpty());
  nlohmann::json wrong = nlohmann::json::parse(sample_text());
  wrong["bodies"][0]["mass"] = nullptr;
  EXPECT_THAT(schema.faults_of(wrong), testing::Not(testing::IsEmpty()));
}

}  // namespace scene_test
}  // namespace grapnel
