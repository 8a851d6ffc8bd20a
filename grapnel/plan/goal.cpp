#include "grapnel/plan/goal.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

using Matrix36d = Eigen::Matrix<double, 3, 6>;

// Two unit vectors perpendicular to d.
Eigen::Matrix<double, 2, 3> across(const Vector3d& d) {
  const Rotationd R = rotation_between({0, 0, 1}, d);
  Eigen::Matrix<double, 2, 3> B;
  B.row(0) = column(R.column(0)).transpose();
  B.row(1) = column(R.column(1)).transpose();
  return B;
}

// Jacobians of the frame's origin in W: with respect to joints at a fixed base, and to a base displacement in B.
void frame_jacobians(const FloatingBase& base, const Posed& X_WB, int frame, Matrix6Xd& J_joint,
                     Eigen::Matrix<double, 6, 6>& J_base) {
  base.frame_jacobian(frame, J_joint);
  const Eigen::Matrix3d R = as_matrix(X_WB.R);
  if (J_joint.cols() > 0) {  // Eigen offsets a null pointer to take rows of a matrix without columns
    J_joint.topRows(3) = (R * J_joint.topRows(3)).eval();
    J_joint.bottomRows(3) = (R * J_joint.bottomRows(3)).eval();
  }
  const Vector3d p = base.frame_pose(frame).p;
  for (int k = 0; k < 6; ++k) J_base.col(k) = column(X_WB.R * shift(twist_from(Vector6d::Unit(k)), p));
}

// Orientation error of a goal, as a rotation in W.
Vector3d orientation_error(const Goal& g, const Rotationd& R_WE) {
  if (g.orientation == Goal::Orientation::axis)
    return rotation_vector(rotation_between(g.direction_W, R_WE * g.axis_E));
  if (g.orientation == Goal::Orientation::pose) return rotation_vector(R_WE * transpose(g.X_WG.R));
  return Vector3d::zero();
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

// Base pose and placed joints => stacked errors of all goals.
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error) {
  error.resize(error_rows(goals));
  int row = 0;
  for (const Goal& g : goals) {
    const Posed X_WE = X_WB * base.frame_pose(g.frame);
    error.segment<3>(row) = column(X_WE.p - g.X_WG.p);
    if (g.orientation == Goal::Orientation::axis) {
      error.segment<2>(row + 3) = across(g.direction_W) * column(orientation_error(g, X_WE.R));
    } else if (g.orientation == Goal::Orientation::pose) {
      error.segment<3>(row + 3) = column(orientation_error(g, X_WE.R));
    }
    row += rows_of(g);
  }
}

// Base pose and placed joints => errors and their Jacobians with respect to joints and a base displacement.
void goal_error(const FloatingBase& base, const Posed& X_WB, std::span<const Goal> goals, Eigen::VectorXd& error,
                Eigen::MatrixXd& J_joint, Eigen::MatrixXd& J_base) {
  goal_error(base, X_WB, goals, error);
  const Eigen::Index rows = error.size();
  J_joint.resize(rows, base.joints()), J_base.resize(rows, 6);
  Matrix6Xd J;
  Eigen::Matrix<double, 6, 6> Jb;
  int row = 0;
  const bool joints = base.joints() > 0;
  for (const Goal& g : goals) {
    frame_jacobians(base, X_WB, g.frame, J, Jb);
    if (joints) J_joint.middleRows(row, 3) = J.bottomRows(3);
    J_base.middleRows(row, 3) = Jb.bottomRows(3);
    row += 3;
    if (g.orientation == Goal::Orientation::axis) {
      const Eigen::Matrix<double, 2, 3> B = across(g.direction_W);
      if (joints) J_joint.middleRows(row, 2) = B * J.topRows(3);
      J_base.middleRows(row, 2) = B * Jb.topRows(3);
      row += 2;
    } else if (g.orientation == Goal::Orientation::pose) {
      if (joints) J_joint.middleRows(row, 3) = J.topRows(3);
      J_base.middleRows(row, 3) = Jb.topRows(3);
      row += 3;
    }
  }
}

Eigen::Vector3d across_in_world(const Goal& goal, const Eigen::Vector2d& error) {
  return across(goal.direction_W).transpose() * error;
}

namespace {

// Number of constrained angular components of a demand (the velocity is always constrained): none, the component along
// the goal's direction, the two perpendicular to it, or all.
int spin_rows(const Goal& g, RateDemand demand) {
  if (demand == RateDemand::linear) return 0;
  if (demand != RateDemand::task) return 3;
  return std::min(3, rows_of(g) - 3 + (g.roll ? 1 : 0));
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

// Writes the goal's rows, from `row` on, of twists in W, one per column. Without joints there are no columns.
template <class Twists, class Matrix>
void put_rows(const Goal& g, int row, int spin, const Twists& V, Matrix& all) {
  if (V.cols() == 0) return;
  auto rows = all.middleRows(row, 3 + spin);
  rows.topRows(3) = V.bottomRows(3);
  if (spin == 3) rows.bottomRows(3) = V.topRows(3);
  if (spin == 2) rows.bottomRows(2) = across(g.direction_W) * V.topRows(3);
  if (spin == 1) rows.bottomRows(1) = column(g.direction_W).transpose() * V.topRows(3);
}

// Wrench [angular; linear] in W whose product with every twist equals the product of the weights with the twist's rows.
Vector6d weights_as_wrench(const Goal& g, int spin, const Eigen::VectorXd& weights) {
  Vector6d F = Vector6d::Zero();
  F.tail<3>() = weights.head<3>();
  if (spin == 3) F.head<3>() = weights.tail<3>();
  if (spin == 2) F.head<3>() = across(g.direction_W).transpose() * weights.tail<2>();
  if (spin == 1) F.head<3>() = weights[3] * column(g.direction_W);
  return F;
}

// The constrained components of an angular velocity.
Vector3d constrained_spin(const Goal& g, int spin, const Vector3d& w) {
  const Vector3d along = dot(w, g.direction_W) * g.direction_W;
  return spin == 0 ? Vector3d::zero() : spin == 1 ? along : spin == 2 ? w - along : w;
}

// Block-diagonal matrix [R 0; 0 R].
Eigen::Matrix<double, 6, 6> both(const Eigen::Matrix3d& R) {
  Eigen::Matrix<double, 6, 6> X = Eigen::Matrix<double, 6, 6>::Zero();
  X.topLeftCorner<3, 3>() = X.bottomRightCorner<3, 3>() = R;
  return X;
}

}  // namespace

// Base pose and momentum => rows G and b of the demand, with G from the generalized Jacobian (2.5) and b without the
// momentum part (2.3).
void demand_rows(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B, std::span<const Goal> goals,
                 RateDemand demand, Eigen::MatrixXd& G, Eigen::VectorXd& b, const Vector3d& w_B) {
  const int rows = demanded_rows(goals, demand);
  G.resize(rows, base.joints()), b.resize(rows);
  const Twistd V_h = twist_from(base.momentum_part(h_B)) + Twistd{w_B, -cross(w_B, base.com())};
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

GoalGap goal_gap(const Goal& goal, const Posed& X_WE, const Twistd& V_WE) {
  const Twistd V = V_WE - goal.V_WG;
  return {X_WE.p - goal.X_WG.p, orientation_error(goal, X_WE.R), V.linear,
          constrained_spin(goal, spin_rows(goal, RateDemand::task), V.angular)};
}

// Base pose and momentum => minimum-norm rates G^+ b and the unmet part, refined once.
DemandedRates demanded_rates(const FloatingBase& base, const Posed& X_WB, const Momentumd& h_B,
                             std::span<const Goal> goals, RateDemand demand, const Vector3d& w_B) {
  Eigen::VectorXd b;
  DemandedRates result;
  demand_rows(base, X_WB, h_B, goals, demand, result.G, b, w_B);
  result.G_inverse = pseudo_inverse(result.G, 1e-10);
  result.rates = result.G_inverse * b;
  result.unmet_part = b - result.G * result.rates;
  // One refinement step: the pseudo-inverse is accurate to the rounding error of its entries, its product with the
  // remainder to that of the rates.
  const Eigen::VectorXd rest = result.G_inverse * result.unmet_part;
  result.rates += rest;
  result.unmet_part -= result.G * rest;
  result.unmet = b.size() ? result.unmet_part.lpNorm<Eigen::Infinity>() : 0;
  return result;
}

void add_self_motion(const Eigen::VectorXd& z, DemandedRates& demanded) {
  demanded.added = z;
  demanded.rates += z - demanded.G_inverse * (demanded.G * z);
}

namespace {

// dG^T weights: per joint rate (rows) and joint value or component of a small base rotation in B (columns).
struct WeightedChange {
  Eigen::MatrixXd per_angle, per_rotation;
};

// Weights on the rows => derivatives of the weighted rows G with respect to joint values and base rotation.
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
    if (base.is_held(j)) continue;  // its column remains zero
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

// Demanded rates => their derivatives with respect to joint values and a base displacement, by (1) of goal.hpp.
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
    const Eigen::VectorXd solved = demanded.added.size() ? demanded.rates - demanded.added : demanded.rates;
    const WeightedChange change = change_of_rows(base, X_WB, goals, demand, inverse.transpose() * solved);
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
    // Directions that a planar arm never has are excluded.
    for (double s : sigma) {
      if (s > 1e-9 * sigma[0]) sum -= std::log(s);
    }
  }
  return sum;
}

// Half the sum of squared distances of the joints from reference values.
double half_squares(std::span<const double> position, const std::vector<double>& place, double weight,
                    Objective::Gradient* gradient) {
  double sum = 0;
  for (std::size_t j = 0; j < position.size(); ++j) {
    const double d = position[j] - place[j];
    sum += 0.5 * d * d;
    if (gradient) gradient->position[j] += weight * d;
  }
  return sum;
}

// Integrals over a segment of products of the x-derivatives of s, e, b and N_k, relative to that of s'^2.
Eigen::MatrixXd excursion_products(const SegmentStart& start) {
  const JointSpline spline(start.knots);
  // Simpson's rule on polynomials of order 8, span by span, or on a cycloid: accuracy 1e-9.
  const int intervals = start.knots == 0 ? 200 : 40 * (start.knots + 1);
  Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(3 + start.knots, 3 + start.knots);
  std::vector<JointPoint> N(static_cast<std::size_t>(start.knots));
  Eigen::VectorXd slopes(3 + start.knots);
  for (int i = 0; i <= intervals; ++i) {
    const double x = static_cast<double>(i) / intervals;
    slopes[0] = evaluate(JointPath{start.profile, 1, 0, 1, 0, 0}, x).rate;
    slopes[1] = evaluate(JointPath{start.profile, 1, 0, 0, 0, 1}, x).rate;
    slopes[2] = evaluate(JointPath{start.profile, 1, 0, 0, 1, 0}, x).rate;
    spline.evaluate(x, N);
    for (int k = 0; k < start.knots; ++k) slopes[3 + k] = N[static_cast<std::size_t>(k)].rate;
    const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
    sum += weight * slopes * slopes.transpose();
  }
  return sum / sum(0, 0);
}

}  // namespace

Objective::Objective(std::vector<Term> terms, const SegmentStart& start, std::vector<double> guess,
                     std::vector<double> lower, std::vector<double> upper)
    : terms_(std::move(terms)),
      start_(start),
      guess_(std::move(guess)),
      lower_(std::move(lower)),
      upper_(std::move(upper)) {
  std::erase_if(terms_, [](const Term& t) { return t.kind == Kind::as_found || t.weight == 0; });
  const auto is_excursion = [](const Term& t) { return t.kind == Kind::excursion; };
  if (std::any_of(terms_.begin(), terms_.end(), is_excursion)) excursion_ = excursion_products(start);
}

bool Objective::depends_on_end_alone(Kind kind) {
  return kind == Kind::excursion || kind == Kind::nearest || kind == Kind::limits || kind == Kind::manipulability;
}

bool Objective::depends_on_end_alone() const {
  return std::all_of(terms_.begin(), terms_.end(), [](const Term& t) { return depends_on_end_alone(t.kind); });
}

Objective Objective::with_knots(int knots) const {
  SegmentStart start = start_;
  start.knots = knots;
  return {terms_, start, guess_, lower_, upper_};
}

// Final values, rates and spline => excursion (6.8a) of all joints, a quadratic form per joint; adds `weight` times its
// gradient.
double Objective::excursion(std::span<const double> position, std::span<const double> rate,
                            std::span<const double> coefficients, double weight, Gradient* gradient) const {
  const double T = start_.end - start_.begin;
  const std::size_t n = position.size();
  Eigen::VectorXd v = Eigen::VectorXd::Zero(excursion_.rows());
  double sum = 0;
  for (std::size_t j = 0; j < n; ++j) {
    v[0] = position[j] - start_.position[j];
    v[1] = rate.empty() ? 0.0 : T * rate[j];
    v[2] = T * start_.rate[j];
    for (std::size_t i = j, k = 3; i < coefficients.size(); i += n) v[static_cast<Eigen::Index>(k++)] = coefficients[i];
    const Eigen::VectorXd slope = excursion_ * v;
    sum += 0.5 * v.dot(slope);
    if (!gradient) continue;
    gradient->position[j] += weight * slope[0];
    gradient->rate[j] += weight * T * slope[1];
    for (std::size_t i = j, k = 3; i < coefficients.size(); i += n) {
      gradient->coefficients[i] += weight * slope[static_cast<Eigen::Index>(k++)];
    }
  }
  return sum;
}

// K => positive definite approximation of the objective's Hessian, from the quadratic terms and a small regularization.
Eigen::MatrixXd Objective::curvature(const Eigen::MatrixXd& K) const {
  constexpr double kLittle = 1e-6;
  const Eigen::Index n = K.rows(), knots = K.cols() / std::max<Eigen::Index>(n, 1) - 1;
  Eigen::MatrixXd B = kLittle * Eigen::MatrixXd::Identity(K.cols(), K.cols());
  for (const Term& term : terms_) {
    if (term.kind == Kind::nearest || term.kind == Kind::manipulability) {
      B.diagonal().head(n).array() += term.weight;
    } else if (term.kind == Kind::limits) {
      for (Eigen::Index j = 0; j < n; ++j) {
        const double range = upper_[static_cast<std::size_t>(j)] - lower_[static_cast<std::size_t>(j)];
        if (std::isfinite(range) && range > 0) B(j, j) += term.weight / (range * range);
      }
    } else if (term.kind == Kind::excursion) {
      // Gradient of v = S y as in excursion(), joint by joint.
      const double T = start_.end - start_.begin;
      Eigen::MatrixXd S = Eigen::MatrixXd::Zero(3 + knots, K.cols());
      for (Eigen::Index j = 0; j < n; ++j) {
        S.setZero();
        S(0, j) = 1;
        S.row(1) = T * K.row(j);
        for (Eigen::Index k = 0; k < knots; ++k) S(3 + k, (1 + k) * n + j) = 1;
        B += term.weight * S.transpose() * (excursion_ * S);
      }
    }
  }
  return B;
}

// Term and final values => its unweighted value: excursion, distance from the guess or from mid-range, or lost
// manipulability (gradient by central differences); 0 for terms along the path. Adds the weighted gradient.
double Objective::term(const Term& term, FloatingBase& base, std::span<const Goal> goals,
                       std::span<const double> position, std::span<const double> rate, Gradient* gradient,
                       std::span<const double> coefficients) const {
  const std::size_t n = position.size();
  if (term.kind == Kind::excursion) return excursion(position, rate, coefficients, term.weight, gradient);
  if (term.kind == Kind::nearest) return half_squares(position, guess_, term.weight, gradient);
  if (term.kind == Kind::limits) {
    double sum = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const double range = upper_[j] - lower_[j];
      if (!std::isfinite(range) || range <= 0) continue;
      const double d = (position[j] - 0.5 * (lower_[j] + upper_[j])) / range;
      sum += 0.5 * d * d;
      if (gradient) gradient->position[j] += term.weight * d / range;
    }
    return sum;
  }
  if (term.kind != Kind::manipulability) return 0;
  if (gradient) {
    constexpr double kDifference = 1e-6;
    std::vector<double> x(position.begin(), position.end());
    for (std::size_t j = 0; j < n; ++j) {
      x[j] = position[j] + kDifference;
      const double above = lost_manipulability(base, goals, x);
      x[j] = position[j] - kDifference;
      gradient->position[j] += term.weight * (above - lost_manipulability(base, goals, x)) / (2 * kDifference);
      x[j] = position[j];
    }
  }
  return lost_manipulability(base, goals, position);
}

double Objective::value(FloatingBase& base, std::span<const Goal> goals, std::span<const double> position,
                        std::span<const double> rate, Gradient* gradient, std::span<const double> coefficients) const {
  const std::size_t n = position.size();
  if (gradient) {
    gradient->position.assign(n, 0.0), gradient->rate.assign(n, 0.0);
    gradient->coefficients.assign(coefficients.size(), 0.0);
  }
  double sum = 0;
  for (const Term& t : terms_) sum += t.weight * term(t, base, goals, position, rate, gradient, coefficients);
  return sum;
}

}  // namespace grapnel
