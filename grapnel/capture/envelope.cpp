#include "grapnel/capture/envelope.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/capture/problem_lookup.hpp"

namespace grapnel {
namespace {

// One tolerance: its name, the deviation, what is allowed, the unit.
struct Item {
  const char* name;
  double value, tolerance;
  const char* unit;
};
std::array<Item, 4> items(const CaptureEnvelope& e, const GraspDeviation& d) {
  return {{{"distance", d.position, e.position, "m"},
           {"angle", d.angle, e.angle, "rad"},
           {"speed", d.velocity, e.velocity, "m/s"},
           {"angular rate", d.angular_velocity, e.angular_velocity, "rad/s"}}};
}

}  // namespace

std::vector<GraspDeviation> grasp_deviations(const CaptureProblem& problem, const CaptureSystem& system,
                                             const Kinematics& kinematics) {
  const std::vector<GraspGap> gaps = grasp_gaps(problem, system, kinematics);
  std::vector<GraspDeviation> deviations;
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const GraspSetup& grasp = problem.grasps[i];
    const GraspGap& gap = gaps[i];
    GraspDeviation d;
    d.position = gap.distance;
    if (grasp.orientation == GraspSetup::Orientation::pose) d.angle = gap.angle;
    if (grasp.orientation == GraspSetup::Orientation::axis) {
      const GraspPoint& point = grasp_point_of(problem, grasp);
      // The direction is given in the target's frame, the gap knows the grasp point's.
      const Vector3d direction_W = gap.X_WG.R * transposed_times(point.X_TG.R, *point.approach_direction);
      const Vector3d axis_W = gap.X_WE.R * *end_effector_of(problem, grasp).approach_axis;
      d.angle = rotation_angle(rotation_between(direction_W, axis_W));
    }
    d.velocity = norm(gap.V_WE.linear - gap.V_WG.linear);
    d.angular_velocity = norm(gap.V_WE.angular - gap.V_WG.angular);
    deviations.push_back(d);
  }
  return deviations;
}

double envelope_excess(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation) {
  double excess = -1;
  if (!envelope) return excess;
  for (const Item& item : items(*envelope, deviation)) excess = std::max(excess, item.value / item.tolerance - 1);
  return excess;
}

std::vector<GripDecision> decide_grips(const CaptureProblem& problem, const CaptureSystem& system,
                                       const Kinematics& kinematics) {
  const std::vector<GraspDeviation> deviations = grasp_deviations(problem, system, kinematics);
  std::vector<GripDecision> decisions;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    const std::optional<CaptureEnvelope>& envelope = end_effector_of(problem, problem.grasps[i]).envelope;
    GripDecision decision{true, {}, deviations[i]};
    if (!envelope) {
      decision.reason = "the end-effector has no envelope: it holds whatever it meets";
    } else {
      std::string inside, outside;
      for (const Item& item : items(*envelope, deviations[i])) {
        if (item.tolerance == CaptureEnvelope::kAny) continue;
        // Found by an event, a deviation may be on the edge to rounding.
        const bool fits = item.value <= item.tolerance * (1 + 1e-9);
        std::string& text = fits ? inside : outside;
        text += fmt::format("{}{} {:.4g} {} of {:.4g} {}", text.empty() ? "" : ", ", item.name, item.value, item.unit,
                            item.tolerance, item.unit);
      }
      decision.captured = outside.empty();
      decision.reason = decision.captured ? "within the envelope: " + inside : "outside the envelope: " + outside;
    }
    decisions.push_back(std::move(decision));
  }
  return decisions;
}

std::vector<double> envelope_excesses(const CaptureProblem& problem, const CaptureSystem& system,
                                      const Kinematics& kinematics) {
  const std::vector<GraspDeviation> deviations = grasp_deviations(problem, system, kinematics);
  std::vector<double> excesses;
  for (std::size_t i = 0; i < deviations.size(); ++i) {
    excesses.push_back(envelope_excess(end_effector_of(problem, problem.grasps[i]).envelope, deviations[i]));
  }
  return excesses;
}

}  // namespace grapnel
