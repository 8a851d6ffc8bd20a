// capture.glb against the rules of glTF 2.0 for binary files and animations, and against the run.

#include "grapnel/report/gltf_export.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <set>

#include "grapnel/report/drawn_shape.hpp"
#include "report/sample_run.hpp"
#include "result/sample_result.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace gltf_test {

using Json = nlohmann::json;

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < 4; ++k)
    value |= static_cast<std::uint32_t>(static_cast<unsigned char>(bytes.at(at + k))) << (8 * k);
  return value;
}

// A parsed file; violations of the rules fail the test.
class Glb {
 public:
  explicit Glb(const std::string& bytes) {
    EXPECT_EQ(word(bytes, 0), 0x46546c67u);
    EXPECT_EQ(word(bytes, 4), 2u);
    EXPECT_EQ(word(bytes, 8), bytes.size());
    const std::size_t json_length = word(bytes, 12);
    EXPECT_EQ(word(bytes, 16), 0x4e4f534au);
    EXPECT_EQ(json_length % 4, 0u);
    document = Json::parse(bytes.substr(20, json_length));
    const std::size_t binary = 20 + json_length, length = word(bytes, binary);
    EXPECT_EQ(word(bytes, binary + 4), 0x004e4942u);
    EXPECT_EQ(length % 4, 0u);
    EXPECT_EQ(binary + 8 + length, bytes.size());
    buffer_ = bytes.substr(binary + 8);
    EXPECT_EQ(document["buffers"].size(), 1u);
    EXPECT_EQ(document["buffers"][0]["byteLength"].get<std::size_t>(), buffer_.size());
    EXPECT_FALSE(document["buffers"][0].contains("uri"));
    check_accessors();
    check_meshes();
    check_nodes();
    check_animations();
  }

  std::vector<float> floats(int accessor) const {
    const Json& a = document["accessors"].at(static_cast<std::size_t>(accessor));
    EXPECT_EQ(a["componentType"], 5126);
    const std::size_t count = a["count"].get<std::size_t>() * width(a);
    std::vector<float> values;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t bits = word(buffer_, offset(a) + 4 * i);
      float value = 0;
      std::memcpy(&value, &bits, 4);
      values.push_back(value);
    }
    return values;
  }
  // Keyframes of a node: "translation" or "rotation"; input and output accessors.
  std::pair<int, int> channel(const std::string& node, const std::string& path) const {
    const Json& animation = document["animations"][0];
    for (const Json& c : animation["channels"]) {
      const Json& at = document["nodes"][c["target"]["node"].get<std::size_t>()];
      if (at["name"] != node || c["target"]["path"] != path) continue;
      const Json& sampler = animation["samplers"][c["sampler"].get<std::size_t>()];
      return {sampler["input"].get<int>(), sampler["output"].get<int>()};
    }
    ADD_FAILURE() << "no channel " << node << " " << path;
    return {0, 0};
  }
  Json document;

 private:
  static std::size_t width(const Json& accessor) {
    return accessor["type"] == "SCALAR" ? 1 : accessor["type"] == "VEC3" ? 3 : 4;
  }
  std::size_t offset(const Json& accessor) const {
    return document["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteOffset"].get<std::size_t>();
  }
  void check_accessors() {
    std::size_t end = 0;
    for (const Json& view : document["bufferViews"]) {
      EXPECT_EQ(view["buffer"], 0);
      EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
      EXPECT_GE(view["byteOffset"].get<std::size_t>(), end) << "views overlap";
      EXPECT_GT(view["byteLength"].get<std::size_t>(), 0u);
      end = view["byteOffset"].get<std::size_t>() + view["byteLength"].get<std::size_t>();
      EXPECT_LE(end, buffer_.size());
    }
    for (std::size_t i = 0; i < document["accessors"].size(); ++i) {
      const Json& a = document["accessors"][i];
      EXPECT_GT(a["count"].get<std::size_t>(), 0u);
      const Json& view = document["bufferViews"][a["bufferView"].get<std::size_t>()];
      EXPECT_EQ(view["byteLength"].get<std::size_t>(), a["count"].get<std::size_t>() * width(a) * 4);
      if (a["componentType"] == 5125) continue;
      const std::vector<float> values = floats(static_cast<int>(i));
      for (std::size_t k = 0; k < width(a); ++k) {
        float low = values[k], high = values[k];
        for (std::size_t j = k; j < values.size(); j += width(a))
          low = std::min(low, values[j]), high = std::max(high, values[j]);
        EXPECT_TRUE(std::isfinite(low) && std::isfinite(high));
        EXPECT_EQ(a["min"][k].get<float>(), low);
        EXPECT_EQ(a["max"][k].get<float>(), high);
      }
    }
  }
  void check_meshes() {
    for (const Json& mesh : document["meshes"]) {
      for (const Json& primitive : mesh["primitives"]) {
        const std::vector<float> points = floats(primitive["attributes"]["POSITION"]),
                                 normals = floats(primitive["attributes"]["NORMAL"]);
        ASSERT_EQ(points.size(), normals.size());
        for (std::size_t i = 0; i < normals.size(); i += 3)
          EXPECT_NEAR(std::hypot(normals[i], normals[i + 1], normals[i + 2]), 1, 1e-6);
        const Json& indices = document["accessors"][primitive["indices"].get<std::size_t>()];
        EXPECT_EQ(indices["componentType"], 5125);
        EXPECT_EQ(indices["count"].get<std::size_t>() % 3, 0u);
        for (std::size_t i = 0; i < indices["count"].get<std::size_t>(); ++i)
          EXPECT_LT(word(buffer_, offset(indices) + 4 * i), points.size() / 3);
        EXPECT_LT(primitive["material"].get<std::size_t>(), document["materials"].size());
      }
    }
  }
  void check_nodes() {
    std::set<std::size_t> children;
    for (const Json& node : document["nodes"]) {
      for (const Json& child : node.value("children", Json::array())) {
        EXPECT_LT(child.get<std::size_t>(), document["nodes"].size());
        EXPECT_TRUE(children.insert(child.get<std::size_t>()).second) << "a node with two parents";
      }
      if (node.contains("mesh")) {
        EXPECT_LT(node["mesh"].get<std::size_t>(), document["meshes"].size());
      }
    }
    EXPECT_EQ(document["scenes"][0]["nodes"], Json::array({0}));
    EXPECT_EQ(children.count(0), 0u);
    EXPECT_EQ(children.size() + 1, document["nodes"].size());
  }
  void check_animations() {
    std::set<std::pair<int, std::string>> targets;
    for (const Json& c : document["animations"][0]["channels"])
      EXPECT_TRUE(targets.insert({c["target"]["node"].get<int>(), c["target"]["path"]}).second);
    for (const Json& sampler : document["animations"][0]["samplers"]) {
      const std::vector<float> times = floats(sampler["input"]), values = floats(sampler["output"]);
      for (std::size_t i = 1; i < times.size(); ++i) EXPECT_LT(times[i - 1], times[i]);
      EXPECT_GE(times.front(), 0);
      const std::size_t width = values.size() / times.size();
      if (width != 4) continue;
      for (std::size_t i = 0; i < values.size(); i += 4) {
        double square = 0, along = 0;
        for (std::size_t k = 0; k < 4; ++k)
          square += values[i + k] * values[i + k], along += i > 0 ? values[i + k] * values[i + k - 4] : 1;
        EXPECT_NEAR(square, 1, 1e-6);
        EXPECT_GT(along, 0) << "the quaternion changes its sign";
      }
    }
  }
  std::string buffer_;
};

// Pose of a body at a time with glTF's LINEAR interpolation: position, and quaternion x, y, z, w.
struct Played {
  Vector3d p;
  double q[4];
};

Played play(const Glb& glb, const std::string& node, double time) {
  const auto [input, translation] = glb.channel(node, "translation");
  const std::vector<float> times = glb.floats(input), p = glb.floats(translation),
                           q = glb.floats(glb.channel(node, "rotation").second);
  std::size_t k = 0;
  while (k + 2 < times.size() && times[k + 1] < time) ++k;
  const double share = std::min(std::max((time - times[k]) / (static_cast<double>(times[k + 1]) - times[k]), 0.0), 1.0);
  Played played{};
  for (int c = 0; c < 3; ++c) {
    const std::size_t at = 3 * k + static_cast<std::size_t>(c);
    played.p[c] = p[at] + share * (static_cast<double>(p[at + 3]) - p[at]);
  }
  double along = 0;
  for (std::size_t c = 0; c < 4; ++c) along += static_cast<double>(q[4 * k + c]) * q[4 * k + 4 + c];
  const double angle = std::acos(std::min(along, 1.0)), s = std::sin(angle);
  for (std::size_t c = 0; c < 4; ++c) {
    played.q[c] = s < 1e-9
                      ? q[4 * k + c]
                      : (std::sin((1 - share) * angle) * q[4 * k + c] + std::sin(share * angle) * q[4 * k + 4 + c]) / s;
  }
  return played;
}

TEST(Gltf, FollowsTheFormatAndTheMotion) {
  // At the higher spin every sample is needed; at the lower one some are omitted.
  for (const double spin : {1.7, 0.1}) {
    if (test::kSanitized && spin > 1) continue;
    const RunSource run = test::sample_run(spin > 1, "", spin);
    const Glb glb(glb_bytes(run, "9.8.7"));
    EXPECT_EQ(glb.document["asset"]["version"], "2.0");
    EXPECT_EQ(glb.document["asset"]["generator"], "Grapnel 9.8.7");
    const Json& extras = glb.document["asset"]["extras"];
    const double metres = extras["largest_position_deviation_m"], radians = extras["largest_angle_deviation_rad"];
    EXPECT_LT(metres, 1e-3);   // measured 0 and 2.4e-5
    EXPECT_LT(radians, 1e-3);  // measured 0 and 8e-16: slerp is exact at a constant rate
    if (spin < 1) {
      EXPECT_LT(extras["keyframes"].get<int>(), 190) << "nothing was left out";  // measured 169 of 204
    }
    EXPECT_LT(extras["largest_time_shift_s"].get<double>(), 1e-5);  // measured 3e-6 at 10 s, for three equal times
    for (std::size_t b = 0; b < run.scene->bodies.size(); ++b) {
      const RecordedPose pose(run.series, run.scene->bodies[b].series);
      for (std::size_t i = 0; i < run.series.time.size(); ++i) {
        const Played is = play(glb, run.scene->bodies[b].name, run.series.time[i]);
        EXPECT_LT(norm(is.p - pose.position(i)), metres + 1e-6) << i;  // single precision
        const Quaterniond q = pose.quaternion(i);
        const double along = std::abs(is.q[3] * q.w + is.q[0] * q.x + is.q[1] * q.y + is.q[2] * q.z);
        EXPECT_LT(2 * std::acos(std::min(along, 1.0)), radians + 1e-3) << i;  // acos near 1 in single precision
      }
    }
  }
}

TEST(Gltf, ObstaclesAreNodesWithoutMotion) {
  RunSource run = test::sample_run(false);
  const Posed X_WO{rotation_about({1, 0, 0}, 0.3), {0, 0, -2}};
  run.scene->obstacles = {{"floor", X_WO, true, {}},
                          {"post", X_WO, false, {{"sphere", {0.2, 0, 0}, Posed::identity(), -1}}}};
  const Json& document = Glb(glb_bytes(run, "1")).document;
  const std::size_t bodies = run.scene->bodies.size();
  ASSERT_EQ(document["nodes"].size(), 1 + bodies + 2);
  EXPECT_EQ(document["nodes"][0]["children"].size(), bodies + 2);
  for (std::size_t i = 0; i < 2; ++i) {
    const Json& node = document["nodes"][1 + bodies + i];
    EXPECT_EQ(node["name"], run.scene->obstacles[i].name);
    EXPECT_EQ(node["translation"], Json::array({0.0, 0.0, -2.0}));
    EXPECT_EQ(document["meshes"][node["mesh"].get<std::size_t>()]["name"], node["name"]);
  }
  EXPECT_EQ(document["animations"][0]["channels"].size(), 2 * bodies);
}

// The square of a half-space is below its surface, and covers the motion of the bodies.
TEST(DrawnShape, OfAHalfSpaceIsASquareOfItsSurface) {
  const RunSource run = test::sample_run(false);
  const MotionExtent extent = motion_extent(run);
  for (const SceneBody& body : run.scene->bodies) {
    const RecordedPose pose(run.series, body.series);
    for (std::size_t i = 0; i < run.series.time.size(); ++i)
      EXPECT_LE(norm(pose.position(i) - extent.centre), extent.radius);
  }
  const SceneObstacle wall{"wall", {rotation_about({0.6, 0, 0.8}, 1), {0.3, -2, 1}}, true, {}};
  const std::vector<SceneShape> shapes = drawn_shapes(wall, extent);
  ASSERT_EQ(shapes.size(), 1u);
  const Vector3d centre = wall.X_WO * shapes[0].X_BG.p;
  EXPECT_DOUBLE_EQ(shapes[0].X_BG.p[2] + 0.5 * shapes[0].size[2], 0);
  EXPECT_LT(norm(cross(wall.X_WO.R * Vector3d{0, 0, 1}, extent.centre - centre)), 1e-12);  // measured 6e-16
  EXPECT_DOUBLE_EQ(shapes[0].size[0], 2 * extent.radius);
}

TEST(Gltf, TurnsZUp) {
  const Glb glb(glb_bytes(test::sample_run(false), "1"));
  const Json& q = glb.document["nodes"][0]["rotation"];
  const Rotationd R = rotation_matrix(Quaterniond{q[3], q[0], q[1], q[2]});
  const Vector3d up = R * Vector3d{0, 0, 1};
  EXPECT_LT(norm(up - Vector3d{0, 1, 0}), 1e-15);
}

TEST(Gltf, OddNamesStayNames) {
  const std::string odd = "\"},{\\ <b>\xff\n\xc3\xa4";
  const Glb glb(glb_bytes(test::sample_run(true, odd), "1"));
  EXPECT_EQ(glb.document["nodes"][1]["name"], "base\"},{\\ <b>\xef\xbf\xbd\n\xc3\xa4");
}

TEST(Gltf, ReportsAMissingScene) {
  RunSource run = test::sample_run(true);
  run.scene.reset();
  try {
    glb_bytes(run, "1");
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("scene.json: missing"), std::string::npos) << error.what();
  }
}

TEST(Gltf, NumbersThatItCannotHoldAreNamed) {
  const auto fault = [](auto change) {
    RunSource run = test::sample_run(true);
    change(run.series);
    return test::message_of([&] { glb_bytes(run, "1"); });
  };
  const auto set = [](TimeSeries& s, const char* path, double value) {
    for (Series& one : s.series) {
      if (one.path == path) one.data[8] = value;
    }
  };
  EXPECT_EQ(fault([](TimeSeries& s) { s.time[5] = INFINITY; }), "made-up/timeseries.h5: a time is not finite");
  const std::string pose = "made-up/timeseries.h5: the pose of ball is not finite";
  EXPECT_EQ(fault([&](TimeSeries& s) { set(s, "targets/ball/quaternion_wxyz", NAN); }), pose);
  EXPECT_EQ(fault([&](TimeSeries& s) { set(s, "targets/ball/position", 1e300); }), pose);  // overflows a float
}

// Outward triangles form a closed surface: its signed volume is that of the shape.
double volume(const DrawnMesh& mesh) {
  double sum = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const auto p = [&](int i) { return mesh.points[static_cast<std::size_t>(i)]; };
    sum += dot(p(a), cross(p(b), p(c))) / 6;
  }
  return sum;
}

TEST(DrawnShape, TrianglesEncloseTheVolume) {
  Scene scene;
  const Posed X{rotation_about({0.6, 0, 0.8}, 1.1), {0.3, -2, 1}};
  const double pi = 3.14159265358979323846;
  EXPECT_NEAR(volume(triangles_of(scene, {"box", {1, 2, 3}, X, -1})), 6, 1e-12);
  EXPECT_NEAR(volume(triangles_of(scene, {"cylinder", {0.5, 2, 0}, X, -1}, 128)), pi * 0.25 * 2,
              1e-3);                                                                              // measured 6e-4
  EXPECT_NEAR(volume(triangles_of(scene, {"sphere", {1, 0, 0}, X, -1}, 128)), 4 * pi / 3, 5e-3);  // measured 4.2e-3
  EXPECT_NEAR(volume(triangles_of(scene, {"capsule", {1, 2, 0}, X, -1}, 128)), 4 * pi / 3 + 2 * pi,
              1e-2);  // measured 6.7e-3
  scene.meshes = {{"tetrahedron", {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3}}};
  EXPECT_NEAR(volume(triangles_of(scene, {"mesh", {2, 2, 2}, X, 0})), 8.0 / 6, 1e-12);
  EXPECT_NEAR(volume(triangles_of(scene, {"mesh", {-2, 2, 2}, X, 0})), 8.0 / 6, 1e-12);  // mirrored
}

TEST(DrawnShape, AreAllOfTheBody) {
  Scene scene;
  SceneBody body;
  body.kind = "target", body.mass = 1;
  body.shapes = {{"box", {1, 2, 3}, Posed::identity(), -1}, {"sphere", {0.5, 0, 0}, Posed::identity(), -1}};
  scene.bodies = {body};
  const std::vector<SceneShape> shapes = drawn_shapes(scene, 0);
  ASSERT_EQ(shapes.size(), 2u);
  EXPECT_EQ(shapes[0].shape, "box");
  EXPECT_EQ(shapes[1].shape, "sphere");
  scene.bodies[0].shapes.clear();
  EXPECT_EQ(drawn_shapes(scene, 0).size(), 1u);
}

TEST(DrawnShape, BoxHasTheBodysInertia) {
  SceneBody body;
  body.mass = 12;
  const Rotationd R = rotation_about({0.6, 0, 0.8}, 0.7);
  body.inertia = rotate(R, Symmetric3d::diagonal(4 + 9, 1 + 9, 1 + 4));  // edges 1, 2, 3
  const SceneShape box = box_of_inertia(body);
  EXPECT_EQ(box.shape, "box");
  Symmetric3d is = rotate(box.X_BG.R, Symmetric3d::diagonal(box.size[1] * box.size[1] + box.size[2] * box.size[2],
                                                            box.size[0] * box.size[0] + box.size[2] * box.size[2],
                                                            box.size[0] * box.size[0] + box.size[1] * box.size[1]));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(is(i, j), body.inertia(i, j), 1e-12);
  }
}

}  // namespace gltf_test
}  // namespace grapnel
