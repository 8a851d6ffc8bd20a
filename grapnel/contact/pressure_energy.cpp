#include <algorithm>
#include <cmath>

#include "grapnel/contact/contact_element.hpp"

namespace grapnel {

// The elastic energy of pressure contacts. Where one field is the least is a convex cell of the overlap, bounded by a
// part of its face, and by walls to other cells: polygons on which two fields are the least ones. The overlap with the
// height min f over it is a polytope in four dimensions. Its volume is that of pyramids over the cells, whose common
// apex is inside of the overlap, and the cells' volumes are those of pyramids over walls, whose apex is in the cell
// (23.12). No term is negative.

// Fields => those that may have cells: of parallel ones the least. Equal fields, as of faces in one plane, have one.
void PressureContact::drop_parallel_fields(double tolerance) {
  const auto hides = [&](std::size_t i, std::size_t j) {
    const Field difference = fields_[j] - fields_[i];
    if (!(norm(difference.gradient) <= tolerance)) return false;
    return difference.constant > 0 || (difference.constant == 0 && i < j);
  };
  is_least_.assign(fields_.size(), 1);
  for (std::size_t j = 0; j < fields_.size(); ++j) {
    for (std::size_t i = 0; is_least_[j] && i < fields_.size(); ++i) is_least_[j] = i == j || !hides(i, j);
  }
  std::size_t kept = 0, kept_a = 0;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (!is_least_[i]) continue;
    if (i < count_a_) ++kept_a;
    fields_.set(kept++, fields_[i]);
  }
  fields_.resize(kept), count_a_ = kept_a;
  find_lowest();
}

// Fields => the part of each face in the overlap, whose centroid is the apex of its cell; their total area, and their
// mean centroid, a point inside of the overlap.
double PressureContact::cut_faces(Vector3d& inside) {
  apex_.assign(fields_.size(), Vector3d::zero());
  has_apex_.assign(fields_.size(), 0);
  inside = Vector3d::zero();
  double total = 0;
  Corner centroid;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    if (!cut(fields_[i], {Vector3d::zero(), 0}, i, i)) continue;
    const double area = area_and_centroid(centroid);
    if (!(area > 0)) continue;
    apex_[i] = plane_.point(centroid), has_apex_[i] = 1;
    inside += area * apex_[i], total += area;
  }
  if (total > 0) inside *= 1 / total;
  return total;
}

// Fields and apexes => volumes of the cells. A cell that does not reach its face has an apex on its first wall.
void PressureContact::cut_walls(double tolerance) {
  volume_.assign(fields_.size(), 0);
  Corner centroid;
  for (std::size_t i = 0; i < fields_.size(); ++i) {
    for (std::size_t j = i + 1; j < fields_.size(); ++j) {
      const Field across = fields_[i] - fields_[j];
      const double length = norm(across.gradient);
      if (!(length > tolerance) || !cut(across, fields_[i], i, j)) continue;
      const double area = area_and_centroid(centroid);
      for (const std::size_t k : {i, j}) {
        if (!has_apex_[k]) apex_[k] = plane_.point(centroid), has_apex_[k] = 1;
      }
      volume_[i] += area * std::max(0.0, -across.at(apex_[i])) / (3 * length);
      volume_[j] += area * std::max(0.0, across.at(apex_[j])) / (3 * length);
    }
  }
}

double PressureContact::energy(const ContactShapes& shapes, const Posed& X_AB) {
  if (!collect(shapes, X_AB)) return 0;
  const double tolerance = 1e-12 * shapes.pressure;
  drop_parallel_fields(tolerance);
  Vector3d inside;
  if (!(cut_faces(inside) > 0)) return 0;
  cut_walls(tolerance);
  double energy = 0;
  for (std::size_t i = 0; i < fields_.size(); ++i) energy += 0.25 * fields_[i].at(inside) * volume_[i];
  return energy;
}

}  // namespace grapnel
