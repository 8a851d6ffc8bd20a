#pragma once

/// @file
/// Motion in the result of a capture: bodies, joints and end-effectors at an instant, and the plan of an approach.
/// motion_fields.cpp describes each field with its unit. Public, kept stable.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/spatial/pose.hpp"
#include "grapnel/spatial/vector3.hpp"

namespace grapnel {

/// Motion of a free body's frame at one instant.
struct BodyMotion {
  std::string name;
  Vector3d position;
  Quaterniond quaternion_wxyz;
  Vector3d angular_velocity;
  Vector3d velocity;
};

struct JointMotion {
  std::vector<std::string> names;
  std::vector<double> position;
  std::vector<double> velocity;
};

/// An end-effector and its motion relative to its grasp point (end-effector minus grasp point).
struct EndEffectorMotion {
  std::string name;
  Vector3d position;
  Vector3d velocity;
  Vector3d angular_velocity;
  std::string target;
  std::string grasp_point;
  double miss_distance = 0;
  Vector3d relative_velocity = Vector3d::zero();
  Vector3d relative_angular_velocity = Vector3d::zero();
};

/// The system at the end of a phase.
struct PhaseEnd {
  double time = 0;
  BodyMotion base;
  JointMotion joints;
  std::vector<EndEffectorMotion> end_effectors;
  std::vector<BodyMotion> targets;
};

// The plan of an approach.

/// Deviation of an end-effector from its goal when the joints follow the plan exactly.
struct PlannedMiss {
  std::string end_effector;
  double distance = 0;
  double angle = 0;
  std::optional<double> velocity = {};
  std::optional<double> angular_velocity = {};
};

/// The final straight approach.
struct StraightInReport {
  double begin = 0;
  double stand_off = 0;
  double final_speed = 0;
  double smallest_singular_value = 0;
  bool damped = false;
  double damped_begin = 0, damped_end = 0;
  double unmet = 0;
  double unmet_time = 0;
  double fit_error = 0;
  double self_motion = 0;
};

/// One term of the sum that is a plan's objective.
struct PlanTerm {
  std::string name;
  double weight = 0;
  double value = 0;
};

/// Predicted load of a reaction wheel on the planned trajectory.
struct WheelShare {
  std::string wheel;
  double share = 0;
};

/// Properties of a planned segment.
struct PlannedPath {
  int knots = 0;
  std::optional<double> position_margin;
  std::optional<double> rate_share;
  std::optional<double> effort_share;
  std::optional<double> clearance;
  std::string body_a, body_b;
  double clearance_time = 0;
  bool attitude_held = false;
  double base_turn = 0;
  std::vector<WheelShare> wheels;
};

/// A capture time that the planner evaluated.
struct WindowPoint {
  double time = 0;
  bool reachable = false;
  std::string reason;
  double objective = 0;
  double speed = 0;
  double direction_angle = 0;
  double reach_share = 0;
};

/// The evaluated capture times and the selected one.
struct WindowReport {
  double time = 0;
  std::optional<double> not_before;
  std::vector<WindowPoint> points;
};

/// A pair of bodies that touches before the planned capture.
struct PlannedContact {
  std::string body_a, body_b;
  std::optional<double> predicted = {};
  std::optional<double> simulated = {};
  bool disturbs = false;
};

struct PlanReport {
  std::vector<std::string> joints;
  std::vector<double> final_position;
  std::vector<double> final_rates;
  double unmet_rate = 0;

  bool searched = false;  // final positions were searched; the fields below are valid only then
  bool found = false;
  std::string objective;
  double objective_value = 0;
  std::vector<PlanTerm> terms;
  std::vector<PlannedMiss> miss;
  int starts = 0;
  int solutions = 0;
  int distinct_solutions = 0;
  int iterations = 0;
  long rhs_evaluations = 0;
  double smallest_singular_value = 0;
  std::optional<StraightInReport> straight_in;
  std::optional<PlannedPath> path;
  std::optional<WindowReport> window;
  std::string assumes;
  std::vector<PlannedContact> contacts;
};

}  // namespace grapnel
