#include "grapnel/report/gltf_export.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "grapnel/report/drawn_shape.hpp"
#include "grapnel/report/figure.hpp"
#include "grapnel/report/series_table.hpp"
#include "grapnel/result/atomic_file.hpp"

namespace grapnel {

namespace {

using Json = nlohmann::ordered_json;

// Constants of glTF 2.0.
constexpr int kFloat = 5126, kUnsignedInt = 5125, kVertexData = 34962, kIndexData = 34963;
constexpr std::uint32_t kMagic = 0x46546c67, kVersion = 2, kJsonChunk = 0x4e4f534a, kBinaryChunk = 0x004e4942;

void append(std::uint32_t value, std::string& out) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(value >> shift & 0xff);
}

void pad(std::string& bytes, char with) {
  while (bytes.size() % 4 != 0) bytes += with;
}

std::string bytes_of(const std::vector<float>& values) {
  std::string bytes;
  bytes.reserve(4 * values.size());
  for (const float value : values) append(std::bit_cast<std::uint32_t>(value), bytes);
  return bytes;
}

// Least and largest value per component.
void add_bounds(const std::vector<float>& values, std::size_t width, Json& accessor) {
  std::vector<float> low(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(width)), high = low;
  for (std::size_t i = 0; i < values.size(); ++i) {
    low[i % width] = std::min(low[i % width], values[i]);
    high[i % width] = std::max(high[i % width], values[i]);
  }
  accessor["min"] = low;
  accessor["max"] = high;
}

}  // namespace

int GltfFile::add_accessor(const std::string& bytes, Json accessor, int target) {
  Json view{{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}};
  if (target != 0) view["target"] = target;
  buffer_ += bytes;
  pad(buffer_, '\0');
  accessor["bufferView"] = add("bufferViews", std::move(view));
  return add("accessors", std::move(accessor));
}

int GltfFile::add_floats(const std::vector<float>& values, int width) {
  Json accessor{{"componentType", kFloat},
                {"count", values.size() / static_cast<std::size_t>(width)},
                {"type", width == 1   ? "SCALAR"
                         : width == 3 ? "VEC3"
                                      : "VEC4"}};
  if (!values.empty()) add_bounds(values, static_cast<std::size_t>(width), accessor);
  return add_accessor(bytes_of(values), std::move(accessor), 0);
}

int GltfFile::add_vertices(const std::vector<float>& values) {
  Json accessor{{"componentType", kFloat}, {"count", values.size() / 3}, {"type", "VEC3"}};
  if (!values.empty()) add_bounds(values, 3, accessor);
  return add_accessor(bytes_of(values), std::move(accessor), kVertexData);
}

int GltfFile::add_indices(const std::vector<std::uint32_t>& values) {
  std::string bytes;
  for (const std::uint32_t value : values) append(value, bytes);
  return add_accessor(bytes, {{"componentType", kUnsignedInt}, {"count", values.size()}, {"type", "SCALAR"}},
                      kIndexData);
}

int GltfFile::add(const char* array, Json entry) {
  Json& list = document_[array];
  list.push_back(std::move(entry));
  return static_cast<int>(list.size()) - 1;
}

std::string GltfFile::bytes() const {
  Json document = document_;
  document["buffers"] = Json::array({Json{{"byteLength", buffer_.size()}}});
  // Names of bodies are external input: bytes that are not UTF-8 are replaced.
  std::string text = document.dump(-1, ' ', false, Json::error_handler_t::replace);
  pad(text, ' ');
  if (12 + 8 + text.size() + 8 + buffer_.size() > std::numeric_limits<std::uint32_t>::max())
    throw std::runtime_error("more than 4 GB, the limit of a .glb file");
  std::string file;
  append(kMagic, file);
  append(kVersion, file);
  append(static_cast<std::uint32_t>(12 + 8 + text.size() + 8 + buffer_.size()), file);
  append(static_cast<std::uint32_t>(text.size()), file);
  append(kJsonChunk, file);
  file += text;
  append(static_cast<std::uint32_t>(buffer_.size()), file);
  append(kBinaryChunk, file);
  return file + buffer_;
}

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMarkColor = "#222222";
constexpr double kMarkRadius = 0.06;    // of a grasp point's mark, of its distance from the target's origin
constexpr double kSmallestMark = 0.01;  // [m]

// --- Motion ---

// glTF's numbers are floats, and none of them may be infinite or NaN.
bool is_finite_float(double x) { return std::abs(x) <= static_cast<double>(std::numeric_limits<float>::max()); }

// Poses of all bodies with unit quaternions that do not change sign from sample to sample.
TimeSeries body_motion(const RunSource& run) {
  TimeSeries motion;
  motion.time = run.series.time, motion.phase = run.series.phase, motion.phases = run.series.phases;
  if (!std::all_of(motion.time.begin(), motion.time.end(), is_finite_float))
    throw std::runtime_error((run.folder / "timeseries.h5").string() + ": a time is not finite");
  for (const SceneBody& body : run.scene->bodies) {
    const RecordedPose pose(run.series, body.series);
    Series position{body.series + "/position", "m", "", {"x", "y", "z"}, {}};
    Series quaternion{body.series + "/quaternion_wxyz", "1", "", {"w", "x", "y", "z"}, {}};
    Quaterniond before = Quaterniond::identity();
    for (std::size_t i = 0; i < motion.time.size(); ++i) {
      const Vector3d p = pose.position(i);
      Quaterniond q = pose.quaternion(i);
      if (!(is_finite_float(p[0]) && is_finite_float(p[1]) && is_finite_float(p[2]) &&
            std::isfinite(q.w + q.x + q.y + q.z)))
        throw std::runtime_error((run.folder / "timeseries.h5").string() + ": the pose of " + body.name +
                                 " is not finite");
      if (i > 0 && before.w * q.w + before.x * q.x + before.y * q.y + before.z * q.z < 0) q = {-q.w, -q.x, -q.y, -q.z};
      before = q;
      position.data.insert(position.data.end(), {p[0], p[1], p[2]});
      quaternion.data.insert(quaternion.data.end(), {q.w, q.x, q.y, q.z});
    }
    motion.series.push_back(std::move(position));
    motion.series.push_back(std::move(quaternion));
  }
  return motion;
}

// Keyframes: which samples, and their times, strictly ascending also as floats.
struct Keyframes {
  std::vector<std::size_t> samples;
  std::vector<float> times;
  double shift = 0;  // largest [s]
};

Keyframes keyframes_of(const TimeSeries& motion) {
  Keyframes frames;
  frames.samples = decimate(motion, kMaxKeyframes).retained;
  for (const std::size_t i : frames.samples) {
    float time = static_cast<float>(motion.time[i]);
    if (!frames.times.empty() && time <= frames.times.back())
      time = std::nextafter(frames.times.back(), std::numeric_limits<float>::infinity());
    frames.times.push_back(time);
    frames.shift = std::max(frames.shift, std::abs(static_cast<double>(time) - motion.time[i]));
  }
  return frames;
}

using Numbers = std::array<double, 4>;  // of a quaternion w, x, y, z, or of a vector and 0

Numbers row(const Series& series, std::size_t sample) {
  Numbers values{};
  const std::size_t width = series.components.size();
  for (std::size_t k = 0; k < width; ++k) values[k] = series.data[sample * width + k];
  return values;
}

double dot4(const Numbers& a, const Numbers& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]; }

// As glTF's LINEAR goes between unit quaternions.
Numbers slerp(const Numbers& a, const Numbers& b, double share) {
  const double angle = std::acos(std::clamp(dot4(a, b), -1.0, 1.0));
  const double s = std::sin(angle);
  const double u = s < 1e-9 ? 1 - share : std::sin((1 - share) * angle) / s;
  const double v = s < 1e-9 ? share : std::sin(share * angle) / s;
  return {u * a[0] + v * b[0], u * a[1] + v * b[1], u * a[2] + v * b[2], u * a[3] + v * b[3]};
}

double distance(const Numbers& a, const Numbers& b) {
  return std::sqrt(
      dot4({a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]}, {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]}));
}

// The largest errors between keyframes: position [m] and angle [rad].
std::array<double, 2> deviations(const TimeSeries& motion, const std::vector<std::size_t>& retained) {
  std::array<double, 2> largest{0, 0};
  for (std::size_t s = 0; s < motion.series.size(); ++s) {
    const Series& series = motion.series[s];
    const bool turns = series.components.size() == 4;
    for (std::size_t k = 1; k < retained.size(); ++k) {
      const std::size_t from = retained[k - 1], to = retained[k];
      const Numbers a = row(series, from), b = row(series, to);
      for (std::size_t i = from + 1; i < to; ++i) {
        const double share = (motion.time[i] - motion.time[from]) / (motion.time[to] - motion.time[from]);
        const Numbers is = row(series, i);
        if (turns) {  // the chord of unit quaternions is half the angle
          largest[1] = std::max(largest[1], 4 * std::asin(std::min(distance(slerp(a, b, share), is) / 2, 1.0)));
        } else {
          Numbers between{};
          for (std::size_t c = 0; c < 3; ++c) between[c] = a[c] + share * (b[c] - a[c]);
          largest[0] = std::max(largest[0], distance(between, is));
        }
      }
    }
  }
  return largest;
}

// --- Looks ---

double linear_of(int srgb) {
  const double c = srgb / 255.0;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

class Materials {
 public:
  explicit Materials(GltfFile& file) : file_(file) {}
  int operator()(const std::string& color) {
    const auto known = known_.find(color);
    if (known != known_.end()) return known->second;
    const long rgb = std::strtol(color.c_str() + 1, nullptr, 16);
    const Json factor{linear_of(static_cast<int>(rgb >> 16 & 0xff)), linear_of(static_cast<int>(rgb >> 8 & 0xff)),
                      linear_of(static_cast<int>(rgb & 0xff)), 1.0};
    Json material{
        {"name", color},
        {"pbrMetallicRoughness", {{"baseColorFactor", factor}, {"metallicFactor", 0.1}, {"roughnessFactor", 0.55}}}};
    return known_[color] = file_.add("materials", std::move(material));
  }

 private:
  GltfFile& file_;
  std::map<std::string, int> known_;
};

Json primitive_of(GltfFile& file, const std::vector<DrawnMesh>& parts, int material) {
  std::vector<float> points, normals;
  std::vector<std::uint32_t> indices;
  for (const DrawnMesh& part : parts) {
    const std::size_t first = points.size() / 3;
    for (const Vector3d& p : part.points) {
      for (int k = 0; k < 3; ++k) points.push_back(static_cast<float>(p[k]));
    }
    for (const Vector3d& n : part.normals) {
      for (int k = 0; k < 3; ++k) normals.push_back(static_cast<float>(n[k]));
    }
    for (const std::array<int, 3>& t : part.triangles) {
      for (const int corner : t)
        indices.push_back(static_cast<std::uint32_t>(first + static_cast<std::size_t>(corner)));
    }
  }
  if (indices.empty()) return {};
  const int position = file.add_vertices(points), normal = file.add_vertices(normals),
            corners = file.add_indices(indices);
  return {{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"indices", corners}, {"material", material}};
}

// The number of the body's mesh; -1 if there is nothing to draw.
int add_mesh(GltfFile& file, const Scene& scene, std::size_t body, int arm, Materials& materials) {
  const SceneBody& it = scene.bodies[body];
  const std::string color = it.kind == "link"                          ? series_color(arm)
                            : it.kind == "target" || it.kind == "part" ? kTargetColor
                                                                       : kBaseColor;
  std::vector<DrawnMesh> parts, marks;
  for (const SceneShape& shape : drawn_shapes(scene, body)) parts.push_back(triangles_of(scene, shape));
  for (const SceneGraspPoint& point : scene.grasp_points) {
    if (it.kind != "target" || point.target != it.name) continue;
    SceneShape mark;
    mark.shape = "sphere";
    mark.size = {std::max(kMarkRadius * norm(point.position), kSmallestMark), 0, 0};
    mark.X_BG.p = point.position;
    marks.push_back(triangles_of(scene, mark, 16));
  }
  Json primitives = Json::array();
  if (Json primitive = primitive_of(file, parts, materials(color)); !primitive.empty())
    primitives.push_back(std::move(primitive));
  if (!marks.empty()) {
    if (Json primitive = primitive_of(file, marks, materials(kMarkColor)); !primitive.empty())
      primitives.push_back(std::move(primitive));
  }
  if (primitives.empty()) return -1;
  return file.add("meshes", {{"name", it.name}, {"primitives", std::move(primitives)}});
}

// The number of an obstacle's mesh; -1 if there is nothing to draw.
int add_mesh(GltfFile& file, const Scene& scene, const SceneObstacle& obstacle, const MotionExtent& extent,
             Materials& materials) {
  std::vector<DrawnMesh> parts;
  for (const SceneShape& shape : drawn_shapes(obstacle, extent)) parts.push_back(triangles_of(scene, shape));
  Json primitive = primitive_of(file, parts, materials(kObstacleColor));
  if (primitive.empty()) return -1;
  return file.add("meshes", {{"name", obstacle.name}, {"primitives", Json::array({std::move(primitive)})}});
}

// --- Putting it together ---

// Nodes that do not move, after those of the bodies.
void add_obstacles(GltfFile& file, const RunSource& run, Materials& materials) {
  if (run.scene->obstacles.empty()) return;
  const MotionExtent extent = motion_extent(run);
  for (const SceneObstacle& obstacle : run.scene->obstacles) {
    const Vector3d& p = obstacle.X_WO.p;
    const Quaterniond q = quaternion_from(obstacle.X_WO.R);
    Json node{{"name", obstacle.name}, {"translation", {p[0], p[1], p[2]}}, {"rotation", {q.x, q.y, q.z, q.w}}};
    if (const int mesh = add_mesh(file, *run.scene, obstacle, extent, materials); mesh >= 0) node["mesh"] = mesh;
    file.add("nodes", std::move(node));
  }
}

void add_channel(Json& animation, int node, const char* path, int times, int values) {
  Json& samplers = animation["samplers"];
  samplers.push_back({{"input", times}, {"interpolation", "LINEAR"}, {"output", values}});
  animation["channels"].push_back({{"sampler", samplers.size() - 1}, {"target", {{"node", node}, {"path", path}}}});
}

// Unit quaternions in glTF's order, also as floats.
std::vector<float> xyzw(const Series& quaternion, const std::vector<std::size_t>& samples) {
  std::vector<float> values;
  for (const std::size_t i : samples) {
    const Numbers q = row(quaternion, i);
    for (const std::size_t k : {1, 2, 3, 0}) values.push_back(static_cast<float>(q[k]));
  }
  return values;
}

std::vector<float> xyz(const Series& position, const std::vector<std::size_t>& samples) {
  std::vector<float> values;
  for (const std::size_t i : samples) {
    const Numbers p = row(position, i);
    for (std::size_t k = 0; k < 3; ++k) values.push_back(static_cast<float>(p[k]));
  }
  return values;
}

Json asset_of(const RunSource& run, const std::string& version, const TimeSeries& motion, const Keyframes& frames) {
  const std::array<double, 2> missed = deviations(motion, frames.samples);
  return {{"version", "2.0"},
          {"generator", "Grapnel " + version},
          {"extras",
           {{"scenario", run.metadata.scenario_name},
            {"sha256", run.metadata.scenario_sha256},
            {"keyframes", frames.samples.size()},
            {"samples", motion.time.size()},
            {"largest_position_deviation_m", missed[0]},
            {"largest_angle_deviation_rad", missed[1]},
            {"largest_time_shift_s", frames.shift}}}};
}

}  // namespace

std::string glb_bytes(const RunSource& run, const std::string& version) {
  if (!run.scene)
    throw std::runtime_error((run.folder / "scene.json").string() +
                             ": missing, but required for the bodies' shapes; run the scenario again");
  const Scene& scene = *run.scene;
  const TimeSeries motion = body_motion(run);
  const Keyframes frames = keyframes_of(motion);
  const std::vector<ArmPlace> places = body_places(scene);

  GltfFile file;
  file.document()["asset"] = asset_of(run, version, motion, frames);
  file.document()["scene"] = 0;
  file.document()["scenes"] = Json::array();
  Materials materials(file);
  const double half = std::sqrt(0.5);
  Json root{{"name", "W (z up)"}, {"rotation", {-half, 0.0, 0.0, half}}, {"children", Json::array()}};
  for (std::size_t n = 0; n < scene.bodies.size() + scene.obstacles.size(); ++n) root["children"].push_back(n + 1);
  file.add("nodes", std::move(root));

  const int times = file.add_floats(frames.times, 1);
  Json animation{{"name", "capture"}, {"samplers", Json::array()}, {"channels", Json::array()}};
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const std::vector<float> positions = xyz(motion.series[2 * b], frames.samples);
    const std::vector<float> rotations = xyzw(motion.series[2 * b + 1], frames.samples);
    Json node{{"name", scene.bodies[b].name},
              {"translation", std::vector<float>(positions.begin(), positions.begin() + 3)},
              {"rotation", std::vector<float>(rotations.begin(), rotations.begin() + 4)}};
    if (const int mesh = add_mesh(file, scene, b, places[b].arm, materials); mesh >= 0) node["mesh"] = mesh;
    const int number = file.add("nodes", std::move(node));
    add_channel(animation, number, "translation", times, file.add_floats(positions, 3));
    add_channel(animation, number, "rotation", times, file.add_floats(rotations, 4));
  }
  add_obstacles(file, run, materials);
  file.add("animations", std::move(animation));
  file.add("scenes", {{"name", run.metadata.scenario_name}, {"nodes", {0}}});
  return file.bytes();
}

std::filesystem::path export_glb(const std::filesystem::path& folder, const std::string& version) {
  std::filesystem::path path = folder / "capture.glb";
  write_file_atomically(path, glb_bytes(read_run_source(folder), version));
  return path;
}

}  // namespace grapnel
