#pragma once

/// @file
/// Fills a KernelTable for one instruction set; only that set's translation unit includes this file.

#include <new>

#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/link_motion_kernel.hpp"
#include "grapnel/dynamics/newton_euler_kernel.hpp"
#include "grapnel/dynamics/root_velocity_kernel.hpp"
#include "grapnel/lanes/lane_loops.hpp"
#include "grapnel/spatial/pack.hpp"
#include "lane_kernels/kernel_table.hpp"

namespace grapnel::lanes {

/// KernelTable's functions on packs of one instruction set.
template <class Arch>
struct LaneModel {
  using P = Pack<Arch>;
  static constexpr int kWidth = Arch::kWidth;

  Tree<P> tree;
  DynamicsWorkspace<P> workspace;
  std::vector<RootMomentum<P>> momenta;
  std::vector<LinkMotion<P>> motion;
  // Loops refer to the members above.
  LaneArray<P, LinkTable> links;
  PhaseTables tables{};
  LaneLoops<P> loops;

  static P* packs(double* x) { return reinterpret_cast<P*>(x); }
  static const P* packs(const double* x) { return reinterpret_cast<const P*>(x); }
  static std::span<const P> span(const double* x, int count) {
    return x == nullptr ? std::span<const P>() : std::span<const P>(packs(x), static_cast<std::size_t>(count));
  }
  static std::span<P> span(double* x, int count) { return {packs(x), static_cast<std::size_t>(count)}; }

  explicit LaneModel(const LaneTrees& trees)
      : links(trees.link_count), tables(tables_of(trees, links)), loops(tables, tree) {
    tree.coordinates = trees.coordinates;
    tree.velocities = trees.velocities;
    for (int i = 0; i < trees.link_count; ++i) tree.links.push_back(link(trees, i));
    workspace = DynamicsWorkspace<P>(tree);
    momenta.resize(static_cast<std::size_t>(free_root_count(tree)));
    motion.resize(tree.links.size());
    if (!loops.any()) return;
    LaneArray<P, int> place(trees.link_count);
    for (int i = 0; i < trees.link_count; ++i) place[i] = i;
    loops.lay_out(place);
    for (int lane = 0; lane < kWidth; ++lane) loops.load_case(lane, trees.loop_numbers[lane]);
  }
  LaneModel(const LaneModel&) = delete;
  LaneModel& operator=(const LaneModel&) = delete;

  // Tables for the loops.
  static PhaseTables tables_of(const LaneTrees& trees, LaneArray<P, LinkTable>& links) {
    for (int i = 0; i < trees.link_count; ++i) {
      links[i] = LinkTable{};
      links[i].parent = trees.links[0][i].parent, links[i].joint = trees.links[0][i].joint;
    }
    PhaseTables tables{};
    tables.links = links.data(), tables.link_count = trees.link_count;
    tables.coordinates = trees.coordinates, tables.velocities = trees.velocities;
    tables.loops = trees.loops, tables.loop_count = trees.loop_count;
    return tables;
  }

  static TreeLink<P> link(const LaneTrees& trees, int i) {
    const TreeLink<double>& first = trees.links[0][i];
    TreeLink<P> t{first.parent, first.joint, first.axis, first.rotated, first.q, first.v,
                  first.sign,   {},          {},         P(0.0),        false};
    for (int lane = 0; lane < kWidth; ++lane) {
      const TreeLink<double>& l = trees.links[lane][i];
      t.rotated = t.rotated || l.rotated;
      t.has_armature = t.has_armature || l.has_armature;
      t.armature.set(lane, l.armature);
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) t.X_PF.R.m[r][c].set(lane, l.X_PF.R.m[r][c]);
        t.X_PF.p[r].set(lane, l.X_PF.p[r]);
        t.inertia.first_moment[r].set(lane, l.inertia.first_moment[r]);
      }
      t.inertia.mass.set(lane, l.inertia.mass);
      Symmetric3<P>& J = t.inertia.rotational;
      const Symmetric3<double>& own = l.inertia.rotational;
      J.xx.set(lane, own.xx), J.yy.set(lane, own.yy), J.zz.set(lane, own.zz);
      J.xy.set(lane, own.xy), J.xz.set(lane, own.xz), J.yz.set(lane, own.yz);
    }
    return t;
  }

  DynamicsInput<P> input(const LaneInput& in) const {
    DynamicsInput<P> result;
    result.q = span(in.q, tree.coordinates), result.v = span(in.v, tree.velocities);
    result.force = span(in.force, tree.velocities);
    result.acceleration = span(in.acceleration, tree.velocities);
    if (in.link_wrench != nullptr) {
      result.link_wrench = {reinterpret_cast<const Wrench<P>*>(in.link_wrench), tree.links.size()};
    }
    if (in.prescribed != nullptr) result.prescribed = {in.prescribed, static_cast<std::size_t>(tree.velocities)};
    if (in.gravity != nullptr) {
      const P* g = packs(in.gravity);
      result.gravity = {g[0], g[1], g[2]};
    }
    return result;
  }

  static LaneModel& of(void* model) { return *static_cast<LaneModel*>(model); }

  static void* create(const LaneTrees& trees) { return new LaneModel(trees); }
  static void destroy(void* model) { delete &of(model); }
  static void forward_dynamics(void* model, const LaneInput& in, double* vdot, double* force) {
    LaneModel& m = of(model);
    articulated_body<P>(m.tree, m.input(in), m.workspace, span(vdot, m.tree.velocities),
                        span(force, m.tree.velocities));
  }
  static void loop_dynamics(void* model, const LaneInput& in, double* vdot, double* force) {
    LaneModel& m = of(model);
    m.loops.accelerate(m.input(in), m.workspace, span(vdot, m.tree.velocities), span(force, m.tree.velocities));
  }
  static void inverse_dynamics(void* model, const LaneInput& in, double* force) {
    LaneModel& m = of(model);
    newton_euler<P>(m.tree, m.input(in), m.workspace, span(force, m.tree.velocities));
  }
  static void root_momenta(void* model, const double* q, const double* v, double* momenta) {
    LaneModel& m = of(model);
    grapnel::root_momenta<P>(m.tree, span(q, m.tree.coordinates), span(v, m.tree.velocities), m.workspace,
                             std::span<RootMomentum<P>>(m.momenta));
    P* out = packs(momenta);
    for (std::size_t i = 0; i < m.momenta.size(); ++i, out += kRootNumbers) {
      const RootMomentum<P>& root = m.momenta[i];
      for (int k = 0; k < 3; ++k)
        out[k] = root.h.angular[k], out[3 + k] = root.h.linear[k], out[6 + k] = root.p_WCom[k];
      out[9] = root.mass;
    }
  }
  static void recover_roots(void* model, const double* momenta, const double* elapsed, double* q, double* v) {
    LaneModel& m = of(model);
    const P* in = packs(momenta);
    for (std::size_t i = 0; i < m.momenta.size(); ++i, in += kRootNumbers) {
      m.momenta[i] = {{{in[0], in[1], in[2]}, {in[3], in[4], in[5]}}, {in[6], in[7], in[8]}, in[9]};
    }
    grapnel::recover_roots<P>(m.tree, std::span<const RootMomentum<P>>(m.momenta), *packs(elapsed), m.workspace,
                              span(q, m.tree.coordinates), span(v, m.tree.velocities));
  }
  static void link_motion(void* model, const double* q, const double* v, double* motion) {
    LaneModel& m = of(model);
    grapnel::link_motion<P>(m.tree, span(q, m.tree.coordinates), span(v, m.tree.velocities),
                            std::span<LinkMotion<P>>(m.motion));
    P* out = packs(motion);
    for (const LinkMotion<P>& own : m.motion) {
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) out[3 * r + c] = own.X_WL.R.m[r][c];
        out[9 + r] = own.X_WL.p[r], out[12 + r] = own.V_WL.angular[r], out[15 + r] = own.V_WL.linear[r];
      }
      out += 18;
    }
  }
  static void sine_cosine(const double* angle, double* sine, double* cosine, int count) {
    for (int i = 0; i < count; ++i) {
      const SineCosine<P> at = lanes::sine_cosine(packs(angle)[i]);
      packs(sine)[i] = at.sine, packs(cosine)[i] = at.cosine;
    }
  }
};

template <class Arch>
constexpr KernelTable make_kernel_table() {
  using M = LaneModel<Arch>;
  return {Arch::kWidth,        M::create,       M::destroy,       M::forward_dynamics, M::loop_dynamics,
          M::inverse_dynamics, M::root_momenta, M::recover_roots, M::link_motion,      M::sine_cosine};
}

}  // namespace grapnel::lanes
