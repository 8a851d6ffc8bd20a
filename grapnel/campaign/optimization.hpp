#pragma once

/// @file
/// An optimization: a search for the best of many captures that differ in some numbers. Plain data and two functions;
/// campaign/study_files.hpp reads it from a file. Thread safety: plain values; `point` may be called from any
/// thread.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/campaign/case_pool.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// A variable between two bounds.
struct OptimizationVariable {
  std::string name;
  std::string unit;  // of the numbers here; empty: unknown
  double from = 0, to = 0;
  double start = 0;  // value of the scenario if it is a number; else the middle
};

/// Combination of several columns.
enum class Combine { largest, least, largest_magnitude, sum, norm };
template <>
struct Described<Combine> : Enumeration<Combine, "Combine", "largest", "least", "largest_magnitude", "sum", "norm"> {};

/// Combined columns.
struct Measured {
  std::string name;                  // as in the file
  std::string unit;                  // of the columns; empty if they differ
  std::vector<std::size_t> columns;  // in Optimization::columns
  Combine combine = Combine::largest;
};

struct ObjectiveTerm {
  Measured measured;
  double weight = 1;
};

struct OptimizationLimit {
  Measured measured;
  bool at_most = true;  // false: at least
  double bound = 0;
  std::string text() const;  // "margins at least 0.2"
};

/// Steps of local searches. subplex: only points are compared. gradient: along derivatives of objective and limits.
enum class LocalSteps { subplex, gradient };

struct SearchSetup {
  std::size_t evaluations = 200;  // at most
  std::uint64_t seed = 0;         // of the sample
  std::size_t refine = 3;         // number of best points of the sample from which local searches begin; 0: none
  LocalSteps steps = LocalSteps::subplex;
};

struct Optimization {
  std::string name;
  std::string file;    // path given by the user
  std::string text;    // its bytes
  std::string sha256;  // of those and of the scenario with its included files
  StudyMode mode = StudyMode::run;
  std::vector<OptimizationVariable> variables;
  std::vector<Column> columns;  // the last is feasibility_column()
  bool maximize = false;
  std::vector<ObjectiveTerm> objective;  // the weighted sum
  std::vector<OptimizationLimit> limits;
  bool feasible = true;  // joints within their limits and bodies with their clearance, if monitored
  SearchSetup search;
  StudyCase before;  // the unchanged scenario
  /// The capture at values of the variables. @throws std::exception if there is none; its message becomes the point's
  /// reason.
  std::function<StudyCase(std::span<const double>)> point;
  /// The same as a scenario file at a path.
  std::function<std::string(std::span<const double>, const std::filesystem::path& place, const std::string& comment)>
      scenario_text;
};

/// Violation of joint limits and clearances: the sum over the ledger's feasibility rows; 0 if all pass, NaN if the
/// capture did not complete.
Column feasibility_column();

/// The value of combined columns; NaN if one of them is NaN.
double value_of(const Measured& measured, std::span<const double> row);

/// Rating of a point. comes_before() compares points.
struct Score {
  bool reached = false;         // the simulation completed
  double objective = 0;         // NaN if it does not exist
  std::vector<double> limits;   // per limit: the measured value
  double violation = 0;         // sum of the relative violations of limits; 0: acceptable
  std::size_t worst_limit = 0;  // largest contribution; limits.size(): feasibility; + 1: the objective does not exist
  bool acceptable() const { return reached && violation == 0; }
};
Score score_of(const Optimization& optimization, const CaseRow& row);

/// Acceptable points before others, the better objective first; then by violation; those that cannot be reached last
/// (Deb's rules, 2000).
bool comes_before(const Optimization& optimization, const Score& a, const Score& b);

// Variables without a single value in a scenario: the contact point on a patch, the posture of the arms. Each is a
// function on a CaptureProblem.

/// Admissible positions of a grasp point in a plane through it. If it lies on a sphere of the target's shapes, it is
/// projected onto that sphere, and its directions and frame rotate accordingly.
struct ContactPatch {
  std::string target;
  std::string point;
  Vector3d u{1, 0, 0}, v{0, 1, 0};  // unit, perpendicular, in the target's frame
  double half_width_u = 0;          // [m]
  double half_width_v = 0;          // [m]
  bool is_disc = false;             // of radius half_width_u = half_width_v
};

/// Displacements along u and v for a position in the box of the half widths. For a disc the enclosing square is mapped
/// smoothly onto it, its sides onto the circle: a sqrt(1 - b^2/2), b sqrt(1 - a^2/2) with a, b in -1 ... 1.
std::pair<double, double> on_patch(const ContactPatch& patch, double along_u, double along_v);

/// Moves the grasp point to a position in the box of the half widths [m].
void move_on_patch(const ContactPatch& patch, double along_u, double along_v, CaptureProblem& problem);

/// A configuration, and an orthonormal basis of the joint directions that keep the position of every end-effector and
/// its required grasp orientation, with a floating base.
struct PostureSpace {
  std::vector<double> configuration;            // per joint [rad or m]
  std::vector<std::vector<double>> directions;  // per joint; none if the robot is not redundant
};

/// About the planned final configuration: the null space of the end-effectors' generalized Jacobian (2.5), without the
/// rows that the orientations leave free. @throws std::runtime_error if no configuration is found,
/// std::invalid_argument without approach.plan.
PostureSpace posture_space(const CaptureProblem& problem);

/// Makes the planner find the solution nearest to the configuration moved by `coordinates`, one per direction.
void set_posture(const PostureSpace& space, const std::vector<double>& coordinates, CaptureProblem& problem);

}  // namespace grapnel
