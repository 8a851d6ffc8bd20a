#include "grapnel/simulate/thruster_allocation.hpp"

#include <cmath>
#include <stdexcept>

#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/spatial/pose.hpp"

namespace grapnel {

Vector3d thrust_direction(const Thruster& thruster) {
  const double angle = norm(thruster.misalignment);
  if (angle == 0) return thruster.direction;
  // Rodrigues' formula
  const Vector3d n = (1 / angle) * thruster.misalignment;
  const Vector3d& d = thruster.direction;
  return std::cos(angle) * d + std::sin(angle) * cross(n, d) + (1 - std::cos(angle)) * dot(n, d) * n;
}

// Thruster => propellant at full force F/(I_sp g_0) [kg/s] (18.2).
double mass_flow(const Thruster& thruster) { return thruster.force / (thruster.specific_impulse * kStandardGravity); }

namespace {

// Entries of the tableau below this are rounding errors; its rows and right-hand side are of size one.
constexpr double kZero = 1e-11;
// Maximum residual of the equations after phase one, relative to b.
constexpr double kInfeasible = 1e-9;

// Rows: equations, then the reduced costs. The last column is the right-hand side.
class Simplex {
 public:
  // A x = b => tableau of phase one with one artificial variable per row as the basis; rows are negated for b >= 0.
  Simplex(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) : n_(A.cols()) {
    T_ = Eigen::MatrixXd::Zero(A.rows() + 1, n_ + A.rows() + 1);
    for (Eigen::Index i = 0; i < A.rows(); ++i) {
      const double sign = b[i] < 0 ? -1 : 1;
      T_.row(i).head(n_) = sign * A.row(i);
      T_(i, n_ + i) = 1;
      T_(i, T_.cols() - 1) = sign * b[i];
      basis_.push_back(n_ + i);
    }
  }

  // Minimizes the sum of the equations' residuals.
  double find_feasible() {
    const Eigen::Index m = rows();
    for (Eigen::Index i = 0; i < m; ++i) T_.row(m) -= T_.row(i);
    T_.row(m).segment(n_, m).setZero();
    improve();
    return -T_(rows(), T_.cols() - 1);
  }

  void minimize(const Eigen::VectorXd& cost) {
    drop_artificial();
    const Eigen::Index m = rows();
    T_.row(m).setZero();
    T_.row(m).head(n_) = cost.transpose();
    for (Eigen::Index i = 0; i < m; ++i) T_.row(m) -= cost[basis_[static_cast<std::size_t>(i)]] * T_.row(i);
    improve();
  }

  const std::vector<Eigen::Index>& basis() const { return basis_; }

 private:
  Eigen::Index rows() const { return T_.rows() - 1; }

  // Row and column of the tableau => tableau with that column as the basis of the row, by Gauss-Jordan elimination.
  void pivot(Eigen::Index row, Eigen::Index column) {
    T_.row(row) /= T_(row, column);
    for (Eigen::Index i = 0; i < T_.rows(); ++i) {
      if (i == row) continue;
      const double factor = T_(i, column);
      if (factor != 0) T_.row(i) -= factor * T_.row(row);
      T_(i, column) = 0;
    }
    basis_[static_cast<std::size_t>(row)] = column;
  }

  // Bland's rule: the first improving column, and of the binding rows the one with the first variable.
  void improve() {
    const Eigen::Index m = rows(), last = T_.cols() - 1;
    for (;;) {
      Eigen::Index entering = 0;
      while (entering < n_ && !(T_(m, entering) < -kZero)) ++entering;
      if (entering == n_) return;
      Eigen::Index leaving = -1;
      double least = 0;
      for (Eigen::Index i = 0; i < m; ++i) {
        if (!(T_(i, entering) > kZero)) continue;
        const double ratio = std::max(T_(i, last), 0.0) / T_(i, entering);
        const bool tie = leaving >= 0 && std::abs(ratio - least) <= kZero;
        const bool sooner = tie ? basis_[static_cast<std::size_t>(i)] < basis_[static_cast<std::size_t>(leaving)]
                                : leaving < 0 || ratio < least;
        if (sooner) leaving = i, least = ratio;
      }
      if (leaving < 0) return;  // unbounded: impossible with nonnegative costs
      pivot(leaving, entering);
    }
  }

  // Removes artificial variables from the basis; if none can replace one, its row is redundant.
  void drop_artificial() {
    for (Eigen::Index i = 0; i < rows();) {
      if (basis_[static_cast<std::size_t>(i)] < n_) {
        ++i;
        continue;
      }
      Eigen::Index best = 0;
      T_.row(i).head(n_).cwiseAbs().maxCoeff(&best);
      if (std::abs(T_(i, best)) > kInfeasible) {
        pivot(i, best);
        ++i;
        continue;
      }
      const Eigen::Index below = T_.rows() - 1 - i;
      T_.middleRows(i, below) = T_.bottomRows(below).eval();
      T_.conservativeResize(T_.rows() - 1, T_.cols());
      basis_.erase(basis_.begin() + i);
    }
    T_.middleCols(n_, T_.cols() - 1 - n_).setZero();
  }

  Eigen::Index n_;
  Eigen::MatrixXd T_;
  std::vector<Eigen::Index> basis_;
};

}  // namespace

// A, b and costs c >= 0 => minimum-cost x >= 0 with A x = b, or empty if infeasible. Two-phase simplex method on scaled
// columns; the corner is then solved from its basis. Throws std::invalid_argument for wrong sizes.
std::optional<Eigen::VectorXd> min_cost(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, const Eigen::VectorXd& c) {
  if (A.rows() != b.size() || A.cols() != c.size() || (c.size() > 0 && c.minCoeff() < 0))
    throw std::invalid_argument("min_cost: sizes do not fit, or a cost is negative");
  Eigen::VectorXd x = Eigen::VectorXd::Zero(A.cols());
  if (b.size() == 0 || b.cwiseAbs().maxCoeff() == 0) return x;
  // Scales columns and right-hand side to size one, with the relative sizes of the rows unchanged.
  const double size = b.cwiseAbs().maxCoeff();
  Eigen::VectorXd scale = Eigen::VectorXd::Ones(A.cols());
  Eigen::MatrixXd S = A;
  for (Eigen::Index j = 0; j < A.cols(); ++j) {
    const double largest = A.col(j).cwiseAbs().maxCoeff();
    if (largest > 0) scale[j] = 1 / largest;
    S.col(j) *= scale[j];
  }
  Simplex simplex(S, b / size);
  if (!(simplex.find_feasible() <= kInfeasible)) return {};
  Eigen::VectorXd cost = c.cwiseProduct(scale);
  if (cost.maxCoeff() > 0) cost /= cost.maxCoeff();
  simplex.minimize(cost);
  // Solves for the corner itself, without the rounding errors of the pivots.
  const auto count = static_cast<Eigen::Index>(simplex.basis().size());
  Eigen::MatrixXd B(A.rows(), count);
  for (Eigen::Index k = 0; k < count; ++k) B.col(k) = S.col(simplex.basis()[static_cast<std::size_t>(k)]);
  const Eigen::VectorXd corner = pseudo_inverse(B, kInfeasible) * b;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::Index j = simplex.basis()[static_cast<std::size_t>(k)];
    const bool is_rounding = std::abs(corner[k]) <= kZero * size;
    x[j] = is_rounding ? 0 : std::max(corner[k], 0.0) * scale[j];
  }
  return x;
}

// Thrusters and reference point p => torque rows of (18.2), plus force rows if the array gives, without a net force,
// torques about all axes about which it can give one; costs are mass flows, or forces without a specific impulse.
ThrusterAllocation::ThrusterAllocation(std::span<const Thruster> thrusters, const Vector3d& about) {
  const auto n = static_cast<Eigen::Index>(thrusters.size());
  Eigen::MatrixXd A(6, n);
  cost_.resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Thruster& thruster = thrusters[static_cast<std::size_t>(i)];
    const Vector3d F = thruster.force * thruster.direction, M = cross(thruster.position - about, F);
    for (int k = 0; k < 3; ++k) A(k, i) = M[k], A(3 + k, i) = F[k];
    cost_[i] = thruster.specific_impulse > 0 ? mass_flow(thruster) : thruster.force;
  }
  A_ = A.topRows(3);
  // Without a net force, if this removes no direction of torque.
  bool pure = n > 0, any = false;
  for (int k = 0; k < 6 && pure; ++k) {
    Eigen::VectorXd b = Eigen::VectorXd::Zero(6);
    b[k / 2] = k % 2 == 0 ? 1 : -1;
    const bool turns = min_cost(A_, b.head(3), cost_).has_value();
    any = any || turns;
    pure = !turns || min_cost(A, b, cost_).has_value();
  }
  if (pure && any) A_ = A;
}

std::optional<std::vector<double>> ThrusterAllocation::on_times(const Vector3d& torque) const {
  Eigen::VectorXd b = Eigen::VectorXd::Zero(A_.rows());
  for (int k = 0; k < 3; ++k) b[k] = torque[k];
  const std::optional<Eigen::VectorXd> x = min_cost(A_, b, cost_);
  if (!x) return {};
  return std::vector<double>(x->data(), x->data() + x->size());
}

Vector3d ThrusterAllocation::torque(std::size_t thruster) const {
  const auto i = static_cast<Eigen::Index>(thruster);
  return {A_(0, i), A_(1, i), A_(2, i)};
}

}  // namespace grapnel
