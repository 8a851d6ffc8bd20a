#include "grapnel/impact/yielding_drives.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/dense/decompositions.hpp"

namespace grapnel {
namespace {

// Of the size of its terms, what of a self-stress reaches a drive: less than this is rounding, and the self-stress one
// of the grips alone.
constexpr double kGripsAlone = 1e-8;
// Of the size of its terms: what a self-stress does on the rates told is zero.
constexpr double kWorkRounding = 1e-13;
// Of the largest rate, in the metric J_r: a drive that misses what it was told by less has not given way.
constexpr double kNoticed = 1e-9;
// Pivots of self-stresses of unit size that are one another's sum.
constexpr double kDependent = 1e-14;

}  // namespace

double drive_inertia(const Model& model, int velocity) {
  for (int body : model.joints()) {
    if (model.bodies()[body].v != velocity) continue;
    const double inertia = model.bodies()[body].description.joint.reflected_inertia();
    return inertia > 0 ? inertia : 1;
  }
  return 1;  // of a root or a spherical joint
}

std::optional<Eigen::VectorXd> rates_that_grips_allow(const BilateralRows& rows, const Eigen::VectorXd& after,
                                                      const Eigen::MatrixXd& null_space) {
  const Eigen::Index held = rows.held_inertia.size();
  if (held == 0 || null_space.cols() == 0) return {};
  // Self-stresses that reach the drives: S_h = -J_h^T S_g over the size that its terms can have.
  const Eigen::Index grips = rows.J.rows() - held;
  const Eigen::MatrixXd J_h = rows.J.topRows(grips)(Eigen::all, rows.held);
  const Eigen::VectorXd size = (J_h.cwiseAbs().transpose() * rows.D.diagonal().head(grips).cwiseSqrt().cwiseInverse());
  Eigen::MatrixXd reach = null_space.bottomRows(held);
  for (Eigen::Index i = 0; i < held; ++i) reach.row(i) *= size[i] > 0 ? 1 / size[i] : 0;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(reach, Eigen::ComputeFullV);
  const Eigen::Index count = (svd.singularValues().array() > kGripsAlone).count();
  if (count == 0) return {};
  const Eigen::MatrixXd V = svd.matrixV().leftCols(count);
  Eigen::MatrixXd S = null_space * V;
  for (Eigen::Index i = 0; i < held; ++i) {
    if ((reach.row(i) * V).norm() <= kGripsAlone) S.row(grips + i).setZero();  // a drive in no loop
  }
  const Eigen::VectorXd work = S.transpose() * after;  // on the rates told
  const Eigen::VectorXd terms = S.cwiseAbs().transpose() * after.cwiseAbs();
  if ((work.array().abs() <= kWorkRounding * terms.array()).all()) return {};
  // x = J_r^(1/2) (w_h - s) is the least solution of B^T x = S^T w, B = J_r^(-1/2) S_h.                        (7.20)
  const Eigen::VectorXd root = rows.held_inertia.cwiseSqrt();
  const Eigen::MatrixXd B = root.cwiseInverse().asDiagonal() * S.bottomRows(held);
  const Eigen::VectorXd x = B.transpose().completeOrthogonalDecomposition().solve(work);
  return after.tail(held) - x.cwiseQuotient(root);
}

std::vector<bool> which_gave_way(const Model& model, std::span<const HeldRate> held, std::span<const double> velocity) {
  std::vector<double> told, missed;
  double largest = 0;
  for (const HeldRate& h : held) {
    const double root = std::sqrt(drive_inertia(model, h.velocity));
    told.push_back(root * std::abs(h.after)), missed.push_back(root * std::abs(velocity[h.velocity] - h.after));
    largest = std::max({largest, told.back(), missed.back()});
  }
  std::vector<bool> gave_way;
  for (double miss : missed) gave_way.push_back(miss > kNoticed * largest);
  return gave_way;
}

YieldingDrives::YieldingDrives(const Model& model, int rows)
    : rows_(static_cast<std::size_t>(rows)),
      velocities_(static_cast<std::size_t>(model.velocities())),
      inertia_(velocities_),
      response_(rows_ * velocities_),
      stress_(response_),
      null_(rows_),
      right_(rows_),
      z_(rows_),
      ignored_(rows_),
      small_(rows) {
  for (std::size_t v = 0; v < velocities_; ++v) inertia_[v] = drive_inertia(model, static_cast<int>(v));
}

bool YieldingDrives::give_way(const PivotedCholesky& factor, std::span<const std::uint8_t> held,
                              std::span<double> after) {
  const std::size_t count = rows_ - static_cast<std::size_t>(factor.rank());
  const std::span<double> A = small_.matrix();  // S_h^T J_r^-1 S_h; rows beyond the self-stresses are the identity's
  std::fill(A.begin(), A.end(), 0.0);
  bool contradict = false;
  for (std::size_t k = 0; k < rows_; ++k) {
    A[k * rows_ + k] = 1, right_[k] = 0;
    if (k >= count) continue;
    factor.null_vector(static_cast<int>(k), null_);
    const std::span<double> S = std::span(stress_).subspan(k * velocities_, velocities_);
    double size = 0;
    for (std::size_t v = 0; v < velocities_; ++v) {
      double sum = 0, terms = 0;
      for (std::size_t r = 0; held[v] != 0 && r < rows_; ++r) {
        const double term = null_[r] * response_[r * velocities_ + v];
        sum += term, terms += std::abs(term);
      }
      S[v] = std::abs(sum) > kGripsAlone * terms ? sum : 0;
      size += S[v] * S[v] / inertia_[v];
    }
    double work = 0, terms = 0;
    for (std::size_t v = 0; size > 0 && v < velocities_; ++v) {
      S[v] /= std::sqrt(size);
      work += S[v] * after[v], terms += std::abs(S[v] * after[v]);
    }
    right_[k] = work;
    contradict = contradict || std::abs(work) > kWorkRounding * terms;
    for (std::size_t l = 0; size > 0 && l < k; ++l) {
      double sum = 0;
      for (std::size_t v = 0; v < velocities_; ++v) sum += S[v] * stress_[l * velocities_ + v] / inertia_[v];
      A[k * rows_ + l] = A[l * rows_ + k] = sum;
    }
  }
  if (!contradict) return false;
  small_.factor(kDependent);
  small_.solve(right_, z_, ignored_);
  for (std::size_t k = 0; k < count; ++k) {
    for (std::size_t v = 0; v < velocities_; ++v)
      after[v] -= stress_[k * velocities_ + v] * z_[k] / inertia_[v];  // (7.20)
  }
  return true;
}

}  // namespace grapnel
