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
  if (J_joint.cols() > 0) {  // Eigen moves a null pointer to take rows of a matrix without columns
    J_joint.topRows(3) = (R * J_joint.topRows(3)).eval();
    J_joint.bottomRows(3) = (R * J_joint.bottomRows(3)).eval();
  }
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
  const bool joints = base.joints() > 0;
  for (const Goal& g : goals) {
    const Posed X_WE = X_WB * base.frame_pose(g.frame);
    frame_jacobians(base, X_WB, g.frame, J, Jb);
    error.segment<3>(row) = column(X_WE.p - g.X_WG.p);
    if (joints) J_joint.middleRows(row, 3) = J.bottomRows(3);
    J_base.middleRows(row, 3) = Jb.bottomRows(3);
    row += 3;
    if (g.orientation == Goal::Orientation::axis) {
      const Vector3d a = X_WE.R * g.axis_E;
      const Vector3d phi = rotation_vector(rotation_between(g.direction_W, a));
      const Eigen::Matrix<double, 2, 3> B = across(g.direction_W);
      error.segment<2>(row) = B * column(phi);
      if (joints) J_joint.middleRows(row, 2) = B * J.topRows(3);
      J_base.middleRows(row, 2) = B * Jb.topRows(3);
      row += 2;
    } else if (g.orientation == Goal::Orientation::pose) {
      error.segment<3>(row) = column(rotation_vector(X_WE.R * transpose(g.X_WG.R)));
      if (joints) J_joint.middleRows(row, 3) = J.topRows(3);
      J_base.middleRows(row, 3) = Jb.topRows(3);
      row += 3;
    }
  }
}

namespace {

// How much of a twist [angular; linear] a demand looks at: always the velocity, and of the spin nothing, two components
// across the goal's direction, or all.
int spin_rows(const Goal& g, RateDemand demand) {
  if (demand == RateDemand::linear) return 0;
  if (demand != RateDemand::task) return 3;
  return rows_of(g) - 3;
}

int demanded_rows(std::span<const Goal> goals, RateDemand demand) {
  int rows = 0;
  for (const Goal& g : goals) rows += 3 + spin_rows(g, demand);
  return rows;
}

// Calls visit(goal, first row, spin rows) per goal.
template <class Visit>
void for_each_goal(std::span<const Goal> goals, RateDemand demand, Visit&& visit) {
  int row = 0;
  for (const Goal& g : goals) {
    const int spin = spin_rows(g, demand);
    visit(g, row, spin);
    row += 3 + spin;
  }
}

// The goal's rows, from `row` on, of twists in W, one per column. Of a robot without joints there is none.
template <class Twists, class Matrix>
void put_rows(const Goal& g, int row, int spin, const Twists& V, Matrix& all) {
  if (V.cols() == 0) return;
  auto rows = all.middleRows(row, 3 + spin);
  rows.topRows(3) = V.bottomRows(3);
  if (spin == 3) rows.bottomRows(3) = V.topRows(3);
  if (spin == 2) rows.bottomRows(2) = across(g.direction_W) * V.topRows(3);
}

// [angular; linear] in W with the same product with every twist as the rows' weights have with its rows.
Vector6d weights_as_wrench(const Goal& g, int spin, const Eigen::VectorXd& weights) {
  Vector6d F = Vector6d::Zero();
  F.tail<3>() = weights.head<3>();
  if (spin == 3) F.head<3>() = weights.tail<3>();
  if (spin == 2) F.head<3>() = across(g.direction_W).transpose() * weights.tail<2>();
  return F;
}

// R on both parts.
Eigen::Matrix<double, 6, 6> both(const Eigen::Matrix3d& R) {
  Eigen::Matrix<double, 6, 6> X = Eigen::Matrix<double, 6, 6>::Zero();
  X.topLeftCorner<3, 3>() = X.bottomRightCorner<3, 3>() = R;
  return X;
}

}  // namespace

void demand_rows(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B, std::span<const Goal> goals,
                 RateDemand demand, Eigen::MatrixXd& G, Eigen::VectorXd& b) {
  const int rows = demanded_rows(goals, demand);
  G.resize(rows, base.joints()), b.resize(rows);
  const Twistd V_h = twist_from(base.momentum_part(h_B));
  const auto R = both(as_matrix(X_WB.R));
  Matrix6Xd J;
  for_each_goal(goals, demand, [&](const Goal& g, int row, int spin) {
    base.generalized_jacobian(g.frame, J);
    J = (R * J).eval();
    put_rows(g, row, spin, J, G);
    const Twistd drift = X_WB.R * shift(V_h, base.frame_pose(g.frame).p);  // second term of (2.3)
    const Vector3d spin_wanted = demand == RateDemand::velocity ? Vector3d::zero() : g.V_WG.angular;
    put_rows(g, row, spin, column(Twistd{spin_wanted, g.V_WG.linear} - drift), b);
  });
}

DemandedRates demanded_rates(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                             std::span<const Goal> goals, RateDemand demand) {
  Eigen::VectorXd b;
  DemandedRates result;
  demand_rows(base, X_WB, h_B, goals, demand, result.G, b);
  result.G_inverse = pseudo_inverse(result.G, 1e-10);
  result.rates = result.G_inverse * b;
  result.unmet_part = b - result.G * result.rates;
  // The pseudo-inverse is accurate to rounding of its own entries; its product with what is left to that of the rates.
  const Eigen::VectorXd rest = result.G_inverse * result.unmet_part;
  result.rates += rest;
  result.unmet_part -= result.G * rest;
  result.unmet = b.size() ? result.unmet_part.lpNorm<Eigen::Infinity>() : 0;
  return result;
}

namespace {

// dG^T weights: per joint of the rates (rows) and joint value or component of a small rotation of the base in B
// (columns).
struct WeightedChange {
  Eigen::MatrixXd per_angle, per_rotation;
};

WeightedChange change_of_rows(FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, RateDemand demand,
                              const Eigen::VectorXd& weights) {
  const int n = base.joints();
  WeightedChange change{Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, 3)};
  const Eigen::Matrix<double, 6, 6> to_base = both(as_matrix(X_WB.R).transpose());
  std::vector<Vector6d> F;  // per goal, in B
  Matrix6Xd J;
  for_each_goal(goals, demand, [&](const Goal& g, int row, int spin) {
    F.push_back(to_base * weights_as_wrench(g, spin, weights.segment(row, 3 + spin)));
    base.generalized_jacobian(g.frame, J);
    for (int j = 0; j < n; ++j) {
      change.per_rotation.row(j) +=
          J.col(j).head<3>().cross(F.back().head<3>()) + J.col(j).tail<3>().cross(F.back().tail<3>());
    }
  });
  std::vector<double> one(n, 0.0);
  for (int j = 0; j < n; ++j) {
    one[j] = 1;
    base.move(one, Momentumd::zero());
    one[j] = 0;
    for (std::size_t i = 0; i < goals.size(); ++i) {
      base.frame_twist_per_angle(goals[i].frame, J);
      change.per_angle.row(j) += F[i].transpose() * J;
    }
  }
  return change;
}

}  // namespace

RateSensitivity rate_sensitivity(FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                                 std::span<const Goal> goals, RateDemand demand, const DemandedRates& demanded) {
  const int n = base.joints();
  const auto rows = demanded.G.rows();
  const Eigen::MatrixXd& inverse = demanded.G_inverse;
  Eigen::MatrixXd per_angle(rows, n), per_displacement(rows, 6);  // d(G rho - b)
  const std::vector<double> rates(demanded.rates.begin(), demanded.rates.end());
  base.move(rates, h_B);
  const auto R = both(as_matrix(X_WB.R));
  const Eigen::Matrix<double, 6, 6> of_base = base.twist_per_displacement(h_B);
  Matrix6Xd D;
  Eigen::Matrix<double, 6, 6> D_xi;
  for_each_goal(goals, demand, [&](const Goal& g, int row, int spin) {
    base.frame_twist_per_angle(g.frame, D);
    D = (R * D).eval();
    put_rows(g, row, spin, D, per_angle);
    const Vector3d p = base.frame_pose(g.frame).p;
    const Twistd V = base.frame_twist(g.frame);
    for (int k = 0; k < 6; ++k) {
      D_xi.col(k) = column(shift(twist_from(of_base.col(k)), p));
      if (k >= 3) continue;
      const Vector3d axis{k == 0 ? 1.0 : 0.0, k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
      D_xi.col(k) += column(Twistd{cross(axis, V.angular), cross(axis, V.linear)});
    }
    D_xi = (R * D_xi).eval();
    put_rows(g, row, spin, D_xi, per_displacement);
  });
  RateSensitivity result{-inverse * per_angle, -inverse * per_displacement};
  const Eigen::MatrixXd null = Eigen::MatrixXd::Identity(n, n) - inverse * demanded.G;
  constexpr double kNothing = 1e-9;
  if (null.lpNorm<Eigen::Infinity>() > kNothing) {
    const WeightedChange change = change_of_rows(base, X_WB, goals, demand, inverse.transpose() * demanded.rates);
    result.per_angle += null * change.per_angle;
    result.per_displacement.leftCols(3) += null * change.per_rotation;
  }
  if (demanded.unmet > kNothing) {
    const WeightedChange change = change_of_rows(base, X_WB, goals, demand, demanded.unmet_part);
    result.per_angle += inverse * (inverse.transpose() * change.per_angle);
    result.per_displacement.leftCols(3) += inverse * (inverse.transpose() * change.per_rotation);
  }
  return result;
}

namespace {

// -sum log sigma over goals of the generalized Jacobian's rows: velocity, and spin where the goal has an orientation.
double lost_manipulability(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position) {
  base.place(position);
  if (base.joints() == 0) return 0;
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
