/// ImpactSolver against plastic_impact() on the same cases.

#include <gtest/gtest.h>

#include "fast_impact/impact_solver.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impact_solver_test {

// Difference of the velocities v+, relative to the velocities before the impact.
double velocity_difference(const ImpactSolver& fast, const ImpactSolution& careful, const State& before) {
  const Eigen::VectorXd found =
      Eigen::Map<const Eigen::VectorXd>(fast.velocity().data(), static_cast<Eigen::Index>(fast.velocity().size()));
  return (found - eigen(careful.velocity)).norm() / eigen(before.v).norm();
}

// Largest difference of impulses, relative to the largest impulse; angular and linear parts separately.
double impulse_difference(const ImpactSolver& fast, const ImpactSolution& careful) {
  double largest[2] = {1e-300, 1e-300}, off[2] = {0, 0};
  for (std::size_t g = 0; g < careful.contacts.size(); ++g) {
    const Impulsed &P = careful.contacts[g].P_WC, difference = fast.impulses()[g] - P;
    largest[0] = std::max(largest[0], norm(P.angular)), largest[1] = std::max(largest[1], norm(P.linear));
    off[0] = std::max(off[0], norm(difference.angular)), off[1] = std::max(off[1], norm(difference.linear));
  }
  return std::max(off[0] / std::max(largest[0], 1e-3 * largest[1]), off[1] / std::max(largest[1], 1e-3 * largest[0]));
}

ImpactSolver solved(const ImpactCase& c, std::span<const HeldRate> held = {}) {
  ImpactSolver solver(c.model, c.grasps);
  solver.solve(c.state.q, c.state.v, c.grasps, held);
  return solver;
}

void scale_mass(double factor, BodyDescription& body) {
  Symmetric3d& I = body.inertia;
  body.mass *= factor;
  for (double* x : {&I.xx, &I.yy, &I.zz, &I.xy, &I.xz, &I.yz}) *x *= factor;
}

// The planar dual-arm robot with grasps at (+-0.5, 1.35), on one shared target or one target per arm.
ImpactCase planar(bool shared, double target_factor = 1) {
  ModelBuilder builder;
  for (const BodyDescription& b : thesis_robot()) builder.add(b);
  for (const FrameDescription& f : thesis_tips(0.5)) builder.add(f);
  for (int i = 0; i < (shared ? 1 : 2); ++i) {
    BodyDescription target = thesis_target("target" + std::to_string(i));
    scale_mass(target_factor, target);
    builder.add(target);
  }
  ImpactCase c{builder.build(), {}, {}};
  c.state = zero_state(c.model);
  const int base = c.model.body_index("base");
  set_root_pose(c.model, base, {rotation_about({0, 0, 1}, 0.094227), {-0.000786, -0.054439, 0}}, c.state);
  const double angles[] = {0.360186, 1.523012, 1.164168, 2.504549, -1.390707, -1.208070};
  const double rates[] = {0.02, -0.05, 0.08, -0.03, 0.04, 0.06};
  for (int j = 0; j < 6; ++j) {
    const Body& body = c.model.bodies()[c.model.joints()[j]];
    c.state.q[body.q] = angles[j], c.state.v[body.v] = rates[j];
  }
  set_root_twist(c.model, base, {{0.01, -0.02, 0.03}, {0.02, 0.01, -0.03}}, c.state);
  const Kinematics k = forward_kinematics(c.model, c.state);
  for (int i = 0; i < 2; ++i) {
    const int frame = c.model.frame_index(i == 0 ? "tip-1" : "tip-2");
    const int target = c.model.body_index(shared || i == 0 ? "target0" : "target1");
    const Vector3d tip = frame_pose(c.model, k, frame).p;
    c.grasps.push_back({c.model.frames()[frame].body, target, GraspModel::rigid, tip, {0, 0, 1}});
    set_root_pose(c.model, target, {rotation_about({0, 0, 1}, 0.3), {shared ? 0 : 2 * tip[0], 1.35, 0}}, c.state);
    set_root_twist(c.model, target, {{0.1, 0.05 - 0.2 * i, 0.2}, {0.02, -0.03, 0.07}}, c.state);
  }
  return c;
}

TEST(ImpactSolver, MatchesReferenceSolver) {
  // Measured 7e-13, 8e-11 and 5e-16.
  Worst velocities("velocities"), impulses("impulses"), left("relative motion that is left");
  int deficient = 0, hinges = 0, points = 0, fixed = 0;
  for (int i = 0; i < 2 * kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = i % 2 == 0 ? random_impact(i / 2) : random_open_impact(i / 2);
    const ImpactSolution careful = plastic_impact(c.model, c.state, c.grasps);
    const ImpactSolver fast = solved(c);
    EXPECT_EQ(fast.rows(), careful.rows);
    EXPECT_EQ(fast.rank(), careful.rank);
    EXPECT_LT(velocities.note(velocity_difference(fast, careful, c.state), i), 1e-11);
    EXPECT_LT(impulses.note(impulse_difference(fast, careful), i), 1e-9);
    EXPECT_LT(left.note(fast.constraint_residual(), i), 1e-13);
    EXPECT_GT((eigen(careful.velocity) - eigen(c.state.v)).norm(), 1e-3 * eigen(c.state.v).norm());
    deficient += careful.rank < careful.rows;
    fixed += c.model.bodies()[c.model.body_index("b0")].description.joint.type != JointType::free;
    for (const Grasp& g : c.grasps) hinges += g.model == GraspModel::hinge, points += g.model == GraspModel::point;
  }
  EXPECT_GT(deficient, 20);
  EXPECT_GT(fixed, 40);
  EXPECT_GT(hinges, 100);
  EXPECT_GT(points, 100);
}

// With separate free targets the rows of planar arms are independent; with a shared target they are redundant.
TEST(ImpactSolver, PlanarArmsAreDeficientOnASharedTargetOnly) {
  for (double factor : {1e-6, 1e-3, 1.0, 1e3, 1e6}) {
    for (bool shared : {false, true}) {
      SCOPED_TRACE(factor);
      const ImpactCase c = planar(shared, factor);
      const ImpactSolution careful = plastic_impact(c.model, c.state, c.grasps);
      const ImpactSolver fast = solved(c);
      EXPECT_EQ(fast.rows(), 12);
      EXPECT_EQ(fast.rank(), shared ? 9 : 12);
      EXPECT_EQ(careful.rank, fast.rank());
      EXPECT_LT(velocity_difference(fast, careful, c.state), 1e-11);  // measured 5e-13 (factor 1e6)
      EXPECT_LT(impulse_difference(fast, careful), 1e-10);            // measured 8e-13 (factor 1e-6)
    }
  }
}

// Joints held at their rate, stopped, or set to another; in some cases also the whole base.
TEST(ImpactSolver, HeldRatesMatchReferenceSolver) {
  // Measured 5e-13, 5e-14 and 2e-13.
  Worst velocities("velocities"), impulses("impulses"), drives("impulses of held joints");
  int tried = 0, bases = 0;
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    Random random(30000 + i);
    std::vector<HeldRate> held;
    for (int b : c.model.joints()) {
      const int v = c.model.bodies()[b].v;
      if (random.chance(0.4)) held.push_back({v, i % 3 == 0 ? 0 : i % 3 == 1 ? c.state.v[v] : random.uniform(-1, 1)});
    }
    if (i % 4 == 0) {
      const int v = c.model.bodies()[c.model.body_index("b0")].v;
      for (int k = 0; k < 6; ++k) held.push_back({v + k, i % 8 == 0 ? c.state.v[v + k] : random.uniform(-1, 1)});
      ++bases;
    }
    if (held.empty()) continue;
    const ImpactSolution careful = plastic_impact(c.model, c.state, c.grasps, held);
    const ImpactSolver fast = solved(c, held);
    ++tried;
    EXPECT_EQ(fast.rank() + static_cast<int>(held.size()), careful.rank);
    EXPECT_LT(velocities.note(velocity_difference(fast, careful, c.state), i), 1e-11);
    EXPECT_LT(impulses.note(impulse_difference(fast, careful), i), 1e-9);
    double largest = 0, off = 0;
    for (std::size_t k = 0; k < held.size(); ++k) {
      EXPECT_EQ(fast.velocity()[held[k].velocity], held[k].after);
      largest = std::max(largest, std::abs(careful.held_impulses[k]));
      off = std::max(off, std::abs(fast.held_impulses()[held[k].velocity] - careful.held_impulses[k]));
    }
    EXPECT_GT(largest, 0);
    EXPECT_LT(drives.note(off / largest, i), 1e-9);
  }
  EXPECT_GT(tried, 250);
  EXPECT_GT(bases, 50);
}

// v+ in extended precision, for independent rows: the remaining error is that of M and J.
Eigen::VectorXd extended_velocity(const ImpactCase& c) {
  using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;
  const Matrix M = mass_matrix(c.model, c.state).cast<long double>();
  const Matrix J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), c.grasps).cast<long double>();
  const Vector v = eigen(c.state.v).cast<long double>();
  const Eigen::LLT<Matrix> mass(M);
  const Matrix response = mass.solve(J.transpose());
  const Vector P = (J * response).eval().ldlt().solve(-(J * v).eval());
  return (v + response * P).cast<double>();
}

TEST(ImpactSolver, SurvivesExtremeMassRatios) {
  // Measured 3e-12, 1e-11 and 1e-12.
  Worst velocities("velocities against extended precision"), careful_worst("those of the careful route");
  Worst impulses("impulses against the careful route");
  for (int i = 0; i < 200; ++i) {
    SCOPED_TRACE(seed_note(i));
    ImpactCase c = random_open_impact(i);
    Random random(40000 + i);
    ModelBuilder builder;
    for (const Body& b : c.model.bodies()) {
      BodyDescription d = b.description;
      if (d.name[0] == 't') scale_mass(random.log_uniform(1e-6, 1e6), d);
      builder.add(d);
    }
    c.model = builder.build();
    const ImpactSolution careful = plastic_impact(c.model, c.state, c.grasps);
    const ImpactSolver fast = solved(c);
    EXPECT_EQ(fast.rank(), careful.rank);
    EXPECT_LT(impulses.note(impulse_difference(fast, careful), i), 1e-10);
    if (fast.rank() < fast.rows()) continue;
    const Eigen::VectorXd exact = extended_velocity(c);
    const double size = eigen(c.state.v).norm();
    EXPECT_LT(
        velocities.note(
            (eigen(std::vector<double>(fast.velocity().begin(), fast.velocity().end())) - exact).norm() / size, i),
        1e-10);
    careful_worst.note((eigen(careful.velocity) - exact).norm() / size, i);
  }
}

TEST(ImpactSolver, ConservesNonzeroMomentum) {  // measured 1e-15
  Worst worst("total momentum, link by link, after against before");
  for (int i = 0; i < kImpacts; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    const ImpactSolver fast = solved(c);
    const Kinematics k0 = forward_kinematics(c.model, c.state);
    const Kinematics k1 =
        forward_kinematics(c.model, with_velocity(c.state, {fast.velocity().begin(), fast.velocity().end()}));
    const Vector3d com = center_of_mass(c.model, k0);
    const Momentumd h0 = momentum_about(c.model, k0, com), h1 = momentum_about(c.model, k1, com);
    ASSERT_GT(norm(h0.linear), 1e-3);
    double linear = 0, angular = 0;
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const BodyMomentum m = body_momentum(c.model, k0, static_cast<int>(b));
      linear += norm(m.h.linear), angular += norm(m.h.angular) + norm(cross(m.p_WC - com, m.h.linear));
    }
    EXPECT_LT(worst.note(norm(h1.linear - h0.linear) / linear, i), 1e-12);
    EXPECT_LT(worst.note(norm(h1.angular - h0.angular) / angular, i), 1e-12);
  }
}

// One solver for many impacts: results do not depend on earlier calls.
TEST(ImpactSolver, IndependentOfEarlierCalls) {
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    ImpactSolver solver(c.model, c.grasps);
    solver.solve(c.state.q, c.state.v, c.grasps);
    const std::vector<double> first(solver.velocity().begin(), solver.velocity().end());
    Random random(i);
    std::vector<Grasp> elsewhere = c.grasps;
    for (Grasp& g : elsewhere) g.p_WC += random.vector(0.1), g.hinge_W = random.direction();
    std::vector<HeldRate> held;
    if (!c.model.joints().empty()) held.push_back({c.model.bodies()[c.model.joints()[0]].v, 0.3});
    solver.solve(c.state.q, random.values(c.model.velocities(), 2), elsewhere, held);
    EXPECT_NE(std::vector<double>(solver.velocity().begin(), solver.velocity().end()), first);
    solver.solve(c.state.q, c.state.v, c.grasps);
    EXPECT_EQ(std::vector<double>(solver.velocity().begin(), solver.velocity().end()), first);  // bit for bit
    for (double P : solver.held_impulses()) EXPECT_EQ(P, 0);
  }
}

TEST(ImpactSolver, RejectsUnsupportedInput) {
  const ImpactCase c = random_open_impact(3);
  ImpactSolver solver(c.model, c.grasps);
  const auto message = [&](const auto& call) -> std::string {
    try {
      call();
    } catch (const std::invalid_argument& e) {
      return e.what();
    }
    return "nothing thrown";
  };
  const std::vector<double> shorter(c.state.v.begin(), c.state.v.end() - 1);
  EXPECT_EQ(message([&] { solver.solve(c.state.q, shorter, c.grasps); }),
            "ImpactSolver: the state has another model's size");
  std::vector<Grasp> other = c.grasps;
  other[0].robot_body =
      c.model.body_index("b0") == other[0].robot_body ? other[0].target_body : c.model.body_index("b0");
  EXPECT_EQ(message([&] { solver.solve(c.state.q, c.state.v, other); }),
            "ImpactSolver: not the grasps it was made for");
  const int base = c.model.bodies()[c.model.body_index("b0")].v;
  const HeldRate part[] = {{base + 2, 0}};
  EXPECT_EQ(message([&] { solver.solve(c.state.q, c.state.v, c.grasps, part); }),
            "ImpactSolver: a free root or a spherical joint is held as a whole or not at all");
  const HeldRate none[] = {{c.model.velocities(), 0}};
  EXPECT_EQ(message([&] { solver.solve(c.state.q, c.state.v, c.grasps, none); }),
            "ImpactSolver: no such velocity to hold");
  std::vector<Grasp> itself = c.grasps;
  itself[0].target_body = itself[0].robot_body;
  EXPECT_NE(message([&] { ImpactSolver(c.model, itself); }).find("have no relative motion"), std::string::npos);
}

}  // namespace impact_solver_test
}  // namespace grapnel::testing
