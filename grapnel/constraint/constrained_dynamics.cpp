#include "grapnel/constraint/constrained_dynamics.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/constraint/loop_limits.hpp"
#include "grapnel/constraint/pivoted_cholesky.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/model/coupling.hpp"

namespace grapnel {
namespace {

using namespace loop_limits;

// Relative to the size of velocities: smaller closure motion is not corrected again.
constexpr double kRounding = 4e-16;

}  // namespace

struct LoopSolver::Implementation {
  const Model& model;
  std::vector<LoopClosure> closures;
  std::vector<LoopPath> paths;
  std::vector<LoopPlace> places;
  std::vector<CouplingPath> couplings;
  LoopColumns columns;
  PivotedCholesky factor;
  int row_total;
  std::vector<double> u, work;                         // per row: motion to be removed
  std::vector<double> rhs, solution, residual, scale;  // per row, for the factorization
  std::vector<double> rows;                            // multipliers or impulses
  std::vector<double> zeros, step, contact;            // per velocity, likewise; rows x rows
  std::vector<double> ignored_force, last_q, last_v;
  double contradiction = 0;
  int contradicting = 0;

  static std::vector<LoopPath> make_paths(const Model& model, std::span<const LoopClosure> closures) {
    std::vector<LoopPath> paths;
    int row = 0;
    for (const LoopClosure& closure : closures) {
      paths.push_back(make_loop_path(model, closure));
      paths.back().first_row = row;
      row += paths.back().rows;
    }
    return paths;
  }

  Implementation(const Model& m, std::span<const LoopClosure> c)
      : model(m),
        closures(c.begin(), c.end()),
        paths(make_paths(m, c)),
        places(paths.size()),
        couplings(make_coupling_paths(m, closure_rows(c))),
        columns(m.tree(), paths, couplings),
        factor(closure_rows(c) + static_cast<int>(couplings.size())),
        row_total(factor.size()),
        u(static_cast<std::size_t>(row_total)),
        work(u),
        rhs(u),
        solution(u),
        residual(u),
        scale(u),
        rows(u),
        zeros(static_cast<std::size_t>(m.velocities())),
        step(zeros),
        contact(u.size() * u.size()),
        ignored_force(zeros),
        last_q(static_cast<std::size_t>(m.coordinates())),
        last_v(zeros) {
    for (const LoopPath& path : paths) {
      for (int r = 0; r < path.rows; ++r) scale[path.first_row + r] = path.scale(r);
    }
    for (const CouplingPath& coupling : couplings) scale[coupling.row] = coupling.scale;
  }

  std::span<double> part(std::vector<double>& all, const LoopPath& path) {
    return std::span<double>(all).subspan(path.first_row, path.rows);
  }

  void locate_all(const std::vector<LinkScratch<double>>& links, std::span<const double> q) {
    for (std::size_t k = 0; k < paths.size(); ++k) places[k] = locate(paths[k], model.tree(), links, q);
  }

  void close_positions(std::span<const std::uint8_t> prescribed, Workspace& workspace, std::span<double> q,
                       std::span<const double> v);
  std::pair<double, double> close_velocities(std::span<const std::uint8_t> prescribed, Workspace& workspace,
                                             std::span<const double> q, std::span<double> v);

  // Factors the scaled W for the articulated inertias in `workspace`.
  void prepare(const DynamicsWorkspace<double>& workspace, const DynamicsInput<double>& in) {
    locate_all(workspace.links, in.q);
    columns.carry(paths, places, workspace, in);
    columns.contact_inertia(contact);
    const std::span<double> A = factor.matrix();
    for (int i = 0; i < row_total; ++i) {
      for (int j = 0; j < row_total; ++j) {
        const std::size_t at = static_cast<std::size_t>(i * row_total + j);
        A[at] = scale[i] * scale[j] * contact[at];
      }
    }
    factor.factor(kRankTolerance);
  }

  // Solves W rows = -u for `rows`; `size` is the scaled magnitude of the terms of the sum u.
  void solve(double size) {
    for (int i = 0; i < row_total; ++i) rhs[i] = -scale[i] * u[i];
    factor.solve(rhs, solution, residual);
    contradiction = 0;
    for (int i = 0; i < row_total; ++i) {
      rows[i] = scale[i] * solution[i];
      const double share = std::abs(residual[i]) / std::max(size, kSmallest);
      if (!(share <= contradiction)) contradiction = share, contradicting = i;
    }
  }

  // Rows of the relative twist, and the magnitude of its terms; `links` have their twists at v.
  double velocity_rows(const std::vector<LinkScratch<double>>& links, std::span<const double> v,
                       std::vector<double>& out) {
    double size = 0;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const Twistd &V_a = links[path.link_a].V, &V_b = links[path.link_b].V;
      const Twistd relative = relative_motion(path, places[k], V_a, V_b);
      take_rows(path, relative, part(out, path));
      size = std::max({size, path.angular_scale * (norm(V_a.angular) + norm(V_b.angular)),
                       path.linear_scale * (norm(V_a.linear) + norm(V_b.linear))});
    }
    for (const CouplingPath& coupling : couplings) {
      out[coupling.row] = coupling_motion(coupling, v);
      size = std::max(size, coupling.scale * coupling_motion_size(coupling, v, 0));
    }
    return size;
  }

  // Scaled magnitude of the accelerations of the closures' bodies, gravity included, and of the coupled joints, bounded
  // below by the negligible acceleration.
  double acceleration_size(const std::vector<LinkScratch<double>>& links, std::span<const double> vdot) const {
    double size = 0;
    for (const LoopPath& path : paths) {
      for (int link : {path.link_a, path.link_b}) {
        const SpatialAccelerationd& A = links[link].A;
        size = std::max({size, path.angular_scale * std::max(norm(A.angular), kUnnoticed),
                         path.linear_scale * std::max(norm(A.linear), kUnnoticed)});
      }
    }
    for (const CouplingPath& coupling : couplings)
      size = std::max(size, coupling.scale * coupling_motion_size(coupling, vdot, kUnnoticed));
    return size;
  }

  // Rows of the relative acceleration due to forces alone, and the magnitude of its terms.
  double acceleration_rows(const std::vector<LinkScratch<double>>& links, std::vector<double>& out) {
    double size = 0;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const LinkScratch<double>&a = links[path.link_a], &b = links[path.link_b];
      // The components of V_D in C change by A_D - V_C x V_D.                                               (8.5)
      const Twistd V_C = transposed_times(path.X_aC.R, shift(a.V, path.X_aC.p));
      const Twistd V_D = transposed_times(places[k].X_bC.R, shift(b.V, places[k].X_bC.p));
      double turning[6];
      take_rows(path, cross_motion(V_C, V_D), turning);
      const auto &free = columns.free_acceleration(k).r, &squares = columns.free_acceleration_squares(k).r;
      double most = 0;
      for (int r = 0; r < path.rows; ++r) {
        out[path.first_row + r] = free[r] + turning[r];
        const double s = path.scale(r);
        most = std::max(most, s * s * (squares[r] + turning[r] * turning[r]));
      }
      size = std::max(size, std::sqrt(most));
    }
    for (std::size_t k = 0; k < couplings.size(); ++k) {
      out[couplings[k].row] = columns.coupled_acceleration(k).r[0];
      size = std::max(size, couplings[k].scale * std::sqrt(columns.coupled_acceleration_squares(k).r[0]));
    }
    return size;
  }

  DynamicsInput<double> at_rest(std::span<const double> q, std::span<const std::uint8_t> prescribed) const {
    DynamicsInput<double> in;
    in.q = q, in.v = zeros, in.force = zeros, in.prescribed = prescribed, in.acceleration = zeros;
    return in;
  }

  // Articulated inertias and the factor of W at q; twists of links at v.
  void refresh(std::span<const double> q, std::span<const double> v, std::span<const std::uint8_t> prescribed,
               Workspace& workspace) {
    const DynamicsInput<double> in = at_rest(q, prescribed);
    articulated_inertias<double>(model.tree(), in, workspace.kernel);
    prepare(workspace.kernel, in);
    move_all({}, v, workspace.kernel.links);
  }

  // Changes of velocities `step` and of link twists (their A) due to impulses `rows`, after refresh().
  void respond(std::span<const double> q, std::span<const std::uint8_t> prescribed, Workspace& workspace) {
    columns.release(workspace.kernel);
    columns.impose(rows, prescribed, workspace.kernel);
    articulated_accelerations<double>(model.tree(), at_rest(q, prescribed), workspace.kernel, step, ignored_force);
  }

  // Twists of links at v; with q also their angles and offsets, and the poses of the closures. Articulated inertias are
  // unchanged.
  void move_all(std::span<const double> q, std::span<const double> v, std::vector<LinkScratch<double>>& links) {
    using namespace recursion;
    const Tree<double>& tree = model.tree();
    for (std::size_t n = 0; n < tree.links.size(); ++n) {
      const TreeLink<double>& link = tree.links[n];
      LinkScratch<double>& w = links[n];
      visit_joint(link, [&](auto joint) {
        if constexpr (kIsRoot<decltype(joint)>) {
          w.V = root_velocity(link, v);
        } else if (q.empty()) {
          move(joint, link, v, links[link.parent].V, w);
        } else {
          follow(joint, link, q, v, links[link.parent].V, w);
        }
      });
    }
    if (!q.empty()) locate_all(links, q);
  }

  // Maximum defects over the closures from poses and twists, and over the couplings at q and v.
  ClosureDefect defects(const std::vector<LinkScratch<double>>& links, std::span<const double> q,
                        std::span<const double> v) const {
    ClosureDefect largest;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      double e[6], slip[6];
      position_rows(path, places[k], e);
      const Twistd relative = relative_motion(path, places[k], links[path.link_a].V, links[path.link_b].V);
      take_rows(path, relative, slip);
      const auto size = [](const double* x, int count) {
        double sum = 0;
        for (int i = 0; i < count; ++i) sum += x[i] * x[i];
        return std::sqrt(sum);
      };
      largest.raise({size(e + path.angular_count, path.linear_count()), size(e, path.angular_count),
                     size(slip + path.angular_count, path.linear_count()), size(slip, path.angular_count)});
    }
    for (const CouplingPath& coupling : couplings) {
      const double position = std::abs(coupling_position(coupling, q)), rate = std::abs(coupling_motion(coupling, v));
      largest.raise(coupling.slides ? ClosureDefect{position, 0, rate, 0} : ClosureDefect{0, position, 0, rate});
    }
    return largest;
  }

  void place_rows(std::span<const double> q, std::vector<double>& e) {
    for (std::size_t k = 0; k < paths.size(); ++k) position_rows(paths[k], places[k], part(e, paths[k]));
    for (const CouplingPath& coupling : couplings) e[coupling.row] = coupling_position(coupling, q);
  }

  // Relative motion that remains after the change by respond() and `sum`.
  void changed_rows(const std::vector<LinkScratch<double>>& links, std::vector<double>& sum) {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      double more[6];
      take_rows(path, relative_motion(path, places[k], links[path.link_a].A, links[path.link_b].A), more);
      for (int r = 0; r < path.rows; ++r) sum[path.first_row + r] += more[r];
    }
    for (const CouplingPath& coupling : couplings) sum[coupling.row] += coupling_motion(coupling, step);
  }

  void add_step(std::span<double> v) const {
    for (std::size_t i = 0; i < step.size(); ++i) v[i] += step[i];
  }

  double scaled_size(const std::vector<double>& x_rows) const {
    double most = 0;
    for (int i = 0; i < row_total; ++i) {
      const double x = std::abs(scale[i] * x_rows[i]);
      if (!(x <= most)) most = x;
    }
    return most;
  }
};

LoopSolver::LoopSolver(const Model& model, std::span<const LoopClosure> closures)
    : implementation_(std::make_unique<Implementation>(model, closures)) {}
LoopSolver::~LoopSolver() = default;
LoopSolver::LoopSolver(LoopSolver&&) noexcept = default;
LoopSolver& LoopSolver::operator=(LoopSolver&&) noexcept = default;

// Closures, and results of the last solution.
const std::vector<LoopClosure>& LoopSolver::closures() const { return implementation_->closures; }
int LoopSolver::rows() const { return implementation_->row_total; }
std::span<const double> LoopSolver::multipliers() const { return implementation_->rows; }
std::span<const double> LoopSolver::coupling_multipliers() const {
  return multipliers().last(implementation_->couplings.size());
}
int LoopSolver::rank() const { return implementation_->factor.rank(); }
double LoopSolver::contradiction() const { return implementation_->contradiction; }
double LoopSolver::min_pivot() const { return implementation_->factor.min_pivot(); }

// Last solution => name of the row with the largest contradiction: closure, kind of motion and axis.
std::string LoopSolver::contradicting_row() const {
  const Implementation& s = *implementation_;
  for (std::size_t k = 0; k < s.paths.size(); ++k) {
    const LoopPath& path = s.paths[k];
    const int row = s.contradicting - path.first_row;
    if (row < 0 || row >= path.rows) continue;
    static constexpr const char* kAxes[] = {"x", "y", "z"};
    const bool turning = row < path.angular_count;
    return s.closures[k].name + (turning ? ", rotation about " : ", along ") +
           (turning && turns_about_axis(path.model)
                ? "a normal of the hinge"
                : std::string(kAxes[turning ? row : row - path.angular_count]) + " of the grasp");
  }
  for (std::size_t k = 0; k < s.couplings.size(); ++k) {
    if (s.couplings[k].row != s.contradicting) continue;
    const Body& dependent = s.model.bodies()[dependent_body(s.model.couplings()[k])];
    return "the coupling of joint '" + dependent.description.joint.name + "'";
  }
  return {};
}

Eigen::MatrixXd LoopSolver::self_stresses() const {
  const Implementation& s = *implementation_;
  Eigen::MatrixXd basis(s.row_total, s.row_total - s.factor.rank());
  std::vector<double> x(s.u.size());
  for (Eigen::Index k = 0; k < basis.cols(); ++k) {
    s.factor.null_vector(static_cast<int>(k), x);
    for (int i = 0; i < s.row_total; ++i) basis(i, k) = s.scale[i] * x[i];
  }
  return basis;
}

// Transfers a wrench on one side of a closure from joint to joint to the common ancestor of both sides, by (8.6); the
// efforts are those that balance it.
LoopSolver::JointEfforts LoopSolver::self_stress_efforts(const Workspace& workspace) const {
  const Implementation& s = *implementation_;
  const Tree<double>& tree = s.model.tree();
  const Eigen::MatrixXd basis = self_stresses();
  JointEfforts out;
  out.effort = out.terms = Eigen::MatrixXd::Zero(s.model.velocities(), basis.cols());
  for (Eigen::Index column = 0; column < basis.cols(); ++column) {
    double moment = 0, thrust = 0;  // maxima over the joints
    const auto climb = [&](const std::vector<int>& links, Wrenchd F) {
      for (const int n : links) {
        const TreeLink<double>& link = tree.links[n];
        const LinkScratch<double>& w = workspace.kernel.links[n];
        recursion::visit_joint(link, [&](auto joint) {
          if constexpr (recursion::OneAxis<decltype(joint)>) {
            out.effort(link.v, column) -= link.sign * recursion::along(joint, F);
            moment = std::max(moment, norm(F.angular)), thrust = std::max(thrust, norm(F.linear));
          }
          if constexpr (!recursion::kIsRoot<decltype(joint)>) F = recursion::force_to_parent(joint, link, w, F);
        });
      }
    };
    for (std::size_t k = 0; k < s.paths.size(); ++k) {
      const LoopPath& path = s.paths[k];
      Wrenchd F = Wrenchd::zero();
      for (int r = 0; r < path.angular_count; ++r)
        F.angular += basis(path.first_row + r, column) * path.angular_rows[r];
      for (int r = 0; r < path.linear_count(); ++r)
        F.linear[r] = basis(path.first_row + path.angular_count + r, column);
      climb(path.from_a, shift(path.X_aC.R * F, -path.X_aC.p));
      climb(path.from_b, shift(s.places[k].X_bC.R * (-1.0 * F), -s.places[k].X_bC.p));
    }
    for (const CouplingPath& coupling : s.couplings) {
      for (const CouplingPath::Joint& joint : coupling.joints) {
        const double effort = joint.factor * basis(coupling.row, column);
        out.effort(joint.v, column) -= effort;
        double& most = tree.links[joint.link].joint == JointType::prismatic ? thrust : moment;
        most = std::max(most, std::abs(effort));
      }
    }
    // Values in an arm without self-stress are rounding errors: they are judged relative to the whole.
    for (const TreeLink<double>& link : tree.links) {
      if (link.joint == JointType::revolute) out.terms(link.v, column) = moment;
      if (link.joint == JointType::prismatic) out.terms(link.v, column) = thrust;
    }
  }
  return out;
}

Eigen::MatrixXd LoopSolver::contact_inertia() const {
  const Implementation& s = *implementation_;
  Eigen::MatrixXd W(s.row_total, s.row_total);
  std::copy(s.contact.begin(), s.contact.end(), W.data());  // symmetric
  return W;
}

// Inputs of the recursion => vdot and generalized forces with closures, by the range-space method: W lambda = -(J M^-1
// phi + Jdot v) (2.11), then vdot by (2.12).
void LoopSolver::accelerations(const DynamicsInput<double>& in, double feedback, Workspace& workspace,
                               std::span<double> vdot, std::span<double> force) {
  Implementation& s = *implementation_;
  std::vector<LinkScratch<double>>& links = workspace.kernel.links;
  if (s.row_total == 0) {
    articulated_body<double>(s.model.tree(), in, workspace.kernel, vdot, force);
    return;
  }
  articulated_inertias<double>(s.model.tree(), in, workspace.kernel);
  s.prepare(workspace.kernel, in);
  const double size = s.acceleration_rows(links, s.u);  // J I^-1 phi + Jdot v
  if (feedback > 0) {
    s.velocity_rows(links, in.v, s.work);
    for (int i = 0; i < s.row_total; ++i) s.u[i] += 2 * feedback * s.work[i];
    s.place_rows(in.q, s.work);
    for (int i = 0; i < s.row_total; ++i) s.u[i] += feedback * feedback * s.work[i];
  }
  s.solve(size);  // (2.11)
  // (2.12) and the tree's own accelerations in one sweep. Roots keep the wrench that their articulated equation needs;
  // the wrench on a held or fixed root is computed from it.
  s.columns.impose(s.rows, in.prescribed, workspace.kernel);
  articulated_accelerations<double>(s.model.tree(), in, workspace.kernel, vdot, force);
  // Between immovable bodies, such as braked joints, the terms cancel and their magnitudes are meaningless; the
  // accelerations of the two sides are used instead.
  s.contradiction *= std::max(size, kSmallest) / std::max(size, s.acceleration_size(links, vdot));
}

// Coordinates and velocities => velocities on the closures, by the plastic impact v - M^-1 J^T W^+ J v with one
// iterative refinement.
void LoopSolver::close_velocities(std::span<const double> q, std::span<const std::uint8_t> prescribed,
                                  Workspace& workspace, std::span<double> v) {
  Implementation& s = *implementation_;
  if (s.row_total == 0) return;
  std::vector<LinkScratch<double>>& links = workspace.kernel.links;
  s.refresh(q, v, prescribed, workspace);
  const double size = s.velocity_rows(links, v, s.u);
  s.solve(size);
  s.respond(q, prescribed, workspace);
  s.add_step(v);
  s.changed_rows(links, s.u);
  if (s.scaled_size(s.u) <= kRounding * size) return;
  // Solves once more for the rounding error.
  const double contradiction = s.contradiction;
  std::copy(s.rows.begin(), s.rows.end(), s.work.begin());
  s.solve(size);
  s.respond(q, prescribed, workspace);
  s.add_step(v);
  for (int i = 0; i < s.row_total; ++i) s.rows[i] += s.work[i];
  s.contradiction = contradiction;
}

// Newton's method for coordinates, with the same factor while defects are small (8.9).
void LoopSolver::Implementation::close_positions(std::span<const std::uint8_t> prescribed, Workspace& workspace,
                                                 std::span<double> q, std::span<const double> v) {
  std::vector<LinkScratch<double>>& links = workspace.kernel.links;
  place_rows(q, u);
  double defect = scaled_size(u);
  for (int i = 0; i < kMaxIterations && defect > 0; ++i) {
    if (i > 0 && defect > kRefactorBeyond) refresh(q, v, prescribed, workspace);
    solve(1);
    respond(q, prescribed, workspace);
    std::copy(q.begin(), q.end(), last_q.begin());
    step_coordinates(model.tree(), step, q);
    move_all(q, v, links);
    place_rows(q, u);
    const double next = scaled_size(u);
    if (!(next < 0.5 * defect)) {  // converged or stalled
      if (!(next < defect)) {
        std::copy(last_q.begin(), last_q.end(), q.begin());
        move_all(q, v, links);
      }
      break;
    }
    defect = next;
  }
}

// The plastic impact that closes the loops (8.10) => size of the velocity rows before it, and their defect after it.
std::pair<double, double> LoopSolver::Implementation::close_velocities(std::span<const std::uint8_t> prescribed,
                                                                       Workspace& workspace, std::span<const double> q,
                                                                       std::span<double> v) {
  std::vector<LinkScratch<double>>& links = workspace.kernel.links;
  const double size = velocity_rows(links, v, u);
  double defect = scaled_size(u);
  for (int i = 0; i < kMaxIterations && defect > 0; ++i) {
    solve(1);
    std::copy(v.begin(), v.end(), last_v.begin());
    respond(q, prescribed, workspace);
    add_step(v);
    move_all({}, v, links);
    velocity_rows(links, v, u);
    const double next = scaled_size(u);
    if (!(next < 0.5 * defect)) {
      if (!(next < defect)) {
        std::copy(last_v.begin(), last_v.end(), v.begin());
        move_all({}, v, links);
      }
      break;
    }
    defect = next;
  }
  return {size, defect};
}

// State => state on the closures: Newton's method for coordinates (8.9), then the plastic impact for velocities (8.10),
// both in the mass metric.
ProjectionResult LoopSolver::project(std::span<const std::uint8_t> prescribed, Workspace& workspace,
                                     std::span<double> q, std::span<double> v, double negligible) {
  Implementation& s = *implementation_;
  ProjectionResult result;
  result.converged = true;
  if (s.row_total == 0) return result;
  std::vector<LinkScratch<double>>& links = workspace.kernel.links;
  s.refresh(q, v, prescribed, workspace);
  result.before = result.after = s.defects(links, q, v);
  const ClosureDefect& d = result.before;
  if (std::max({d.position, d.angle, d.velocity, d.angular_velocity}) <= negligible) return result;
  result.changed = true;

  s.close_positions(prescribed, workspace, q, v);
  const auto [size, defect] = s.close_velocities(prescribed, workspace, q, v);
  result.after = s.defects(links, q, v);
  result.converged = result.after.position <= kClosed && result.after.angle <= kClosed;
  s.contradiction = 0;
  if (defect > kContradiction * size) {  // prescribed joints leave no compatible velocity
    s.velocity_rows(links, v, s.u);
    s.solve(size);
    result.converged = result.converged && s.contradiction <= kContradiction;
  }
  return result;
}

}  // namespace grapnel
