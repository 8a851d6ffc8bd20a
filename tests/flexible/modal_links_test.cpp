/// Flexible links with few modes: against the same segments with dense matrices over the modes, and against segments
/// with all degrees of freedom.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "flexible/flexible_model.hpp"
#include "grapnel/constraint/constrained_dynamics.hpp"
#include "grapnel/dynamics/elastic_modes.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/impact/bilateral_restitution.hpp"
#include "grapnel/impact/contact_impact.hpp"
#include "grapnel/impact/impulse_measures.hpp"
#include "grapnel/impact/impulse_sensitivity.hpp"
#include "grapnel/impact/plastic_impact.hpp"
#include "grapnel/simulate/simulate_phase.hpp"
#include "grapnel/spatial/decompositions.hpp"

namespace grapnel::testing {
namespace modal_links_test {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A free base with an arm of two beams, a boom in the middle of the first, and a rigid arm.
RobotSetup two_arms(std::optional<int> modes) {
  RobotSetup robot = only_base(50, 10);
  BodyDescription first = slender_link("first", "base", JointType::revolute, 2, 2, 40, 3);
  first.X_PF.p = {0.5, 0, 0.2};
  first.beam->bending_stiffness_y = 60, first.beam->torsional_stiffness = 20;
  first.inertia.xx = 0.05;
  first.inertia.yy += 0.05, first.inertia.zz += 0.05;
  BodyDescription second = slender_link("second", "first", JointType::revolute, 1, 2, 30, 2);
  second.X_PF.p = {2, 0, 0};
  second.joint.axis = {0, 1, 0};
  second.beam->from = {0.1, 0, 0}, second.beam->mass_per_length = 1.5;
  second.beam->damping_ratio = first.beam->damping_ratio = 0.01;
  for (BodyDescription* link : {&first, &second}) link->beam->modes = modes, link->beam->fastest_mode = 1e9;
  BodyDescription boom;
  boom.name = "boom", boom.parent = "first", boom.X_PF.p = {0.9, 0.1, 0};
  boom.joint.name = "boom-joint", boom.joint.type = JointType::revolute, boom.joint.axis = {1, 0, 0};
  boom.mass = 3, boom.com = {0, 0.4, 0.1}, boom.inertia = Symmetric3d::diagonal(0.3, 0.1, 0.25);
  BodyDescription arm = boom;
  arm.name = "arm", arm.parent = "base", arm.X_PF.p = {-0.3, 0.4, 0};
  arm.joint.name = "arm-joint", arm.joint.type = JointType::spherical;
  robot.bodies.insert(robot.bodies.end(), {first, second, boom, arm});
  return robot;
}

Model with_ball(const RobotSetup& robot) {
  ModelBuilder builder(model_of(robot));
  BodyDescription ball;
  ball.name = "ball", ball.joint.name = "ball", ball.joint.type = JointType::free;
  ball.mass = 20, ball.com = {0.1, 0, 0.05}, ball.inertia = Symmetric3d::diagonal(1, 2, 1.5);
  return builder.add(ball).build();
}

// The same model twice: with modal and with independent beam joints. Columns of T: the admissible velocities.
struct Pair {
  explicit Pair(int modes) : model(with_ball(two_arms(modes))), independent(with_ball(two_arms({}))) {
    const auto n = static_cast<Index>(model.velocities());
    std::vector<bool> in_chain(static_cast<std::size_t>(n));
    for (const ModalChain& chain : model.tree().chains) {
      for (const int v : chain.velocities) in_chain[static_cast<std::size_t>(v)] = true;
    }
    T = MatrixXd::Zero(n, n);
    Index column = 0;
    for (int v = 0; v < n; ++v) {
      if (!in_chain[static_cast<std::size_t>(v)]) T(v, column++) = 1;
    }
    for (const ModalChain& chain : model.tree().chains) {
      for (int k = 0; k < chain.modes; ++k, ++column) {
        for (std::size_t j = 0; j < chain.velocities.size(); ++j)
          T(chain.velocities[j], column) = chain.row(static_cast<int>(j))[k];
      }
    }
    T.conservativeResize(n, column);
  }
  State random_state(std::mt19937& random) const {
    std::normal_distribution<double> normal;
    State state = zero_state(model);
    for (const int body : model.joints()) state.q[model.bodies()[body].q] = 0.3 * normal(random);
    for (const int offset : model.quaternions()) {
      double size = 0;
      for (int k = 0; k < 4; ++k) state.q[offset + k] = normal(random), size += std::pow(state.q[offset + k], 2);
      for (int k = 0; k < 4; ++k) state.q[offset + k] /= std::sqrt(size);
    }
    const VectorXd z = VectorXd::NullaryExpr(T.cols(), [&] { return 0.5 * normal(random); });
    const VectorXd v = T * z;
    state.v.assign(v.begin(), v.end());
    return state;
  }
  // In modal coordinates: z'' with T^T M T z'' = T^T (right - c).
  VectorXd reduced(const MatrixXd& M, const VectorXd& right) const {
    return T * (T.transpose() * M * T).llt().solve(T.transpose() * right);
  }
  Model model, independent;
  MatrixXd T;
};

VectorXd random_vector(Index n, std::mt19937& random) {
  std::normal_distribution<double> normal;
  return VectorXd::NullaryExpr(n, [&] { return normal(random); });
}
std::vector<double> numbers(const VectorXd& x) { return {x.begin(), x.end()}; }

VectorXd bias_of(const Model& model, const State& state, const Vector3d& gravity) {
  Workspace workspace(model);
  std::vector<double> c;
  bias(model, state, gravity, workspace, c);
  return as_vector(c);
}

LoopClosure tie(const Model& model, const char* a, const char* b, GraspModel kind) {
  LoopClosure closure;
  closure.name = std::string(a) + "-" + b;
  closure.body_a = model.body_index(a), closure.body_b = model.body_index(b);
  closure.X_AC = {rotation_about({0.6, 0, 0.8}, 0.4), {0.1, 0.05, -0.02}};
  closure.X_BD = {rotation_about({0, 1, 0}, -0.7), {-0.2, 0.1, 0.3}};
  closure.model = kind;
  return closure;
}

// Loops within one flexible link (the chains meet on a segment, from either side), from a branch in its middle, between
// two trees, and two that share a link.
std::vector<LoopClosure> closures_of(const Model& model, int which) {
  std::vector<LoopClosure> all{
      tie(model, "first:4", "boom", GraspModel::point), tie(model, "second", "arm", GraspModel::hinge),
      tie(model, "second:2", "ball", GraspModel::rigid), tie(model, "boom", "ball", GraspModel::point),
      tie(model, "boom", "first:5", GraspModel::point)};
  switch (which) {
    case 0:
      return {all[0]};
    case 1:
      return {all[1]};
    case 2:
      return {all[2], all[3]};
    case 3:
      return {all[4]};
    default:
      return {all[1], all[2]};
  }
}

// Jacobian of the closures: body a relative to body b at C, in C's axes.
MatrixXd closure_jacobian(const Model& model, const std::vector<LoopClosure>& closures, const State& state) {
  const Kinematics k = forward_kinematics(model, state);
  MatrixXd J(closure_rows(closures), model.velocities()), J_a(6, model.velocities()), J_b(6, model.velocities());
  Index row = 0;
  for (const LoopClosure& c : closures) {
    const Posed X_WC = k.X_WB[c.body_a] * c.X_AC;
    point_jacobian(model, k, c.body_a, X_WC.p, J_a);
    point_jacobian(model, k, c.body_b, X_WC.p, J_b);
    Vector3d axes[3];
    const int turns = forbidden_turns(c, axes);
    for (int r = 0; r < turns + 3; ++r, ++row) {
      const Vector3d d = X_WC.R * (r < turns ? axes[r] : Vector3d::unit(r - turns));
      const Eigen::RowVector3d e(d[0], d[1], d[2]);
      J.row(row) = e * (r < turns ? (J_a - J_b).topRows<3>() : (J_a - J_b).bottomRows<3>());
    }
  }
  return J;
}

// The rows' velocities at a time h later, with C and D fixed to their bodies; D's velocity is taken at D (8.5).
VectorXd moved_rows(const Model& model, const std::vector<LoopClosure>& closures, State state,
                    const std::vector<double>& vdot, double h) {
  std::vector<double> rates(state.q.size());
  coordinate_rates(model, state.q, state.v, rates);
  for (std::size_t i = 0; i < rates.size(); ++i) state.q[i] += h * rates[i];
  for (std::size_t i = 0; i < vdot.size(); ++i) state.v[i] += h * vdot[i];
  return closure_jacobian(model, closures, state) * as_vector(state.v);
}

TEST(ModalLinks, ForwardDynamicsAgreesWithModalCoordinates) {
  std::mt19937 random(5);
  for (const int modes : {1, 2, 4}) {
    const Pair pair(modes);
    ASSERT_EQ(pair.model.tree().chains.size(), 2u);
    for (int trial = 0; trial < 5; ++trial) {
      const State state = pair.random_state(random);
      const Vector3d gravity{0.1, -3, 5};
      const VectorXd f = random_vector(pair.model.velocities(), random);
      Forces forces;
      forces.generalized = numbers(f), forces.gravity = gravity;
      const VectorXd vdot = as_vector(forward_dynamics(pair.model, state, forces));
      const VectorXd wanted =
          pair.reduced(mass_matrix(pair.independent, state), f - bias_of(pair.independent, state, gravity));
      EXPECT_LT((vdot - wanted).norm(), 1e-10 * wanted.norm()) << modes;  // measured 2e-12
      // Mass matrix and Jacobians agree.
      const VectorXd by_matrix = mass_matrix(pair.model, state).llt().solve(f - bias_of(pair.model, state, gravity));
      EXPECT_LT((pair.T.transpose() * (by_matrix - wanted)).norm(), 1e-10 * wanted.norm()) << modes;
      const VectorXd v = as_vector(state.v);
      EXPECT_NEAR(v.dot(mass_matrix(pair.model, state) * v), v.dot(mass_matrix(pair.independent, state) * v),
                  1e-12 * v.squaredNorm());
    }
  }
}

TEST(ModalLinks, AllModesEqualIndependentJoints) {
  const Pair pair(6);  // both kinds of the second link have four hinges
  std::mt19937 random(6);
  const State state = pair.random_state(random);
  const VectorXd f = random_vector(pair.model.velocities(), random);
  Forces forces;
  forces.generalized = numbers(f);
  const VectorXd a = as_vector(forward_dynamics(pair.model, state, forces));
  const VectorXd b = as_vector(forward_dynamics(pair.independent, state, forces));
  EXPECT_LT((a - b).norm(), 1e-9 * b.norm());
}

// Links with joints of prescribed acceleration, and a completely prescribed link.
TEST(ModalLinks, PrescribedJoints) {
  std::mt19937 random(7);
  const Pair pair(2);
  for (const bool link_too : {false, true}) {
    const State state = pair.random_state(random);
    const auto n = static_cast<std::size_t>(pair.model.velocities());
    std::vector<std::uint8_t> prescribed(n);
    prescribed[static_cast<std::size_t>(pair.model.bodies()[pair.model.body_index("second")].v)] = 1;
    if (link_too) {
      for (const int v : pair.model.tree().chains[0].velocities) prescribed[static_cast<std::size_t>(v)] = 1;
    }
    const VectorXd z = random_vector(pair.T.cols(), random), given = pair.T * z, f = random_vector(n, random);
    std::vector<double> vdot(n), force(n);
    const std::vector<double> g = numbers(given), ff = numbers(f);
    DynamicsInput<double> in;
    in.q = state.q, in.v = state.v, in.force = ff, in.prescribed = prescribed, in.acceleration = g;
    DynamicsWorkspace<double> workspace(pair.model.tree());
    articulated_body<double>(pair.model.tree(), in, workspace, vdot, force);
    // The same with the free and the prescribed columns of T.
    std::vector<int> free;
    VectorXd known = VectorXd::Zero(static_cast<Index>(n));
    for (Index c = 0; c < pair.T.cols(); ++c) {
      bool is_given = false;
      for (std::size_t v = 0; v < n; ++v)
        is_given = is_given || (prescribed[v] && pair.T(static_cast<Index>(v), c) != 0);
      if (is_given) {
        known += z[c] * pair.T.col(c);
      } else {
        free.push_back(static_cast<int>(c));
      }
    }
    const MatrixXd M = mass_matrix(pair.independent, state), T = pair.T(Eigen::all, free);
    const VectorXd right = f - bias_of(pair.independent, state, {}) - M * known;
    const VectorXd wanted = known + T * (T.transpose() * M * T).llt().solve(T.transpose() * right);
    EXPECT_LT((as_vector(vdot) - wanted).norm(), 1e-10 * wanted.norm()) << link_too;
  }
}

TEST(ModalLinks, LoopsThroughModalLinks) {
  std::mt19937 random(8);
  for (const int modes : {1, 3}) {
    const Pair pair(modes);
    const auto n = static_cast<std::size_t>(pair.model.velocities());
    for (int which = 0; which < 5; ++which) {
      const std::vector<LoopClosure> closures = closures_of(pair.model, which);
      LoopSolver solver(pair.model, closures);
      Workspace workspace(pair.model);
      for (int trial = 0; trial < 3; ++trial) {
        const State state = pair.random_state(random);
        const VectorXd f = random_vector(static_cast<Index>(n), random);
        const std::vector<double> force = numbers(f);
        DynamicsInput<double> in;
        in.q = state.q, in.v = state.v, in.force = force;
        std::vector<double> vdot(n), applied(n);
        solver.accelerations(in, 0, workspace, vdot, applied);
        const MatrixXd J = closure_jacobian(pair.independent, closures, state);
        // The rates of the rows vanish, J vdot + Jdot v = 0: by finite differences along the motion.
        const VectorXd u_before = moved_rows(pair.independent, closures, state, vdot, -1e-6);
        const VectorXd u_after = moved_rows(pair.independent, closures, state, vdot, 1e-6);
        const double size = (J.cwiseAbs() * as_vector(vdot).cwiseAbs()).maxCoeff();
        EXPECT_LT((u_after - u_before).norm() / 2e-6, 1e-7 * size) << modes << ' ' << which;
        // W agrees with that of T.
        const MatrixXd M = mass_matrix(pair.independent, state), J_T = J * pair.T;
        const MatrixXd W = J_T * (pair.T.transpose() * M * pair.T).llt().solve(J_T.transpose());
        EXPECT_LT((solver.contact_inertia() - W).norm(), 1e-10 * W.norm()) << modes << ' ' << which;
        // So does the motion due to the multipliers.
        const Eigen::Map<const VectorXd> lambda(solver.multipliers().data(), J.rows());
        const VectorXd wanted = pair.reduced(M, f - bias_of(pair.independent, state, {}) + J.transpose() * lambda);
        EXPECT_LT((as_vector(vdot) - wanted).norm(), 1e-8 * wanted.norm()) << modes << ' ' << which;
        // Velocities after closing the loops.
        std::vector<double> closed = state.v;
        solver.close_velocities(state.q, {}, workspace, closed);
        const VectorXd v = as_vector(state.v);
        const VectorXd nearest =
            v - pair.T * (pair.T.transpose() * M * pair.T).llt().solve(J_T.transpose() * W.llt().solve(J * v));
        EXPECT_LT((as_vector(closed) - nearest).norm(), 1e-9 * v.norm()) << modes << ' ' << which;
      }
    }
  }
}

// Accelerations preserve the closures: consistent positions and velocities remain so during one second of motion.
TEST(ModalLinks, LoopsStayClosed) {
  std::mt19937 random(9);
  const Pair pair(2);
  State state = pair.random_state(random);
  const Kinematics k = forward_kinematics(pair.model, state);
  std::vector<LoopClosure> closures{tie(pair.model, "second", "arm", GraspModel::rigid)};
  closures[0].X_BD = inverse(k.X_WB[closures[0].body_b]) * k.X_WB[closures[0].body_a] * closures[0].X_AC;
  LoopSolver solver(pair.model, closures);
  Workspace workspace(pair.model);
  solver.close_velocities(state.q, {}, workspace, state.v);
  PhaseSetup setup;
  setup.closures = closures;
  setup.recover_roots = false;
  PhaseDynamics dynamics(pair.model, setup);
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-11;
  State end;
  const auto momentum = [&](const State& s) {
    return momentum_about(pair.model, forward_kinematics(pair.model, s), Vector3d::zero());
  };
  simulate_phase(dynamics, {state, 0, 1, 0.1}, integration, {.observe = [&](const PhaseSample& s) { end = s.state; }});
  const ClosureDefect d = closure_defect(closures[0], forward_kinematics(pair.model, end));
  EXPECT_LT(std::max({d.position, d.angle, d.velocity, d.angular_velocity}), 1e-8);
  const Momentumd drift = momentum(end) - momentum(state);
  EXPECT_LT(norm(drift.linear) + norm(drift.angular), 1e-9);
  // The joints of the beams still move in their modes only.
  const VectorXd v = as_vector(end.v);
  EXPECT_LT((v - pair.T * (pair.T.transpose() * v)).norm(), 1e-12 * v.norm());
}

// Impacts: against modal coordinates, with redundant grasps and held rates.
TEST(ModalLinks, ImpactsAgreeWithModalCoordinates) {
  std::mt19937 random(10);
  const Pair pair(2);
  const State state = pair.random_state(random);
  const Kinematics k = forward_kinematics(pair.independent, state);
  std::vector<Grasp> grasps(2);
  grasps[0].robot_body = pair.model.body_index("second:2"), grasps[0].target_body = pair.model.body_index("ball");
  grasps[1] = grasps[0], grasps[1].robot_body = pair.model.body_index("arm");
  grasps[0].p_WC = {1.2, 0.2, 0.1}, grasps[1].p_WC = {0.1, 0.6, 0.2};
  grasps[1].model = GraspModel::point;
  const HeldRate held{pair.model.bodies()[pair.model.body_index("first")].v, 0.3};
  const ImpactSolution s = plastic_impact(pair.model, state, grasps, {&held, 1});
  MatrixXd J(10, pair.model.velocities());
  J.topRows(9) = grasp_jacobian(pair.independent, k, grasps);
  J.row(9).setZero(), J(9, held.velocity) = 1;
  VectorXd after = VectorXd::Zero(10);
  after[9] = 0.3;
  const MatrixXd M = mass_matrix(pair.independent, state), J_T = J * pair.T, M_T = pair.T.transpose() * M * pair.T;
  const MatrixXd W = J_T * M_T.llt().solve(J_T.transpose());
  const VectorXd v = as_vector(state.v), P = W.ldlt().solve(after - J * v);
  const VectorXd wanted = v + pair.T * M_T.llt().solve(J_T.transpose() * P);
  EXPECT_LT((as_vector(s.velocity) - wanted).norm(), 1e-10 * wanted.norm());
  EXPECT_NEAR(s.contacts[0].P_WC.linear[1], P[4], 1e-9 * P.norm());
  EXPECT_NEAR(s.held_impulses[0], P[9], 1e-9 * P.norm());
  EXPECT_LT(s.energy_identity_residual, 1e-11);
  EXPECT_LT(s.generalized_momentum_residual, 1e-11);
  EXPECT_LT(s.constraint_residual, 1e-11);

  // Derivatives with respect to the target's velocity, by finite differences.
  const auto sensitivities = impulse_sensitivities(pair.model, state, 0, grasps, {&held, 1});
  ASSERT_FALSE(sensitivities.empty());
  for (const ImpulseSensitivity& d : sensitivities) {
    if (d.parameter != "target mass") continue;
    const auto impulse_with = [&](double mass) {
      ModelBuilder builder;
      for (const Body& b : pair.model.bodies()) {
        BodyDescription body = b.description;
        if (body.name == "ball") body.mass += mass;
        builder.add(body);
      }
      return plastic_impact(builder.build(), state, grasps, {&held, 1}).contacts[0].P_WC;
    };
    const Impulsed difference = (1 / 2e-3) * (impulse_with(1e-3) - impulse_with(-1e-3));
    EXPECT_NEAR(d.impulse[0].linear[0], difference.linear[0], 1e-6 * norm(difference.linear));
    EXPECT_NEAR(d.impulse[0].angular[2], difference.angular[2], 1e-6 * norm(difference.angular));
  }
}

// Modes of vibration held during an impact (HeldRate::row), with every impact law, and the remaining inertia: M^-1 - X
// X^T, X their shapes.
TEST(FastModes, AreHeldByEveryImpactLaw) {
  std::mt19937 random(11);
  const Pair pair(2);
  const Model& model = pair.independent;
  const State state = pair.random_state(random);
  const MatrixXd M = mass_matrix(model, state);
  const VectorXd v = as_vector(state.v);
  const std::vector<ElasticMode> modes = elastic_modes(model, state, {});
  std::vector<HeldRate> held;
  MatrixXd X(model.velocities(), static_cast<Index>(modes.size()) - 4);
  for (std::size_t i = 4; i < modes.size(); ++i) {
    X.col(static_cast<Index>(i) - 4) = modes[i].shape;
    const VectorXd row = M * modes[i].shape;
    held.push_back({-1, row.dot(v), numbers(row)});
  }
  const auto held_change = [&](const std::vector<double>& after) {
    return (X.transpose() * M * (as_vector(after) - v)).norm();
  };
  std::vector<Grasp> grasps(1);
  grasps[0].robot_body = model.body_index("second:2"), grasps[0].target_body = model.body_index("ball");
  grasps[0].p_WC = {1.2, 0.2, 0.1};
  const MatrixXd J = grasp_jacobian(model, forward_kinematics(model, state), grasps);
  const MatrixXd W = J * (M.inverse() - X * X.transpose()) * J.transpose();
  EXPECT_LT((impulse_measures(model, state, 0, grasps, {}, held).contact_inertia - W).norm(), 1e-10 * W.norm());

  const ImpactSolution plastic = plastic_impact(model, state, grasps, held);
  EXPECT_LT(held_change(plastic.velocity), 1e-10 * v.norm());
  EXPECT_LT((J * as_vector(plastic.velocity)).norm(), 1e-10 * (J * v).norm());
  const std::vector<std::vector<double>> half{std::vector<double>(6, 0.5)};
  const ImpactSolution thrown = bilateral_restitution(model, state, grasps, half, held);
  EXPECT_LT(held_change(thrown.velocity), 1e-10 * v.norm());
  EXPECT_LT((J * (as_vector(thrown.velocity) + 0.5 * v)).norm(), 1e-10 * (J * v).norm());
  EXPECT_EQ(thrown.inconsistent, "");

  ContactPoint contact;
  contact.robot_body = grasps[0].robot_body, contact.target_body = grasps[0].target_body;
  contact.p_WC = grasps[0].p_WC, contact.restitution = 0.5, contact.friction = 0.2;
  const Eigen::Vector3d n = -(J * v).tail<3>().normalized();  // they approach
  contact.n_W = {n[0], n[1], n[2]};
  const ImpactSolution rebound = contact_impact(model, state, {&contact, 1}, RestitutionHypothesis::stronge, {}, held);
  EXPECT_GT(rebound.points[0].normal, 0);
  EXPECT_LT(held_change(rebound.velocity), 1e-10 * v.norm());
  EXPECT_LT(rebound.generalized_momentum_residual, 1e-10);
  EXPECT_LT(rebound.energy_identity_residual, 1e-10);
}

// Clamped and with its payload, the retained modes equal those of the segments exactly.
TEST(ModalLinks, PreservesFrequenciesOfClampedLink) {
  for (const double tip : {0.0, 5.0}) {
    const auto model_with = [&](std::optional<int> modes) {
      RobotSetup robot = only_base(1, 1, true);
      BodyDescription link = slender_link("beam", "base", JointType::revolute, 3, 2, 500, 4);
      link.beam->modes = modes, link.beam->fastest_mode = 1e6;
      robot.bodies.push_back(link);
      if (tip > 0) {
        BodyDescription load = robot.bodies.front();
        load.name = "load", load.parent = "beam", load.X_PF.p = {3, 0, 0};
        load.joint.name = "wrist", load.joint.type = JointType::revolute;
        load.mass = tip, load.com = {0.2, 0.1, 0};
        robot.bodies.push_back(load);
      }
      return model_of(robot);
    };
    const Model independent = model_with({}), modal = model_with(3);
    std::vector<int> held = velocities_of(independent, "beam");
    if (tip > 0) held.push_back(velocities_of(independent, "load").front());
    const auto a = elastic_modes(independent, zero_state(independent), held),
               b = elastic_modes(modal, zero_state(modal), held);
    ASSERT_EQ(b.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(b[i].frequency, a[i].frequency, 1e-10 * a[i].frequency) << tip << ' ' << i;
      EXPECT_NEAR(b[i].damping_ratio, a[i].damping_ratio, 1e-10);
    }
    // With a free joint the lowest modes differ by the effect of the omitted modes.
    const auto c = elastic_modes(independent, zero_state(independent), {}),
               d = elastic_modes(modal, zero_state(modal), {});
    EXPECT_NEAR(d[0].frequency, c[0].frequency, 2e-2 * c[0].frequency) << tip;
    EXPECT_GE(d[0].frequency, c[0].frequency * (1 - 1e-12)) << "by Rayleigh";
  }
}

}  // namespace modal_links_test
}  // namespace grapnel::testing
