#pragma once

/// @file
/// Support points of a convex hull in constant time.

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "grapnel/model/geometry.hpp"

namespace grapnel {

/// The vertices of a scaled hull, listed by the directions in which they may be the farthest. Directions are divided
/// into the cells of a grid on a cube; a cell lists every vertex that some direction of the cell may have as its
/// support point. The result is therefore exact and does not depend on earlier calls. Immutable after construction.
class SupportMap {
 public:
  /// Of the hull's vertices relative to its centre, with scale factors into m.
  SupportMap(const ConvexHull& hull, const Vector3d& scale) {
    for (const Vector3d& v : hull.vertices) {
      const Vector3d p = v - hull.center;
      vertices_.push_back({scale[0] * p[0], scale[1] * p[1], scale[2] * p[2]});
    }
    for (int side = 0; side < 6; ++side) {
      for (int i = 0; i < kCells; ++i) {
        for (int j = 0; j < kCells; ++j) add_cell(side, i, j);
      }
    }
    begin_[6 * kCells * kCells] = static_cast<int>(listed_.size());
  }

  /// The farthest vertex along `direction` (of any length), in the frame of the core.
  Vector3d support(const Vector3d& direction) const {
    const int cell = cell_of(direction);
    const int end = begin_[cell + 1];
    int best = begin_[cell];
    double farthest = dot(direction, listed_[best]);
    for (int i = best + 1; i < end; ++i) {
      if (const double along = dot(direction, listed_[i]); along > farthest) farthest = along, best = i;
    }
    return listed_[best];
  }
  const std::vector<Vector3d>& vertices() const { return vertices_; }

 private:
  static constexpr int kCells = 8;  // along each edge of the cube

  // A vector that is not finite gets some cell.
  static int cell_of(const Vector3d& d) {
    int k = 0;
    if (std::abs(d[1]) > std::abs(d[k])) k = 1;
    if (std::abs(d[2]) > std::abs(d[k])) k = 2;
    const double scale = 0.5 * kCells / std::abs(d[k]);
    const auto index = [&](double x) {
      return static_cast<int>(std::min(kCells - 1.0, std::max(0.0, scale * x + 0.5 * kCells)));
    };
    return ((2 * k + (d[k] < 0 ? 1 : 0)) * kCells + index(d[(k + 1) % 3])) * kCells + index(d[(k + 2) % 3]);
  }
  static Vector3d direction(int side, double i, double j) {
    Vector3d d = Vector3d::zero();
    const int k = side / 2;
    d[k] = side % 2 == 0 ? 1 : -1;
    d[(k + 1) % 3] = 2 * i / kCells - 1, d[(k + 2) % 3] = 2 * j / kCells - 1;
    return d;
  }
  const Vector3d& farthest(const Vector3d& d) const {
    return *std::max_element(vertices_.begin(), vertices_.end(),
                             [&](const Vector3d& a, const Vector3d& b) { return dot(d, a) < dot(d, b); });
  }
  // A vertex is not listed if one other vertex is farther in all directions of the cell, which are the cone of its
  // corners. A margin keeps directions that rounding assigns to a neighbouring cell.
  void add_cell(int side, int i, int j) {
    constexpr double kMargin = 1e-6;
    std::array<Vector3d, 4> corner;
    for (int c = 0; c < 4; ++c) {
      corner[c] = direction(side, i + (c & 1 ? 1 + kMargin : -kMargin), j + (c & 2 ? 1 + kMargin : -kMargin));
    }
    const std::array<const Vector3d*, 5> rivals = {&farthest(direction(side, i + 0.5, j + 0.5)), &farthest(corner[0]),
                                                   &farthest(corner[1]), &farthest(corner[2]), &farthest(corner[3])};
    begin_[(side * kCells + i) * kCells + j] = static_cast<int>(listed_.size());
    for (const Vector3d& v : vertices_) {
      const bool beaten = std::any_of(rivals.begin(), rivals.end(), [&](const Vector3d* rival) {
        return std::all_of(corner.begin(), corner.end(), [&](const Vector3d& d) { return dot(d, v - *rival) < 0; });
      });
      if (!beaten) listed_.push_back(v);
    }
  }

  std::vector<Vector3d> vertices_, listed_;
  std::array<int, 6 * kCells * kCells + 1> begin_{};
};

}  // namespace grapnel
