#include "grapnel/constraint/loop_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/constraint/pivoted_cholesky.hpp"
#include "grapnel/dynamics/derivatives_workspace.hpp"
#include "grapnel/dynamics/modal_chains.hpp"
#include "grapnel/model/tree.hpp"

namespace grapnel {
namespace {

using namespace derivatives;

// One velocity on the path of a closure, at C in C's axes.
struct PathVelocity {
  int v, link;
  int side;  // 1: it moves body a alone; -1: body b
  Motion S, psi, psi2, T;
};

// A closure at the present state, at C in C's axes.
struct ClosureTerms {
  LoopPlace place;
  Motion V_C, V_D, A_C, A_D;
  std::vector<PathVelocity> velocities;  // of each side from its body to the common ancestor or the root
};

// Derivatives of position_rows() by a motion S of C relative to D: (28.20).
void position_slopes(const LoopPath& path, const LoopPlace& place, const Motion& S, std::span<double> slopes) {
  const Posed X_CD = pose_CD(path, place);
  Vector3d turn = Vector3d::zero();  // minus the derivative of the rotation of D relative to C
  if (path.model == GraspModel::rigid || path.model == GraspModel::orientation) {
    // The inverse of the left Jacobian of the rotation vector phi: 1 - phi x / 2 + c phi x phi x.
    const Vector3d phi = rotation_vector(X_CD.R);
    const double square = dot(phi, phi), half = 0.5 * std::sqrt(square);
    const double c = square > 1e-6 ? (1 - half * std::cos(half) / std::sin(half)) / square : 1.0 / 12 + square / 720;
    const Vector3d once = cross(phi, S.angular);
    turn = S.angular - 0.5 * once + c * cross(phi, once);
  } else if (turns_about_axis(path.model)) {
    // f(c) h x a with a = R_CD h, c = h . a and f = angle / sine.
    const Vector3d &h = path.hinge_C, a = X_CD.R * h, sine = cross(h, a), change = cross(S.angular, a);
    const double s = norm(sine), cosine = dot(h, a), angle = std::atan2(s, cosine);
    const double f = s > 1e-4 || cosine < 0 ? angle / s : 1 + s * s / 6;
    const double slope = s > 1e-3 || cosine < 0 ? (angle * cosine - s) / (s * s * s) : -1.0 / 3 - 2.0 / 15 * s * s;
    turn = f * cross(h, change) + slope * dot(h, change) * sine;
  }
  for (int r = 0; r < path.angular_count; ++r) slopes[r] = dot(path.angular_rows[r], turn);
  const Vector3d shifted = S.linear + cross(S.angular, X_CD.p);
  for (int r = 0; r < path.linear_count(); ++r) slopes[path.angular_count + r] = shifted[r];
}

}  // namespace

struct LoopDerivatives::Implementation {
  const Model& model;
  std::vector<LoopPath> paths;
  std::vector<CouplingPath> couplings;
  DerivativesWorkspace workspace;
  std::vector<ClosureTerms> closures;
  PivotedCholesky factor;
  int n, row_total;
  std::vector<double> scale;
  RowMatrix J, Y;           // Y = M^-1 J^T
  RowMatrix R_q, R_v, U_q;  // derivatives of the rows of accelerations, and of velocities
  std::vector<double> rhs, solution, residual;

  static std::vector<LoopPath> make_paths(const Model& m, std::span<const LoopClosure> c) {
    std::vector<LoopPath> made;
    int row = 0;
    for (const LoopClosure& closure : c) {
      made.push_back(make_loop_path(m, closure));
      made.back().first_row = row;
      row += made.back().rows;
    }
    return made;
  }

  Implementation(const Model& m, std::span<const LoopClosure> c)
      : model(m),
        paths(make_paths(m, c)),
        couplings(make_coupling_paths(m, closure_rows(c))),
        workspace(m),
        closures(paths.size()),
        factor(closure_rows(c) + static_cast<int>(couplings.size())),
        n(m.velocities()),
        row_total(factor.size()),
        scale(static_cast<std::size_t>(row_total)),
        rhs(scale),
        solution(scale),
        residual(scale) {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      for (int r = 0; r < path.rows; ++r) scale[path.first_row + r] = path.scale(r);
      list_velocities(path, closures[k]);
    }
    for (const CouplingPath& coupling : couplings) scale[coupling.row] = coupling.scale;
  }

  void list_velocities(const LoopPath& path, ClosureTerms& terms) const {
    const auto list = [&](const std::vector<int>& links, int root, int side) {
      const auto add = [&](int link) {
        const TreeLink<double>& l = model.tree().links[link];
        for (int k = 0; k < velocity_count(l.joint); ++k)
          terms.velocities.push_back({l.v + k, link, side, {}, {}, {}, {}});
      };
      for (const int link : links) add(link);
      if (!path.one_tree()) add(root);
    };
    list(path.from_a, path.root_a, 1);
    list(path.from_b, path.root_b, -1);
  }

  // Poses, twists and directions that do not depend on accelerations.
  void locate() {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      ClosureTerms& terms = closures[k];
      const LinkTerms &a = workspace.link(path.link_a), &b = workspace.link(path.link_b);
      const Posed in_a = Posed{a.R, a.p} * path.X_aC;  // C in the frame of the root of a, of b
      Posed in_b = in_a;
      if (!path.one_tree()) {
        // Far from the world's origin only the distance of the roots matters.
        const Posed &X_Wa = workspace.root_of(path.link_a), &X_Wb = workspace.root_of(path.link_b);
        in_b = Posed{transpose(X_Wb.R) * X_Wa.R, transposed_times(X_Wb.R, X_Wa.p - X_Wb.p)} * in_a;
      }
      terms.place = {inverse(Posed{b.R, b.p}) * in_b};
      terms.V_C = at_C(in_a, a.V), terms.V_D = at_C(in_b, b.V);
      terms.A_C = at_C(in_a, a.A), terms.A_D = at_C(in_b, b.A);
      for (PathVelocity& x : terms.velocities) {
        const Posed& X = x.side > 0 ? in_a : in_b;
        x.S = at_C(X, workspace.at(DerivativesWorkspace::kS, x.v));
        x.psi = at_C(X, workspace.at(DerivativesWorkspace::kPsi, x.v));
        x.psi2 = at_C(X, workspace.at(DerivativesWorkspace::kPsi2, x.v));
        x.T = at_C(X, workspace.at(DerivativesWorkspace::kT, x.v));
      }
    }
  }
  static Motion at_C(const Posed& X, const Motion& of_root) { return transposed_times(X.R, shift(of_root, X.p)); }

  // J, and the rows of relative velocity and acceleration => u, scaled size of the accelerations.
  double fill_rows(const State& state, std::span<const double> vdot, double feedback, std::vector<double>& u) {
    J.setZero(row_total, n);
    double size = loop_limits::kSmallest;
    double rows[6], motion[6], position[6];
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const ClosureTerms& t = closures[k];
      for (const PathVelocity& x : t.velocities) {
        take_rows(path, x.S, rows);
        for (int r = 0; r < path.rows; ++r) J(path.first_row + r, x.v) += x.side * rows[r];
      }
      take_rows(path, t.A_C - t.A_D + cross(t.V_C, t.V_D), rows);
      take_rows(path, t.V_C - t.V_D, motion);
      position_rows(path, t.place, position);
      for (int r = 0; r < path.rows; ++r)
        u[path.first_row + r] = rows[r] + feedback * (2 * motion[r] + feedback * position[r]);
      for (const Motion& A : {t.A_C, t.A_D}) {
        size = std::max({size, path.angular_scale * std::max(norm(A.angular), loop_limits::kUnnoticed),
                         path.linear_scale * std::max(norm(A.linear), loop_limits::kUnnoticed)});
      }
    }
    for (const CouplingPath& coupling : couplings) {
      for (const CouplingPath::Joint& joint : coupling.joints) J(coupling.row, joint.v) += joint.factor;
      u[coupling.row] = coupling_motion(coupling, vdot) + feedback * (2 * coupling_motion(coupling, state.v) +
                                                                      feedback * coupling_position(coupling, state.q));
      size = std::max(size, coupling.scale * coupling_motion_size(coupling, vdot, loop_limits::kUnnoticed));
    }
    return size;
  }

  // Y = M^-1 J^T, and the factor of the scaled W = J Y, (8.7).
  void factor_rows(std::span<const std::uint8_t> prescribed) {
    Eigen::MatrixXd rows = J;
    project_columns(model.tree(), rows);
    for (std::size_t i = 0; i < prescribed.size(); ++i) {
      if (prescribed[i]) rows.col(static_cast<Eigen::Index>(i)).setZero();
    }
    const int stride = padded(row_total);
    PackedNumbers X(n * stride);
    for (int i = 0; i < n; ++i) {
      for (int r = 0; r < row_total; ++r) X.data()[i * stride + r] = rows(r, i);
    }
    workspace.solve_rows(X.data(), stride, row_total);
    Y.resize(n, row_total);
    for (int i = 0; i < n; ++i) {
      for (int r = 0; r < row_total; ++r) Y(i, r) = X.data()[i * stride + r];
    }
    const RowMatrix W = J * Y;
    for (int i = 0; i < row_total; ++i) {
      for (int j = 0; j < row_total; ++j)
        factor.matrix()[static_cast<std::size_t>(i * row_total + j)] = scale[i] * scale[j] * 0.5 * (W(i, j) + W(j, i));
    }
    factor.factor(loop_limits::kRankTolerance);
  }

  // W x = b for b in rhs, in unscaled rows => largest scaled residual of a redundant row.
  double solve() {
    for (int i = 0; i < row_total; ++i) rhs[i] *= scale[i];
    factor.solve(rhs, solution, residual);
    double largest = 0;
    for (int i = 0; i < row_total; ++i) {
      solution[i] *= scale[i];
      largest = std::max(largest, std::abs(residual[i]));
    }
    return largest;
  }

  // Derivatives of the rows: (28.16) to (28.19).
  void differentiate_rows(double feedback) {
    R_q.setZero(row_total, n), R_v.setZero(row_total, n), U_q.setZero(row_total, n);
    double rows[6], motion[6], position[6];
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const ClosureTerms& t = closures[k];
      for (const PathVelocity& x : t.velocities) {
        const Motion moved = cross(x.S, t.V_D);
        take_rows(path, x.psi + moved, motion);
        const auto add = [&](RowMatrix& to, const double* values, double weight) {
          for (int r = 0; r < path.rows; ++r) to(path.first_row + r, x.v) += x.side * weight * values[r];
        };
        take_rows(path, x.psi2 - cross(t.V_C + t.V_D, x.psi) + cross(x.S, t.A_D) - cross(t.V_C, moved), rows);
        add(R_q, rows, 1), add(U_q, motion, 1);
        take_rows(path, x.T - cross(t.V_C + t.V_D, x.S), rows);
        add(R_v, rows, 1);
        if (feedback == 0) continue;
        take_rows(path, x.S, rows);
        position_slopes(path, t.place, x.S, position);
        add(R_q, motion, 2 * feedback), add(R_q, position, feedback * feedback), add(R_v, rows, 2 * feedback);
      }
    }
    for (const CouplingPath& coupling : couplings) {
      for (const CouplingPath::Joint& joint : coupling.joints) {
        R_q(coupling.row, joint.v) += feedback * feedback * joint.factor;
        R_v(coupling.row, joint.v) += 2 * feedback * joint.factor;
      }
    }
  }

  // d(J^T lambda)/dq (28.15), subtracted from the derivatives of inverse dynamics.
  void subtract_reactions(const std::vector<double>& multipliers) {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const std::vector<PathVelocity>& velocities = closures[k].velocities;
      const double* rows = multipliers.data() + path.first_row;
      Load F = Load::zero();
      for (int r = 0; r < path.angular_count; ++r) F.angular += rows[r] * path.angular_rows[r];
      for (int r = 0; r < path.linear_count(); ++r) F.linear[r] = rows[path.angular_count + r];
      for (std::size_t j = 0; j < velocities.size(); ++j) {
        const PathVelocity& x = velocities[j];
        const Load moved = cross_load(x.S, F);  // (S_j x S_i) . F = -S_i . (S_j x* F)
        for (std::size_t i = 0; i < velocities.size(); ++i) {
          const PathVelocity& y = velocities[i];
          // Velocities of a side are in inward order: those before the link of i are beyond it.
          const bool beyond = j < i && x.link != y.link;
          if (y.side > 0 ? x.side > 0 && beyond : x.side < 0 && !beyond)
            workspace.by_q(y.v, x.v) -= product(y.S, moved);
          else if (y.side < 0 && x.side > 0)
            workspace.by_q(y.v, x.v) += product(y.S, moved);
        }
      }
    }
  }

  double largest_scale() const {
    return std::accumulate(scale.begin(), scale.end(), 1.0, [](double a, double b) { return std::max(a, b); });
  }

  // Derivatives without a change of the multipliers, D, and those of the rows => with loops, and those of the
  // multipliers (28.18).
  void close(const RowMatrix* of_rows, RowMatrix& D, RowMatrix& multipliers, double& contradiction) {
    RowMatrix total = J * D;
    if (of_rows) total += *of_rows;
    multipliers.resize(row_total, D.cols());
    double inconsistent = 0, size = loop_limits::kUnnoticed * largest_scale();
    for (Eigen::Index j = 0; j < D.cols(); ++j) {
      for (int i = 0; i < row_total; ++i) {
        rhs[i] = -total(i, j);
        size = std::max(size, scale[i] * std::abs(total(i, j)));
      }
      inconsistent = std::max(inconsistent, solve());
      for (int i = 0; i < row_total; ++i) multipliers(i, j) = solution[i];
    }
    D += Y * multipliers;
    contradiction = std::max(contradiction, inconsistent / size);
  }
};

LoopDerivatives::LoopDerivatives(const Model& model, std::span<const LoopClosure> closures)
    : implementation_(std::make_unique<Implementation>(model, closures)) {}
LoopDerivatives::~LoopDerivatives() = default;
LoopDerivatives::LoopDerivatives(LoopDerivatives&&) noexcept = default;
LoopDerivatives& LoopDerivatives::operator=(LoopDerivatives&&) noexcept = default;
int LoopDerivatives::rows() const { return implementation_->row_total; }

// State, forces => accelerations and multipliers of (2.11) and (2.12), and their derivatives (28.18).
void LoopDerivatives::evaluate(const State& state, const Forces& forces, const PrescribedMotion& given, double feedback,
                               LoopDynamicsDerivatives& result) {
  Implementation& s = *implementation_;
  DerivativesWorkspace& w = s.workspace;
  ForwardDynamicsDerivatives& d = result.motion;
  LoopDynamicsDerivatives::Multipliers& lambda = result.multipliers;
  w.accelerate_freely(s.model, state, forces, given, "LoopDerivatives::evaluate", d.vdot);
  w.locate_roots(state.q);
  s.locate();
  lambda.value.resize(static_cast<std::size_t>(s.row_total));
  const double size = s.fill_rows(state, d.vdot, feedback, lambda.value);
  s.factor_rows(given.prescribed);
  for (int i = 0; i < s.row_total; ++i) s.rhs[i] = -lambda.value[i];
  const double inconsistent = s.solve();
  std::copy(s.solution.begin(), s.solution.end(), lambda.value.begin());
  Eigen::VectorXd change = s.Y * Eigen::VectorXd::Map(lambda.value.data(), s.row_total);
  for (int i = 0; i < s.n; ++i) d.vdot[i] += change[i];
  w.accelerate({change.data(), static_cast<std::size_t>(s.n)});
  result.rank = s.factor.rank();

  w.differentiate();
  s.locate();  // with the accelerations of the closed loops
  std::vector<double> rest(lambda.value.size());
  result.contradiction = inconsistent / std::max(size, s.fill_rows(state, d.vdot, feedback, rest));
  s.differentiate_rows(feedback);
  s.subtract_reactions(lambda.value);
  w.invert(given.prescribed);
  w.read_forward(d.dq, d.dv, d.dtau);
  result.contradiction_of_derivatives = 0;
  s.close(&s.R_q, d.dq, lambda.dq, result.contradiction_of_derivatives);
  s.close(&s.R_v, d.dv, lambda.dv, result.contradiction_of_derivatives);
  s.close(nullptr, d.dtau, lambda.dtau, result.contradiction_of_derivatives);
  w.wrench_columns(s.model, forces.external, d.dtau, d.dwrench);
  w.wrench_columns(s.model, forces.external, lambda.dtau, lambda.dwrench);
  RowMatrix impulses;
  result.closing_dq.setZero(s.n, s.n);
  s.close(&s.U_q, result.closing_dq, impulses, result.contradiction_of_derivatives);
}

}  // namespace grapnel
