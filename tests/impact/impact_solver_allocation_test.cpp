// No heap allocation in an ImpactSolver's work after set-up: the C library's and C++'s allocation functions replaced.
#include "fast_impact/impact_solver.hpp"
#include "impact/impact_case.hpp"
#include "support/allocation_trap.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel::testing {
namespace {

TEST(ImpactSolver, AllocatesNothingAfterSetUp) {
  if (!kTrapWorks) GTEST_SKIP() << "the sanitizer has its own allocator";
  int deficient = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    std::vector<HeldRate> held;
    if (!c.model.joints().empty()) held.push_back({c.model.bodies()[c.model.joints()[0]].v, 0.3});
    ImpactSolver solver(c.model, c.grasps);
    AllocationTrap trap;
    solver.solve(c.state.q, c.state.v, c.grasps);
    deficient += solver.rank() < solver.rows();
    solver.solve(c.state.q, c.state.v, c.grasps, held);
    EXPECT_EQ(trap.stop(), 0);
    EXPECT_TRUE(std::isfinite(solver.velocity()[0] + solver.constraint_residual()));
  }
  EXPECT_GT(deficient, 5);
}

}  // namespace
}  // namespace grapnel::testing
