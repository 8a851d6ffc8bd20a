#pragma once

/// @file
/// What planning an approach has found. What each field is: motion_fields.cpp.

#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// How far an end-effector stays from its goal when the joints follow the plan exactly.
struct PlannedMiss {
  std::string end_effector;
  double distance = 0;
  double angle = 0;
};

/// The piece straight in.
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
};

struct PlanReport {
  std::vector<std::string> joints;
  std::vector<double> final_position;
  std::vector<double> final_rates;
  double unmet_rate = 0;

  bool searched = false;  // final positions were looked for; the rest is meaningful then
  bool found = false;
  std::string objective;
  double objective_value = 0;
  std::vector<PlannedMiss> miss;
  int starts = 0;
  int solutions = 0;
  int iterations = 0;
  long rhs_evaluations = 0;
  double smallest_singular_value = 0;
  std::optional<StraightInReport> straight_in;
};

}  // namespace grapnel
