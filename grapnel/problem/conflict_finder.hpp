#pragma once

/// @file
/// Private to this module: the common base of the files that find a problem's conflicts. Each checks one part of the
/// problem and appends its conflicts to one list.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/problem_conflicts.hpp"

namespace grapnel {

/// Conflicts of the orbit, and those with the conditions of the linear field near it.
void find_orbit_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Conflicts of external wrenches.
void find_load_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Conflicts of materials, obstacles and the pairs of bodies that may touch.
void find_contact_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Conflicts of the stages of captures by contacts.
void find_stage_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Joint values that violate couplings of joints, and features without couplings.
void find_coupling_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Commands of tendons in the first phase of motion.
void find_tendon_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Faults of the robot's tendons; `before`: prefix of paths in messages.
void add_tendon_faults(const RobotSetup& robot, const std::string& before, std::vector<ProblemFault>& found);
/// Conflicts of the laws that drive joints and base, of the on-board computer and of the actuators.
void find_control_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Conflicts of the times at which grasps close, and of the limits of what they hold.
void find_grasp_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);
/// Conflicts of the sequence of phases after the approach: names, conditions, and phases that need a capture.
void find_phase_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);

/// Conflicts of sensors, of estimates of targets, and of identification.
void find_sensor_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found);

template <class Named>
const Named* find_named(const std::vector<Named>& list, const std::string& name) {
  const auto found = std::find_if(list.begin(), list.end(), [&](const Named& one) { return one.name == name; });
  return found == list.end() ? nullptr : &*found;
}

inline bool is_zero(const Vector3d& v) { return v[0] == 0 && v[1] == 0 && v[2] == 0; }

/// Checks a problem and appends conflicts to a list; both outlive the object.
class ConflictFinder {
 public:
  ConflictFinder(const CaptureProblem& problem, std::vector<ProblemFault>& found) : problem_(problem), found_(found) {}

 protected:
  template <class... Arguments>
  ProblemFault& add(std::string path, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    return found_.emplace_back(ProblemFault{std::move(path), fmt::format(form, std::forward<Arguments>(arguments)...)});
  }
  // Adds the conflict that a key is present at all.
  template <class... Arguments>
  ProblemFault& add_key(std::string path, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    ProblemFault& fault = add(std::move(path), form, std::forward<Arguments>(arguments)...);
    fault.of_key = true;
    return fault;
  }

  const EndEffectorSetup* end_effector(const std::string& name) const {
    return find_named(problem_.robot.end_effectors, name);
  }
  const GraspPoint* grasp_point(const GraspSetup& grasp) const {
    const TargetSetup* target = find_named(problem_.targets, grasp.target);
    return target ? find_named(target->grasp_points, grasp.grasp_point) : nullptr;
  }

  // A phase's duration; 0 without the phase. Empty if it is invalid.
  template <class Phase>
  static std::optional<double> duration_of(const std::optional<Phase>& phase) {
    if (!phase) return 0.0;
    if (!(phase->duration > 0) || !std::isfinite(phase->duration)) return {};
    return phase->duration;
  }

  // The duration of all phases after the approach.
  static std::optional<double> duration_of(const MotionPhases& phases) {
    const auto in_doubt = [](const PostImpactSetup& p) { return !(p.duration > 0) || !std::isfinite(p.duration); };
    if (phases.any(in_doubt)) return {};
    return phases.total_duration();
  }

  // The minimum duration of an approach whose time of capture is searched.
  static std::optional<double> shortest(const std::optional<ApproachSetup>& approach) {
    if (!approach || !approach->window) return duration_of(approach);
    const double earliest = approach->window->earliest;
    return earliest > 0 && std::isfinite(earliest) ? std::optional(earliest) : std::nullopt;
  }
  // The maximum duration.
  static std::optional<double> longest(const std::optional<ApproachSetup>& approach) {
    if (!approach || !approach->window) return duration_of(approach);
    const double latest = approach->window->latest;
    return latest > 0 && std::isfinite(latest) ? std::optional(latest) : std::nullopt;
  }

  const CaptureProblem& problem_;
  std::vector<ProblemFault>& found_;
};

}  // namespace grapnel
