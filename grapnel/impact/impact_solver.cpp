#include "grapnel/impact/impact_solver.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "grapnel/constraint/loop_columns.hpp"
#include "grapnel/constraint/pivoted_cholesky.hpp"
#include "grapnel/dynamics/recursion.hpp"
#include "grapnel/impact/least_impulse.hpp"
#include "grapnel/impact/yielding_drives.hpp"

namespace grapnel {
namespace {

// As for LoopSolver: pivots of the scaled W below this are redundant rows.
constexpr double kRankTolerance = 1e-12;
// Of the size of velocities: what is left of the relative motion is not solved for again.
constexpr double kRoundingLeft = 4e-16;
constexpr double kSmallest = 1e-300;

bool same_grip(const Grasp& x, const Grasp& y) {
  return x.robot_body == y.robot_body && x.target_body == y.target_body && x.model == y.model;
}

// A grip as a closure: only bodies and kind matter, frames come with each impact. C's z axis is a hinge's.
LoopPath make_path(const Model& model, const Grasp& grip, std::size_t index, int first_row) {
  LoopClosure closure{"grip " + std::to_string(index + 1),
                      grip.robot_body,
                      Posed::identity(),
                      grip.target_body,
                      Posed::identity(),
                      grip.model};
  LoopPath path = make_loop_path(model, closure);
  path.first_row = first_row;
  return path;
}

}  // namespace

struct ImpactSolver::Implementation {
  const Model& model;
  std::vector<Grasp> grips;
  std::vector<LoopPath> paths;  // X_aC, X_bD and scales of the last impact
  std::vector<LoopPlace> places;
  std::vector<LoneBody> targets;  // per grip
  std::vector<Rotationd> R_WC;    // per grip: the identity, or z along the hinge
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

  static std::vector<LoopPath> make_paths(const Model& model, std::span<const Grasp> grips) {
    std::vector<LoopPath> paths;
    int row = 0;
    for (std::size_t k = 0; k < grips.size(); ++k) {
      paths.push_back(make_path(model, grips[k], k, row));
      row += paths.back().rows;
    }
    return paths;
  }
  static int count_rows(std::span<const Grasp> grips) {
    int rows = 0;
    for (const Grasp& g : grips) rows += row_count(g.model);
    return rows;
  }

  Implementation(const Model& m, std::span<const Grasp> g)
      : model(m),
        grips(g.begin(), g.end()),
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
    for (const Grasp& grip : grips) targets.emplace_back(m.bodies()[grip.target_body]);
  }

  void check(std::span<const double> q, std::span<const double> v, std::span<const Grasp> now) const {
    if (q.size() != static_cast<std::size_t>(model.coordinates()) || v.size() != zeros.size())
      throw std::invalid_argument("ImpactSolver: the state has another model's size");
    if (!std::equal(now.begin(), now.end(), grips.begin(), grips.end(), same_grip))
      throw std::invalid_argument("ImpactSolver: not the grips it was made for");
  }

  // Marks what is held and by how much its velocity changes.
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
      const int count = link.joint == LinkJoint::root_free ? 6 : link.joint == LinkJoint::spherical ? 3 : 0;
      for (int k = 1; k < count; ++k) {
        if (held[link.v + k] != held[link.v])
          throw std::invalid_argument(
              "ImpactSolver: a free root or a spherical joint is held as a whole or not at all");
      }
    }
  }

  // Frames of the grips on both bodies, and the units of their rows.
  void place_grips(std::span<const double> q, std::span<const Grasp> now) {
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
    columns.carry(paths, places, workspace.links, in);
    columns.contact_inertia(contact);
    const std::span<double> A = factor.matrix();
    const std::size_t n = u.size();
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) A[i * n + j] = scale[i] * scale[j] * contact[i * n + j];
    }
    factor.factor(kRankTolerance);
  }

  // Where grips are redundant and contradict what is held drives give way: changes what is held. Links then are at
  // rest. After factor_contact_inertia().
  void let_drives_give_way(DynamicsInput<double> in, std::span<const double> v) {
    in.acceleration = zeros;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      rest();
      std::fill(solution.begin(), solution.end(), 0.0);
      solution[r] = scale[r];
      columns.impose(solution, in.prescribed, workspace.links);
      articulated_accelerations<double>(model.tree(), in, workspace, change, force);
      std::copy(force.begin(), force.end(), drives.response(static_cast<int>(r)).begin());
    }
    if (!drives.give_way(factor, held, held_rate)) return;
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

  // Impulses `solution` act: adds to velocities, and to u what they do to it. `in`: what else acts.
  void respond(const DynamicsInput<double>& in) {
    columns.impose(solution, in.prescribed, workspace.links);
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

  // What is met after respond(): the largest scaled row.
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

ImpactSolver::ImpactSolver(const Model& model, std::span<const Grasp> grips)
    : implementation_(std::make_unique<Implementation>(model, grips)) {}
ImpactSolver::~ImpactSolver() = default;
ImpactSolver::ImpactSolver(ImpactSolver&&) noexcept = default;
ImpactSolver& ImpactSolver::operator=(ImpactSolver&&) noexcept = default;

void ImpactSolver::solve(std::span<const double> q, std::span<const double> v, std::span<const Grasp> grips,
                         std::span<const HeldRate> held) {
  Implementation& s = *implementation_;
  s.check(q, v, grips);
  const bool holding = !held.empty();
  if (holding) s.hold(v, held);
  // Impulses and changes of velocity stand where the recursion has forces and accelerations, at rest.
  DynamicsInput<double> in;
  in.q = q, in.v = s.zeros, in.force = s.zeros;
  if (holding) in.prescribed = s.held, in.acceleration = s.held_change;
  articulated_inertias<double>(s.model.tree(), in, s.workspace);
  s.place_grips(q, grips);
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
    // What rounding left is solved for once more.
    std::copy(s.met.begin(), s.met.end(), s.u.begin());
    s.rest();
    in.acceleration = s.zeros;
    s.solve_rows();
    s.respond(in);
    left = s.meet();
  }
  s.residual = left / std::max(size, kSmallest);
  for (const HeldRate& rate : held) s.velocity[rate.velocity] = s.held_rate[rate.velocity];  // exactly, not to rounding
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
