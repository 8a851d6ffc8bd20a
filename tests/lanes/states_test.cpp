// States in lanes against dynamics/ for single states, on random robots with every kind of joint: equal up to rounding
// error, and identical bits for any neighbours and any width.
#include "grapnel/lanes/states.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "support/random_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::lanes {
namespace states_test {

using namespace grapnel::testing;

constexpr Vector3d kGravity{0.3, -0.2, -1.5};

Model some_model(int i, Random& random) {
  RobotOptions options;
  options.free_root = i % 3 != 2;
  options.spherical_joints = true;
  options.targets = i % 2;
  return random_model(options, random);
}

// Cases of one model, row-major, and their results in lanes.
struct Cases {
  std::vector<State> states;
  std::vector<double> q, v, force, acceleration;
  std::vector<double> motion, accelerations, forces, mass_matrix;
};

Cases some_cases(const Model& model, int count, Random& random) {
  Cases c;
  const auto add = [](std::vector<double>& to, const std::vector<double>& row) {
    to.insert(to.end(), row.begin(), row.end());
  };
  for (int k = 0; k < count; ++k) {
    c.states.push_back(random_state(model, random));
    add(c.q, c.states.back().q), add(c.v, c.states.back().v);
    add(c.force, random.values(model.velocities(), 3)), add(c.acceleration, random.values(model.velocities(), 3));
  }
  return c;
}

void compute(const Model& model, InstructionSet set, Cases& c) {
  const int nq = model.coordinates(), nv = model.velocities();
  StateCases in;
  in.count = static_cast<std::int64_t>(c.states.size());
  const auto rows = [](const std::vector<double>& numbers, int stride) { return StateRows{numbers.data(), stride}; };
  in.q = rows(c.q, nq), in.v = rows(c.v, nv);
  in.force = rows(c.force, nv), in.acceleration = rows(c.acceleration, nv);
  for (int k = 0; k < 3; ++k) in.gravity[k] = kGravity[k];
  const std::size_t count = c.states.size(), n = static_cast<std::size_t>(nv);
  c.motion.assign(count * model.tree().links.size() * kMotionNumbers, NAN);
  c.accelerations.assign(count * n, NAN), c.forces.assign(count * n, NAN), c.mass_matrix.assign(count * n * n, NAN);
  in.motion = c.motion.data(), in.accelerations = c.accelerations.data();
  in.forces = c.forces.data(), in.mass_matrix = c.mass_matrix.data();
  States(model, set).run(in);
}

// The largest difference of part k of `found`, relative to the largest of `expected`.
double difference(const std::vector<double>& found, std::size_t k, const std::vector<double>& expected) {
  double largest = 0, scale = 1e-300;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double d = std::abs(found[k * expected.size() + i] - expected[i]);
    largest = std::isnan(d) ? INFINITY : std::max(largest, d);
    scale = std::max(scale, std::abs(expected[i]));
  }
  return expected.empty() ? 0 : largest / scale;
}

std::vector<double> numbers_of(const std::vector<LinkMotion<double>>& links) {
  std::vector<double> numbers;
  for (const LinkMotion<double>& link : links) {
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) numbers.push_back(link.X_WL.R(r, c));
    for (int r = 0; r < 3; ++r) numbers.push_back(link.X_WL.p[r]);
    for (int r = 0; r < 3; ++r) numbers.push_back(link.V_WL.angular[r]);
    for (int r = 0; r < 3; ++r) numbers.push_back(link.V_WL.linear[r]);
  }
  return numbers;
}

TEST(States, AgreeWithScalarDynamics) {
  Worst motion("motion"), forward("forward dynamics"), inverse("inverse dynamics"), mass("mass matrix");
  for (const InstructionSet set : supported_instruction_sets()) {
    for (int i = 0; i < 12; ++i) {
      SCOPED_TRACE(std::string(name(set)) + ", " + seed_note(i));
      Random random(i);
      const Model model = some_model(i, random);
      Cases c = some_cases(model, 11, random);  // not a multiple of the width
      compute(model, set, c);
      Workspace workspace(model);
      for (std::size_t k = 0; k < c.states.size(); ++k) {
        const std::size_t n = static_cast<std::size_t>(model.velocities());
        const auto row = [&](const std::vector<double>& of) {
          return std::vector<double>(of.begin() + static_cast<std::ptrdiff_t>(k * n),
                                     of.begin() + static_cast<std::ptrdiff_t>((k + 1) * n));
        };
        const State& state = c.states[k];
        std::vector<double> expected;
        forward_dynamics(model, state, {row(c.force), {}, kGravity}, workspace, expected);
        EXPECT_LT(forward.note(difference(c.accelerations, k, expected), i), 1e-12);  // measured 6.4e-15
        inverse_dynamics(model, state, row(c.acceleration), {{}, {}, kGravity}, workspace, expected);
        EXPECT_LT(inverse.note(difference(c.forces, k, expected), i), 1e-13);  // measured 1.4e-15
        const Eigen::MatrixXd M = mass_matrix(model, state);
        EXPECT_LT(mass.note(difference(c.mass_matrix, k, {M.data(), M.data() + M.size()}), i),
                  1e-14);  // measured 5.1e-16
        EXPECT_LT(motion.note(difference(c.motion, k, numbers_of(forward_kinematics(model, state).links)), i),
                  1e-14);  // measured 4.6e-16
      }
    }
  }
}

TEST(States, DependOnTheCaseAlone) {
  Random random(3);
  const Model model = some_model(1, random);
  Cases all = some_cases(model, 13, random);
  compute(model, InstructionSet::one_lane, all);
  for (const InstructionSet set : supported_instruction_sets()) {
    SCOPED_TRACE(name(set));
    Cases again = all;
    compute(model, set, again);
    if (set != InstructionSet::sse2) {
      EXPECT_EQ(again.motion, all.motion);
      EXPECT_EQ(again.accelerations, all.accelerations);
      EXPECT_EQ(again.forces, all.forces);
      EXPECT_EQ(again.mass_matrix, all.mass_matrix);
    }
    // One case alone.
    const std::size_t k = 9, nq = all.q.size() / 13, nv = all.v.size() / 13;
    Cases one;
    const auto take = [&](const std::vector<double>& from, std::size_t n) {
      return std::vector<double>(from.begin() + static_cast<std::ptrdiff_t>(k * n),
                                 from.begin() + static_cast<std::ptrdiff_t>((k + 1) * n));
    };
    one.states = {all.states[k]};
    one.q = take(all.q, nq), one.v = take(all.v, nv);
    one.force = take(all.force, nv), one.acceleration = take(all.acceleration, nv);
    compute(model, set, one);
    EXPECT_EQ(one.accelerations, take(again.accelerations, nv));
    EXPECT_EQ(one.forces, take(again.forces, nv));
    EXPECT_EQ(one.mass_matrix, take(again.mass_matrix, nv * nv));
    EXPECT_EQ(one.motion, take(again.motion, one.motion.size()));
  }
}

TEST(States, RowsThatAreAbsentAreZeroAndOneRowServesAll) {
  Random random(5);
  const Model model = some_model(0, random);
  const State state = random_state(model, random);
  const std::size_t n = static_cast<std::size_t>(model.velocities());
  std::vector<double> bias_of_all(5 * n), expected;
  StateCases in;
  in.count = 5, in.q = {state.q.data(), 0}, in.v = {state.v.data(), 0}, in.forces = bias_of_all.data();
  States(model).run(in);
  Workspace workspace(model);
  bias(model, state, Vector3d::zero(), workspace, expected);
  for (std::size_t k = 0; k < 5; ++k) EXPECT_LT(difference(bias_of_all, k, expected), 1e-12);
  EXPECT_GT(*std::max_element(expected.begin(), expected.end()), 1e-3);
}

// Kinematics only: dynamics would treat the joints as independent.
TEST(States, RejectModalJoints) {
  ModelBuilder builder;
  BodyDescription body;
  body.name = "base", body.joint.type = JointType::free;
  body.mass = 1, body.inertia = Symmetric3d::diagonal(1, 1, 1);
  builder.add(body);
  body.name = "boom", body.parent = "base", body.joint.name = "root", body.joint.type = JointType::revolute;
  body.joint.modal = ModalJoint{"boom", {1}};
  const Model model = builder.add(body).build();
  const State state = zero_state(model);
  std::vector<double> out(64);
  StateCases in;
  in.count = 1, in.q = {state.q.data(), 0}, in.motion = out.data();
  EXPECT_NO_THROW(States(model).run(in));
  in.motion = nullptr, in.mass_matrix = out.data();
  EXPECT_THROW(States(model).run(in), std::invalid_argument);
  in.mass_matrix = nullptr, in.accelerations = out.data();
  EXPECT_THROW(States(model).run(in), std::invalid_argument);
}

}  // namespace states_test
}  // namespace grapnel::lanes
