#include "grapnel/capture/run_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {
namespace {

// Greatest depth at which shapes count as touching at the start: of rounding errors in positions [m].
constexpr double kTouching = 1e-9;

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

RunContacts::RunContacts(const CaptureProblem& problem, const CaptureSystem& free)
    : problem_(problem), pairs_(contact_pairs(problem, free)) {}

std::shared_ptr<ContactSet> RunContacts::in(const CaptureSystem& system) {
  if (!any()) return nullptr;
  const Surfaces surfaces(problem_, system);
  std::vector<SurfacePair> pairs;
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    for (const int a : surfaces.of(pairs_[g].a)) {
      for (const int b : surfaces.of(pairs_[g].b)) pairs.push_back({a, b, pairs_[g].law, static_cast<int>(g)});
    }
  }
  auto set = std::make_shared<ContactSet>(surfaces.all, pairs, static_cast<int>(pairs_.size()));
  if (last_) set->take(*last_);
  return last_ = std::move(set);
}

std::string RunContacts::overlaps(const CaptureSystem& system, const State& state) {
  if (!any()) return {};
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  std::vector<double> depth(pairs_.size(), 0);
  for (std::size_t p = 0; p < set->size(); ++p) {
    if (set->mode(p) != ContactSet::Mode::passing)
      depth[set->group_of(p)] = std::max(depth[set->group_of(p)], -set->separation(p, kinematics).distance);
  }
  std::string text;
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    if (depth[g] <= kTouching) continue;
    text += fmt::format("{}{} and {} overlap by {:.4g} m", text.empty() ? "" : "; ",
                        contact_name(problem_, pairs_[g].a), contact_name(problem_, pairs_[g].b), depth[g]);
  }
  return text;
}

void RunContacts::close(std::size_t grasp, const CaptureSystem& system, const State& state, double time) {
  if (!any()) return;
  const GraspSetup& setup = problem_.grasps[grasp];
  const std::vector<int> gripper = gripper_bodies(system, setup);
  const BodyName target = BodyName::of_target(target_index(problem_, setup.target));
  const auto is_gripper = [&](const BodyName& name) {
    return std::ranges::any_of(bodies_named(problem_, system, name),
                               [&](int body) { return std::ranges::find(gripper, body) != gripper.end(); });
  };
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    const ContactPair& pair = pairs_[g];
    if ((pair.a == target && is_gripper(pair.b)) || (pair.b == target && is_gripper(pair.a)))
      set->let_pass(static_cast<int>(g), kinematics, time);
  }
}

}  // namespace grapnel
