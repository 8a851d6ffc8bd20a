// Random captures with closed loops: every row of the ledger passes at the default integration settings, and grasps
// remain closed by the tests' own kinematics. Seeds: random_run.hpp.
//
//   build/release/bin/random_closed_loop_test --seed 42 --cases 100

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "capture/capture_case.hpp"
#include "examples/written_kinematics.hpp"
#include "grapnel/scenario/scenario.hpp"
#include "random_scenarios/closed_loop_text.hpp"
#include "random_scenarios/random_run.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace random_closed_loop_test {

struct Tally {
  int runs = 0, completed = 0, planned = 0, triple = 0, redundant = 0;
  double apart = 0, turned = 0;             // largest errors of closed grasps, by the tests' own kinematics [m, rad]
  double slowest = 0;                       // [s]
  std::map<std::string, double> of_bounds;  // largest share, per row
  std::vector<std::string> failures;
};
Tally tally;

// At every sample, the relative pose of a grasp equals that just after the impact, by the tests' own kinematics.
void expect_held(const CaptureProblem& p, const CaptureResult& r) {
  const std::size_t begin = first_sample(r, "post_impact");
  RC_ASSERT(begin + 10 < r.series.time.size());
  for (std::size_t i = 0; i < p.grasps.size(); ++i) {
    const GraspSetup& grasp = p.grasps[i];
    const auto seen = [&](std::size_t k) {  // pose of the target in the end-effector's frame
      return inverse(written_end_effector(p.robot, written_poses(p.robot, r, k), grasp.end_effector)) *
             pose_at(r, "targets/" + grasp.target, k);
    };
    const Posed X_ET = seen(begin);
    const Vector3d p_EC = inverse(written_end_effector(p.robot, written_poses(p.robot, r, begin), grasp.end_effector)) *
                          r.impact()->grasps[i].contact_point;
    const Vector3d p_TC = inverse(X_ET) * p_EC;
    for (std::size_t k = begin; k < r.series.time.size(); ++k) {
      const Posed X = seen(k);
      const Rotationd turn = X.R * transpose(X_ET.R);
      const double apart = norm(X * p_TC - p_EC);
      double turned = 0;
      if (grasp.model == GraspModel::rigid) turned = rotation_angle(turn);
      if (grasp.model == GraspModel::hinge) turned = norm(turn * grasp.hinge_axis - grasp.hinge_axis);
      if (!(apart < 1e-11)) RC_FAIL("the grasp of " + grasp.end_effector + " opens by " + std::to_string(apart) + " m");
      if (!(turned < 1e-11)) RC_FAIL("the grasp of " + grasp.end_effector + " turns by " + std::to_string(turned));
      tally.apart = std::max(tally.apart, apart), tally.turned = std::max(tally.turned, turned);
    }
  }
}

void check(const std::filesystem::path& file) {
  const CaptureProblem problem = load_scenario(file);
  const auto begin = std::chrono::steady_clock::now();
  const CaptureResult result = simulate_capture(problem);
  tally.slowest =
      std::max(tally.slowest, std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  ++tally.runs;
  require_finite(result);
  if (result.status != CaptureStatus::completed) {
    RC_ASSERT(result.failure.size() > 10u);
    tally.failures.push_back(result.failure);
    return;
  }
  ++tally.completed;
  RC_ASSERT(result.captured());
  RC_ASSERT(result.loops.size() == 1u);
  tally.planned += problem.approach.has_value();
  tally.triple += result.loops[0].closures.size() == 2;
  tally.redundant += result.loops[0].rank < result.loops[0].rows;
  for (const LedgerEntry& e : result.ledger.entries) {
    if (e.kind != LedgerEntry::Kind::conservation) continue;
    double& share = tally.of_bounds[e.name];
    share = std::max(share, e.value / e.bound);
    if (!e.pass()) RC_FAIL("ledger: " + e.name + " is " + std::to_string(e.value / e.bound) + " bounds");
  }
  RC_ASSERT(row(result, "loop_closure_position").applies);
  RC_ASSERT(norm(vector_at(result, "system/linear_momentum", 0)) > 0.0);
  expect_held(problem, result);
  if (!grapnel::test::kSanitized) require_same(result, simulate_capture(problem));
}

TEST(RandomClosedLoops, LedgerPasses) {
  const bool passed = passes_on_random("a closed loop stays closed and its ledger passes", closed_loop_text(),
                                       GRAPNEL_RANDOM_CLOSED_LOOPS, check);
  EXPECT_TRUE(passed);
  std::printf(
      "[ measured ] %d runs: %d completed, %d planned, %d with two loops, %d with redundant closures; grasps open by "
      "%.2g m, %.2g rad; slowest %.3f s\n",
      tally.runs, tally.completed, tally.planned, tally.triple, tally.redundant, tally.apart, tally.turned,
      tally.slowest);
  for (const auto& [name, share] : tally.of_bounds) std::printf("[ measured ] %.3f of %s\n", share, name.c_str());
  for (const std::string& failure : tally.failures) std::printf("[ measured ] stopped: %s\n", failure.c_str());
  if (!passed) return;
  EXPECT_GE(10 * tally.completed, 7 * tally.runs);
}

}  // namespace random_closed_loop_test
}  // namespace grapnel::testing
