#include "grapnel/identify/identify_target.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "grapnel/identify/momentum_rows.hpp"
#include "grapnel/identify/rate_noise.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

constexpr int kN = kInertialParameters;
// Minimum relative error of momenta, due to integration and rounding.
constexpr double kMomentumError = 1e-9;
// Singular values below this part of the largest are rounding errors.
constexpr double kRankTolerance = 1e-8;
// A direction is significant if its squared singular value exceeds this multiple of the contribution of rate noise.
constexpr double kAboveNoise = 4;
constexpr int kMaxIterations = 50;
// Convergence: change in standard deviations.
constexpr double kSettled = 1e-3;
// A parameter is determined if null-space directions change it by at most this part of the servicer's own value, or by
// this multiple of its standard deviation.
constexpr double kUnseen = 1e-6, kUnseenDeviations = 10;
constexpr int kSamplesAtOnce = 64;  // per step of the orthogonal reduction

using Matrix10 = Eigen::Matrix<double, kN, kN>;

// The reduced least-squares problem for one set of weights: R (x / scale) = b, with residual |rest|. noise_gram:
// expected contribution of rate noise to R^T R.
struct Reduced {
  Eigen::MatrixXd R;
  Eigen::VectorXd b, nuisance;
  Eigen::MatrixXd coupling, factor;  // of the nuisance parameters: coupling to x, and own factor
  double rest = 0;
  Matrix10 noise_gram = Matrix10::Zero();
};

class Identification {
 public:
  explicit Identification(const IdentificationTask& task)
      : known_(known_bodies(task)), unknown_momentum_(!task.momentum) {
    for (const MotionSample& sample : task.samples) rows_.push_back(momentum_rows(task, known_, sample));
    const int root = task.model.bodies()[task.model.frames()[task.frame].body].root;
    const std::vector<double> deviations = rate_deviations(task.model, root, task.noise);
    variance_ = as_vector(deviations).array().square();
    has_noise_ = variance_.maxCoeff() > 0;
    find_scales();
    momentum_ = Eigen::VectorXd::Zero(known_.rows);
    if (!task.momentum) return;
    const Momentumd h = known_.rows == 6 ? shift(*task.momentum, known_.p_WO) : *task.momentum;
    for (int i = 0; i < known_.rows; ++i) momentum_[i] = i < 3 ? h.angular[i] : h.linear[i - 3];
  }

  IdentifiedBody solve() {
    IdentifiedBody found;
    for (; !found.converged && found.iterations < kMaxIterations; ++found.iterations) {
      const Reduced problem = reduce(found.iterations > 0);
      const LinearParameters before = x_;
      const Eigen::VectorXd momentum_before = momentum_;
      step(problem);
      const Eigen::VectorXd change = ((x_ - before).array() / scale_.array()).matrix();
      found.converged = found.iterations > 0 && (problem.R * change).norm() <= kSettled;
      found.residual = rms(problem.rest);
    }
    describe(found);
    return found;
  }

 private:
  void find_scales() {
    const double m = known_.mass, l = known_.radius;
    scale_ << m, m * l, m * l, m * l, Eigen::Matrix<double, 6, 1>::Constant(m * l * l);
    double speed = 0;
    for (const MomentumRows& rows : rows_) {
      const Eigen::VectorXd V = rows.J * rows.velocity;
      speed = std::max(speed, l * V.head<3>().norm() + V.tail<3>().norm());
    }
    if (!(speed > 0)) speed = 1;  // at rest: arbitrary
    row_scale_ = Eigen::VectorXd::Constant(known_.rows, m * speed);
    row_scale_.head<3>() *= l;
  }

  // Weighted equations of all samples, reduced by Householder reflections, several samples at a time. Smoothed: the
  // regressor at the most likely rates for the present parameters, (16.8); otherwise at the measured rates.
  Reduced reduce(bool smoothed) const {
    const int m = known_.rows, extra = unknown_momentum_ ? m : 0, columns = extra + kN + 1;
    Reduced reduced;
    Eigen::MatrixXd stack = Eigen::MatrixXd::Zero(columns + kSamplesAtOnce * m, columns);
    int at = columns;
    const auto fold = [&] {
      const Eigen::MatrixXd R = thin_qr(stack).R;
      stack.setZero();
      stack.topRows(columns) = R;
      at = columns;
    };
    for (const MomentumRows& rows : rows_) {
      const Eigen::MatrixXd A = momentum_matrix(rows, x_);
      Eigen::MatrixXd S = A * variance_.asDiagonal() * A.transpose();  // (16.7)
      S.diagonal() += (kMomentumError * row_scale_).array().square().matrix();
      const Cholesky L(S);
      const Eigen::VectorXd r = momentum_ + rows.impulse - A * rows.velocity;
      Eigen::VectorXd velocity = rows.velocity;
      if (smoothed) velocity += variance_.asDiagonal() * (A.transpose() * cholesky_solution(L, r));  // (16.8)
      const Eigen::MatrixXd Y = regressor(rows, rows.J * velocity);
      Eigen::MatrixXd block(m, columns);
      if (extra) block.leftCols(extra) = -Eigen::MatrixXd(row_scale_.asDiagonal());
      block.middleCols(extra, kN) = Y * scale_.asDiagonal();
      block.col(columns - 1) = r + Y * x_ - (extra ? momentum_ : Eigen::VectorXd::Zero(m).eval());
      stack.middleRows(at, m) = lower_solution(L, block);
      at += m;
      add_noise(rows, L, reduced.noise_gram);
      if (at == stack.rows()) fold();
    }
    fold();
    reduced.R = stack.block(extra, extra, kN, kN).triangularView<Eigen::Upper>();
    reduced.b = stack.block(extra, columns - 1, kN, 1);
    reduced.rest = stack(columns - 1, columns - 1);
    reduced.nuisance = stack.block(0, columns - 1, extra, 1);
    reduced.coupling = stack.block(0, extra, extra, kN);
    reduced.factor = stack.block(0, 0, extra, extra).triangularView<Eigen::Upper>();
    return reduced;
  }

  void add_noise(const MomentumRows& rows, const Cholesky& L, Matrix10& gram) const {
    for (int j = 0; has_noise_ && j < variance_.size(); ++j) {
      if (variance_[j] == 0) continue;
      const Eigen::MatrixXd Y =
          lower_solution(L, Eigen::MatrixXd(regressor(rows, rows.J.col(j)) * scale_.asDiagonal()));
      gram += variance_[j] * (Y.transpose() * Y);
    }
  }

  // Minimum-norm best fit, in units of the scales: null-space components are zero here and not reported.
  void step(const Reduced& problem) {
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(problem.R, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::VectorXd s = svd.singularValues();
    const Eigen::MatrixXd V = svd.matrixV();
    seen_.resize(kN, 0), unseen_.resize(kN, 0), singular_.clear();
    Eigen::VectorXd y = Eigen::VectorXd::Zero(kN);
    for (int i = 0; i < kN; ++i) {
      const double noise = V.col(i).dot(problem.noise_gram * V.col(i));
      const bool counts = s[i] > kRankTolerance * s[0] && s[i] * s[i] > kAboveNoise * noise;
      Eigen::MatrixXd& list = counts ? seen_ : unseen_;
      list.conservativeResize(kN, list.cols() + 1);
      list.col(list.cols() - 1) = V.col(i);
      if (!counts) continue;
      singular_.push_back(s[i]);
      y += V.col(i) * (svd.matrixU().col(i).dot(problem.b) / s[i]);
    }
    x_ = scale_.asDiagonal() * y;
    if (!unknown_momentum_) return;
    const Eigen::VectorXd h = lu_solution(problem.factor, Eigen::VectorXd(problem.nuisance - problem.coupling * y));
    momentum_ = row_scale_.asDiagonal() * h;
  }

  double rms(double rest) const {
    const int rows = known_.rows * static_cast<int>(rows_.size());
    const int free = rows - static_cast<int>(singular_.size()) - (unknown_momentum_ ? known_.rows : 0);
    return free > 0 ? std::abs(rest) / std::sqrt(free) : 0;
  }

  // From the reduced parameters of (16.5) to those of the body, (16.6), with derivatives.
  LinearParameters whole_body(Matrix10& K) const {
    K.setIdentity();
    if (known_.rows == 6) return x_;
    const double mu = x_[0], rest = known_.mass - mu, f = known_.mass / rest;
    const Eigen::Vector3d h = x_.segment<3>(1);
    const Symmetric3d Q = point_mass_inertia(1.0, Vector3d{h[0], h[1], h[2]});
    LinearParameters z = x_;
    z[0] = f * mu;
    z.segment<3>(1) = f * h;
    const double q[6] = {Q.xx, Q.yy, Q.zz, Q.xy, Q.xz, Q.yz};
    K(0, 0) = f * f;
    K.block<3, 1>(1, 0) = h * (f / rest);
    K.block<3, 3>(1, 1) *= f;
    for (int i = 0; i < 6; ++i) {
      z[4 + i] += q[i] / rest;
      K(4 + i, 0) = q[i] / (rest * rest);
    }
    K.block<6, 3>(4, 1) = moment_derivative(h) / rest;
    return z;
  }

  // d (|h|^2 1 - h h^T) / dh, rows as in Symmetric3.
  static Eigen::Matrix<double, 6, 3> moment_derivative(const Eigen::Vector3d& h) {
    Eigen::Matrix<double, 6, 3> D;
    D << 0, 2 * h[1], 2 * h[2], 2 * h[0], 0, 2 * h[2], 2 * h[0], 2 * h[1], 0, -h[1], -h[0], 0, -h[2], 0, -h[0], 0,
        -h[2], -h[1];
    return D;
  }

  // From mass, first moment and inertia about the origin to mass, centre of mass and inertia about it, with
  // derivatives.
  static LinearParameters about_com(const LinearParameters& z, Matrix10& J) {
    const double m = z[0];
    const Eigen::Vector3d c = z.segment<3>(1) / m;
    const Symmetric3d P = point_mass_inertia(1.0, Vector3d{c[0], c[1], c[2]});
    const double p[6] = {P.xx, P.yy, P.zz, P.xy, P.xz, P.yz};
    LinearParameters y = z;
    y.segment<3>(1) = c;
    J.setIdentity();
    J.block<3, 3>(1, 1) /= m;
    J.block<3, 1>(1, 0) = -c / m;
    for (int i = 0; i < 6; ++i) {
      y[4 + i] -= m * p[i];
      J(4 + i, 0) = p[i];
    }
    J.block<6, 3>(4, 1) = -moment_derivative(c);
    return y;
  }

  void describe(IdentifiedBody& found) const {
    found.rank = static_cast<int>(singular_.size());
    found.condition = singular_.empty() ? 0 : singular_.front() / singular_.back();
    Matrix10 K, J;
    const LinearParameters z = whole_body(K);
    const Eigen::MatrixXd free = K * scale_.asDiagonal() * unseen_;  // in mass, first moment, inertia about the origin
    if (found.rank < kN) found.unseen = unseen_changes(free);
    if (!(std::abs(z[0]) > 0)) return;
    const LinearParameters y = about_com(z, J);
    const Eigen::MatrixXd effect = J * free;
    Eigen::MatrixXd spread = J * K * scale_.asDiagonal() * seen_;
    for (int i = 0; i < spread.cols(); ++i) spread.col(i) /= singular_[i];
    LinearParameters size = scale_;
    size.segment<3>(1).setConstant(known_.radius);
    bool known[kN];
    for (int i = 0; i < kN; ++i) {
      const double deviation = spread.row(i).norm();
      known[i] = found.rank == kN || effect.row(i).norm() <= kUnseen * size[i] + kUnseenDeviations * deviation;
      if (!known[i]) continue;
      found.value[i] = y[i];
      // Null-space components may be as large as the servicer's own values.
      if (has_noise_) found.deviation[i] = std::hypot(deviation, found.rank == kN ? 0.0 : effect.row(i).norm());
    }
    const auto group = [&](int first, int count, bool alone) {
      if (std::all_of(known + first, known + first + count, [](bool k) { return k; })) return Identified::determined;
      Eigen::MatrixXd part = effect.middleRows(first, count);
      for (int i = 0; i < count; ++i) part.row(i) /= size[first + i];
      return alone && rank_of_part(part) == 1 ? Identified::ratio_only : Identified::not_determined;
    };
    found.mass = group(0, 1, unseen_.cols() == 1 || rank_of_part(scaled(free).topRows(4)) == 1);
    found.com = group(1, 3, true);
    found.inertia = group(4, 6, true);
    if (found.rank == kN) found.impossible = fault(y);
  }

  Eigen::MatrixXd scaled(const Eigen::MatrixXd& free) const { return scale_.cwiseInverse().asDiagonal() * free; }

  static int rank_of_part(const Eigen::MatrixXd& part) {
    if (part.cols() == 0) return 0;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(part);
    const Eigen::VectorXd s = svd.singularValues();
    return static_cast<int>((s.array() > std::max(kUnseen, 1e-6 * s[0])).count());
  }

  static std::string fault(const LinearParameters& y) {
    if (!(y[0] > 0)) return fmt::format("a mass of {:.6g} kg is not positive", y[0]);
    return inertia_fault({y[4], y[5], y[6], y[7], y[8], y[9]});
  }

  // A basis of the null space in which each vector changes one parameter by one unit, by Gaussian elimination with full
  // pivoting, in the order of the parameters.
  std::vector<UnseenChange> unseen_changes(const Eigen::MatrixXd& free) const {
    Eigen::MatrixXd F = scaled(free);
    std::vector<int> pivots;
    for (int c = 0; c < F.cols(); ++c) {
      int row = 0, column = c;
      F.rightCols(F.cols() - c).cwiseAbs().maxCoeff(&row, &column);
      F.col(c).swap(F.col(column + c));
      F.col(c) /= F(row, c);
      for (int o = 0; o < F.cols(); ++o)
        if (o != c) F.col(o) -= F.col(c) * F(row, o);
      pivots.push_back(row);
    }
    std::vector<UnseenChange> changes;
    for (int c = 0; c < F.cols(); ++c) {
      UnseenChange& one = changes.emplace_back();
      one.parameter = pivots[c];
      for (int i = 0; i < kN; ++i)
        one.change[i] = std::abs(F(i, c)) <= kUnseen ? 0 : F(i, c) * scale_[i] / scale_[pivots[c]];
    }
    std::sort(changes.begin(), changes.end(), [](auto& a, auto& b) { return a.parameter < b.parameter; });
    return changes;
  }

  const KnownBodies known_;
  const bool unknown_momentum_;
  std::vector<MomentumRows> rows_;
  Eigen::VectorXd variance_, row_scale_;
  bool has_noise_ = false;
  LinearParameters scale_, x_ = LinearParameters::Zero();
  Eigen::VectorXd momentum_;                     // total momentum at the first sample
  Eigen::MatrixXd seen_{kN, 0}, unseen_{kN, 0};  // directions, in units of the scales
  std::vector<double> singular_;                 // of the seen ones, decreasing
};

void check(const IdentificationTask& task) {
  const auto refuse = [](const char* why) { throw std::invalid_argument(fmt::format("identify_target: {}", why)); };
  if (task.samples.empty()) refuse("there are no samples");
  const int held = task.model.frames().at(task.frame).body;
  if (task.model.bodies()[held].parent < 0) refuse("the body is not held: it is the root of its tree");
  if (!task.model.has_free_root(held)) refuse("the robot is fixed to the world, which absorbs any momentum");
  for (double deviation : {task.noise.angular_velocity, task.noise.velocity, task.noise.joint_rate})
    if (!(deviation >= 0) || !std::isfinite(deviation)) refuse("noise must be finite and not negative");
  const auto finite = [](const std::vector<double>& values) {
    return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
  };
  for (const MotionSample& sample : task.samples)
    if (!finite(sample.state.q) || !finite(sample.state.v) ||
        !std::isfinite(norm(sample.impulse.angular) + norm(sample.impulse.linear)))
      refuse("a sample has a number that is not finite (set values that are not measured to zero)");
  for (const MotionSample& sample : task.samples)
    if (task.base == MeasuredBase::rotation && norm(sample.impulse.linear) > 0)
      refuse("a force acts: the base's velocity must be measured");
}

}  // namespace

IdentifiedBody identify_target(const IdentificationTask& task) {
  check(task);
  return Identification(task).solve();
}

std::string_view inertial_parameter_name(int parameter) {
  static constexpr std::string_view names[] = {"mass",       "com_x",      "com_y",      "com_z",      "inertia_xx",
                                               "inertia_yy", "inertia_zz", "inertia_xy", "inertia_xz", "inertia_yz"};
  return names[parameter];
}

std::string unseen_text(const UnseenChange& unseen) {
  const auto term = [&](int i) {
    static constexpr std::string_view axes[] = {"x", "y", "z"};
    const bool moment = i >= 1 && i <= 3;
    const std::string name =
        moment ? fmt::format("first_moment_{}", axes[i - 1]) : std::string(inertial_parameter_name(i));
    const char* unit = i == 0 ? "kg" : moment ? "kg m" : "kg m^2";
    return fmt::format("{} {} {:.4g} {}", name, unseen.change[i] < 0 ? "-" : "+", std::abs(unseen.change[i]), unit);
  };
  std::string text = term(unseen.parameter), others;
  for (int i = 0; i < kInertialParameters; ++i)
    if (i != unseen.parameter && unseen.change[i] != 0) others += (others.empty() ? "" : ", ") + term(i);
  return others.empty() ? text : text + " with " + others;
}

}  // namespace grapnel
