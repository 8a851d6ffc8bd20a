#include "grapnel/problem/contact_surfaces.hpp"

#include <algorithm>

namespace grapnel {
namespace {

// The surfaces of a system: shapes of bodies, then obstacles, with the indices of those of one name.
class Surfaces {
 public:
  Surfaces(const CaptureProblem& problem, const CaptureSystem& system) : problem_(problem), system_(system) {
    for (const PlacedShape& shape : shapes_in_model(problem, system))
      all.push_back({shape.body, ContactShape(shape.geometry)});
    for (const ObstacleSetup& obstacle : problem.obstacles) {
      first_of_obstacle_.push_back(static_cast<int>(all.size()));
      if (obstacle.geometry.empty()) all.push_back({-1, ContactShape::half_space(obstacle.X_WO)});
      for (Geometry shape : obstacle.geometry) {
        shape.X_BG = obstacle.X_WO * shape.X_BG;
        all.push_back({-1, ContactShape(shape)});
      }
    }
    first_of_obstacle_.push_back(static_cast<int>(all.size()));
  }

  std::vector<int> of(const BodyName& name) const {
    std::vector<int> indices;
    if (name.obstacle) {
      for (int i = first_of_obstacle_[*name.obstacle]; i < first_of_obstacle_[*name.obstacle + 1]; ++i)
        indices.push_back(i);
      return indices;
    }
    const std::vector<int> bodies = bodies_named(problem_, system_, name);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (all[i].body >= 0 && std::ranges::find(bodies, all[i].body) != bodies.end())
        indices.push_back(static_cast<int>(i));
    }
    return indices;
  }

  std::vector<ContactSurface> all;

 private:
  const CaptureProblem& problem_;
  const CaptureSystem& system_;
  std::vector<int> first_of_obstacle_;
};

}  // namespace

// Pairs of names => pairs of their surfaces in the system, with the law of the pair.
std::shared_ptr<ContactSet> make_contact_set(const CaptureProblem& problem, const CaptureSystem& system,
                                             std::span<const ContactPair> pairs) {
  const Surfaces surfaces(problem, system);
  std::vector<SurfacePair> of_surfaces;
  for (std::size_t g = 0; g < pairs.size(); ++g) {
    for (const int a : surfaces.of(pairs[g].a)) {
      for (const int b : surfaces.of(pairs[g].b)) of_surfaces.push_back({a, b, pairs[g].law, static_cast<int>(g)});
    }
  }
  return std::make_shared<ContactSet>(surfaces.all, of_surfaces, static_cast<int>(pairs.size()));
}

}  // namespace grapnel
