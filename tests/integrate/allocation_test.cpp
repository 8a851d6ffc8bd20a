// No heap allocation after construction: operator new is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/integrate/integrate.hpp"
#include "grapnel/integrate/runge_kutta_4.hpp"
#include "integrate/problems.hpp"

namespace {
std::atomic<long> allocations{0};
}

// Not inlined, or g++ takes new and free for a mismatched pair.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace grapnel {
namespace {

using problems::RigidBody;
using problems::Vector;

template <class Method>
long allocations_of_a_run(Method& stepper) {
  const RigidBody body{{3.0, 2.0, 1.0}};
  const Vector y0 = {1, 0, 0, 0, 1.1, 0.1, 0.4};
  Vector y(7);
  EventLocator<double> locator(RigidBody::manifold());
  const auto g = [](double, std::span<const double> state) { return state[5]; };
  const long before = allocations;
  stepper.start(body, 0.0, y0, 30.0);
  int events = 0;
  while (stepper.status() == StepStatus::running) {
    stepper.step(body);
    stepper.interpolate(body, 0.5 * (stepper.previous_time() + stepper.time()), y);
    if (locator.find(stepper, body, g)) ++events;
  }
  stepper.set_end_time(31.0);
  stepper.set_state(body, stepper.state());
  stepper.step(body);
  const long after = allocations;
  EXPECT_GT(events, 3);
  return after - before;
}

TEST(Allocation, TheCounterCounts) {
  const long before = allocations;
  const Vector v(100);
  asm volatile("" : : "r"(v.data()) : "memory");  // prevents the compiler from removing unused memory
  EXPECT_GT(allocations, before);
}

TEST(Allocation, NoneAfterConstruction) {
  DormandPrince853<double> adaptive(RigidBody::manifold(), {});
  EXPECT_EQ(allocations_of_a_run(adaptive), 0);
  RungeKutta4<double> fixed(RigidBody::manifold(), 0.01);
  EXPECT_EQ(allocations_of_a_run(fixed), 0);
}

}  // namespace
}  // namespace grapnel
