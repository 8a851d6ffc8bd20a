#pragma once

/// @file
/// Common parts of the readers of mesh files. Internal to this module.

#include <fmt/format.h>

#include <array>
#include <bit>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "grapnel/model/geometry.hpp"
#include "grapnel/scenario/mesh_files.hpp"

namespace grapnel::mesh_formats {

std::string lower_case(std::string_view text);

/// Exception that ends the reading of a file.
struct MeshFault {
  int line;  // 0: none
  int column;
  std::string message;
};

/// Limit on the magnitude of coordinates.
inline constexpr double kLargestCoordinate = 1e9;

/// Triangles as they come.
class MeshCollector {
 public:
  int vertex(const Vector3d& p) {
    // -0 is 0 and has the same bits from here on.
    const Key key{std::bit_cast<std::uint64_t>(p[0] + 0.0), std::bit_cast<std::uint64_t>(p[1] + 0.0),
                  std::bit_cast<std::uint64_t>(p[2] + 0.0)};
    const auto [it, fresh] = known_.emplace(key, static_cast<int>(vertices_.size()));
    if (fresh) vertices_.push_back(p);
    return it->second;
  }

  // Counts every triangle; keeps those that have an area.
  void triangle(int a, int b, int c) {
    ++count_;
    if (a == b || b == c || c == a) return;
    const Vector3d n = cross(vertices_[b] - vertices_[a], vertices_[c] - vertices_[a]);
    if (dot(n, n) > 0) triangles_.push_back({a, b, c});
  }
  std::size_t count() const { return count_; }
  /// Contents of the file that are not read.
  std::string warning;

  std::shared_ptr<const TriangleMesh> finish(const std::string& name) {
    if (count_ == 0) throw MeshFault{0, 0, "the mesh has no triangle"};
    if (triangles_.empty()) throw MeshFault{0, 0, "the mesh has no triangle with positive area"};
    drop_unused();
    try {
      return make_triangle_mesh(name, std::move(vertices_), std::move(triangles_));
    } catch (const std::invalid_argument&) {
      throw MeshFault{0, 0, "the mesh is flat: all its vertices lie in one plane; give it a thickness"};
    }
  }

 private:
  using Key = std::array<std::uint64_t, 3>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      std::uint64_t h = 0;
      for (const std::uint64_t k : key) h = (h ^ k) * 0x9e3779b97f4a7c15u ^ (h >> 29);
      return h ^ (h >> 32);
    }
  };

  // Unused vertices would only enlarge the hull.
  void drop_unused() {
    std::vector<int> number(vertices_.size(), -1);
    std::vector<Vector3d> used;
    for (auto& triangle : triangles_) {
      for (int& v : triangle) {
        if (number[v] < 0) {
          number[v] = static_cast<int>(used.size());
          used.push_back(vertices_[v]);
        }
        v = number[v];
      }
    }
    vertices_ = std::move(used);
  }

  std::unordered_map<Key, int, Hash> known_;
  std::vector<Vector3d> vertices_;
  std::vector<std::array<int, 3>> triangles_;
  std::size_t count_ = 0;
};

/// Throws where there are too many triangles; `line` 0: in no line.
inline void check_count(std::size_t count, int line) {
  if (count > kMostTriangles) {
    throw MeshFault{
        line, line > 0 ? 1 : 0,
        line > 0 ? fmt::format("the mesh has more than {} triangles; simplify it", kMostTriangles)
                 : fmt::format("the mesh has {} triangles, at most {} are read; simplify it", count, kMostTriangles)};
  }
}

/// STL, binary or text.
void read_stl(std::string_view bytes, MeshCollector& mesh);
void read_obj(std::string_view bytes, MeshCollector& mesh);
/// The triangles of a Collada file's scene, in metres with z upwards; without a scene, of all its geometries.
void read_collada(std::string_view bytes, const std::filesystem::path& path, MeshCollector& mesh);

}  // namespace grapnel::mesh_formats
