// No heap allocation in a LoopSolver's work after set-up: the C library's and C++'s allocation functions replaced, and
// Eigen's own check, which also sees what would be taken from a pool.
#include <stdexcept>

#define EIGEN_RUNTIME_NO_MALLOC
// Eigen's check is an assertion; make it an exception in every build type.
#define eigen_assert(condition)                                     \
  do {                                                              \
    if (!(condition)) throw std::logic_error("Eigen: " #condition); \
  } while (false)
#include <Eigen/Core>

#include "constraint/closed_case.hpp"
#include "support/allocation_trap.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace grapnel::testing {
namespace {

TEST(LoopSolver, DoesNotAllocateAfterSetup) {
  if (!kTrapWorks) GTEST_SKIP() << "the sanitizer has its own allocator";
  for (int i = 0; i < 40; ++i) {
    SCOPED_TRACE(seed_note(i));
    ClosedCase c = random_closed(i);
    const oracle::MaximalLoads loads = i % 2 == 0 ? c.loads : with_prescribed(c, i);
    Workspace workspace(c.model);
    LoopSolver solver(c.model, c.closures);
    std::vector<double> vdot(c.model.velocities()), force(c.model.velocities());
    const DynamicsInput<double> in = dynamics_input(c.model, c.state, loads, workspace);
    std::vector<double> q = c.state.q, v = c.state.v;
    for (double& x : q) x += 1e-3;
    double sum = 0;
    Eigen::internal::set_is_malloc_allowed(false);
    AllocationTrap trap;
    solver.accelerations(in, 0, workspace, vdot, force);
    solver.accelerations(in, 5, workspace, vdot, force);
    for (double& x : v) x += 1e-3;
    solver.close_velocities(c.state.q, loads.prescribed, workspace, v);
    sum += solver.project({}, workspace, q, v).after.position;
    sum += solver.multipliers()[0] + solver.rank() + solver.contradiction() + solver.least_pivot();
    const long allocations = trap.stop();
    Eigen::internal::set_is_malloc_allowed(true);
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(std::isfinite(sum));
  }
}

}  // namespace
}  // namespace grapnel::testing
