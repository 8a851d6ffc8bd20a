#include "grapnel/dynamics/articulated_body_kernel.hpp"
#include "grapnel/dynamics/composite_body_kernel.hpp"
#include "grapnel/dynamics/newton_euler_kernel.hpp"

#include "bench/operation_count.hpp"

namespace grapnel {
namespace {

bench::OperationCount tally;

struct Counted {
  double value;
  Counted() = default;
  Counted(double v) : value(v) {}  // NOLINT(google-explicit-constructor): constants mix with scalars
};
Counted operator+(Counted a, Counted b) { return ++tally.additions, a.value + b.value; }
Counted operator-(Counted a, Counted b) { return ++tally.additions, a.value - b.value; }
Counted operator*(Counted a, Counted b) { return ++tally.multiplications, a.value * b.value; }
Counted operator/(Counted a, Counted b) { return ++tally.divisions, a.value / b.value; }
Counted operator-(Counted a) { return -a.value; }  // counts with the operation that uses it
Counted& operator+=(Counted& a, Counted b) { return a = a + b; }
Counted& operator-=(Counted& a, Counted b) { return a = a - b; }
[[maybe_unused]] Counted& operator*=(Counted& a, Counted b) { return a = a * b; }
Counted sin(Counted a) { return ++tally.sine_cosines, std::sin(a.value); }
Counted cos(Counted a) { return std::cos(a.value); }

// One case of a workload with the counting scalar.
struct CountedCase {
  Tree<Counted> tree;
  std::vector<Counted> q, v, force, result, applied;
  DynamicsWorkspace<Counted> workspace;
  DynamicsInput<Counted> in;

  explicit CountedCase(const bench::Workload& workload)
      : tree(convert_tree<Counted>(workload.model.tree())),
        q(workload.states[0].q.begin(), workload.states[0].q.end()),
        v(workload.states[0].v.begin(), workload.states[0].v.end()),
        force(workload.forces[0].generalized.begin(), workload.forces[0].generalized.end()),
        result(v.size() * v.size()),
        applied(v.size()),
        workspace(tree) {
    in.q = q, in.v = v, in.force = force;
    tally = {};
  }
};

}  // namespace

bench::OperationCount bench::count_forward_dynamics(const Workload& workload) {
  CountedCase c(workload);
  articulated_body<Counted>(c.tree, c.in, c.workspace, std::span(c.result).first(c.v.size()), c.applied);
  return tally;
}

bench::OperationCount bench::count_inverse_dynamics(const Workload& workload) {
  CountedCase c(workload);
  c.in.acceleration = c.force;
  newton_euler<Counted>(c.tree, c.in, c.workspace, c.applied);
  return tally;
}

bench::OperationCount bench::count_mass_matrix(const Workload& workload) {
  CountedCase c(workload);
  composite_body<Counted>(c.tree, c.q, c.workspace, c.result);
  return tally;
}

}  // namespace grapnel
