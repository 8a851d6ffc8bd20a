#include "grapnel/import/component_modes.hpp"

#include <fmt/format.h>

#include <Spectra/SymGEigsShiftSolver.h>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "grapnel/import/interface_rows.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double>;
using SparseCholesky = Eigen::SimplicialLDLT<Sparse>;

constexpr double kTwoPi = 2 * std::numbers::pi;
// A free model moves as a whole without stiffness: its remaining frequency must be below this fraction of the first
// mode's, otherwise the model is supported.
constexpr double kGrounding = 0.02;
// Permitted dependence of the mass on the direction: files have limited digits, and elements have discretization
// errors.
constexpr double kRigidity = 1e-3;
// Modes whose effective mass and inertia are below this fraction of the total in every direction are not excited.
constexpr double kParticipation = 1e-9;
// Up to this number of inner degrees of freedom, dense matrices give all modes.
constexpr int kDense = 400;

// K^-1 x and M x in the interface of Spectra; without a shift.
class InverseProduct {
 public:
  using Scalar = double;
  explicit InverseProduct(const SparseCholesky& K) : K_(K) {}
  Index rows() const { return K_.rows(); }
  Index cols() const { return K_.cols(); }
  void set_shift(double) {}
  void perform_op(const double* x, double* y) const {
    Eigen::Map<VectorXd>(y, rows()) = K_.solve(Eigen::Map<const VectorXd>(x, rows()));
  }

 private:
  const SparseCholesky& K_;
};
class MassProduct {
 public:
  using Scalar = double;
  explicit MassProduct(const Sparse& M) : M_(M) {}
  Index rows() const { return M_.rows(); }
  Index cols() const { return M_.cols(); }
  void perform_op(const double* x, double* y) const {
    Eigen::Map<VectorXd>(y, rows()) = M_ * Eigen::Map<const VectorXd>(x, rows());
  }

 private:
  const Sparse& M_;
};

class Reduction {
 public:
  Reduction(const ElementMatrix& mass, const ElementMatrix& stiffness, FaultList& faults)
      : mass_(mass), stiffness_(stiffness), faults_(faults) {}

  std::optional<ComponentModes> run(const ElementInterface& interface, const ElementUnits& units,
                                    const ComponentModeSettings& settings) {
    auto parts = interface_rows(mass_, stiffness_, interface, faults_);
    if (!parts) return std::nullopt;
    parts_ = std::move(*parts);
    if (!split()) return std::nullopt;
    // (22.11): the stress-free motion of the model with its interface.
    SparseCholesky K(K_ii_);
    if (!is_positive(K)) return std::nullopt;
    const MatrixXd K_ib_motion = K_ib_ * parts_.motion;
    const MatrixXd follow = parts_.inner.empty() ? MatrixXd(0, 6) : MatrixXd(-K.solve(K_ib_motion));
    const MatrixXd M_rigid = parts_.motion.transpose() * (M_bb_ * parts_.motion + M_ib_.transpose() * follow) +
                             follow.transpose() * (M_ib_ * parts_.motion + M_ii_ * follow);
    const MatrixXd K_rigid = parts_.motion.transpose() * (K_bb_ * parts_.motion + K_ib_.transpose() * follow);
    ComponentModes result;
    result.degrees_of_freedom = mass_.size();
    std::vector<double> omega2;
    MatrixXd shapes;
    if (!eigenmodes(settings.modes, K, omega2, shapes)) return std::nullopt;
    if (!is_free(0.5 * (K_rigid + K_rigid.transpose()), M_rigid, omega2, result)) return std::nullopt;
    if (!rigid_body(0.5 * (M_rigid + M_rigid.transpose()), units, result)) return std::nullopt;
    // (22.13): momenta of a mode at unit rate.
    const MatrixXd P = parts_.motion.transpose() * (M_ib_.transpose() * shapes) + follow.transpose() * (M_ii_ * shapes);
    take_modes(omega2, P, M_rigid, units, settings, result);
    return result;
  }

 private:
  Mark mark_of(const ElementMatrix& m) const { return {std::make_shared<const std::string>(m.name), 0, 0}; }
  std::string row_name(int row) const {
    return mass_.dofs.empty() ? fmt::format("row {}", row + 1) : mass_.dofs[static_cast<std::size_t>(row)].text();
  }

  // --- Blocks ---

  bool split() {
    std::vector<int> place(static_cast<std::size_t>(mass_.size()));
    std::vector<std::uint8_t> is_inner(place.size());
    // Removes rows of zeros, which have neither mass nor stiffness.
    std::erase_if(parts_.inner, [&](int row) {
      const auto is_empty = [&](const Sparse& A) {
        for (Sparse::InnerIterator it(A, row); it; ++it) {
          if (it.value() != 0) return false;
        }
        return true;
      };
      return is_empty(mass_.A) && is_empty(stiffness_.A);
    });
    std::fill(place.begin(), place.end(), -1);
    for (std::size_t i = 0; i < parts_.boundary.size(); ++i)
      place[static_cast<std::size_t>(parts_.boundary[i])] = static_cast<int>(i);
    for (std::size_t i = 0; i < parts_.inner.size(); ++i)
      place[static_cast<std::size_t>(parts_.inner[i])] = static_cast<int>(i),
      is_inner[static_cast<std::size_t>(parts_.inner[i])] = 1;
    const auto blocks = [&](const Sparse& A, Sparse& ii, Sparse& ib, Sparse& bb) {
      std::vector<Eigen::Triplet<double>> in_ii, in_ib, in_bb;
      for (int column = 0; column < A.outerSize(); ++column) {
        const auto c = static_cast<std::size_t>(column);
        if (place[c] < 0) continue;
        for (Sparse::InnerIterator it(A, column); it; ++it) {
          const auto r = static_cast<std::size_t>(it.row());
          if (place[r] < 0) continue;
          if (is_inner[r] && is_inner[c]) in_ii.emplace_back(place[r], place[c], it.value());
          if (is_inner[r] && !is_inner[c]) in_ib.emplace_back(place[r], place[c], it.value());
          if (!is_inner[r] && !is_inner[c]) in_bb.emplace_back(place[r], place[c], it.value());
        }
      }
      const auto i = static_cast<Index>(parts_.inner.size()), b = static_cast<Index>(parts_.boundary.size());
      ii.resize(i, i), ib.resize(i, b), bb.resize(b, b);
      ii.setFromTriplets(in_ii.begin(), in_ii.end());
      ib.setFromTriplets(in_ib.begin(), in_ib.end());
      bb.setFromTriplets(in_bb.begin(), in_bb.end());
    };
    blocks(mass_.A, M_ii_, M_ib_, M_bb_);
    blocks(stiffness_.A, K_ii_, K_ib_, K_bb_);
    if (!parts_.inner.empty()) return true;
    faults_.add(mark_of(mass_), "the matrices contain only the interface: there are no modes of vibration");
    return false;
  }

  // Clamped at the interface, the model must not move without stiffness.
  bool is_positive(const SparseCholesky& K) {
    const VectorXd pivots = K.info() == Eigen::Success ? VectorXd(K.vectorD()) : VectorXd();
    Index least = 0;
    const bool is_definite = pivots.size() > 0 && pivots.minCoeff(&least) > 0;
    const VectorXd diagonal = K_ii_.diagonal();
    if (is_definite) {
      const Index row = K.permutationPinv().indices()[least];
      if (pivots[least] > 1e-13 * std::abs(diagonal[row])) return true;
      return loose(row);
    }
    Index row = 0;
    if (pivots.size() > 0)
      row = K.permutationPinv().indices()[least];
    else
      diagonal.minCoeff(&row);
    return loose(row);
  }
  bool loose(Index row) {
    faults_.add(
        mark_of(stiffness_),
        fmt::format("clamped at the interface, the model can move without stiffness, for example at {}: the stiffness "
                    "matrix is indefinite there, or a part is not connected with the interface",
                    row_name(parts_.inner[static_cast<std::size_t>(row)])));
    return false;
  }

  // --- The model as a rigid body: (22.12) ---

  bool rigid_body(const MatrixXd& M, const ElementUnits& units, ComponentModes& result) {
    const double m = (M(0, 0) + M(1, 1) + M(2, 2)) / 3;
    double off = 0;
    for (Index i = 0; i < 3; ++i) {
      for (Index j = 0; j < 3; ++j) off = std::max(off, std::abs(M(i, j) - (i == j ? m : 0)));
    }
    if (!(m > 0) || off > kRigidity * m) {
      faults_.add(mark_of(mass_),
                  fmt::format("the model's mass along x, y and z is {:.6g}, {:.6g} and {:.6g}: the mass of "
                              "a body must be equal in all directions",
                              M(0, 0), M(1, 1), M(2, 2)));
      return false;
    }
    // Linear momentum of a rotation: theta x h = -[h x] theta, which has no symmetric part.
    const MatrixXd H = M.block(0, 3, 3, 3);
    const Vector3d h{0.5 * (H(1, 2) - H(2, 1)), 0.5 * (H(2, 0) - H(0, 2)), 0.5 * (H(0, 1) - H(1, 0))};
    const double size = std::sqrt(m * std::max({M(3, 3), M(4, 4), M(5, 5), 0.0}));
    if ((0.5 * (H + H.transpose())).cwiseAbs().maxCoeff() > kRigidity * size) {
      faults_.add(mark_of(mass_),
                  "the model's mass matrix is not that of a body: its first moments about the interface depend on the "
                  "direction");
      return false;
    }
    RigidBodyInertiad I;
    I.mass = m, I.first_moment = h;
    I.rotational = {M(3, 3), M(4, 4), M(5, 5), M(3, 4), M(3, 5), M(4, 5)};
    result.mass = m * units.mass;
    result.com = units.length * I.com();
    const Symmetric3d J = I.rotational_about_com();
    const double scale = units.mass * units.length * units.length;
    result.inertia = {scale * J.xx, scale * J.yy, scale * J.zz, scale * J.xy, scale * J.xz, scale * J.yz};
    return true;
  }

  // Stiffness of the model as a whole, relative to its mass: a frequency that must be nearly zero.
  bool is_free(const MatrixXd& K, const MatrixXd& M, const std::vector<double>& omega2, ComponentModes& result) {
    const Cholesky factor(M);
    if (factor.info() != Eigen::Success) return indefinite_mass();
    const MatrixXd half = lower_solution(factor, K);
    const MatrixXd A = lower_solution(factor, MatrixXd(half.transpose()));
    const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(0.5 * (A + A.transpose())));
    const double largest = std::max(std::abs(solver.eigenvalues()[0]), std::abs(solver.eigenvalues()[5]));
    result.grounding = std::sqrt(largest) / kTwoPi;
    if (omega2.empty() || largest <= kGrounding * kGrounding * omega2[0]) return true;
    faults_.add(
        mark_of(stiffness_),
        fmt::format("the model has supports besides the interface: as a whole it would vibrate at {:.4g} Hz, "
                    "and its first mode, clamped, is at {:.4g} Hz. The matrices must be those of the free model, with "
                    "enough digits, and the nodes of the interface must have displacements along the model's axes",
                    result.grounding, std::sqrt(omega2[0]) / kTwoPi));
    return false;
  }

  // --- Modes: K_ii x = omega^2 M_ii x, x^T M_ii x = 1 ---

  // The slowest `wanted` modes and one more.
  bool eigenmodes(int wanted, const SparseCholesky& stiffness_factor, std::vector<double>& omega2, MatrixXd& shapes) {
    const auto n = static_cast<int>(parts_.inner.size());
    int count = std::min(wanted + 1, n);
    MatrixXd x;
    if (n <= kDense || count > n / 2) {
      // With K = L L^T: L^-1 M L^-T y = y / omega^2. Masses may be zero.
      const Cholesky K{MatrixXd(K_ii_)};
      const MatrixXd half = lower_solution(K, MatrixXd(M_ii_));
      const MatrixXd A = lower_solution(K, MatrixXd(half.transpose()));
      const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(0.5 * (A + A.transpose())));
      const double most = solver.eigenvalues()[n - 1];
      if (!(solver.eigenvalues()[0] >= -1e-9 * most)) return indefinite_mass();
      const auto with_mass = static_cast<int>((solver.eigenvalues().array() > 1e-14 * most).count());
      count = std::min(count, with_mass);
      x = upper_solution(K, MatrixXd(solver.eigenvectors().rightCols(count).rowwise().reverse()));
    } else {
      using Shift = InverseProduct;
      using Product = MassProduct;
      Shift shift(stiffness_factor);
      Product product(M_ii_);
      Spectra::SymGEigsShiftSolver<Shift, Product, Spectra::GEigsMode::ShiftInvert> solver(
          shift, product, count, std::min(n, std::max(2 * count + 10, 40)), 0.0);
      solver.init();
      solver.compute(Spectra::SortRule::LargestMagn, 1000, 1e-12);
      if (solver.info() != Spectra::CompInfo::Successful) {
        faults_.add(mark_of(stiffness_),
                    fmt::format("the {} slowest modes were not found: the eigenvalue solver did not converge", count));
        return false;
      }
      x = solver.eigenvectors();
      // If M lacks masses, M + K / w^2 is definite for every w, unless M is indefinite.
      const double beyond = 1e4 * solver.eigenvalues().cwiseAbs().maxCoeff();
      const SparseCholesky both(Sparse(M_ii_ + K_ii_ / beyond));
      if (both.info() != Eigen::Success || !(both.vectorD().minCoeff() > 0)) return indefinite_mass();
    }
    // Rayleigh quotients, which have twice the digits of the shapes.
    std::vector<std::pair<double, Index>> order;
    for (Index k = 0; k < x.cols(); ++k) {
      const double inertia = x.col(k).dot(M_ii_ * x.col(k)), stiffness = x.col(k).dot(K_ii_ * x.col(k));
      if (!(inertia > 0)) return indefinite_mass();
      order.emplace_back(stiffness / inertia, k);
      x.col(k) /= std::sqrt(inertia);
    }
    std::sort(order.begin(), order.end());
    shapes.resize(n, static_cast<Index>(order.size()));
    for (std::size_t k = 0; k < order.size(); ++k) {
      omega2.push_back(order[k].first);
      shapes.col(static_cast<Index>(k)) = x.col(order[k].second);
    }
    return n <= kDense || none_is_missing(omega2);
  }
  // Iterations can miss one of several modes with equal frequency. K - s M has as many negative pivots as there are
  // modes below s (Sylvester's law of inertia): s lies in the widest gap among the last modes.
  bool none_is_missing(const std::vector<double>& omega2) {
    std::size_t below = omega2.size() - 1;
    for (std::size_t k = omega2.size() / 2; k < omega2.size(); ++k) {
      if (k > 0 && omega2[k] / omega2[k - 1] > omega2[below] / omega2[std::max<std::size_t>(below, 1) - 1]) below = k;
    }
    if (below == 0) return true;
    const double between = std::sqrt(omega2[below] * omega2[below - 1]);
    const SparseCholesky shifted(Sparse(K_ii_ - between * M_ii_));
    if (shifted.info() != Eigen::Success) return true;  // no statement is possible
    const auto found = static_cast<Index>(below), there = (shifted.vectorD().array() < 0).count();
    if (there == found) return true;
    faults_.add(
        mark_of(stiffness_),
        fmt::format(
            "the eigenvalue solver found {2} instead of {0} modes below {1:.6g} Hz; use another number of modes", there,
            std::sqrt(between) / kTwoPi, found));
    return false;
  }
  bool indefinite_mass() {
    faults_.add(mark_of(mass_), "the mass matrix is indefinite: a motion would have negative kinetic energy");
    return false;
  }

  void take_modes(const std::vector<double>& omega2, const MatrixXd& P, const MatrixXd& M_rigid,
                  const ElementUnits& units, const ComponentModeSettings& settings, ComponentModes& result) const {
    const double root_mass = std::sqrt(units.mass);
    for (std::size_t k = 0; k < omega2.size(); ++k) {
      const double frequency = std::sqrt(omega2[k]) / kTwoPi;
      if (static_cast<int>(k) >= settings.modes || frequency > settings.below) {
        result.next = frequency;
        return;
      }
      const VectorXd p = P.col(static_cast<Index>(k));
      // Relative to the total, so that the choice is independent of units.
      Index largest = 0;
      const VectorXd parts = p.array().square() / M_rigid.diagonal().array();
      if (parts.maxCoeff(&largest) < kParticipation) {
        ++result.without_participation;
        continue;
      }
      const double sign = p[largest] < 0 ? -1 : 1;
      const double t = sign * root_mass, r = t * units.length;
      result.modes.push_back(
          {frequency, settings.damping_ratio, {t * p[0], t * p[1], t * p[2]}, {r * p[3], r * p[4], r * p[5]}});
    }
  }

  const ElementMatrix& mass_;
  const ElementMatrix& stiffness_;
  FaultList& faults_;
  ModelParts parts_;
  Sparse M_ii_, M_ib_, M_bb_, K_ii_, K_ib_, K_bb_;
};

}  // namespace

std::optional<ComponentModes> component_modes(ElementMatrix mass, ElementMatrix stiffness,
                                              const ElementInterface& interface, const ElementUnits& units,
                                              const ComponentModeSettings& settings, FaultList& faults) {
  if (!align(mass, stiffness, faults)) return std::nullopt;
  return Reduction(mass, stiffness, faults).run(interface, units, settings);
}

}  // namespace grapnel
