#include "grapnel/capture/envelope.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "grapnel/capture/problem_lookup.hpp"

namespace grapnel {
namespace {

// One tolerance: its key in a robot file, its name, the deviation, what is allowed, the unit.
struct Item {
  const char* key;
  const char* name;
  double value, tolerance;
  const char* unit;
};
std::array<Item, 4> items(const CaptureEnvelope& e, const GraspDeviation& d) {
  return {{{"position", "distance", d.position, e.position, "m"},
           {"angle", "angle", d.angle, e.angle, "rad"},
           {"velocity", "speed", d.velocity, e.velocity, "m/s"},
           {"angular_velocity", "angular rate", d.angular_velocity, e.angular_velocity, "rad/s"}}};
}

GripDecision decide(const std::optional<CaptureEnvelope>& envelope, const GraspDeviation& deviation) {
  GripDecision decision;
  decision.captured = true;
  decision.deviation = deviation;
  decision.judged = judges_position(envelope);
  if (!envelope) {
    decision.reason = "the end-effector has no envelope: nobody judged whether it can close, it is taken to hold";
    return decision;
  }
  std::string inside, outside;
  double largest = 0;
  for (const Item& item : items(*envelope, deviation)) {
    if (item.tolerance == CaptureEnvelope::kAny) continue;
    // Found by an event, a deviation may be on the edge to rounding.
    const bool fits = item.value <= item.tolerance * (1 + 1e-9);
    std::string& text = fits ? inside : outside;
    text += fmt::format("{}{} {:.4g} {} of {:.4g} {}", text.empty() ? "" : ", ", item.name, item.value, item.unit,
                        item.tolerance, item.unit);
    if (fits || !(item.value / item.tolerance > largest)) continue;
    largest = item.value / item.tolerance;
    decision.limiting = item.key;
  }
  decision.captured = outside.empty();
  decision.reason = decision.captured ? "within the envelope: " + inside : "outside the envelope: " + outside;
  if (decision.captured && !decision.judged) decision.reason += "; it has no position: nobody judged the distance";
  return decision;
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

bool judges_position(const std::optional<CaptureEnvelope>& envelope) {
  return envelope && envelope->position != CaptureEnvelope::kAny;
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
    decisions.push_back(decide(end_effector_of(problem, problem.grasps[i]).envelope, deviations[i]));
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
