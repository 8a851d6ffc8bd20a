#pragma once

/// @file
/// An optimization: captures that differ in some numbers, and which of them is best. Plain data and two functions;
/// study_files/study_files.hpp makes it from a file. Thread safety: plain values; `point` may be called from any
/// thread.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/study/case_pool.hpp"

namespace grapnel {

/// A number that is varied, between two bounds.
struct OptimizationVariable {
  std::string name;
  std::string unit;  // of the numbers here; empty: unknown
  double from = 0, to = 0;
  double start = 0;  // where the scenario is, as far as that is a number; else the middle
};

/// What several columns make together.
enum class Combine { largest, least, largest_magnitude, sum, norm };
template <>
struct Described<Combine> : Enumeration<Combine, "Combine", "largest", "least", "largest_magnitude", "sum", "norm"> {};

/// Columns taken together.
struct Measured {
  std::string name;                  // as the file says it
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
  bool at_most = true;  // else at least
  double bound = 0;
  std::string text() const;  // "margins at least 0.2"
};

struct SearchSetup {
  std::size_t evaluations = 200;  // at most
  std::uint64_t seed = 0;         // of the sample
  std::size_t refine = 3;         // best points of the sample from which the search goes on locally; 0: none
};

struct Optimization {
  std::string name;
  std::string file;    // as the user named it
  std::string text;    // its bytes
  std::string sha256;  // of those and of the scenario with what it includes
  StudyMode mode = StudyMode::run;
  std::vector<OptimizationVariable> variables;
  std::vector<Column> columns;  // the last is feasibility_column()
  bool maximize = false;
  std::vector<ObjectiveTerm> objective;  // the weighted sum
  std::vector<OptimizationLimit> limits;
  bool feasible = true;  // joints within their limits and bodies clear of each other, as far as that is watched
  SearchSetup search;
  StudyCase before;  // the scenario as it is
  /// The capture at values of the variables. @throws std::exception where there is none; it becomes the point's reason.
  std::function<StudyCase(std::span<const double>)> point;
  /// The same as a scenario file, for a place on disk.
  std::function<std::string(std::span<const double>, const std::filesystem::path& place, const std::string& comment)>
      scenario_text;
};

/// By how much joints and clearances are beyond what they must keep, the sum of the ledger's rows of feasibility; 0 if
/// all hold, NaN if the capture was not completed.
Column feasibility_column();

/// The value of columns taken together; NaN if one of them is.
double value_of(const Measured& measured, std::span<const double> row);

/// How good a point is. Points compare by comes_before().
struct Score {
  bool reached = false;         // it could be simulated
  double objective = 0;         // NaN if it does not exist
  std::vector<double> limits;   // per limit: the measured value
  double violation = 0;         // sum of what is beyond limits, relative to them; 0 if none; then it may be chosen
  std::size_t worst_limit = 0;  // contributes most to it; limits.size(): feasibility; + 1: the objective is no number
  bool acceptable() const { return reached && violation == 0; }
};
Score score_of(const Optimization& optimization, const CaseRow& row);

/// Acceptable points before others, the better objective first; then by violation; those that cannot be reached last
/// (Deb's rules, 2000).
bool comes_before(const Optimization& optimization, const Score& a, const Score& b);

// How an optimization moves what has no single value in a scenario: the contact point on a patch, the posture of the
// arms. Each is a function on a CaptureProblem.

/// Where a grasp point may be: in a plane through it. On a sphere among the target's shapes, if it lies on it, it is
/// projected onto that sphere, and its directions and frame turn along.
struct ContactPatch {
  std::string target;
  std::string point;
  Vector3d u{1, 0, 0}, v{0, 1, 0};  // unit, perpendicular, in the target's frame
  double half_width_u = 0;          // [m]
  double half_width_v = 0;          // [m]
  bool is_disc = false;             // of radius half_width_u = half_width_v
};

/// Displacements along u and v for a place in the box of the half widths. Of a disc the square around it is mapped onto
/// it smoothly, its sides onto the circle: a sqrt(1 - b^2/2), b sqrt(1 - a^2/2) with a, b in -1 ... 1.
std::pair<double, double> on_patch(const ContactPatch& patch, double along_u, double along_v);

/// Moves the grasp point to a place in the box of the half widths [m].
void move_on_patch(const ContactPatch& patch, double along_u, double along_v, CaptureProblem& problem);

/// A configuration, and the directions in which all joints together can leave it while every end-effector keeps its
/// place and what its grasp's orientation asks for, the base floating: an orthonormal basis.
struct PostureSpace {
  std::vector<double> configuration;            // per joint [rad or m]
  std::vector<std::vector<double>> directions;  // per joint; none if the robot is not redundant
};

/// About the planned final configuration: the null space of the end-effectors' generalized Jacobian (2.5), without the
/// rows that the orientations leave free. @throws std::runtime_error if no configuration is found,
/// std::invalid_argument without approach.plan.
PostureSpace posture_space(const CaptureProblem& problem);

/// The planner is to find the solution nearest to the configuration moved by `coordinates`, one per direction.
void set_posture(const PostureSpace& space, const std::vector<double>& coordinates, CaptureProblem& problem);

}  // namespace grapnel
