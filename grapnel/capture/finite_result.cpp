#include "grapnel/capture/finite_result.hpp"

#include <cmath>

namespace grapnel {
namespace {

// Keeps the first name whose number is not finite.
class Finder {
 public:
  template <class... Parts>
  void look(double x, const Parts&... what) {
    if (found_.empty() && !std::isfinite(x)) found_ = join(what...);
  }
  template <class... Parts>
  void look(const Vector3d& x, const Parts&... what) {
    look(norm(x), what...);
  }
  const std::string& found() const { return found_; }

 private:
  template <class... Parts>
  static std::string join(const Parts&... parts) {
    std::string text;
    ((text += parts), ...);
    return text;
  }
  std::string found_;
};

void look_at(const PhaseEnd& end, const char* when, Finder& finder) {
  finder.look(end.base.position, "the base's position ", when);
  finder.look(end.base.velocity, "the base's velocity ", when);
  finder.look(end.base.angular_velocity, "the base's angular velocity ", when);
  for (const EndEffectorMotion& e : end.end_effectors) {
    finder.look(e.miss_distance, "the distance of ", e.name, " from its grasp point ", when);
    finder.look(e.relative_velocity, "the relative velocity of ", e.name, " ", when);
    finder.look(e.relative_angular_velocity, "the relative angular velocity of ", e.name, " ", when);
  }
  for (const BodyMotion& t : end.targets) {
    finder.look(t.position, "the position of ", t.name, " ", when);
    finder.look(t.velocity, "the velocity of ", t.name, " ", when);
    finder.look(t.angular_velocity, "the angular velocity of ", t.name, " ", when);
  }
}

void look_at(const ImpactReport& impact, Finder& finder) {
  for (const GraspImpulse& g : impact.grasps) {
    finder.look(g.gap, "the gap of ", g.end_effector, " in the impact");
    finder.look(g.impulse, "the impulse on ", g.end_effector);
    finder.look(g.angular_impulse, "the angular impulse on ", g.end_effector);
    finder.look(g.relative_velocity_before, "the relative velocity of ", g.end_effector, " before the impact");
    finder.look(g.relative_velocity_after, "the relative velocity of ", g.end_effector, " after the impact");
  }
  finder.look(impact.kinetic_energy_before, "the kinetic energy before the impact");
  finder.look(impact.kinetic_energy_after, "the kinetic energy after the impact");
}

}  // namespace

std::string first_not_finite(const CaptureResult& result) {
  Finder finder;
  if (result.approach_start) look_at(*result.approach_start, "at the start", finder);
  if (result.approach_end) look_at(*result.approach_end, "at the approach's end", finder);
  for (const GripOutcome& g : result.grips) {
    finder.look(g.distance, "the distance of ", g.end_effector, " from its grasp point");
    finder.look(g.velocity, "the relative speed of ", g.end_effector);
    finder.look(g.angular_velocity, "the relative angular velocity of ", g.end_effector);
  }
  if (result.impact) look_at(*result.impact, finder);
  for (const ImpactReport& later : result.later_impacts) look_at(later, finder);
  if (result.post_impact_end) look_at(*result.post_impact_end, "at the end", finder);
  for (const GripLoad& g : result.grip_loads) {
    finder.look(g.largest_force, "the force on ", g.end_effector);
    finder.look(g.largest_moment, "the moment on ", g.end_effector);
  }
  finder.look(result.ledger.scale.linear_momentum, "the size of linear momenta");
  finder.look(result.ledger.scale.angular_momentum, "the size of angular momenta");
  finder.look(result.ledger.scale.energy, "the kinetic energy");
  return finder.found();
}

}  // namespace grapnel
