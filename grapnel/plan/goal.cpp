#include "grapnel/plan/goal.hpp"

#include <cmath>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

using Matrix36d = Eigen::Matrix<double, 3, 6>;

// Two unit vectors across d.
Eigen::Matrix<double, 2, 3> across(const Vector3d& d) {
  const Rotationd R = rotation_between({0, 0, 1}, d);
  Eigen::Matrix<double, 2, 3> B;
  B.row(0) = column(R.column(0)).transpose();
  B.row(1) = column(R.column(1)).transpose();
  return B;
}

// Twists of the frame's origin in W: of the joints at a fixed base, and of the base's displacement in B.
void frame_jacobians(const FloatingBase& base, const Posed& X_WB, int frame, Matrix6Xd& J_joint,
                     Eigen::Matrix<double, 6, 6>& J_base) {
  base.frame_jacobian(frame, J_joint);
  const Eigen::Matrix3d R = as_matrix(X_WB.R);
  J_joint.topRows(3) = (R * J_joint.topRows(3)).eval();
  J_joint.bottomRows(3) = (R * J_joint.bottomRows(3)).eval();
  const Vector3d p = base.frame_pose(frame).p;
  for (int k = 0; k < 6; ++k) J_base.col(k) = column(X_WB.R * shift(twist_from(Vector6d::Unit(k)), p));
}

}  // namespace

int rows_of(const Goal& goal) {
  return goal.orientation == Goal::Orientation::free ? 3 : goal.orientation == Goal::Orientation::axis ? 5 : 6;
}

int error_rows(std::span<const Goal> goals) {
  int rows = 0;
  for (const Goal& g : goals) rows += rows_of(g);
  return rows;
}

void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error,
                Eigen::MatrixXd& J_joint, Eigen::MatrixXd& J_base) {
  const int rows = error_rows(goals);
  error.resize(rows), J_joint.resize(rows, base.joints()), J_base.resize(rows, 6);
  Matrix6Xd J;
  Eigen::Matrix<double, 6, 6> Jb;
  int row = 0;
  for (const Goal& g : goals) {
    const Posed X_WE = X_WB * base.frame_pose(g.frame);
    frame_jacobians(base, X_WB, g.frame, J, Jb);
    error.segment<3>(row) = column(X_WE.p - g.X_WG.p);
    J_joint.middleRows(row, 3) = J.bottomRows(3);
    J_base.middleRows(row, 3) = Jb.bottomRows(3);
    row += 3;
    if (g.orientation == Goal::Orientation::axis) {
      const Vector3d a = X_WE.R * g.axis_E;
      const Vector3d phi = rotation_vector(rotation_between(g.direction_W, a));
      const Eigen::Matrix<double, 2, 3> B = across(g.direction_W);
      error.segment<2>(row) = B * column(phi);
      J_joint.middleRows(row, 2) = B * J.topRows(3);
      J_base.middleRows(row, 2) = B * Jb.topRows(3);
      row += 2;
    } else if (g.orientation == Goal::Orientation::pose) {
      error.segment<3>(row) = column(rotation_vector(X_WE.R * transpose(g.X_WG.R)));
      J_joint.middleRows(row, 3) = J.topRows(3);
      J_base.middleRows(row, 3) = Jb.topRows(3);
      row += 3;
    }
  }
}

void demand_rows(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B, std::span<const Goal> goals,
                 RateDemand demand, Eigen::MatrixXd& G, Eigen::VectorXd& b) {
  const bool task = demand == RateDemand::task;
  int rows = 0;
  for (const Goal& g : goals) rows += demand == RateDemand::linear ? 3 : task ? rows_of(g) : 6;
  G.resize(rows, base.joints()), b.resize(rows);
  const Twistd V_h = twist_from(base.momentum_part(h_B));
  const Eigen::Matrix3d R = as_matrix(X_WB.R);
  Matrix6Xd J;
  int row = 0;
  for (const Goal& g : goals) {
    base.generalized_jacobian(g.frame, J);
    const Twistd drift = X_WB.R * shift(V_h, base.frame_pose(g.frame).p);  // second term of (2.3)
    G.middleRows(row, 3) = R * J.bottomRows(3);
    b.segment<3>(row) = column(g.V_WG.linear - drift.linear);
    row += 3;
    const bool axis_only = task && g.orientation == Goal::Orientation::axis;
    if (demand == RateDemand::linear || (task && g.orientation == Goal::Orientation::free)) continue;
    const Vector3d spin = demand == RateDemand::velocity ? Vector3d::zero() : g.V_WG.angular;
    const Eigen::Vector3d missing = column(spin - drift.angular);
    if (axis_only) {
      const Eigen::Matrix<double, 2, 3> B = across(g.direction_W);
      G.middleRows(row, 2) = B * R * J.topRows(3);
      b.segment<2>(row) = B * missing;
      row += 2;
    } else {
      G.middleRows(row, 3) = R * J.topRows(3);
      b.segment<3>(row) = missing;
      row += 3;
    }
  }
}

DemandedRates demanded_rates(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                             std::span<const Goal> goals, RateDemand demand) {
  Eigen::MatrixXd G;
  Eigen::VectorXd b;
  demand_rows(base, X_WB, h_B, goals, demand, G, b);
  DemandedRates result;
  result.rates = least_norm_solution(G, b, 1e-10);
  result.unmet = b.size() ? (G * result.rates - b).lpNorm<Eigen::Infinity>() : 0;
  return result;
}

namespace {

// -sum log sigma over goals of the generalized Jacobian's rows: velocity, and spin where the goal has an orientation.
double lost_manipulability(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position) {
  base.place(position);
  double sum = 0;
  Matrix6Xd J;
  for (const Goal& g : goals) {
    base.generalized_jacobian(g.frame, J);
    const bool spin = g.orientation != Goal::Orientation::free;
    const Eigen::MatrixXd rows = spin ? Eigen::MatrixXd(J) : Eigen::MatrixXd(J.bottomRows(3));
    const Eigen::VectorXd sigma = Eigen::JacobiSVD<Eigen::MatrixXd>(rows).singularValues();
    // What a planar arm can never do does not count.
    for (double s : sigma) {
      if (s > 1e-9 * sigma[0]) sum -= std::log(s);
    }
  }
  return sum;
}

// Half the square of a distance of each joint from a place, over a length.
double half_squares(std::span<const double> position, const std::vector<double>& place, Objective::Gradient* gradient) {
  double sum = 0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double d = position[j] - place[j];
    sum += 0.5 * d * d;
    if (gradient) gradient->position[j] = d;
  }
  return sum;
}

}  // namespace

Objective::Objective(Kind kind, const SegmentStart& start, std::vector<double> guess, std::vector<double> lower,
                     std::vector<double> upper)
    : kind_(kind), start_(start), guess_(std::move(guess)), lower_(std::move(lower)), upper_(std::move(upper)) {
  if (kind != Kind::excursion) return;
  // Simpson's rule on polynomials of order 8 or a cycloid: 1e-9.
  constexpr int kIntervals = 200;
  double ss = 0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double x = static_cast<double>(i) / kIntervals;
    const double weight = i == 0 || i == kIntervals ? 1 : i % 2 == 1 ? 4 : 2;
    const double s = evaluate(JointPath{start.profile, 1, 0, 1, 0, 0}, x).rate;
    const double e = evaluate(JointPath{start.profile, 1, 0, 0, 0, 1}, x).rate;
    const double b = evaluate(JointPath{start.profile, 1, 0, 0, 1, 0}, x).rate;
    ss += weight * s * s, se_ += weight * s * e, sb_ += weight * s * b;
    ee_ += weight * e * e, eb_ += weight * e * b, bb_ += weight * b * b;
  }
  se_ /= ss, sb_ /= ss, ee_ /= ss, eb_ /= ss, bb_ /= ss;
}

double Objective::excursion(std::span<const double> position, std::span<const double> rate, Gradient* gradient) const {
  const double T = start_.end - start_.begin;
  double sum = 0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double d = position[j] - start_.position[j], b = T * start_.rate[j];
    const double e = rate.empty() ? 0.0 : T * rate[j];
    sum += 0.5 * (d * d + ee_ * e * e + bb_ * b * b) + se_ * d * e + sb_ * d * b + eb_ * e * b;
    if (!gradient) continue;
    gradient->position[j] = d + se_ * e + sb_ * b;
    gradient->rate[j] = T * (ee_ * e + se_ * d + eb_ * b);
  }
  return sum;
}

double Objective::value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
                        std::span<const double> rate, Gradient* gradient) const {
  const std::size_t n = position.size();
  if (gradient) gradient->position.assign(n, 0.0), gradient->rate.assign(n, 0.0);
  double sum = 0;
  switch (kind_) {
    case Kind::excursion:
      return excursion(position, rate, gradient);
    case Kind::nearest:
      return half_squares(position, guess_, gradient);
    case Kind::as_found:
      return 0;
    case Kind::limits:
      for (std::size_t j = 0; j < n; ++j) {
        const double range = upper_[j] - lower_[j];
        if (!std::isfinite(range) || range <= 0) continue;
        const double d = (position[j] - 0.5 * (lower_[j] + upper_[j])) / range;
        sum += 0.5 * d * d;
        if (gradient) gradient->position[j] = d / range;
      }
      return sum;
    case Kind::manipulability:
      break;
  }
  if (gradient) {
    constexpr double kDifference = 1e-6;
    std::vector<double> x(position.begin(), position.end());
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = position[j] + kDifference;
      const double above = lost_manipulability(base, goals, x);
      x[j] = position[j] - kDifference;
      gradient->position[j] = (above - lost_manipulability(base, goals, x)) / (2 * kDifference);
      x[j] = position[j];
    }
  }
  return lost_manipulability(base, goals, position);
}

}  // namespace grapnel
