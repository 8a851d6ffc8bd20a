#include "lanes/lane_cases.hpp"

#include <new>
#include <span>

#include "grapnel/dynamics/link_motion.hpp"
#include "grapnel/dynamics/newton_euler.hpp"
#include "grapnel/dynamics/root_velocity.hpp"

namespace grapnel::lanes::testing {
namespace {

using grapnel::testing::Random;

// Entries of `width` lanes each, aligned for the kernels.
class Packed {
 public:
  Packed(std::size_t entries, int width)
      : width_(width), values_(static_cast<double*>(::operator new((entries * width + 1) * sizeof(double), kAlign))) {
    std::fill_n(values_.get(), entries * width, 0.0);
  }
  double* data() { return values_.get(); }
  void put(int lane, std::span<const double> x) {
    for (std::size_t i = 0; i < x.size(); ++i) values_.get()[i * width_ + lane] = x[i];
  }
  std::vector<double> get(int lane, std::size_t count) const {
    std::vector<double> x(count);
    for (std::size_t i = 0; i < count; ++i) x[i] = values_.get()[i * width_ + lane];
    return x;
  }

 private:
  static constexpr std::align_val_t kAlign{kLaneAlignment};
  struct Free {
    void operator()(double* x) const { ::operator delete(x, kAlign); }
  };
  std::size_t width_;
  std::unique_ptr<double, Free> values_;
};

std::vector<double> numbers(const std::vector<Wrenchd>& wrenches) {
  std::vector<double> x;
  for (const Wrenchd& F : wrenches) {
    for (int k = 0; k < 3; ++k) x.push_back(F.angular[k]);
    for (int k = 0; k < 3; ++k) x.push_back(F.linear[k]);
  }
  return x;
}

// The same robot with other parameters: every number changed, the structure unchanged.
Tree<double> varied(Tree<double> tree, Random& random) {
  for (TreeLink<double>& link : tree.links) {
    const double mass = random.uniform(0.7, 1.4), size = random.uniform(0.8, 1.2);
    RigidBodyInertiad& I = link.inertia;
    I.mass *= mass;
    I.first_moment *= mass * size;
    Symmetric3d& J = I.rotational;
    for (double* x : {&J.xx, &J.yy, &J.zz, &J.xy, &J.xz, &J.yz}) *x *= mass * size * size;
    link.X_PF.p += random.vector(0.1);
    link.armature *= random.uniform(0.5, 2);
  }
  return tree;
}

// One pack: `width` cases and their kernel model.
class LaneRun {
 public:
  LaneRun(const KernelTable& kernels, const CaseSet& cases, std::span<const int> chosen)
      : kernels_(kernels), cases_(cases), chosen_(chosen.begin(), chosen.end()), model_(nullptr, kernels.destroy) {
    std::vector<const TreeLink<double>*> links;
    for (const int i : chosen_) links.push_back(cases.cases[i].tree.links.data());
    const Tree<double>& tree = cases.cases[0].tree;
    model_.reset(
        kernels.create({links.data(), static_cast<int>(tree.links.size()), tree.coordinates, tree.velocities}));
  }

  void run(std::array<LaneResults, kCases>& results) {
    const Tree<double>& tree = cases_.cases[0].tree;
    const std::size_t links = tree.links.size(), nv = tree.velocities, nq = tree.coordinates;
    Packed q = packed([](const LaneCase&c) { return c.q; }), v = packed([](const LaneCase&c) { return c.v; });
    Packed force = packed([](const LaneCase& c) { return c.force; });
    Packed acceleration = packed([](const LaneCase& c) { return c.acceleration; });
    Packed wrench = packed([](const LaneCase& c) { return numbers(c.link_wrench); });
    Packed gravity = packed([](const LaneCase& c) { return std::vector<double>(c.gravity.e, c.gravity.e + 3); });
    Packed elapsed = packed([](const LaneCase& c) { return std::vector<double>{c.elapsed}; });
    const LaneInput in{
        q.data(), v.data(), force.data(), wrench.data(), cases_.prescribed.data(), acceleration.data(), gravity.data()};
    Packed vdot(nv, width()), applied(nv, width()), inverse(nv, width()), motion(18 * links, width());
    const std::size_t roots = kRootNumbers * free_root_count(tree);
    Packed momenta(roots, width());
    kernels_.forward_dynamics(model_.get(), in, vdot.data(), applied.data());
    kernels_.inverse_dynamics(model_.get(), in, inverse.data());
    kernels_.link_motion(model_.get(), q.data(), v.data(), motion.data());
    kernels_.root_momenta(model_.get(), q.data(), v.data(), momenta.data());
    kernels_.recover_roots(model_.get(), momenta.data(), elapsed.data(), q.data(), v.data());
    for (int lane = 0; lane < width(); ++lane) {
      results[chosen_[lane]] = {vdot.get(lane, nv),          applied.get(lane, nv), inverse.get(lane, nv),
                                momenta.get(lane, roots),    q.get(lane, nq),       v.get(lane, nv),
                                motion.get(lane, 18 * links)};
    }
  }

 private:
  int width() const { return kernels_.width; }
  template <class Part>
  Packed packed(Part part) const {
    Packed x(part(cases_.cases[chosen_[0]]).size(), width());
    for (int lane = 0; lane < width(); ++lane) x.put(lane, part(cases_.cases[chosen_[lane]]));
    return x;
  }

  const KernelTable& kernels_;
  const CaseSet& cases_;
  std::vector<int> chosen_;
  std::unique_ptr<void, void (*)(void*)> model_;
};

}  // namespace

CaseSet random_cases(int index) {
  Random random(index);
  grapnel::testing::RobotOptions options;
  options.spherical_joints = index % 2 == 0;
  options.free_root = index % 5 != 0;
  options.targets = index % 3;
  const Model model = grapnel::testing::random_model(options, random);
  CaseSet set;
  set.prescribed.assign(model.velocities(), 0);
  for (const TreeLink<double>& link : model.tree().links) {
    if (link.parent < 0 || !random.chance(0.3)) continue;
    const int count = link.joint == JointType::spherical ? 3 : 1;
    for (int k = 0; k < count; ++k) set.prescribed[link.v + k] = 1;
  }
  for (LaneCase& c : set.cases) {
    c.tree = varied(model.tree(), random);
    const State state = grapnel::testing::random_state(model, random);
    c.q = state.q, c.v = state.v;
    c.force = random.values(model.velocities(), 5);
    c.acceleration = random.values(model.velocities(), 2);
    for (std::size_t i = 0; i < c.tree.links.size(); ++i) c.link_wrench.push_back({random.vector(3), random.vector(3)});
    c.gravity = random.vector(9);
    c.elapsed = random.uniform(0.1, 2);
  }
  return set;
}

LaneResults double_results(const LaneCase& c, const std::vector<std::uint8_t>& prescribed) {
  LaneResults r;
  DynamicsWorkspace<double> workspace(c.tree);
  DynamicsInput<double> in;
  in.q = c.q, in.v = c.v, in.force = c.force, in.acceleration = c.acceleration, in.link_wrench = c.link_wrench;
  in.prescribed = prescribed, in.gravity = c.gravity;
  r.vdot.resize(c.v.size()), r.force.resize(c.v.size()), r.inverse.resize(c.v.size());
  articulated_body<double>(c.tree, in, workspace, r.vdot, r.force);
  newton_euler<double>(c.tree, in, workspace, r.inverse);
  std::vector<LinkMotion<double>> motion(c.tree.links.size());
  link_motion<double>(c.tree, c.q, c.v, motion);
  for (const LinkMotion<double>& m : motion) {
    r.motion.insert(r.motion.end(), &m.X_WL.R.m[0][0], &m.X_WL.R.m[0][0] + 9);
    r.motion.insert(r.motion.end(), m.X_WL.p.e, m.X_WL.p.e + 3);
    r.motion.insert(r.motion.end(), m.V_WL.angular.e, m.V_WL.angular.e + 3);
    r.motion.insert(r.motion.end(), m.V_WL.linear.e, m.V_WL.linear.e + 3);
  }
  std::vector<RootMomentum<double>> momenta(free_root_count(c.tree));
  root_momenta<double>(c.tree, c.q, c.v, workspace, momenta);
  for (const RootMomentum<double>& m : momenta) {
    r.momenta.insert(r.momenta.end(), m.h.angular.e, m.h.angular.e + 3);
    r.momenta.insert(r.momenta.end(), m.h.linear.e, m.h.linear.e + 3);
    r.momenta.insert(r.momenta.end(), m.p_WCom.e, m.p_WCom.e + 3);
    r.momenta.push_back(m.mass);
  }
  r.q = c.q, r.v = c.v;
  recover_roots<double>(c.tree, momenta, c.elapsed, workspace, r.q, r.v);
  return r;
}

std::array<LaneResults, kCases> lane_results(InstructionSet set, const CaseSet& cases,
                                             const std::array<int, kCases>& order) {
  std::array<LaneResults, kCases> results;
  const KernelTable& table = kernels(set);
  for (int first = 0; first < kCases; first += table.width) {
    LaneRun(table, cases, std::span(order).subspan(first, table.width)).run(results);
  }
  return results;
}

}  // namespace grapnel::lanes::testing
