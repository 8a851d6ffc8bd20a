// The plastic impact: ImpactSolver, the fast route, beside plastic_impact(), the careful one, each arm grasping a
// separate target; and the latter with all arms on one target (arms x joints of each). The same impacts as compliant
// impacts, with grasps that yield: an implicit stepper whose stages and Jacobians are evaluated in packs, per
// instruction set, and in doubles. Contacts with restitution and friction: a path and those by which its spread is
// found, likewise.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "bench/dynamics_bench.hpp"
#include "bench/workload.hpp"
#include "fast_impact/impact_solver.hpp"
#include "grapnel/impact/compliant_scales.hpp"
#include "grapnel/impact/compliant_stepper.hpp"
#include "grapnel/impact/contact_path.hpp"

namespace grapnel::bench {
namespace {

struct ImpactWorkload {
  Workload base;
  std::vector<std::vector<Grasp>> grasps;  // per state
};
using SharedImpact = std::shared_ptr<const ImpactWorkload>;

std::string target_name(int i) { return "target" + std::to_string(i); }

// The robot with free targets, each grasped rigidly by the ends of its arms: every arm has its own, or all have one.
SharedImpact make_impacts(const std::string& name, int arms, int joints, bool alternate, bool own_targets) {
  ModelBuilder builder = describe_robot(arms, joints, alternate);
  for (int i = 0; i < (own_targets ? arms : 1); ++i) {
    BodyDescription target;
    target.name = target.joint.name = target_name(i);
    target.joint.type = JointType::free;
    target.mass = 200;
    target.inertia = Symmetric3d::diagonal(30, 40, 50);
    builder.add(target);
  }
  ImpactWorkload impacts{make_workload(name, builder.build()), {}};
  const Model& model = impacts.base.model;
  std::mt19937_64 generator(20239);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (State& state : impacts.base.states) {
    const Kinematics k = forward_kinematics(model, state);
    std::vector<Grasp>& grasps = impacts.grasps.emplace_back();
    for (int arm = 0; arm < arms; ++arm) {
      const int hand = model.body_index("link" + std::to_string(arm) + "." + std::to_string(joints - 1));
      const int target = model.body_index(target_name(own_targets ? arm : 0));
      grasps.push_back({hand, target, GraspModel::rigid, k.X_WB[hand] * Vector3d{1, 0, 0}, {0, 0, 1}});
      if (!own_targets && arm > 0) continue;
      // The target's surface is at the end-effector (the first that grasps it): its centre is a metre away.
      const Vector3d axis{uniform(generator), uniform(generator), uniform(generator)};
      const Rotationd R = rotation_about((1 / norm(axis)) * axis, 3 * uniform(generator));
      set_root_pose(model, target, {R, grasps.back().p_WC + R.column(0)}, state);
    }
  }
  return std::make_shared<const ImpactWorkload>(std::move(impacts));
}

// Both routes must answer the same before they are timed.
void check(const ImpactWorkload& impacts) {
  ImpactSolver solver(impacts.base.model, impacts.grasps[0]);
  for (int i = 0; i < Workload::kCases; ++i) {
    const State& state = impacts.base.states[i];
    const ImpactSolution careful = plastic_impact(impacts.base.model, state, impacts.grasps[i]);
    solver.solve(state.q, state.v, impacts.grasps[i]);
    double difference = 0, size = 0;
    for (std::size_t v = 0; v < careful.velocity.size(); ++v) {
      difference = std::max(difference, std::abs(careful.velocity[v] - solver.velocity()[v]));
      size = std::max(size, std::abs(careful.velocity[v]));
    }
    if (!(difference <= 1e-11 * size) || careful.rank != solver.rank()) {
      throw std::runtime_error(fmt::format("{}: the routes' velocities differ by {:.3g} of {:.3g}, ranks are {} and {}",
                                           impacts.base.name, difference, size, solver.rank(), careful.rank));
    }
  }
}

void add_solve(const SharedImpact& impacts) {
  check(*impacts);
  benchmark::RegisterBenchmark(("plastic_solve/" + impacts->base.name).c_str(), [impacts](benchmark::State& timer) {
    ImpactSolver solver(impacts->base.model, impacts->grasps[0]);
    int i = 0;
    for (auto _ : timer) {
      const State& state = impacts->base.states[i];
      solver.solve(state.q, state.v, impacts->grasps[i]);
      benchmark::DoNotOptimize(solver.velocity().data());
      benchmark::ClobberMemory();
      i = (i + 1) % Workload::kCases;
    }
  });
}

void add_plastic_impact(const SharedImpact& impacts) {
  benchmark::RegisterBenchmark(("plastic_impact/" + impacts->base.name).c_str(), [impacts](benchmark::State& timer) {
    int i = 0;
    for (auto _ : timer) {
      benchmark::DoNotOptimize(plastic_impact(impacts->base.model, impacts->base.states[i], impacts->grasps[i]));
      i = (i + 1) % Workload::kCases;
    }
  });
}

// --- In time ---

using Set = std::optional<lanes::InstructionSet>;
constexpr double kUntil = 0.1;  // [s]

// Velocities after a compliant impact from one state.
std::vector<double> step_through(const ImpactWorkload& impacts, int i, Set set) {
  const Model& model = impacts.base.model;
  const State& state = impacts.base.states[i];
  std::vector<CompliantGrasp> grasps;
  for (const Grasp& g : impacts.grasps[i]) grasps.push_back({g, 2e5, 3e3, 2e4, 1e3});
  CompliantSystem system(model, state, {}, grasps, {}, nullptr, set);
  system.load(0, std::vector<double>(system.size(), 0.0));
  const CompliantScales scales = compliant_scales(model, state, system, {}, grasps);
  StiffIntegrator integrator(system, absolute_tolerances(model, scales, 1), absolute_tolerances(model, scales, 1e-9),
                             1e-4 * scales.shortest_time, kUntil);
  StiffIntegrator::Result made;
  do made = integrator.step();
  while (made == StiffIntegrator::Result::stepped);
  if (made != StiffIntegrator::Result::end) throw std::runtime_error(integrator.message());
  system.load(integrator.time(), integrator.y());
  return system.now().v;
}

void check_steps(const ImpactWorkload& impacts, Set set) {
  for (int i = 0; i < Workload::kCases; ++i) {
    const std::vector<double> doubles = step_through(impacts, i, {}), packs = step_through(impacts, i, set);
    double difference = 0, size = 0;
    for (std::size_t v = 0; v < doubles.size(); ++v) {
      difference = std::max(difference, std::abs(doubles[v] - packs[v]));
      size = std::max(size, std::abs(doubles[v]));
    }
    if (!(difference <= 1e-9 * size))
      throw std::runtime_error(
          fmt::format("{} in time: velocities differ by {:.3g} of {:.3g}", impacts.base.name, difference, size));
  }
}

void add_steps(const SharedImpact& impacts) {
  std::vector<Set> sets{std::nullopt};
  for (const lanes::InstructionSet set : lanes::supported_instruction_sets()) sets.emplace_back(set);
  for (const Set set : sets) {
    check_steps(*impacts, set);
    const std::string at = set ? "@" + std::string(lanes::name(*set)) : "";
    benchmark::RegisterBenchmark(("compliant_steps" + at + "/" + impacts->base.name).c_str(),
                                 [impacts, set](benchmark::State& timer) {
                                   int i = 0;
                                   for (auto _ : timer) {
                                     benchmark::DoNotOptimize(step_through(*impacts, i, set));
                                     i = (i + 1) % Workload::kCases;
                                   }
                                 });
  }
}

// --- Contacts ---

// As contact_impact() asks for them: the path of random contacts, and 2 n with other stiffness ratios.
std::vector<ContactPathProblem> make_paths(int contacts, unsigned seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto random = [&] { return uniform(generator); };
  const Eigen::MatrixXd J = Eigen::MatrixXd::NullaryExpr(3 * contacts, 3 * contacts + 2, random);
  ContactPathProblem path;
  path.W = J * J.transpose();
  path.u = J * Eigen::VectorXd::NullaryExpr(J.cols(), random);
  if (path.u[0] > 0) path.u = -path.u;
  for (int i = 0; i < contacts; ++i) path.contacts.push_back({std::abs(random()), 0.4 * std::abs(random()), 1});
  std::vector<ContactPathProblem> paths(2 * path.contacts.size() + 1, path);
  for (std::size_t k = 0; k + 1 < paths.size(); ++k) {
    paths[k + 1].tolerance = 1e-9;
    paths[k + 1].contacts[k / 2].stiffness = k % 2 == 0 ? 100 : 0.01;
  }
  return paths;
}

void add_paths(int contacts) {
  std::vector<std::vector<ContactPathProblem>> cases;
  for (int i = 0; i < Workload::kCases; ++i) cases.push_back(make_paths(contacts, 1000 + static_cast<unsigned>(i)));
  std::vector<Set> sets{std::nullopt};
  for (const lanes::InstructionSet set : lanes::supported_instruction_sets()) sets.emplace_back(set);
  for (const Set set : sets) {
    for (const std::vector<ContactPathProblem>& paths : cases) {
      for (const ContactPath& path : follow_contacts(paths, set)) {
        if (!path.failure.empty()) throw std::runtime_error(path.failure);
      }
    }
    const std::string at = set ? "@" + std::string(lanes::name(*set)) : "";
    benchmark::RegisterBenchmark(fmt::format("contact_paths{}/{}", at, contacts).c_str(),
                                 [cases, set](benchmark::State& timer) {
                                   std::size_t i = 0;
                                   for (auto _ : timer) {
                                     benchmark::DoNotOptimize(follow_contacts(cases[i], set));
                                     i = (i + 1) % cases.size();
                                   }
                                 });
  }
}

}  // namespace

void register_impacts() {
  for (const SharedImpact& impacts :
       {make_impacts("a+2targets", 2, 3, false, true), make_impacts("b+2targets", 2, 7, true, true),
        make_impacts("2x7", 2, 7, true, false), make_impacts("3x7", 3, 7, true, false),
        make_impacts("6x7", 6, 7, true, false)}) {
    add_solve(impacts);
    add_plastic_impact(impacts);
  }
  for (const SharedImpact& impacts :
       {make_impacts("a+2targets", 2, 3, false, true), make_impacts("b+2targets", 2, 7, true, true)})
    add_steps(impacts);
  for (const int contacts : {1, 2, 3}) add_paths(contacts);
}

}  // namespace grapnel::bench
