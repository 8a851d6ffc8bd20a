#include "fast_impact/impact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/constraint/pivoted_cholesky.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/impact/yielding_drives.hpp"

namespace grapnel {
namespace {

// As in LoopSolver: smaller pivots of the scaled W indicate redundant rows.
constexpr double kRankTolerance = 1e-12;
// Relative to the size of velocities: smaller relative motion is not corrected again.
constexpr double kRoundingLeft = 4e-16;
constexpr double kSmallest = 1e-300;
// Relative to the size of its terms: the part of a self-stress that reaches a drive, its work on the commanded rates,
// and pivots of dependent self-stresses; as in grapnel/impact/yielding_drives.cpp.
constexpr double kGraspsAlone = 1e-8, kWorkRounding = 1e-13, kDependent = 1e-14;

bool same_grasp(const Grasp& x, const Grasp& y) {
  return x.robot_body == y.robot_body && x.target_body == y.target_body && x.model == y.model;
}

// A grasp as a closure: bodies and kind are fixed, frames are set with each impact. C's z axis is a hinge's axis.
LoopPath make_path(const Model& model, const Grasp& grasp, std::size_t index, int first_row) {
  LoopClosure closure{"grasp " + std::to_string(index + 1),
                      grasp.robot_body,
                      Posed::identity(),
                      grasp.target_body,
                      Posed::identity(),
                      grasp.model};
  LoopPath path = make_loop_path(model, closure);
  path.first_row = first_row;
  return path;
}

// Poses of all links in W.
void link_poses(const Tree<double>& tree, std::span<const LinkScratch<double>> links, std::span<const double> q,
                std::span<Posed> X_WL) {
  using namespace link_motion_steps;
  for (std::size_t n = 0; n < tree.links.size(); ++n) {
    const TreeLink<double>& link = tree.links[n];
    if (link.parent < 0) {
      X_WL[n] = root_motion<double>(link, q, {}).X_WL;
      continue;
    }
    const Posed& X = X_WL[link.parent];
    visit_joint(link, [&](auto joint) {
      if constexpr (!std::is_same_v<decltype(joint), Root>) {
        X_WL[n] = {joint_rotation(joint, links[n], link.rotated ? X.R * link.X_PF.R : X.R), X.p + X.R * links[n].p_PL};
      }
    });
  }
}

// Response of the lone body at C to an impulse about C in C's axes: J_t M_t^-1 J_t^T P.
Twistd response(const LoneBody& body, const Posed& X_bC, const Impulsed& P_C) {
  const Vector3d r = X_bC.p - body.com;
  const Impulsed P = X_bC.R * P_C;
  const Vector3d turn = body.inverse_inertia * (P.angular + cross(r, P.linear));
  return transposed_times(X_bC.R, Twistd{turn, body.inverse_mass * P.linear + cross(turn, r)});
}

// Selects, among all impulses that redundant rows allow, the one with the minimum P^T D P (docs/theory, equation
// (7.8)), from a pivoted factor of W: with a basis N of self-stresses, N^T D N z = -N^T D P and P + N z. No allocation
// after construction.
class LeastImpulse {
 public:
  // For this number of rows.
  explicit LeastImpulse(int rows);

  // Changes `P`, physical impulses per row, by a self-stress of `factor`, whose W is in the rows' units
  // (LoopPath::scale). `targets[k]` is body b of paths[k].
  void choose(const PivotedCholesky& factor, std::span<const LoopPath> paths, std::span<const LoopPlace> places,
              std::span<const LoneBody> targets, std::span<double> P);

 private:
  double& at(std::vector<double>& matrix, int row, int column) {
    return matrix[static_cast<std::size_t>(row * rows_ + column)];
  }
  void multiply_by_metric(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
                          std::span<const LoneBody> targets, std::span<const double> x,
                          std::span<double> product) const;

  int rows_;
  std::vector<double> self_stress_, weighted_;  // N^T and (D N)^T, row-major, as many rows of them as are needed
  std::vector<double> scaled_, right_, z_, ignored_;
  PivotedCholesky small_;
};

LeastImpulse::LeastImpulse(int rows)
    : rows_(rows),
      self_stress_(static_cast<std::size_t>(rows * rows)),
      weighted_(self_stress_),
      scaled_(static_cast<std::size_t>(rows)),
      right_(scaled_),
      z_(scaled_),
      ignored_(scaled_),
      small_(rows) {}

// D x in the rows' units.
void LeastImpulse::multiply_by_metric(std::span<const LoopPath> paths, std::span<const LoopPlace> places,
                                      std::span<const LoneBody> targets, std::span<const double> x,
                                      std::span<double> product) const {
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const LoopPath& path = paths[k];
    Impulsed P = Impulsed::zero();
    for (int r = 0; r < path.angular_count; ++r)
      P.angular += path.angular_scale * x[path.first_row + r] * path.angular_rows[r];
    for (int r = 0; r < 3; ++r) P.linear[r] = path.linear_scale * x[path.first_row + path.angular_count + r];
    const std::span<double> part = product.subspan(path.first_row, path.rows);
    take_rows(path, response(targets[k], places[k].X_bC, P), part);
    for (int r = 0; r < path.rows; ++r) part[r] *= path.scale(r);
  }
}

void LeastImpulse::choose(const PivotedCholesky& factor, std::span<const LoopPath> paths,
                          std::span<const LoopPlace> places, std::span<const LoneBody> targets, std::span<double> P) {
  const int count = rows_ - factor.rank();
  if (count <= 0) return;
  const auto size = static_cast<std::size_t>(rows_);
  for (const LoopPath& path : paths) {
    for (int r = 0; r < path.rows; ++r) scaled_[path.first_row + r] = P[path.first_row + r] / path.scale(r);
  }
  // Rows of `small_` beyond the self-stresses are those of the identity.
  const std::span<double> A = small_.matrix();
  std::fill(A.begin(), A.end(), 0.0);
  for (int k = 0; k < rows_; ++k) A[static_cast<std::size_t>(k * rows_ + k)] = 1, right_[k] = 0;
  for (int k = 0; k < count; ++k) {
    const std::span<double> n = std::span(self_stress_).subspan(k * size, size);
    const std::span<double> Dn = std::span(weighted_).subspan(k * size, size);
    factor.null_vector(k, n);
    multiply_by_metric(paths, places, targets, n, Dn);
    for (int i = 0; i < rows_; ++i) right_[k] -= Dn[i] * scaled_[i];
    for (int l = 0; l <= k; ++l) {
      double sum = 0;
      for (int i = 0; i < rows_; ++i) sum += Dn[i] * at(self_stress_, l, i);
      A[static_cast<std::size_t>(k * rows_ + l)] = A[static_cast<std::size_t>(l * rows_ + k)] = sum;
    }
  }
  small_.factor(0);
  small_.solve(right_, z_, ignored_);
  for (const LoopPath& path : paths) {
    for (int r = 0; r < path.rows; ++r) {
      double sum = 0;
      for (int k = 0; k < count; ++k) sum += at(self_stress_, k, path.first_row + r) * z_[k];
      P[path.first_row + r] += path.scale(r) * sum;
    }
  }
}

// (7.20) for self-stresses of grasps from a pivoted factor of W, in which the held joints have no row. No allocation
// after construction.
class YieldingDrives {
 public:
  YieldingDrives(const Model& model, int rows);

  // Per velocity, to be filled by the caller for every row: what impulse the held velocities take if an impulse of
  // unit size acts in that row, in the units of the factor.
  std::span<double> response(int row) { return std::span(response_).subspan(row * velocities_, velocities_); }

  // Changes `after`, rates of the `held` velocities, by (7.20), with w_g = 0. Returns whether any changed.
  bool yield_to(const PivotedCholesky& factor, std::span<const std::uint8_t> held, std::span<double> after);

 private:
  std::size_t rows_, velocities_;
  std::vector<double> inertia_;   // J_r, per velocity
  std::vector<double> response_;  // rows x velocities
  std::vector<double> stress_;    // S_h, self-stresses x velocities, of unit size in J_r^-1
  std::vector<double> null_, right_, z_, ignored_;
  PivotedCholesky small_;
};

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

bool YieldingDrives::yield_to(const PivotedCholesky& factor, std::span<const std::uint8_t> held,
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
      S[v] = std::abs(sum) > kGraspsAlone * terms ? sum : 0;
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

}  // namespace

struct ImpactSolver::Implementation {
  const Model& model;
  std::vector<Grasp> grasps;
  std::vector<LoopPath> paths;  // X_aC, X_bD and scales of the last impact
  std::vector<LoopPlace> places;
  std::vector<LoneBody> targets;  // per grasp
  std::vector<Rotationd> R_WC;    // per grasp: the identity, or z along the hinge
  LoopColumns columns;
  PivotedCholesky factor;
  LeastImpulse least;
  YieldingDrives drives;
  DynamicsWorkspace<double> workspace;
  std::vector<Posed> X_WL;                                       // per link
  std::vector<double> u, met, rhs, solution, left, scale, rows;  // per row
  std::vector<double> contact;                                   // W, rows x rows
  std::vector<double> zeros, change, force;                      // per velocity
  std::vector<double> velocity, held_impulses, held_change, held_rate;
  std::vector<std::uint8_t> held;
  std::vector<Impulsed> impulses;
  double residual = 0;

  static std::vector<LoopPath> make_paths(const Model& model, std::span<const Grasp> grasps) {
    std::vector<LoopPath> paths;
    int row = 0;
    for (std::size_t k = 0; k < grasps.size(); ++k) {
      paths.push_back(make_path(model, grasps[k], k, row));
      row += paths.back().rows;
    }
    return paths;
  }
  static int count_rows(std::span<const Grasp> grasps) {
    int rows = 0;
    for (const Grasp& g : grasps) rows += row_count(g.model);
    return rows;
  }

  Implementation(const Model& m, std::span<const Grasp> g)
      : model(m),
        grasps(g.begin(), g.end()),
        paths(make_paths(m, g)),
        places(paths.size()),
        R_WC(paths.size(), Rotationd::identity()),
        columns(m.tree(), paths),
        factor(count_rows(g)),
        least(count_rows(g)),
        drives(m, count_rows(g)),
        workspace(m.tree()),
        X_WL(m.tree().links.size()),
        u(static_cast<std::size_t>(count_rows(g))),
        met(u),
        rhs(u),
        solution(u),
        left(u),
        scale(u),
        rows(u),
        contact(u.size() * u.size()),
        zeros(static_cast<std::size_t>(m.velocities())),
        change(zeros),
        force(zeros),
        velocity(zeros),
        held_impulses(zeros),
        held_change(zeros),
        held_rate(zeros),
        held(zeros.size()),
        impulses(paths.size(), Impulsed::zero()) {
    for (const Grasp& grasp : grasps) targets.emplace_back(m.bodies()[grasp.target_body]);
  }

  void check(std::span<const double> q, std::span<const double> v, std::span<const Grasp> now) const {
    if (q.size() != static_cast<std::size_t>(model.coordinates()) || v.size() != zeros.size())
      throw std::invalid_argument("ImpactSolver: the state has another model's size");
    if (!std::equal(now.begin(), now.end(), grasps.begin(), grasps.end(), same_grasp))
      throw std::invalid_argument("ImpactSolver: not the grasps it was made for");
  }

  // Stores the held velocities and their changes.
  void hold(std::span<const double> v, std::span<const HeldRate> rates) {
    std::fill(held.begin(), held.end(), std::uint8_t{0});
    std::fill(held_change.begin(), held_change.end(), 0.0);
    for (const HeldRate& rate : rates) {
      if (rate.velocity < 0 || rate.velocity >= model.velocities())
        throw std::invalid_argument("ImpactSolver: no such velocity to hold");
      held[rate.velocity] = 1;
      held_rate[rate.velocity] = rate.after;
      held_change[rate.velocity] = rate.after - v[rate.velocity];
    }
    for (const TreeLink<double>& link : model.tree().links) {
      const int count = link.joint == JointType::free ? 6 : link.joint == JointType::spherical ? 3 : 0;
      for (int k = 1; k < count; ++k) {
        if (held[link.v + k] != held[link.v])
          throw std::invalid_argument(
              "ImpactSolver: a free root or a spherical joint is held as a whole or not at all");
      }
    }
  }

  // Sets the frames of the grasps on both bodies, and the units of their rows.
  void place_grasps(std::span<const double> q, std::span<const Grasp> now) {
    link_poses(model.tree(), workspace.links, q, X_WL);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      LoopPath& path = paths[k];
      if (path.model == GraspModel::hinge) R_WC[k] = rotation_between({0, 0, 1}, now[k].hinge_W);
      const auto in_link = [&](int link) {
        return Posed{transpose(X_WL[link].R) * R_WC[k], transposed_times(X_WL[link].R, now[k].p_WC - X_WL[link].p)};
      };
      path.X_aC = in_link(path.link_a);
      path.X_bD = places[k].X_bC = in_link(path.link_b);
      targets[k].scale_rows(path.X_bD.p, path);
      for (int r = 0; r < path.rows; ++r) scale[path.first_row + r] = path.scale(r);
    }
  }

  // Twists of the links.
  void move_links(std::span<const double> v) {
    using namespace recursion;
    const Tree<double>& tree = model.tree();
    for (std::size_t n = 0; n < tree.links.size(); ++n) {
      const TreeLink<double>& link = tree.links[n];
      LinkScratch<double>& w = workspace.links[n];
      visit_joint(link, [&](auto joint) {
        if constexpr (std::is_same_v<decltype(joint), Root>) {
          w.V = root_velocity(link, v);
        } else {
          w.V = motion_to_link(joint, link, w, workspace.links[link.parent].V);
          add_joint_motion(joint, link, v, w.V);
        }
      });
    }
  }

  // Scaled W, factored.
  void factor_contact_inertia(const DynamicsInput<double>& in) {
    columns.carry(paths, places, workspace, in);
    columns.contact_inertia(contact);
    const std::span<double> A = factor.matrix();
    const std::size_t n = u.size();
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) A[i * n + j] = scale[i] * scale[j] * contact[i * n + j];
    }
    factor.factor(kRankTolerance);
  }

  // If redundant grasps contradict held joints, drives are overpowered: changes the held rates. The links are at rest
  // afterwards. Call after factor_contact_inertia().
  void let_drives_give_way(DynamicsInput<double> in, std::span<const double> v) {
    in.acceleration = zeros;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      rest();
      std::fill(solution.begin(), solution.end(), 0.0);
      solution[r] = scale[r];
      columns.impose(solution, in.prescribed, workspace);
      articulated_accelerations<double>(model.tree(), in, workspace, change, force);
      std::copy(force.begin(), force.end(), drives.response(static_cast<int>(r)).begin());
    }
    if (!drives.yield_to(factor, held, held_rate)) return;
    for (std::size_t i = 0; i < held.size(); ++i) held_change[i] = held[i] != 0 ? held_rate[i] - v[i] : 0;
  }

  // u- in `met`, in `u` with what held joints alone make of it; returns the scaled size of the terms.
  double approach(bool holding) {
    double size = 0;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const Twistd &V_a = workspace.links[path.link_a].V, &V_b = workspace.links[path.link_b].V;
      take_rows(path, relative_motion(path, places[k], V_a, V_b), std::span(met).subspan(path.first_row, path.rows));
      size = std::max({size, path.angular_scale * (norm(V_a.angular) + norm(V_b.angular)),
                       path.linear_scale * (norm(V_a.linear) + norm(V_b.linear))});
    }
    std::copy(met.begin(), met.end(), u.begin());
    if (!holding) return size;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const auto &alone = columns.free_acceleration(k).r, &squares = columns.free_acceleration_squares(k).r;
      for (int r = 0; r < paths[k].rows; ++r) {
        u[paths[k].first_row + r] += alone[r];
        size = std::max(size, paths[k].scale(r) * std::sqrt(squares[r]));
      }
    }
    return size;
  }

  // `solution` with W solution = -u.
  void solve_rows() {
    for (std::size_t i = 0; i < u.size(); ++i) rhs[i] = -scale[i] * u[i];
    factor.solve(rhs, solution, left);
    for (std::size_t i = 0; i < u.size(); ++i) solution[i] *= scale[i];
  }

  // Applies the impulses `solution`: adds their effect to velocities and to u. `in`: other loads.
  void respond(const DynamicsInput<double>& in) {
    columns.impose(solution, in.prescribed, workspace);
    articulated_accelerations<double>(model.tree(), in, workspace, change, force);
    for (std::size_t i = 0; i < velocity.size(); ++i) velocity[i] += change[i];
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i] += solution[i];
    if (!in.prescribed.empty()) {
      for (std::size_t i = 0; i < force.size(); ++i) held_impulses[i] += in.prescribed[i] != 0 ? force[i] : 0;
    }
  }

  // Links as articulated_inertias() leaves them if nothing acts and nothing is prescribed to move.
  void rest() {
    for (LinkScratch<double>& w : workspace.links) {
      w.g = 0, w.p = Wrenchd::zero();
      w.bias = SpatialAccelerationd::zero();
    }
  }

  // Remaining relative motion after respond(): the largest scaled row.
  double meet() {
    double most = 0;
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      double more[6];
      take_rows(path, relative_motion(path, places[k], workspace.links[path.link_a].A, workspace.links[path.link_b].A),
                more);
      for (int r = 0; r < path.rows; ++r) {
        const double x = std::abs(path.scale(r) * (met[path.first_row + r] += more[r]));
        if (!(x <= most)) most = x;
      }
    }
    return most;
  }

  void report() {
    for (std::size_t k = 0; k < paths.size(); ++k) {
      const LoopPath& path = paths[k];
      const double* P = &rows[path.first_row];
      Impulsed P_C = Impulsed::zero();
      for (int r = 0; r < path.angular_count; ++r) P_C.angular += P[r] * path.angular_rows[r];
      for (int r = 0; r < 3; ++r) P_C.linear[r] = P[path.angular_count + r];
      impulses[k] = R_WC[k] * P_C;
    }
  }
};

ImpactSolver::ImpactSolver(const Model& model, std::span<const Grasp> grasps)
    : implementation_(std::make_unique<Implementation>(model, grasps)) {}
ImpactSolver::~ImpactSolver() = default;
ImpactSolver::ImpactSolver(ImpactSolver&&) noexcept = default;
ImpactSolver& ImpactSolver::operator=(ImpactSolver&&) noexcept = default;

void ImpactSolver::solve(std::span<const double> q, std::span<const double> v, std::span<const Grasp> grasps,
                         std::span<const HeldRate> held) {
  Implementation& s = *implementation_;
  s.check(q, v, grasps);
  const bool holding = !held.empty();
  if (holding) s.hold(v, held);
  // Impulses and changes of velocity stand where the recursion has forces and accelerations, at rest.
  DynamicsInput<double> in;
  in.q = q, in.v = s.zeros, in.force = s.zeros;
  if (holding) in.prescribed = s.held, in.acceleration = s.held_change;
  articulated_inertias<double>(s.model.tree(), in, s.workspace);
  s.place_grasps(q, grasps);
  s.factor_contact_inertia(in);
  if (holding && s.factor.rank() < s.factor.size()) {
    s.let_drives_give_way(in, v);
    articulated_inertias<double>(s.model.tree(), in, s.workspace);
    s.factor_contact_inertia(in);
  }
  s.move_links(v);
  const double size = s.approach(holding);
  std::copy(v.begin(), v.end(), s.velocity.begin());
  std::fill(s.rows.begin(), s.rows.end(), 0.0);
  std::fill(s.held_impulses.begin(), s.held_impulses.end(), 0.0);
  s.solve_rows();
  s.respond(in);
  double left = s.meet();
  if (left > kRoundingLeft * size) {
    // Solves once more for the rounding error.
    std::copy(s.met.begin(), s.met.end(), s.u.begin());
    s.rest();
    in.acceleration = s.zeros;
    s.solve_rows();
    s.respond(in);
    left = s.meet();
  }
  s.residual = left / std::max(size, kSmallest);
  for (const HeldRate& rate : held) s.velocity[rate.velocity] = s.held_rate[rate.velocity];  // exactly
  s.least.choose(s.factor, s.paths, s.places, s.targets, s.rows);
  s.report();
}

std::span<const double> ImpactSolver::velocity() const { return implementation_->velocity; }
std::span<const Impulsed> ImpactSolver::impulses() const { return implementation_->impulses; }
std::span<const double> ImpactSolver::held_impulses() const { return implementation_->held_impulses; }
int ImpactSolver::rank() const { return implementation_->factor.rank(); }
int ImpactSolver::rows() const { return static_cast<int>(implementation_->rows.size()); }
double ImpactSolver::constraint_residual() const { return implementation_->residual; }

}  // namespace grapnel
