// No heap allocation in the dynamics after setup. Two traps, since each misses allocations that the other finds:
// replaced allocation functions of C and C++, and Eigen's own check, which also detects pooled memory.
#include <stdexcept>

#define EIGEN_RUNTIME_NO_MALLOC
// Eigen's check is an assertion; make it an exception in every build type.
#define eigen_assert(condition)                                     \
  do {                                                              \
    if (!(condition)) throw std::logic_error("Eigen: " #condition); \
  } while (false)
#include <Eigen/Core>

#include "dynamics/random_case.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "support/allocation_trap.hpp"

#include <gtest/gtest.h>

#include <cstring>

namespace grapnel {
namespace {

using namespace testing;

// Prevents the compiler from removing an unused allocation.
void use(void* memory) { asm volatile("" : : "r"(memory) : "memory"); }

TEST(AllocationTrap, CatchesEveryAllocation) {
  if (!kTrapWorks) GTEST_SKIP() << "the sanitizer has its own allocator";
  const auto count = [](auto&& allocate) {
    AllocationTrap trap;
    allocate();
    return trap.stop();
  };
  EXPECT_EQ(count([] {}), 0);
  EXPECT_EQ(count([] {
              void* p = std::malloc(8);
              use(p);
              std::free(p);
            }),
            1);
  EXPECT_EQ(count([] {
              void* p = std::calloc(2, 8);
              use(p);
              std::free(p);
            }),
            1);
  EXPECT_EQ(count([] {
              void* p = std::realloc(nullptr, 8);
              use(p);
              std::free(p);
            }),
            1);
  EXPECT_EQ(count([] {
              void* p = std::aligned_alloc(64, 64);
              use(p);
              std::free(p);
            }),
            1);
  EXPECT_EQ(count([] {
              void* p = nullptr;
              use(posix_memalign(&p, 64, 64) == 0 ? p : nullptr);
              std::free(p);
            }),
            1);
  EXPECT_EQ(count([] {
              std::vector<double> v(3);
              use(v.data());
            }),
            1);
  EXPECT_EQ(count([] {
              struct alignas(128) Wide {
                double x;
              };
              auto* p = new Wide;
              use(p);
              delete p;
            }),
            1);
  EXPECT_GE(count([] {
              Eigen::VectorXd v(40);
              use(v.data());
            }),
            1);
}

TEST(AllocationTrap, CatchesEigensAllocations) {
  Eigen::internal::set_is_malloc_allowed(false);
  EXPECT_THROW(
      {
        Eigen::VectorXd v(40);
        use(v.data());
      },
      std::logic_error);
  Eigen::internal::set_is_malloc_allowed(true);
  EXPECT_NO_THROW({
    Eigen::VectorXd v(40);
    use(v.data());
  });
}

TEST(Dynamics, DoesNotAllocateAfterSetup) {
  if (!kTrapWorks) GTEST_SKIP() << "the sanitizer has its own allocator";
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Case c = random_case(i);
    const int n = c.model.velocities();
    Workspace workspace(c.model);
    Kinematics kinematics(c.model);
    std::vector<double> vdot(n), tau(n), h(n), qdot(c.model.coordinates());
    Eigen::MatrixXd M(n, n), J(6, n);
    const auto derivatives = make_derivatives_workspace(c.model);
    ForwardDynamicsDerivatives forward;
    InverseDynamicsDerivatives inverse;
    forward_dynamics_derivatives(c.model, c.state, c.forces, *derivatives, forward);
    inverse_dynamics_derivatives(c.model, c.state, vdot, c.forces, *derivatives, inverse);
    double sum = 0;
    Eigen::internal::set_is_malloc_allowed(false);
    AllocationTrap trap;
    forward_dynamics(c.model, c.state, c.forces, workspace, vdot);
    inverse_dynamics(c.model, c.state, vdot, c.forces, workspace, tau);
    bias(c.model, c.state, c.forces.gravity, workspace, h);
    mass_matrix(c.model, c.state, workspace, M);
    coordinate_rates(c.model, c.state.q, c.state.v, qdot);
    forward_kinematics(c.model, c.state, kinematics);
    point_jacobian(c.model, kinematics, static_cast<int>(c.model.bodies().size()) - 1, {1, 2, 3}, J);
    forward_dynamics_derivatives(c.model, c.state, c.forces, *derivatives, forward);
    inverse_dynamics_derivatives(c.model, c.state, vdot, c.forces, *derivatives, inverse);
    sum += momentum_about(c.model, kinematics, {1, 2, 3}).linear[0] + kinetic_energy(c.model, kinematics, c.state);
    const long allocations = trap.stop();
    Eigen::internal::set_is_malloc_allowed(true);
    EXPECT_EQ(allocations, 0);
    EXPECT_TRUE(std::isfinite(sum));
  }
}

}  // namespace
}  // namespace grapnel
