// Derivatives of the dynamics in lanes against dual numbers and against those of single states, on random systems of
// all kinds of joints and roots, with rotors, external wrenches and given accelerations.
#include <gtest/gtest.h>

#include <cmath>

#include "dynamics/dual_dynamics.hpp"
#include "grapnel/dynamics/dynamics_derivatives.hpp"
#include "grapnel/lanes/batched_derivatives.hpp"
#include "grapnel/lanes/states.hpp"
#include "support/worst.hpp"

namespace grapnel::lanes {
namespace derivatives_test {

using namespace grapnel::testing;

constexpr std::size_t kStates = 5;  // not a multiple of a width but one

// Results of all states, row-major.
struct Results {
  std::vector<double> vdot, dq, dv, dtau, dwrench;
  std::vector<double> tau, tau_dq, tau_dv, mass;
};

// Several states of one system; the first is the case itself. The wrenches act at the points of their links in it.
struct Batch {
  Case c;
  PrescribedMotion given;
  std::vector<State> states;
  std::vector<double> q, v, force, acceleration;
  std::vector<StateWrench> wrenches;
  std::vector<Vector3d> points;  // of the wrenches, in their bodies

  Batch(int index, bool prescribes) : c(case_with_rotors(index)) {
    if (prescribes) given = some_prescribed(c, index);
    Random random(500000 + index);
    const int n = c.model.velocities();
    const std::vector<double> vdot = given.prescribed.empty() ? random.values(n, 3) : given.vdot;
    for (std::size_t k = 0; k < kStates; ++k) {
      states.push_back(k == 0 ? c.state : random_state(c.model, random));
      q.insert(q.end(), states[k].q.begin(), states[k].q.end());
      v.insert(v.end(), states[k].v.begin(), states[k].v.end());
      force.insert(force.end(), c.forces.generalized.begin(), c.forces.generalized.end());
      acceleration.insert(acceleration.end(), vdot.begin(), vdot.end());
    }
    const Kinematics kinematics = forward_kinematics(c.model, c.state);
    for (const ExternalWrench& e : c.forces.external) {
      const BodyPlacement& placement = c.model.bodies()[static_cast<std::size_t>(e.body)].placement;
      points.push_back(inverse(kinematics.X_WB[static_cast<std::size_t>(e.body)]) * e.p_WP);
      const Vector3d p = placement.X_LB * points.back();
      StateWrench w{placement.link, {p[0], p[1], p[2]}, {}};
      for (int i = 0; i < 3; ++i) w.F_W[i] = e.F_W.angular[i], w.F_W[3 + i] = e.F_W.linear[i];
      wrenches.push_back(w);
    }
  }

  // Of state k alone.
  Forces forces(std::size_t k) const {
    Forces result = c.forces;
    const Kinematics kinematics = forward_kinematics(c.model, states[k]);
    for (std::size_t e = 0; e < points.size(); ++e)
      result.external[e].p_WP = kinematics.X_WB[static_cast<std::size_t>(result.external[e].body)] * points[e];
    return result;
  }

  Results compute(InstructionSet set, std::size_t begin, std::size_t count) const {
    const auto n = static_cast<std::size_t>(c.model.velocities()), nq = static_cast<std::size_t>(c.model.coordinates());
    Results r;
    for (std::vector<double>* x : {&r.vdot, &r.tau}) x->assign(count * n, NAN);
    for (std::vector<double>* x : {&r.dq, &r.dv, &r.dtau, &r.tau_dq, &r.tau_dv, &r.mass}) x->assign(count * n * n, NAN);
    r.dwrench.assign(count * n * 6 * wrenches.size(), NAN);
    const auto rows = [&](const std::vector<double>& x, std::size_t width) {
      return StateRows{x.data() + begin * width, static_cast<std::int64_t>(width)};
    };
    StateCases in;
    in.count = static_cast<std::int64_t>(count);
    in.q = rows(q, nq), in.v = rows(v, n), in.force = rows(force, n), in.acceleration = rows(acceleration, n);
    for (int k = 0; k < 3; ++k) in.gravity[k] = c.forces.gravity[k];
    in.wrenches = wrenches.data(), in.wrench_count = static_cast<int>(wrenches.size());
    if (!given.prescribed.empty()) in.prescribed = given.prescribed.data();
    in.forward = {r.vdot.data(), r.dq.data(), r.dv.data(), r.dtau.data(), r.dwrench.data()};
    in.inverse = {r.tau.data(), r.tau_dq.data(), r.tau_dv.data(), r.mass.data(), nullptr};
    States(c.model, set).run(in);
    return r;
  }
};

double error(const std::vector<double>& found, std::size_t k, const Eigen::MatrixXd& expected) {
  const Eigen::Map<const RowMatrix> part(found.data() + k * static_cast<std::size_t>(expected.size()), expected.rows(),
                                         expected.cols());
  return (part - expected).norm() / (1 + expected.norm());
}

TEST(LaneDerivatives, AgreeWithDualNumbers) {
  Worst worst("derivatives in lanes against dual numbers");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Batch batch(i, true);
    const Case& c = batch.c;
    const Results r = batch.compute(supported_instruction_sets().back(), 0, 1);
    DualDynamics dual(c, batch.given);
    const auto forward = [&] { return dual.forward(); };
    ASSERT_LT(worst.note(error(r.dq, 0, columns(c, dual, By::q, forward)), i), 1e-10);
    ASSERT_LT(worst.note(error(r.dv, 0, columns(c, dual, By::v, forward)), i), 1e-10);
    ASSERT_LT(worst.note(error(r.dtau, 0, columns(c, dual, By::force, forward)), i), 1e-10);
    const std::vector<double> vdot(batch.acceleration.begin(), batch.acceleration.begin() + c.model.velocities());
    const auto inverse = [&] { return dual.inverse_of(vdot); };
    ASSERT_LT(worst.note(error(r.tau_dq, 0, columns(c, dual, By::q, inverse)), i), 1e-10);
    ASSERT_LT(worst.note(error(r.tau_dv, 0, columns(c, dual, By::v, inverse)), i), 1e-10);
  }
}

TEST(LaneDerivatives, AgreeWithThoseOfSingleStates) {
  Worst worst("derivatives in lanes against those of single states");
  for (const InstructionSet set : supported_instruction_sets()) {
    for (int i = 0; i < 24; ++i) {
      SCOPED_TRACE(std::string(name(set)) + ", " + seed_note(i));
      const Batch batch(i, true);
      const Results r = batch.compute(set, 0, kStates);
      const auto n = static_cast<std::size_t>(batch.c.model.velocities());
      for (std::size_t k = 0; k < kStates; ++k) {
        const Forces forces = batch.forces(k);
        const auto d = forward_dynamics_derivatives(batch.c.model, batch.states[k], forces, batch.given);
        ASSERT_LT(worst.note(error(r.vdot, k, eigen(d.vdot)), i), 1e-12);
        ASSERT_LT(worst.note(error(r.dq, k, d.dq), i), 1e-11);
        ASSERT_LT(worst.note(error(r.dv, k, d.dv), i), 1e-11);
        ASSERT_LT(worst.note(error(r.dtau, k, d.dtau), i), 1e-11);
        ASSERT_LT(worst.note(error(r.dwrench, k, d.dwrench), i), 1e-11);
        const std::vector<double> vdot(batch.acceleration.begin(), batch.acceleration.begin() + static_cast<int>(n));
        const auto inverse = inverse_dynamics_derivatives(batch.c.model, batch.states[k], vdot, forces);
        ASSERT_LT(worst.note(error(r.tau, k, eigen(inverse.tau)), i), 1e-12);
        ASSERT_LT(worst.note(error(r.tau_dq, k, inverse.dq), i), 1e-11);
        ASSERT_LT(worst.note(error(r.tau_dv, k, inverse.dv), i), 1e-11);
        ASSERT_LT(worst.note(error(r.mass, k, inverse.dvdot), i), 1e-12);
      }
    }
  }
}

TEST(LaneDerivatives, DependOnTheStateAlone) {
  const Batch batch(6, false);
  const Results all = batch.compute(InstructionSet::one_lane, 0, kStates);
  for (const InstructionSet set : supported_instruction_sets()) {
    SCOPED_TRACE(name(set));
    const Results again = batch.compute(set, 0, kStates), one = batch.compute(set, 3, 1);
    if (set != InstructionSet::sse2) {
      EXPECT_EQ(again.dq, all.dq);
      EXPECT_EQ(again.dtau, all.dtau);
      EXPECT_EQ(again.tau_dv, all.tau_dv);
    }
    const auto size = static_cast<std::ptrdiff_t>(one.dq.size());
    EXPECT_EQ(one.dq, std::vector<double>(again.dq.begin() + 3 * size, again.dq.begin() + 4 * size));
    EXPECT_EQ(one.dv, std::vector<double>(again.dv.begin() + 3 * size, again.dv.begin() + 4 * size));
  }
}

TEST(BatchedDerivatives, AgreeWithThoseOfSingleStates) {
  Worst worst("batched derivatives against those of single states");
  for (int i = 0; i < 8; ++i) {
    SCOPED_TRACE(seed_note(i));
    const Batch batch(i, false);
    const Vector3d gravity = batch.c.forces.gravity;
    const BatchedDerivatives forward =
        batched_forward_dynamics_derivatives(batch.c.model, batch.q, batch.v, batch.force, gravity);
    const BatchedDerivatives inverse =
        batched_inverse_dynamics_derivatives(batch.c.model, batch.q, batch.v, batch.acceleration, gravity);
    const auto n = batch.c.model.velocities();
    for (std::size_t k = 0; k < kStates; ++k) {
      const auto d =
          forward_dynamics_derivatives(batch.c.model, batch.states[k], {batch.c.forces.generalized, {}, gravity});
      ASSERT_LT(worst.note(error(forward.value, k, eigen(d.vdot)), i), 1e-12);
      ASSERT_LT(worst.note(error(forward.dq, k, d.dq), i), 1e-11);
      ASSERT_LT(worst.note(error(forward.dv, k, d.dv), i), 1e-11);
      ASSERT_LT(worst.note(error(forward.by_input, k, d.dtau), i), 1e-11);
      const std::vector<double> vdot(batch.acceleration.begin(), batch.acceleration.begin() + n);
      const auto of_tau = inverse_dynamics_derivatives(batch.c.model, batch.states[k], vdot, {{}, {}, gravity});
      ASSERT_LT(worst.note(error(inverse.value, k, eigen(of_tau.tau)), i), 1e-12);
      ASSERT_LT(worst.note(error(inverse.dq, k, of_tau.dq), i), 1e-11);
      ASSERT_LT(worst.note(error(inverse.by_input, k, of_tau.dvdot), i), 1e-11);
    }
  }
}

TEST(BatchedDerivatives, RejectOtherSizes) {
  const Model model = plain_robot(2);
  const std::vector<double> q(2 * 9, 0), v(2 * 8, 0);
  EXPECT_THROW(batched_forward_dynamics_derivatives(model, q, std::vector<double>(8), v, Vector3d::zero()),
               std::invalid_argument);
}

}  // namespace derivatives_test
}  // namespace grapnel::lanes
