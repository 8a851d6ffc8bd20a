// Joint and base accelerations against MuJoCo and Simbody on random branched robots: |a - a'| / |a| <= 1e-10 if the
// condition number of the mass matrix is below 1e6. The cases include a free root with velocity, joint rates, joint
// forces, external wrenches and gravity.
#include <gtest/gtest.h>

#include "engines/mujoco_engine.hpp"
#include "engines/simbody_engine.hpp"
#include "flexible/flexible_model.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/simulate/phase_dynamics.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel {
namespace engines_test {

using namespace testing;

constexpr int kRobots = 1000;     // with a condition number below the bound
constexpr double kBound = 1e-10;  // the required bound

double condition(const Model& model, const State& state) {
  const Eigen::VectorXd lambda =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(mass_matrix(model, state)).eigenvalues();
  return lambda[lambda.size() - 1] / lambda[0];
}

struct Kinds {
  bool rotors = true;
  bool spherical_joints = true;
};

// Calls compare(index, model, state, forces) for kRobots robots whose mass matrix is well enough conditioned.
template <class Compare>
void for_robots(Kinds kinds, Compare&& compare) {
  int compared = 0, drawn = 0;
  for (; compared < kRobots && drawn < 3 * kRobots; ++drawn) {
    SCOPED_TRACE(seed_note(drawn));
    Random random(drawn);
    RobotOptions options;
    options.rotors = kinds.rotors;
    options.free_root = drawn % 5 != 4;
    options.spherical_joints = kinds.spherical_joints && drawn % 4 == 3;
    options.targets = drawn % 7 == 6 ? 1 : 0;
    const Model model = random_model(options, random);
    const State state = random_state(model, random);
    if (model.velocities() == 0 || !(condition(model, state) < 1e6)) continue;
    const Forces forces = random_forces(model, state, random);
    compare(drawn, model, state, forces);
    if (::testing::Test::HasFailure()) return;
    ++compared;
  }
  std::printf("[ measured ] %d robots compared of %d drawn\n", compared, drawn);
  EXPECT_EQ(compared, kRobots);
}

TEST(Mujoco, AgreesOnAccelerations) {
  Worst difference("MuJoCo, |a - a'| / |a|");
  for_robots({}, [&](int i, const Model& model, const State& state, const Forces& forces) {
    MujocoEngine engine(model);
    const std::vector<double> a = forward_dynamics(model, state, forces), other = engine.acceleration(state, forces);
    EXPECT_LE(difference.note(relative_difference(eigen(other), eigen(a)), i), kBound);
    // measured 1.4e-12; 1.7e-11 over 40 seeds
  });
}

// A free base with two beams with large planar bending at high rates: MuJoCo's own springs and dampers on the same
// segments. (MuJoCo does not support massless bodies, which bending in two planes requires.)
TEST(Mujoco, AgreesOnFlexibleBeams) {
  Worst difference("MuJoCo, bending beams, |a - a'| / |a|");
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    RobotSetup robot = only_base(30, 5);
    BodyDescription first = slender_link("first", "base", JointType::revolute, 2, 3, 400, 2);
    BodyDescription second = slender_link("second", "first", JointType::revolute, 1, 2, 90, 1 + i % 3);
    for (BodyDescription* link : {&first, &second}) {
      link->beam->damping_ratio = 0.02;
      link->inertia.xx = 0.05, link->inertia.yy += 0.1, link->inertia.zz += 0.1;
    }
    first.X_PF.p = {0.5, 0.1, 0}, second.X_PF.p = {2, 0, 0};
    second.joint.axis = {0, 1, 0};
    robot.bodies.insert(robot.bodies.end(), {first, second});
    const Model model = model_of(robot);
    Random random(i);
    const State state = random_state(model, random);
    PhaseDynamics dynamics(model, {});
    const std::vector<double> y = dynamics.initial(state, 0);
    std::vector<double> dydt(y.size());
    dynamics(0, y, dydt);
    const Eigen::VectorXd a =
        Eigen::Map<const Eigen::VectorXd>(&dydt[static_cast<std::size_t>(model.coordinates())], model.velocities());
    MujocoEngine engine(model);
    Forces none;
    none.generalized.assign(static_cast<std::size_t>(model.velocities()), 0.0);
    EXPECT_LE(difference.note(relative_difference(eigen(engine.acceleration(state, none)), a), i), 1e-10);
  }
}

TEST(Mujoco, AgreesOnMassMatrixAndBias) {
  Worst matrix("MuJoCo, mass matrix"), vector("MuJoCo, bias");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    Random random(i);
    RobotOptions options;
    options.free_root = i % 5 != 4;
    options.spherical_joints = i % 4 == 3;
    const Model model = random_model(options, random);
    const State state = random_state(model, random);
    if (model.velocities() == 0) continue;
    const Forces forces = random_forces(model, state, random);
    MujocoEngine engine(model);
    engine.acceleration(state, forces);
    ASSERT_LT(matrix.note(relative_difference(engine.mass_matrix(), mass_matrix(model, state)), i),
              1e-12);  // measured 2.7e-15
    Workspace workspace(model);
    std::vector<double> c;
    bias(model, state, forces.gravity, workspace, c);
    ASSERT_LT(vector.note(relative_difference(engine.bias(), eigen(c)), i), 1e-12);  // measured 8.6e-15
  }
}

TEST(Simbody, AgreesOnAccelerations) {
  Worst difference("Simbody, |a - a'| / |a|");
  for_robots({.rotors = false, .spherical_joints = false},
             [&](int i, const Model& model, const State& state, const Forces& forces) {
               SimbodyEngine engine(model);
               const std::vector<double> a = forward_dynamics(model, state, forces);
               const std::vector<double> other = engine.acceleration(state, forces);
               EXPECT_LE(difference.note(relative_difference(eigen(other), eigen(a)), i), kBound);
               // measured 4.9e-13; 5.1e-13 over 40 seeds
             });
}

// Simbody's ball joints are less accurate. On robot 715 of seed 11 (condition number 2.5e4) its accelerations differ by
// 1.0e-10 from those of Grapnel, MuJoCo and a long-double solution of M a = tau - c, which agree to 1.3e-12; its
// residual is 260 times Grapnel's. Therefore the bound is larger here.
TEST(Simbody, AgreesOnBallJointsToSimbodysAccuracy) {
  Worst difference("Simbody with ball joints, |a - a'| / |a|");
  for_robots({.rotors = false}, [&](int i, const Model& model, const State& state, const Forces& forces) {
    SimbodyEngine engine(model);
    const std::vector<double> a = forward_dynamics(model, state, forces), other = engine.acceleration(state, forces);
    EXPECT_LE(difference.note(relative_difference(eigen(other), eigen(a)), i),
              1e-7);  // measured 8.9e-13; 1.0e-10 over 40 seeds
  });
}

}  // namespace engines_test
}  // namespace grapnel
