#pragma once

/// @file
/// What planning an approach has found. Thread safety: plain values.

#include <optional>
#include <string>
#include <vector>

namespace grapnel {

/// How far an end-effector stays from its goal when the joints follow the plan exactly.
struct PlannedMiss {
  std::string end_effector;
  double distance = 0;  // [m]
  double angle = 0;     // of what the grasp's orientation asks for [rad]
};

/// The piece straight in.
struct StraightInReport {
  double begin = 0;                    // [s]
  double stand_off = 0;                // [m]
  double final_speed = 0;              // [m/s]
  double smallest_singular_value = 0;  // of the generalized Jacobian's rows in use
  bool damped = false;                 // it came so near a singularity that rates were damped, between these times
  double damped_begin = 0, damped_end = 0;
  double unmet = 0;  // largest component of the demanded motion left unmet [m/s or rad/s], and when
  double unmet_time = 0;
  double fit_error = 0;  // of the series that keep the joint motion [rad or m]
};

struct PlanReport {
  std::vector<std::string> joints;     // names
  std::vector<double> final_position;  // [rad or m]
  std::vector<double> final_rates;     // [rad/s or m/s]
  double unmet_rate = 0;               // largest component of the demanded final motion that no rates give

  bool searched = false;  // final positions were looked for; the rest is meaningful then
  bool found = false;
  std::string measure;  // what was made least
  double measure_value = 0;
  std::vector<PlannedMiss> miss;
  int starts = 0;     // beginnings tried
  int solutions = 0;  // of them that led to a solution
  int iterations = 0;
  long rhs_evaluations = 0;            // of the base's motion, while planning
  double smallest_singular_value = 0;  // of the goals' error against the final joint values
  std::optional<StraightInReport> straight_in;
};

}  // namespace grapnel
