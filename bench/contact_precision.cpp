// Work and precision of a scene with contacts: error against evaluations for Grapnel's tolerances and MuJoCo's steps,
// with the same laws. The scene: two arms close on a box, and balls meet other bodies and a wall (tests/engines).
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <stdexcept>

#include "bench/dynamics_bench.hpp"
#include "engines/contact_scene.hpp"
#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/simulate/simulate_phase.hpp"

namespace grapnel::bench {
namespace {

constexpr double kDuration = 2;
constexpr int kRepetitions = 20, kMujocoRepetitions = 3;  // the fastest counts

// Of this thread [s].
double cpu_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Work {
  State end;
  long evaluations = 0, steps = 0;
  long rejected = 0, events = 0;  // discarded steps; begins and ends of contacts
  double seconds = 0;
};

long events_of(const ContactSet& contacts) {
  long events = 0;
  for (std::size_t g = 0; g < contacts.groups(); ++g) {
    const GroupHistory& history = contacts.history(g);
    events += 2 * history.touches - (history.since ? 1 : 0);
  }
  return events;
}

Work by_grapnel(const testing::ContactScene& scene, double tolerance) {
  Work work;
  work.seconds = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kRepetitions; ++i) {
    PhaseSetup setup;
    setup.contacts = std::make_shared<ContactSet>(scene.contacts());
    PhaseDynamics dynamics(scene.model, setup);
    IntegrationSetup integration;
    integration.relative_tolerance = integration.absolute_tolerance = tolerance;
    const double start = cpu_time();
    const PhaseOutcome outcome = simulate_phase(dynamics, {scene.state, 0, kDuration}, integration, {});
    const double taken = cpu_time() - start;
    if (!outcome.finished) throw std::runtime_error("contact_precision: " + outcome.failure);
    work = {outcome.end_state, outcome.rhs_evaluations,    outcome.steps,
            outcome.rejected,  events_of(*setup.contacts), std::min(work.seconds, taken)};
  }
  return work;
}

Work by_mujoco(const testing::ContactScene& scene, double step) {
  testing::MujocoContacts::Settings settings;
  settings.step = step;
  testing::MujocoContacts engine(scene.model, scene.surfaces, scene.pairs, settings);
  Work work;
  work.seconds = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMujocoRepetitions; ++i) {
    engine.start(scene.state);
    const double start = cpu_time();
    engine.run(kDuration);
    const double taken = cpu_time() - start;
    work = {engine.state(), engine.evaluations(), std::lround(kDuration / step), 0, 0, std::min(work.seconds, taken)};
  }
  return work;
}

// Largest difference of the velocities at the end [m/s, rad/s].
double error_of(const Work& work, const State& exact) {
  double error = 0;
  for (std::size_t i = 0; i < exact.v.size(); ++i) error = std::max(error, std::abs(work.end.v[i] - exact.v[i]));
  return error;
}

void print(const std::string& name, const Work& work, const State& exact) {
  fmt::print("{:<30}{:>9}{:>10}{:>8}{:>13}{:>11.1e}{:>10.2f}{:>12.0f}\n", name, work.steps, work.rejected, work.events,
             work.evaluations, error_of(work, exact), 1e3 * work.seconds,
             static_cast<double>(work.steps) / work.seconds);
}

// The scene without its wall, the other bodies far away from the robot and each other: all pairs stay apart.
testing::ContactScene distant_scene() {
  testing::ContactScene scene = testing::two_arm_scene(true);
  const Kinematics kinematics = forward_kinematics(scene.model, scene.state);
  for (std::size_t i = 1; i < scene.model.bodies().size(); ++i) {
    if (scene.model.bodies()[i].description.joint.type != JointType::free) continue;
    const Posed& X_WB = kinematics.X_WB[i];
    set_root_pose(scene.model, static_cast<int>(i), {X_WB.R, 4.0 * X_WB.p}, scene.state);
  }
  const auto has_wall = [&](const SurfacePair& pair) {
    return scene.surfaces[pair.a].body < 0 || scene.surfaces[pair.b].body < 0;
  };
  std::erase_if(scene.pairs, has_wall);
  for (std::size_t i = 0; i < scene.pairs.size(); ++i) scene.pairs[i].group = static_cast<int>(i);
  return scene;
}

// Time of a run [s], with its pairs watched or without contacts.
double seconds_of_run(const testing::ContactScene& scene, double tolerance, bool watched, long& evaluations) {
  PhaseSetup setup;
  if (watched) setup.contacts = std::make_shared<ContactSet>(scene.contacts());
  PhaseDynamics dynamics(scene.model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = tolerance;
  const double start = cpu_time();
  const PhaseOutcome outcome = simulate_phase(dynamics, {scene.state, 0, 1}, integration, {});
  const double taken = cpu_time() - start;
  if (!outcome.finished) throw std::runtime_error("contact_watch: " + outcome.failure);
  if (watched && events_of(*setup.contacts) != 0) throw std::runtime_error("contact_watch: bodies touch");
  evaluations = outcome.rhs_evaluations;
  return taken;
}

// Fastest runs of alternating ones with and without contacts => a line.
void print_watch(double tolerance) {
  constexpr int kRuns = 200;
  const testing::ContactScene scene = distant_scene();
  double least[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  long evaluations[2] = {0, 0};
  for (int i = 0; i < 2 * kRuns; ++i) {
    const bool watched = i % 2 == 1;
    least[watched] = std::min(least[watched], seconds_of_run(scene, tolerance, watched, evaluations[watched]));
  }
  fmt::print("{:<30}{:>13}{:>13}{:>12.3f}{:>12.3f}{:>10.2f}\n", fmt::format("tolerance {:.0e}", tolerance),
             evaluations[0], evaluations[1], 1e3 * least[0], 1e3 * least[1], least[1] / least[0]);
}

}  // namespace

void register_contact_watch() {
  benchmark::RegisterBenchmark("contact_watch", [](benchmark::State& loop) {
    static bool printed = false;  // once, also if repeated
    for (auto _ : loop) {
      if (std::exchange(printed, true)) continue;
      fmt::print("\n{:<30}{:>26}{:>24}{:>10}\n{:<30}{:>13}{:>13}{:>12}{:>12}{:>10}\n", "six pairs that stay apart",
                 "evaluations", "time [ms]", "ratio", "", "none", "watched", "none", "watched", "");
      for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) print_watch(tolerance);
    }
  });
}

void register_contact_precision() {
  benchmark::RegisterBenchmark("contact_precision", [](benchmark::State& loop) {
    static bool printed = false;  // once, also if repeated
    for (auto _ : loop) {
      if (std::exchange(printed, true)) continue;
      const testing::ContactScene scene = testing::two_arm_scene(true);
      const State exact = by_grapnel(scene, 1e-13).end;
      fmt::print("\n{:<30}{:>9}{:>10}{:>8}{:>13}{:>11}{:>10}{:>12}\n", "contacts of seven pairs", "steps", "rejected",
                 "events", "evaluations", "error", "ms", "steps/s");
      for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-8, 1e-10, 1e-12})
        print(fmt::format("Grapnel, tolerance {:.0e}", tolerance), by_grapnel(scene, tolerance), exact);
      const testing::ContactScene capture = testing::dual_arm_capture();
      const State exact_capture = by_grapnel(capture, 1e-13).end;
      for (const double tolerance : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12})
        print(fmt::format("two arms and box, {:.0e}", tolerance), by_grapnel(capture, tolerance), exact_capture);
      for (const double step : {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5})
        print(fmt::format("MuJoCo's RK4, step {:g} s", step), by_mujoco(scene, step), exact);
    }
  });
}

}  // namespace grapnel::bench
