#include "grapnel/campaign/optimization.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/capture/simulate_capture.hpp"
#include "grapnel/plan/floating_base.hpp"
#include "grapnel/problem/capture_problem.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {

namespace {

// Violation of a limit on a number that does not exist.
constexpr double kNoNumber = 1e6;

double beyond(double excess, double scale) {
  if (std::isnan(excess)) return kNoNumber;
  return excess > 0 ? excess / (scale > 0 ? scale : 1) : 0;
}

}  // namespace

std::string OptimizationLimit::text() const {
  return fmt::format("{} {} {}", measured.name, at_most ? "at most" : "at least", bound);
}

Column feasibility_column() {
  return {"ledger/excess", "1", "sum of the excess of the ledger's feasibility rows over their bounds",
          [](const StudyCase&, const CaptureResult& result) {
            if (result.status != CaptureStatus::completed) return double(NAN);
            double excess = 0;
            for (const LedgerEntry& entry : result.ledger.entries) {
              if (entry.kind == LedgerEntry::Kind::feasibility && !entry.pass()) excess += entry.value - entry.bound;
            }
            return excess;
          }};
}

double value_of(const Measured& measured, std::span<const double> row) {
  double value = NAN;
  for (const std::size_t column : measured.columns) {
    const double one = row[column];
    if (std::isnan(one)) return NAN;
    const bool first = std::isnan(value);
    switch (measured.combine) {
      case Combine::largest:
        value = first ? one : std::max(value, one);
        break;
      case Combine::least:
        value = first ? one : std::min(value, one);
        break;
      case Combine::largest_magnitude:
        value = first ? std::abs(one) : std::max(value, std::abs(one));
        break;
      case Combine::sum:
        value = first ? one : value + one;
        break;
      case Combine::norm:
        value = first ? std::abs(one) : std::hypot(value, one);
        break;
    }
  }
  return value;
}

Score score_of(const Optimization& optimization, const CaseRow& row) {
  Score score;
  score.reached = row.status == CaseStatus::ok;
  double largest = 0;
  const auto add = [&](double violation, std::size_t which) {
    score.violation += violation;
    if (violation > largest) largest = violation, score.worst_limit = which;
  };
  for (const ObjectiveTerm& term : optimization.objective)
    score.objective += term.weight * value_of(term.measured, row.values);
  const std::size_t count = optimization.limits.size();
  for (std::size_t i = 0; i < count; ++i) {
    const OptimizationLimit& limit = optimization.limits[i];
    score.limits.push_back(value_of(limit.measured, row.values));
    const double excess = limit.at_most ? score.limits[i] - limit.bound : limit.bound - score.limits[i];
    add(beyond(excess, std::abs(limit.bound)), i);
  }
  if (optimization.feasible) add(beyond(row.values.back(), 1), count);
  if (std::isnan(score.objective)) add(kNoNumber, count + 1);
  return score;
}

bool comes_before(const Optimization& optimization, const Score& a, const Score& b) {
  if (a.reached != b.reached) return a.reached;
  if (!a.reached) return false;
  if (a.violation != b.violation) return a.violation < b.violation;
  if (a.violation > 0) return false;
  return optimization.maximize ? a.objective > b.objective : a.objective < b.objective;
}

namespace {

// Relative to the radius: tolerance for a point on its sphere.
constexpr double kOnSphere = 1e-3;
// Singular values below this fraction of the largest leave a direction free.
constexpr double kRankTolerance = 1e-9;

GraspPoint& grasp_point(const ContactPatch& patch, CaptureProblem& problem) {
  for (TargetSetup& target : problem.targets) {
    if (target.name != patch.target) continue;
    for (GraspPoint& point : target.grasp_points) {
      if (point.name == patch.point) return point;
    }
  }
  throw std::invalid_argument("unknown grasp point '" + patch.point + "' on target '" + patch.target + "'");
}

// Unit directions in B about which the planned orientation of a grasp admits no rotation.
std::vector<Vector3d> held_turns(const EndEffectorSetup& end_effector, const GraspSetup& grasp, const Rotationd& R_BE) {
  if (grasp.orientation == GraspSetup::Orientation::free) return {};
  std::vector<Vector3d> turns;
  // Perpendicular to the approach axis, or all axes.
  const Vector3d along = R_BE * end_effector.approach_axis.value_or(Vector3d::unit(0));
  const Rotationd R = rotation_between(Vector3d::unit(0), along);
  turns.push_back(R.column(1));
  turns.push_back(R.column(2));
  if (grasp.orientation == GraspSetup::Orientation::pose) turns.push_back(R.column(0));
  return turns;
}

// Constraint rows of the grasps on the joint rates, at a given configuration.
Eigen::MatrixXd task_rows(const CaptureProblem& problem, const FloatingBase& base) {
  std::vector<Eigen::RowVectorXd> rows;
  Matrix6Xd J;
  for (const GraspSetup& grasp : problem.grasps) {
    const int frame = base.model().frame_index(grasp.end_effector);
    base.generalized_jacobian(frame, J);
    for (int k = 3; k < 6; ++k) rows.emplace_back(J.row(k));
    for (const Vector3d& d : held_turns(end_effector_of(problem, grasp), grasp, base.frame_pose(frame).R))
      rows.emplace_back(d[0] * J.row(0) + d[1] * J.row(1) + d[2] * J.row(2));
  }
  Eigen::MatrixXd all(static_cast<Eigen::Index>(rows.size()), base.joints());
  for (std::size_t i = 0; i < rows.size(); ++i) all.row(static_cast<Eigen::Index>(i)) = rows[i];
  return all;
}

}  // namespace

std::pair<double, double> on_patch(const ContactPatch& patch, double along_u, double along_v) {
  if (!patch.is_disc) return {along_u, along_v};
  const double a = along_u / patch.half_width_u, b = along_v / patch.half_width_v;
  return {along_u * std::sqrt(1 - b * b / 2), along_v * std::sqrt(1 - a * a / 2)};
}

void move_on_patch(const ContactPatch& patch, double along_u, double along_v, CaptureProblem& problem) {
  GraspPoint& point = grasp_point(patch, problem);
  const auto [du, dv] = on_patch(patch, along_u, along_v);
  const Vector3d moved = point.X_TG.p + du * patch.u + dv * patch.v;
  const auto target =
      std::find_if(problem.targets.begin(), problem.targets.end(), [&](auto& t) { return t.name == patch.target; });
  const auto is_on = [&](const Geometry& shape) {
    return shape.shape == Geometry::Shape::sphere &&
           std::abs(norm(point.X_TG.p - shape.X_BG.p) - shape.size[0]) <= kOnSphere * shape.size[0] &&
           norm(moved - shape.X_BG.p) > 0;
  };
  const auto sphere = std::find_if(target->geometry.begin(), target->geometry.end(), is_on);
  if (sphere == target->geometry.end()) {
    point.X_TG.p = moved;
    return;
  }
  const Vector3d from = point.X_TG.p - sphere->X_BG.p, to = moved - sphere->X_BG.p;
  const Vector3d n = (1 / norm(to)) * to;
  const Rotationd R = rotation_between((1 / norm(from)) * from, n);
  point.X_TG = {R * point.X_TG.R, sphere->X_BG.p + norm(from) * n};
  const auto turn = [&](std::optional<Vector3d>& direction) {
    if (!direction) return;
    const Vector3d turned = R * *direction;
    direction = (1 / norm(turned)) * turned;
  };
  turn(point.approach_direction);
  turn(point.normal);
}

PostureSpace posture_space(const CaptureProblem& problem) {
  if (!problem.approach || !problem.approach->plan)
    throw std::invalid_argument("a posture needs approach.plan, but the final configuration is given");
  const CaptureResult planned = simulate_impact_only(problem);
  if (!planned.plan || !planned.plan->found) throw std::runtime_error("no initial posture: " + planned.failure);
  const CaptureSystem servicer = make_servicer(problem);
  PostureSpace space{planned.plan->final_position, {}};
  FloatingBase base(servicer.model, problem.robot.base_mode == RobotSetup::Base::free);
  base.place(space.configuration);
  const Eigen::MatrixXd rows = task_rows(problem, base);
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullV);
  const Eigen::VectorXd& values = svd.singularValues();
  Eigen::Index rank = 0;
  while (rank < values.size() && values[rank] > kRankTolerance * values[0]) ++rank;
  for (Eigen::Index k = rank; k < rows.cols(); ++k) {
    Eigen::VectorXd direction = svd.matrixV().col(k);
    Eigen::Index largest = 0;
    direction.cwiseAbs().maxCoeff(&largest);
    if (direction[largest] < 0) direction = -direction;
    space.directions.emplace_back(direction.begin(), direction.end());
  }
  return space;
}

void set_posture(const PostureSpace& space, const std::vector<double>& coordinates, CaptureProblem& problem) {
  PlanSetup& plan = *problem.approach->plan;
  plan.objective = PlanSetup::Objective::nearest;
  plan.weights.reset();
  plan.guess = space.configuration;
  for (std::size_t k = 0; k < coordinates.size(); ++k) {
    for (std::size_t j = 0; j < plan.guess.size(); ++j) plan.guess[j] += coordinates[k] * space.directions[k][j];
  }
  const CaptureSystem servicer = make_servicer(problem);
  for (std::size_t j = 0; j < plan.guess.size(); ++j) {
    const int body = servicer.model.joints()[j];
    const JointLimits& limits = servicer.model.bodies()[body].description.joint.limits;
    plan.guess[j] = std::clamp(plan.guess[j], limits.lower, limits.upper);
  }
}

}  // namespace grapnel
