#include "grapnel/problem/contact_surfaces.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "grapnel/contact/contact_chain.hpp"
#include "grapnel/problem/cut_shapes.hpp"

namespace grapnel {
namespace {

// The pieces of a flexible link. Contact changes from one to the next within a quarter of the shorter piece's length on
// both sides of the cut.
std::shared_ptr<const ContactChain> chain_of(const CutShape& shape, const Model& model) {
  ContactChain chain{shape.point, shape.axis, {}, {}};
  for (std::size_t i = 0; i < shape.pieces.size(); ++i) {
    const CutShape::Piece& piece = shape.pieces[i];
    chain.pieces.push_back({model.body_index(piece.body), piece.origin});
    if (i == 0) continue;
    const CutShape::Piece& before = shape.pieces[i - 1];
    chain.cuts.push_back({piece.begin, 0.25 * std::min(before.end - before.begin, piece.end - piece.begin)});
  }
  return std::make_shared<const ContactChain>(std::move(chain));
}

// The surfaces of a system: shapes of bodies, then obstacles, with the indices of those of one name.
class Surfaces {
 public:
  Surfaces(const CaptureProblem& problem, const CaptureSystem& system) : problem_(problem), system_(system) {
    placed_ = shapes_in_model(problem, system);
    for (const PlacedShape& shape : placed_) all.push_back({shape.body, ContactShape(shape.geometry)});
    for (const ObstacleSetup& obstacle : problem.obstacles) {
      first_of_obstacle_.push_back(static_cast<int>(all.size()));
      if (obstacle.geometry.empty()) all.push_back({-1, ContactShape::half_space(obstacle.X_WO)});
      for (Geometry shape : obstacle.geometry) {
        shape.X_BG = obstacle.X_WO * shape.X_BG;
        all.push_back({-1, ContactShape(shape)});
      }
    }
    first_of_obstacle_.push_back(static_cast<int>(all.size()));
    whole_of_.resize(all.size(), -1);
    add_whole_shapes();
  }

  // The whole shape of which a surface is a part, by index; -1: none.
  int whole_of(int surface) const { return whole_of_[surface]; }

  std::vector<int> of(const BodyName& name) const {
    std::vector<int> indices;
    if (name.obstacle) {
      for (int i = first_of_obstacle_[*name.obstacle]; i < first_of_obstacle_[*name.obstacle + 1]; ++i)
        indices.push_back(i);
      return indices;
    }
    const std::vector<int> bodies = bodies_named(problem_, system_, name);
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      if (all[i].body >= 0 && std::ranges::find(bodies, all[i].body) != bodies.end())
        indices.push_back(static_cast<int>(i));
    }
    return indices;
  }

  std::vector<ContactSurface> all;

 private:
  // Adds the whole shapes of flexible links, and finds their parts.
  void add_whole_shapes() {
    std::vector<CutShape> shapes;
    const RobotSetup& robot = problem_.robot.undeformed ? *problem_.robot.undeformed : problem_.robot;
    if (!system_.elastic_joints.empty()) shapes = cut_shapes(robot);
    for (const TargetSetup& target : problem_.targets) {
      for (CutShape& shape : cut_shapes(target)) shapes.push_back(std::move(shape));
    }
    for (const CutShape& shape : shapes) {
      const int whole = static_cast<int>(all.size());
      const std::shared_ptr<const ContactChain> chain = chain_of(shape, system_.model);
      for (std::size_t i = 0; i < shape.pieces.size(); ++i)
        whole_of_[surface_of_part(chain->pieces[i].body, shape.pieces[i].part)] = whole;
      all.push_back({chain->pieces[0].body, ContactShape(shape.whole), chain});
    }
  }

  // The surface of a part that belongs to no whole shape yet.
  std::size_t surface_of_part(int body, const Geometry& part) const {
    for (std::size_t i = 0; i < placed_.size(); ++i) {
      const Geometry& g = placed_[i].geometry;
      if (placed_[i].body == body && whole_of_[i] < 0 && g.shape == part.shape && is_same(g.size, part.size) &&
          is_same(g.X_BG.p, part.X_BG.p))
        return i;
    }
    throw std::logic_error("contacts: a part of a shape is not in the model");
  }
  static bool is_same(const Vector3d& a, const Vector3d& b) { return a[0] == b[0] && a[1] == b[1] && a[2] == b[2]; }

  const CaptureProblem& problem_;
  const CaptureSystem& system_;
  std::vector<PlacedShape> placed_;
  std::vector<int> whole_of_;
  std::vector<int> first_of_obstacle_;
};

}  // namespace

// Pairs of names => pairs of their surfaces in the system, with the law of the pair. A sphere meets the whole shape of
// a flexible link; other shapes meet its parts.
std::shared_ptr<ContactSet> make_contact_set(const CaptureProblem& problem, const CaptureSystem& system,
                                             std::span<const ContactPair> pairs) {
  const Surfaces surfaces(problem, system);
  std::vector<SurfacePair> of_surfaces;
  const auto is_ball = [&](int i) { return surfaces.all[i].shape.kind() == ContactShape::Kind::sphere; };
  for (std::size_t g = 0; g < pairs.size(); ++g) {
    const int group = static_cast<int>(g);
    for (const int part_a : surfaces.of(pairs[g].a)) {
      for (const int part_b : surfaces.of(pairs[g].b)) {
        const int whole_a = surfaces.whole_of(part_a), whole_b = surfaces.whole_of(part_b);
        const int a = whole_a >= 0 && is_ball(part_b) ? whole_a : part_a;
        const int b = whole_b >= 0 && is_ball(part_a) ? whole_b : part_b;
        const auto is_this = [&](const SurfacePair& pair) { return pair.a == a && pair.b == b && pair.group == group; };
        if ((a != part_a || b != part_b) && std::ranges::any_of(of_surfaces, is_this)) continue;
        of_surfaces.push_back({a, b, pairs[g].law, group});
      }
    }
  }
  return std::make_shared<ContactSet>(surfaces.all, of_surfaces, static_cast<int>(pairs.size()));
}

}  // namespace grapnel
