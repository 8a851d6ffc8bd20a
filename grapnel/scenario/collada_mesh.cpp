// Triangles from Collada files (COLLADA 1.4 and 1.5, chapters 5 and 6): geometries of the visual scene.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <span>

#include "grapnel/import/xml_file.hpp"
#include "grapnel/scenario/mesh_formats.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel::mesh_formats {
namespace {

using pugi::xml_node;

constexpr int kMostNodes = 100'000;               // with those of instances
constexpr int kDeepest = 64;                      // nodes within nodes
constexpr std::size_t kMostNumbers = 50'000'000;  // of one list

// x -> A x + p, which scales and shears too.
struct Affine {
  std::array<double, 9> A{1, 0, 0, 0, 1, 0, 0, 0, 1};  // row by row
  Vector3d p = Vector3d::zero();

  Vector3d operator*(const Vector3d& x) const {
    return {A[0] * x[0] + A[1] * x[1] + A[2] * x[2] + p[0], A[3] * x[0] + A[4] * x[1] + A[5] * x[2] + p[1],
            A[6] * x[0] + A[7] * x[1] + A[8] * x[2] + p[2]};
  }
  Affine operator*(const Affine& b) const {
    Affine c;
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j)
        c.A[3 * i + j] = A[3 * i] * b.A[j] + A[3 * i + 1] * b.A[3 + j] + A[3 * i + 2] * b.A[6 + j];
    }
    c.p = *this * b.p;
    return c;
  }
};

std::string_view local_name(const xml_node& node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

class ColladaReader {
 public:
  ColladaReader(const XmlFile& file, MeshCollector& mesh) : file_(file), mesh_(mesh) {}

  void read() {
    const xml_node root = file_.root();
    if (local_name(root) != "COLLADA")
      fail(root,
           fmt::format("the outermost element is <{}>, expected <COLLADA>", shortened(printable_line(root.name()))));
    index(root, 0);
    const Affine to_metres = frame_of(root.child("asset"));
    const xml_node named = root.child("scene").child("instance_visual_scene");
    if (!named) {
      for (const xml_node& library : root.children("library_geometries")) {
        for (const xml_node& geometry : library.children("geometry")) add_geometry(geometry, to_metres);
      }
      return;
    }
    const xml_node scene = target(named, "url", "visual_scene");
    for (const xml_node& node : scene.children("node")) add_node(node, to_metres, 0);
  }

 private:
  [[noreturn]] void fail(const xml_node& node, const std::string& message) const {
    const Mark mark = file_.mark(node);
    throw MeshFault{mark.line, mark.column, message};
  }

  // Elements by their names.
  void index(const xml_node& node, int depth) {
    if (depth > 2 * kDeepest) fail(node, "elements are nested too deeply");
    for (const xml_node& child : node.children()) {
      if (const pugi::xml_attribute id = child.attribute("id")) by_id_.emplace(id.value(), child);
      index(child, depth + 1);
    }
  }

  // The element that an attribute names, "#id".
  xml_node target(const xml_node& node, const char* attribute, std::string_view kind) const {
    const std::string_view url = node.attribute(attribute).value();
    const auto found = url.starts_with('#') ? by_id_.find(url.substr(1)) : by_id_.end();
    if (found != by_id_.end() && local_name(found->second) == kind) return found->second;
    fail(node, fmt::format("{} of <{}> is {}, expected the id of a <{}> in this file", attribute, node.name(),
                           in_quotes(url), kind));
  }

  // Metres, with z upwards.
  Affine frame_of(const xml_node& asset) const {
    double metre = 1;
    if (const xml_node unit = asset.child("unit"); unit.attribute("meter")) {
      const auto number = number_of(unit.attribute("meter").value());
      if (!number || !(*number > 0)) fail(unit, "the meter of <unit> must be a number greater than 0");
      metre = *number;
    }
    const std::string_view up = trimmed(asset.child_value("up_axis"));
    Affine X;
    if (up.empty() || up == "Y_UP")
      X.A = {1, 0, 0, 0, 0, -1, 0, 1, 0};
    else if (up == "X_UP")
      X.A = {0, -1, 0, 0, 0, -1, 1, 0, 0};
    else if (up != "Z_UP")
      fail(asset.child("up_axis"), fmt::format("{} is not an axis; expected X_UP, Y_UP or Z_UP", in_quotes(up)));
    for (double& a : X.A) a *= metre;
    return X;
  }

  // ---- Nodes ----

  void add_node(const xml_node& node, const Affine& above, int depth) {
    if (depth > kDeepest) fail(node, fmt::format("nodes are nested more than {} deep, or within themselves", kDeepest));
    if (++nodes_ > kMostNodes) fail(node, fmt::format("the scene has more than {} nodes", kMostNodes));
    Affine X = above;
    for (const xml_node& child : node.children()) {
      const std::string_view name = local_name(child);
      if (const auto step = transform(child, name)) X = X * *step;
    }
    for (const xml_node& child : node.children()) {
      const std::string_view name = local_name(child);
      if (name == "node")
        add_node(child, X, depth + 1);
      else if (name == "instance_node")
        add_node(target(child, "url", "node"), X, depth + 1);
      else if (name == "instance_geometry")
        add_geometry(target(child, "url", "geometry"), X);
      else if (name == "instance_controller")
        add_controller(target(child, "url", "controller"), X);
    }
  }

  // A skin or morph keeps its bind shape.
  void add_controller(const xml_node& controller, const Affine& above) {
    for (const xml_node& skin : controller.children()) {
      if (!skin.attribute("source")) continue;
      Affine X = above;
      if (const xml_node bound = skin.child("bind_shape_matrix")) X = X * matrix(bound);
      add_geometry(target(skin, "source", "geometry"), X);
    }
  }

  Affine matrix(const xml_node& node) const {
    const std::vector<double> m = numbers(node, 16);
    Affine X;
    X.A = {m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10]};
    X.p = {m[3], m[7], m[11]};
    return X;
  }

  std::optional<Affine> transform(const xml_node& node, std::string_view name) const {
    Affine X;
    if (name == "matrix") return matrix(node);
    if (name == "translate") {
      const std::vector<double> p = numbers(node, 3);
      X.p = {p[0], p[1], p[2]};
      return X;
    }
    if (name == "scale") {
      const std::vector<double> s = numbers(node, 3);
      X.A = {s[0], 0, 0, 0, s[1], 0, 0, 0, s[2]};
      return X;
    }
    if (name == "rotate") {
      const std::vector<double> r = numbers(node, 4);
      const double length = std::hypot(r[0], r[1], r[2]);
      if (!(length > 0)) return X;
      const Rotationd R = rotation_about((1 / length) * Vector3d{r[0], r[1], r[2]}, r[3] * std::numbers::pi / 180);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) X.A[static_cast<std::size_t>(3 * i + j)] = R(i, j);
      }
      return X;
    }
    if (name == "skew" || name == "lookat") fail(node, fmt::format("<{}> of a node is not read", name));
    return std::nullopt;
  }

  // ---- Geometries ----

  struct Input {
    std::size_t offset = 0;  // of places in a tuple of indices
    std::size_t width = 0;   // of a tuple
    const std::vector<Vector3d>* places = nullptr;
  };

  void add_geometry(const xml_node& geometry, const Affine& X) {
    const xml_node mesh = geometry.child("mesh");
    if (!mesh) {
      if (geometry.child("convex_mesh") || geometry.child("spline") || geometry.child("brep"))
        fail(geometry, "the geometry has no <mesh>; splines, breps and convex meshes are not read");
      return;
    }
    for (const xml_node& part : mesh.children()) {
      const std::string_view name = local_name(part);
      if (name == "triangles" || name == "trifans" || name == "tristrips" || name == "polygons" || name == "polylist")
        add_part(part, name, X);
    }
  }

  void add_part(const xml_node& part, std::string_view name, const Affine& X) {
    const Input input = input_of(part);
    corners_.clear();
    for (const Vector3d& p : *input.places) corners_.push_back(checked_vertex(part, X * p));
    if (name == "polylist") {
      const xml_node p = part.child("p");
      std::vector<int> counts = integers(part.child("vcount"));
      const std::vector<int> corners = corners_of(p, input);
      std::size_t at = 0;
      for (const int count : counts) {
        if (count < 0 || at + static_cast<std::size_t>(count) > corners.size())
          fail(part, "<vcount> requires more corners than <p> has");
        add_fan(part, {corners.data() + at, static_cast<std::size_t>(count)});
        at += static_cast<std::size_t>(count);
      }
      return;
    }
    for (const xml_node& child : part.children()) {
      // A polygon with holes is filled.
      const bool is_list = local_name(child) == "p", has_holes = local_name(child) == "ph";
      if (!is_list && !has_holes) continue;
      const std::vector<int> corners = corners_of(has_holes ? child.child("p") : child, input);
      if (name == "triangles") {
        if (corners.size() % 3 != 0) fail(child, "the number of corners of <triangles> is not a multiple of 3");
        for (std::size_t i = 0; i + 2 < corners.size(); i += 3) add_fan(part, {corners.data() + i, 3});
      } else if (name == "tristrips") {
        for (std::size_t i = 2; i < corners.size(); ++i) add_fan(part, {corners.data() + i - 2, 3});
      } else {
        add_fan(part, {corners.data(), corners.size()});
      }
    }
  }

  void add_fan(const xml_node& part, std::span<const int> corners) {
    for (std::size_t k = 2; k < corners.size(); ++k) {
      mesh_.triangle(corners[0], corners[k - 1], corners[k]);
      check_count(mesh_.count(), file_.mark(part).line);
    }
  }

  int checked_vertex(const xml_node& part, const Vector3d& p) {
    for (int k = 0; k < 3; ++k) {
      if (!(std::abs(p[k]) < kLargestCoordinate))
        fail(part, fmt::format("a coordinate is {} m, must be a finite number below {:.0e}", p[k], kLargestCoordinate));
    }
    return mesh_.vertex(p);
  }

  Input input_of(const xml_node& part) {
    Input input;
    for (const xml_node& one : part.children("input")) {
      const auto offset = static_cast<std::size_t>(std::min(one.attribute("offset").as_uint(), 1000u));
      input.width = std::max(input.width, offset + 1);
      const std::string_view semantic = one.attribute("semantic").value();
      if (semantic == "VERTEX")
        input.offset = offset, input.places = &places_of(position_source(target(one, "source", "vertices")));
      else if (semantic == "POSITION")
        input.offset = offset, input.places = &places_of(target(one, "source", "source"));
    }
    if (!input.places) fail(part, fmt::format("<{}> has no input VERTEX", part.name()));
    return input;
  }

  xml_node position_source(const xml_node& vertices) const {
    for (const xml_node& one : vertices.children("input")) {
      if (std::string_view(one.attribute("semantic").value()) == "POSITION") return target(one, "source", "source");
    }
    fail(vertices, "<vertices> has no input POSITION");
  }

  // The places of a source, read once.
  const std::vector<Vector3d>& places_of(const xml_node& source) {
    const auto [known, fresh] = places_.try_emplace(source.attribute("id").value());
    if (!fresh) return known->second;
    const xml_node accessor = source.child("technique_common").child("accessor"), array = source.child("float_array");
    if (!accessor || !array) fail(source, "<source> of places needs a <float_array> and an <accessor>");
    const std::vector<double> values = numbers(array, 0);
    const std::size_t stride = std::max(accessor.attribute("stride").as_uint(1), 1u);
    const std::size_t offset = accessor.attribute("offset").as_uint(0);
    const std::size_t count = accessor.attribute("count").as_uint(0);
    if (stride < 3 || stride > 1000) fail(accessor, "the <accessor> of places must have a stride of 3 or more");
    if (count > 0 && (count > values.size() || offset + stride * (count - 1) + 3 > values.size()))
      fail(accessor, fmt::format("the <accessor> asks for {} places, and the <float_array> has {} numbers", count,
                                 values.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const double* p = values.data() + offset + stride * i;
      known->second.push_back({p[0], p[1], p[2]});
    }
    return known->second;
  }

  // Vertices of the mesh, of the tuples in <p>.
  std::vector<int> corners_of(const xml_node& p, const Input& input) const {
    const std::vector<int> indices = integers(p);
    if (indices.size() % input.width != 0)
      fail(p, fmt::format("<p> has {} indices, expected a multiple of {}", indices.size(), input.width));
    std::vector<int> corners;
    for (std::size_t i = input.offset; i < indices.size(); i += input.width) {
      if (indices[i] < 0 || static_cast<std::size_t>(indices[i]) >= corners_.size())
        fail(p, fmt::format("there is no vertex {}: the source has {}", indices[i], corners_.size()));
      corners.push_back(corners_[static_cast<std::size_t>(indices[i])]);
    }
    return corners;
  }

  // ---- Numbers ----

  static std::string_view trimmed(std::string_view text) {
    const std::size_t begin = text.find_first_not_of(" \t\r\n");
    if (begin == std::string_view::npos) return {};
    return text.substr(begin, text.find_last_not_of(" \t\r\n") - begin + 1);
  }
  static std::optional<double> number_of(std::string_view word) {
    if (word.starts_with('+')) word.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    // Values below the range of a double become zero.
    if (error == std::errc::result_out_of_range && end == word.data() + word.size())
      return word.find("e-") != word.npos || word.find("E-") != word.npos ? std::optional(0.0) : std::nullopt;
    if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) return std::nullopt;
    return value;
  }

  template <class Visit>
  void for_words(const xml_node& node, Visit visit) const {
    const std::string_view text = node.child_value();
    std::size_t count = 0;
    for (std::size_t at = text.find_first_not_of(" \t\r\n"); at != std::string_view::npos;) {
      const std::size_t end = std::min(text.find_first_of(" \t\r\n", at), text.size());
      visit(text.substr(at, end - at));
      if (++count > kMostNumbers) fail(node, fmt::format("<{}> has too many numbers", node.name()));
      at = text.find_first_not_of(" \t\r\n", end);
    }
  }

  // `count` of them, any number if it is 0.
  std::vector<double> numbers(const xml_node& node, std::size_t count) const {
    std::vector<double> values;
    for_words(node, [&](std::string_view word) {
      const auto value = number_of(word);
      if (!value) fail(node, fmt::format("<{}>: {} is not a finite number", node.name(), in_quotes(word)));
      values.push_back(*value);
    });
    if (count > 0 && values.size() != count)
      fail(node, fmt::format("<{}> has {} numbers, expected {}", node.name(), values.size(), count));
    return values;
  }
  std::vector<int> integers(const xml_node& node) const {
    std::vector<int> values;
    for_words(node, [&](std::string_view word) {
      int value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error != std::errc() || end != word.data() + word.size())
        fail(node, fmt::format("<{}>: {} is not an index", node.name(), in_quotes(word)));
      values.push_back(value);
    });
    return values;
  }

  const XmlFile& file_;
  MeshCollector& mesh_;
  std::map<std::string, xml_node, std::less<>> by_id_;
  std::map<std::string, std::vector<Vector3d>> places_;
  int nodes_ = 0;
  std::vector<int> corners_;  // of the mesh, per place of the present part's source
};

}  // namespace

void read_collada(std::string_view bytes, const std::filesystem::path& path, MeshCollector& mesh) {
  FaultList faults;
  const XmlFile file(path.string(), std::string(bytes), faults);
  if (!faults.empty()) throw MeshFault{faults.all()[0].line, faults.all()[0].column, faults.all()[0].message};
  ColladaReader(file, mesh).read();
}

}  // namespace grapnel::mesh_formats
