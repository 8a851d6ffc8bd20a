#include "grapnel/impact/yielding_drives.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/spatial/decompositions.hpp"

namespace grapnel {
namespace {

// Relative to its terms, the part of a self-stress at a drive below which it is a rounding error, and the self-stress
// one of the grasps alone.
constexpr double kGraspsAlone = 1e-8;
// Relative to its terms, the work of a self-stress on the prescribed rates that counts as zero.
constexpr double kWorkRounding = 1e-13;
// Relative to the largest rate, in the metric J_r: deviation below which a drive is not overpowered.
constexpr double kNoticed = 1e-9;

}  // namespace

double drive_inertia(const Model& model, int velocity) {
  for (int body : model.joints()) {
    if (model.bodies()[body].v != velocity) continue;
    const double inertia = model.bodies()[body].description.joint.reflected_inertia();
    return inertia > 0 ? inertia : 1;
  }
  return 1;  // for a root or a spherical joint
}

// Rows, required velocities, self-stresses => nearest rates in the metric J_r that agree with the grasps (7.20); empty
// if the required ones agree up to rounding error. Self-stresses of the grasps alone are excluded.
std::optional<Eigen::VectorXd> rates_that_grasps_allow(const BilateralRows& rows, const Eigen::VectorXd& after,
                                                       const Eigen::MatrixXd& null_space) {
  const Eigen::Index held = rows.held_inertia.size();
  if (held == 0 || null_space.cols() == 0) return {};
  // Self-stresses at the drives: S_h = -J_h^T S_g relative to the possible size of its terms.
  const Eigen::Index grasps = rows.J.rows() - held;
  const Eigen::MatrixXd J_h = rows.J.topRows(grasps)(Eigen::all, rows.held);
  const Eigen::VectorXd size = (J_h.cwiseAbs().transpose() * rows.D.diagonal().head(grasps).cwiseSqrt().cwiseInverse());
  Eigen::MatrixXd reach = null_space.bottomRows(held);
  for (Eigen::Index i = 0; i < held; ++i) reach.row(i) *= size[i] > 0 ? 1 / size[i] : 0;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(reach, Eigen::ComputeFullV);
  const Eigen::Index count = (svd.singularValues().array() > kGraspsAlone).count();
  if (count == 0) return {};
  const Eigen::MatrixXd V = svd.matrixV().leftCols(count);
  Eigen::MatrixXd S = null_space * V;
  for (Eigen::Index i = 0; i < held; ++i) {
    if ((reach.row(i) * V).norm() <= kGraspsAlone) S.row(grasps + i).setZero();  // a drive in no loop
  }
  const Eigen::VectorXd work = S.transpose() * after;  // on the prescribed rates
  const Eigen::VectorXd terms = S.cwiseAbs().transpose() * after.cwiseAbs();
  if ((work.array().abs() <= kWorkRounding * terms.array()).all()) return {};
  // x = J_r^(1/2) (w_h - s) is the least solution of B^T x = S^T w, B = J_r^(-1/2) S_h.                        (7.20)
  const Eigen::VectorXd root = rows.held_inertia.cwiseSqrt();
  const Eigen::MatrixXd B = root.cwiseInverse().asDiagonal() * S.bottomRows(held);
  const Eigen::VectorXd x = least_norm_solution(B.transpose(), work);
  return after.tail(held) - x.cwiseQuotient(root);
}

// Held rates and v+ => per held rate whether it deviates from the prescribed value by more than 1e-9 of the largest
// rate, in the metric J_r; false for modes.
std::vector<bool> which_was_overpowered(const Model& model, std::span<const HeldRate> held,
                                        std::span<const double> velocity) {
  std::vector<double> commanded, deviations;
  double largest = 0;
  for (const HeldRate& h : held) {
    if (h.is_mode()) {
      commanded.push_back(0), deviations.push_back(0);
      continue;
    }
    const double root = std::sqrt(drive_inertia(model, h.velocity));
    commanded.push_back(root * std::abs(h.after)),
        deviations.push_back(root * std::abs(velocity[h.velocity] - h.after));
    largest = std::max({largest, commanded.back(), deviations.back()});
  }
  std::vector<bool> was_overpowered;
  for (double deviation : deviations) was_overpowered.push_back(deviation > kNoticed * largest);
  return was_overpowered;
}

}  // namespace grapnel
