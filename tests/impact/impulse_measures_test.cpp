/// Impulse measures against forward dynamics without a mass matrix, solved impacts, momentum summed over bodies, and
/// closed forms.

#include "grapnel/impact/impulse_measures.hpp"
#include "grapnel/dynamics/workspace.hpp"
#include "grapnel/spatial/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "grapnel/constraint/impulsive_constraint.hpp"
#include "grapnel/dynamics/momentum.hpp"
#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impulse_measures_test {

int root_of(const ImpactCase& c) { return c.model.bodies()[c.grasps[0].robot_body].root; }

std::vector<Impulsed> impulses_of(const ImpactSolution& s) {
  std::vector<Impulsed> impulses;
  for (const ContactImpulse& c : s.contacts) impulses.push_back(c.P_WC);
  return impulses;
}

ImpulseMeasures measure(const ImpactCase& c, std::span<const HeldRate> held = {}) {
  return impulse_measures(c.model, c.state, root_of(c), c.grasps, {}, held);
}

// All joint velocities of the robot, held at their current values.
std::vector<HeldRate> all_joints(const Model& model, const State& state, int root) {
  std::vector<HeldRate> held;
  for (const Body& b : model.bodies()) {
    if (b.root != root || b.parent < 0) continue;
    for (int k = 0; k < velocity_count(b.description.joint.type); ++k) held.push_back({b.v + k, state.v[b.v + k]});
  }
  return held;
}

Twistd twist_at(const Kinematics& k, int body, const Vector3d& p) { return shift(k.V_WB[body], p - k.X_WB[body].p); }

// v+ after impulses on the robot and opposite impulses on the targets, from forward dynamics: an impulse changes the
// velocities as the equal wrench changes the accelerations. Held velocities have prescribed accelerations.
std::vector<double> after_impulses(const ImpactCase& c, const std::vector<Impulsed>& impulses, bool on_targets,
                                   std::span<const HeldRate> held = {}) {
  Workspace workspace(c.model);
  const int n = c.model.velocities();
  std::vector<std::uint8_t> prescribed(static_cast<std::size_t>(n), 0);
  for (const HeldRate& h : held) prescribed[h.velocity] = 1;
  const auto accelerations = [&](bool loaded) {
    std::vector<ExternalWrench> external;
    for (std::size_t i = 0; loaded && i < impulses.size(); ++i) {
      const Grasp& g = c.grasps[i];
      const Wrenchd F{impulses[i].angular, impulses[i].linear};
      external.push_back({g.robot_body, g.p_WC, F});
      if (on_targets) external.push_back({g.target_body, g.p_WC, {-F.angular, -F.linear}});
    }
    // At rest no bias terms reduce the accuracy.
    State rest = c.state;
    std::fill(rest.v.begin(), rest.v.end(), 0.0);
    forward_kinematics(c.model, rest, workspace.kinematics);
    gather_external(c.model, external, workspace);
    const std::vector<double> zero(static_cast<std::size_t>(n), 0.0);
    std::vector<double> vdot(static_cast<std::size_t>(n)), force(static_cast<std::size_t>(n));
    DynamicsInput<double> in;
    in.q = rest.q, in.v = rest.v, in.force = zero, in.link_wrench = workspace.link_wrench;
    in.prescribed = prescribed, in.acceleration = zero;
    articulated_body<double>(c.model.tree(), in, workspace.kernel, vdot, force);
    return vdot;
  };
  const std::vector<double> change = accelerations(true);
  std::vector<double> v = c.state.v;
  for (int i = 0; i < n; ++i) v[i] += change[i];
  return v;
}

Impulsed impulse_from(const Eigen::VectorXd& P) { return {{P[0], P[1], P[2]}, {P[3], P[4], P[5]}}; }

// Impulses per grasp from rows in the constrained directions.
std::vector<Impulsed> from_rows(const ImpactCase& c, const Eigen::VectorXd& rows) {
  std::vector<Impulsed> impulses;
  Eigen::Index row = 0;
  for (const Grasp& g : c.grasps) {
    const Eigen::MatrixXd A = constrained_directions(g);
    impulses.push_back(impulse_from(A.transpose() * rows.segment(row, A.rows())));
    row += A.rows();
  }
  return impulses;
}

// Change of a base's twist, in W.
Eigen::VectorXd base_change(const ImpactCase& c, const std::vector<double>& v) {
  const Twistd before = root_twist(c.model, c.state, root_of(c));
  return eigen(root_twist(c.model, with_velocity(c.state, v), root_of(c)) - before);
}

// --- One end-effector. ----------------------------------------------------------------------------------------------

TEST(ImpulseMeasures, InverseInertiaMatchesForwardDynamics) {
  Worst robot("extended inverse inertia"), pair("of the pair"), locked("with joints held");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    ImpactCase c = random_impact(i);
    c.grasps.resize(1);
    const Grasp& g = c.grasps[0];
    const Kinematics k = forward_kinematics(c.model, c.state);
    const std::vector<HeldRate> held = all_joints(c.model, c.state, root_of(c));
    const ImpulseMeasures m = measure(c), h = measure(c, held);
    ASSERT_EQ(m.end_effectors.size(), 1u);
    Matrix6d own, both, rigid;
    for (int column = 0; column < 6; ++column) {
      const std::vector<Impulsed> unit{impulse_from(Eigen::VectorXd::Unit(6, column))};
      const auto change = [&](const std::vector<double>& v, int body) {
        const Kinematics after = forward_kinematics(c.model, with_velocity(c.state, v));
        return eigen(twist_at(after, body, g.p_WC) - twist_at(k, body, g.p_WC));
      };
      own.col(column) = change(after_impulses(c, unit, false), g.robot_body);
      const std::vector<double> v = after_impulses(c, unit, true);
      both.col(column) = change(v, g.robot_body) - change(v, g.target_body);
      rigid.col(column) = change(after_impulses(c, unit, false, held), g.robot_body);
    }
    EXPECT_LT(robot.note(relative_difference(m.end_effectors[0].inverse_inertia, own), i), 1e-10);  // measured 1.6e-13
    EXPECT_LT(pair.note(relative_difference(m.end_effectors[0].pair_inverse_inertia, both), i),
              1e-10);  // measured 7e-14
    const Matrix6d& composite = h.end_effectors[0].inverse_inertia;
    EXPECT_LT(locked.note((composite - rigid).norm() / both.norm(), i), 1e-10);  // measured 9e-15
  }
}

// P/u of a frictionless contact along n, from an impact with that one row.
TEST(ImpulseMeasures, EffectiveMassIsImpulsePerSpeed) {
  Worst worst("effective mass against P/u");
  for (int i = 0; i < 100; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    Random random(7000 + i);
    const ImpulseMeasures m = measure(c);
    const Kinematics k = forward_kinematics(c.model, c.state);
    Grasp g = c.grasps[0];
    g.model = GraspModel::point;
    const auto contact_mass = [&](const Eigen::Vector3d& n) {
      const Eigen::MatrixXd J = n.transpose() * grasp_jacobian(c.model, k, {&g, 1});
      const ImpulsiveSolution s = solve_impulsive_constraint(mass_matrix(c.model, c.state), J, eigen(c.state.v),
                                                             Eigen::MatrixXd::Identity(1, 1));
      return -s.impulse[0] / (J * eigen(c.state.v))[0];
    };
    const Vector3d n = random.direction();
    EXPECT_LT(worst.note(
                  std::abs(effective_mass(m.end_effectors[0].pair_inverse_inertia, n) / contact_mass(eigen(n)) - 1), i),
              1e-10);
    EXPECT_NEAR(effective_mass(m.end_effectors[0].pair_inverse_inertia, 7.0 * n) /
                    effective_mass(m.end_effectors[0].pair_inverse_inertia, n),
                1, 1e-13);
    const Eigen::Vector3d along = m.end_effectors[0].relative_velocity.normalized();
    EXPECT_LT(worst.note(std::abs(m.end_effectors[0].pair_effective_mass / contact_mass(along) - 1), i),
              1e-10);  // measured 1.6e-13
    // The impulse of a frictionless contact is at most that of a grasp that stops the point in all directions.
    EXPECT_LE(m.end_effectors[0].pair_effective_mass, m.end_effectors[0].impulse_index * (1 + 1e-12));
    EXPECT_GE(m.end_effectors[0].robot_effective_mass, m.end_effectors[0].pair_effective_mass);
  }
}

// A point grasp with a unit relative velocity along an axis of the ellipsoid has that semi-axis as its impulse. The
// index is the magnitude of the impulse per speed.
TEST(ImpulseMeasures, EllipsoidMatchesPointGrasp) {
  Worst axes("semi-axes against impulses"), index("impulse index against |P|/|u|");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    ImpactCase c = random_open_impact(i);
    c.grasps.resize(1);
    Grasp& g = c.grasps[0];
    g.model = GraspModel::point;
    const EndEffectorMeasures m = measure(c).end_effectors[0];
    const Impulsed P = plastic_impact(c.model, c.state, c.grasps).contacts[0].P_WC;
    EXPECT_LT(index.note(std::abs(norm(P.linear) / m.relative_velocity.norm() / m.impulse_index - 1), i),
              1e-10);  // measured 5e-15
    EXPECT_NEAR(m.linear.axes.determinant(), 1, 1e-12);
    EXPECT_LE(m.linear.semi_axes[0], c.model.bodies()[g.target_body].description.mass * (1 + 1e-12));
    const Kinematics k = forward_kinematics(c.model, c.state);
    const Twistd V_E = twist_at(k, g.robot_body, g.p_WC);
    const Vector3d origin = root_pose(c.model, c.state, g.target_body).p;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d n = m.linear.axes.col(axis);
      const Vector3d n_W{n[0], n[1], n[2]};
      State s = c.state;
      set_root_twist(c.model, g.target_body, shift(Twistd{{0.1, 0.2, -0.3}, V_E.linear - n_W}, origin - g.p_WC), s);
      const Impulsed along = plastic_impact(c.model, s, c.grasps).contacts[0].P_WC;
      EXPECT_LT(axes.note((eigen(along.linear) + m.linear.semi_axes[axis] * n).norm() / m.linear.semi_axes[axis], i),
                1e-9);
    }
    for (int axis = 1; axis < 3; ++axis) EXPECT_LE(m.linear.semi_axes[axis], m.linear.semi_axes[axis - 1]);
  }
}

// The angular ellipsoid: a pure couple that stops the relative rotation.
TEST(ImpulseMeasures, AngularEllipsoid) {
  const ImpactCase c = random_open_impact(4);
  const EndEffectorMeasures m = measure(c).end_effectors[0];
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d couple = m.angular.semi_axes[axis] * m.angular.axes.col(axis);
    const Eigen::Vector3d turn = m.pair_inverse_inertia.topLeftCorner<3, 3>() * couple;
    EXPECT_LT((turn - m.angular.axes.col(axis)).norm(), 1e-10);
  }
}

// --- Two bodies in closed form. -------------------------------------------------------------------------------------

ImpactCase two_bodies(double m1, double m2, const Vector3d& C) {
  ModelBuilder builder;
  for (const char* name : {"base", "target"}) {
    BodyDescription b = thesis_target(name);
    b.mass = name[0] == 'b' ? m1 : m2;
    b.inertia = name[0] == 'b' ? Symmetric3d::diagonal(2, 2.5, 3) : Symmetric3d::diagonal(1, 1.2, 1.4);
    builder.add(b);
  }
  ImpactCase c{builder.build(), {}, {}};
  c.state = zero_state(c.model);
  const int target = c.model.body_index("target");
  set_root_pose(c.model, target, {Rotationd::identity(), {1, 0, 0}}, c.state);
  set_root_twist(c.model, target, {{0, 0, 0}, {-0.3, 0, 0}}, c.state);
  c.grasps = {{c.model.body_index("base"), target, GraspModel::point, C, {0, 0, 1}}};
  return c;
}

TEST(ImpulseMeasures, TwoFreeBodies) {
  // Central impact: the reduced mass along x. Along y and z both bodies also rotate, with the levers r1 = 0.4 and r2 =
  // -0.6.
  const double m1 = 30, m2 = 12;
  const EndEffectorMeasures m = measure(two_bodies(m1, m2, {0.4, 0, 0})).end_effectors[0];
  const double reduced = m1 * m2 / (m1 + m2);
  EXPECT_NEAR(m.impulse_index, reduced, 1e-12);
  EXPECT_NEAR(m.pair_effective_mass, reduced, 1e-12);
  EXPECT_NEAR(m.robot_effective_mass, m1, 1e-12);
  EXPECT_NEAR(m.linear.semi_axes[0], reduced, 1e-12);
  EXPECT_NEAR(std::abs(m.linear.axes(0, 0)), 1, 1e-12);
  const auto across = [&](double I1, double I2) { return 1 / (1 / reduced + 0.16 / I1 + 0.36 / I2); };
  EXPECT_NEAR(effective_mass(m.pair_inverse_inertia, {0, 1, 0}), across(3, 1.4), 1e-12);
  EXPECT_NEAR(effective_mass(m.pair_inverse_inertia, {0, 0, 1}), across(2.5, 1.2), 1e-12);
  EXPECT_NEAR(m.angular.semi_axes[0], 1 / (1 / 3.0 + 1 / 1.4), 1e-12);
  // Without relative velocity the direction is undefined.
  ImpactCase rest = two_bodies(m1, m2, {0.4, 0, 0});
  std::fill(rest.state.v.begin(), rest.state.v.end(), 0.0);
  const ImpulseMeasures still = measure(rest);
  EXPECT_EQ(still.end_effectors[0].impulse_index + still.end_effectors[0].pair_effective_mass + still.coupled_index, 0);
}

// Fixed base and held joints: the robot cannot yield, and only the target's inertia matters.
TEST(ImpulseMeasures, ImmovableRobot) {
  for (int i = 4; i < 30; i += 5) {  // fixed roots
    SCOPED_TRACE(seed_note(i));
    ImpactCase c = random_impact(i);
    ASSERT_FALSE(c.model.has_free_root(root_of(c)));
    c.grasps.resize(1);
    const std::vector<HeldRate> held = all_joints(c.model, c.state, root_of(c));
    const ImpulseMeasures m = measure(c, held);
    EXPECT_EQ(m.end_effectors[0].inverse_inertia.norm(), 0);
    EXPECT_EQ(m.end_effectors[0].robot_effective_mass, INFINITY);
    EXPECT_NEAR(m.largest_impulse, 1, 1e-10);
    EXPECT_NEAR(m.smallest_impulse, 1, 1e-10);
    EXPECT_NEAR(m.coupled_index, 1, 1e-10);
    EXPECT_EQ(m.base_response.norm(), 0);
    EXPECT_EQ(m.zero_disturbance.cols(), m.contact_inertia.rows());
    // Free joints yield, but the base still does not move.
    const ImpulseMeasures free = measure(c);
    EXPECT_LE(free.smallest_impulse, 1 + 1e-10);
    EXPECT_LE(free.largest_impulse, 1 + 1e-10);
    EXPECT_EQ(free.base_response.norm(), 0);
    EXPECT_EQ(free.zero_base_angular_velocity.cols(), free.contact_inertia.rows());
  }
}

TEST(ImpulseMeasures, HeldBaseEqualsFixedBase) {
  Worst worst("held against fixed base");
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(i);
    const int root = root_of(c), v = c.model.bodies()[root].v;
    std::vector<HeldRate> held;
    for (int k = 0; k < 6; ++k) held.push_back({v + k, c.state.v[v + k]});
    const ImpulseMeasures m = measure(c, held);
    EXPECT_EQ(m.base_response.norm(), 0);

    ModelBuilder builder;
    for (const Body& b : c.model.bodies()) {
      BodyDescription d = b.description;
      if (&b == &c.model.bodies()[root]) d.joint.type = JointType::fixed, d.X_PF = root_pose(c.model, c.state, root);
      builder.add(d);
    }
    ImpactCase fixed{builder.build(), {}, c.grasps};
    fixed.state = zero_state(fixed.model);
    for (std::size_t b = 0; b < c.model.bodies().size(); ++b) {
      const Body &from = c.model.bodies()[b], &to = fixed.model.bodies()[b];
      if (static_cast<int>(b) == root) continue;
      for (int k = 0; k < coordinate_count(from.description.joint.type); ++k)
        fixed.state.q[to.q + k] = c.state.q[from.q + k];
    }
    const ImpulseMeasures f = measure(fixed);
    EXPECT_LT(worst.note(relative_difference(m.contact_inertia, f.contact_inertia), i), 1e-10);  // measured 3e-15
    EXPECT_LT(
        worst.note(relative_difference(m.end_effectors[0].inverse_inertia, f.end_effectors[0].inverse_inertia), i),
        1e-10);
  }
}

// --- All grasps together. --------------------------------------------------------------------------------------------

// P = -W^+ u in the metric of the targets, after the change of held rates: the coupled index equals that of the solved
// impact.
TEST(ImpulseMeasures, CoupledIndexMatchesImpact) {
  Worst worst("coupled index"), with_held("with held rates"), planned("what plans evaluate");
  int deficient = 0;
  for (int i = 0; i < 150; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const Kinematics k = forward_kinematics(c.model, c.state);
    const Eigen::MatrixXd J = grasp_jacobian(c.model, k, c.grasps);
    Eigen::MatrixXd D = Eigen::MatrixXd::Zero(J.rows(), J.rows());
    for (Eigen::Index row = 0; const Grasp& g : c.grasps) {
      const Eigen::MatrixXd block = target_mobility(c.model, k, g);
      D.block(row, row, block.rows(), block.rows()) = block;
      row += block.rows();
    }
    // Impulses of held rates follow those of the grasps.
    const auto index = [&](const Eigen::VectorXd& all_rows, const Eigen::VectorXd& u) {
      const Eigen::VectorXd P = all_rows.head(D.rows());
      return std::sqrt(P.dot(D * P) / u.dot(D.llt().solve(u)));
    };
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const ImpulseMeasures m = measure(c);
    EXPECT_EQ(m.rank, s.rank);
    deficient += s.rank < s.rows;
    const double wanted = index(stacked_impulse(c, s), J * eigen(c.state.v));
    EXPECT_LT(worst.note(std::abs(m.coupled_index / wanted - 1), i), 1e-10);  // measured 7e-13
    EXPECT_LE(m.coupled_index, m.largest_impulse * (1 + 1e-9));
    EXPECT_LE(m.smallest_impulse, m.largest_impulse);
    const PlannedImpulse p = planned_impulse(c.model, c.state, c.grasps);
    EXPECT_LT(planned.note(std::abs(p.mean_impulse / m.mean_impulse - 1), i), 1e-10);
    EXPECT_LT(planned.note(std::abs(p.energy / m.energy - 1), i), 1e-10);

    // The rates of two joints change: first without grasps, then the grasps act on the resulting velocities.
    std::vector<HeldRate> held = all_joints(c.model, c.state, root_of(c));
    if (held.size() < 4) continue;
    held = {{held[0].velocity, 0.3}, {held[2].velocity, -0.2}};
    const ImpactSolution braked = plastic_impact(c.model, c.state, {}, held);
    const ImpactSolution all = plastic_impact(c.model, c.state, c.grasps, held);
    if (all.rank < all.rows) continue;  // held rates take part in the redundancy
    EXPECT_LT(
        with_held.note(
            std::abs(measure(c, held).coupled_index / index(stacked_impulse(c, all), J * eigen(braked.velocity)) - 1),
            i),
        1e-10);  // measured 7e-13
  }
  EXPECT_GT(deficient, 10);
}

TEST(ImpulseMeasures, BaseResponseMatchesForwardDynamics) {
  Worst worst("base change against response times impulse");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    Random random(8000 + i);
    const ImpulseMeasures m = measure(c);
    const std::vector<double> drawn = random.values(static_cast<int>(m.base_response.cols()), 1);
    const Eigen::VectorXd P = eigen(drawn);
    const Eigen::VectorXd change = base_change(c, after_impulses(c, from_rows(c, P), true));
    if (!c.model.has_free_root(root_of(c))) continue;
    ASSERT_GT(change.norm(), 0);
    EXPECT_LT(worst.note(relative_difference(Eigen::VectorXd(m.base_response * P), change), i),
              1e-10);  // measured 7e-14
  }
}

// Zero-disturbance impulses, applied by forward dynamics, do not change the motion of the base. At least rows - 6 of
// them exist.
TEST(ImpulseMeasures, ZeroDisturbanceImpulses) {
  Worst whole("base twist left"), turning("base turning left");
  int found = 0;
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    if (!c.model.has_free_root(root_of(c))) continue;
    const ImpulseMeasures m = measure(c);
    const Eigen::Index rows = m.base_response.cols();
    EXPECT_GE(m.zero_disturbance.cols(), rows - 6);
    EXPECT_GE(m.zero_base_angular_velocity.cols(), rows - 3);
    for (Eigen::Index n = 0; n < m.zero_disturbance.cols(); ++n, ++found) {
      const Eigen::VectorXd P = m.zero_disturbance.col(n);
      const Eigen::VectorXd size = m.base_response.cwiseAbs() * P.cwiseAbs();
      const Eigen::VectorXd change = base_change(c, after_impulses(c, from_rows(c, P), true));
      EXPECT_LT(whole.note(change.cwiseQuotient(size).cwiseAbs().maxCoeff(), i), 1e-9);
      // P lies in the span of the impulses that do not rotate the base.
      const Eigen::VectorXd in_span = m.zero_base_angular_velocity.colPivHouseholderQr().solve(P);
      EXPECT_LT((m.zero_base_angular_velocity * in_span - P).norm() / P.norm(), 1e-8);
    }
    for (Eigen::Index n = 0; n < m.zero_base_angular_velocity.cols(); ++n) {
      const Eigen::VectorXd P = m.zero_base_angular_velocity.col(n);
      const Eigen::VectorXd size = (m.base_response.cwiseAbs() * P.cwiseAbs()).head<3>();
      const Eigen::VectorXd change = base_change(c, after_impulses(c, from_rows(c, P), true)).head<3>();
      EXPECT_LT(turning.note(change.cwiseQuotient(size).cwiseAbs().maxCoeff(), i), 1e-9);
    }
  }
  EXPECT_GT(found, 50);
}

// For target motions with u = -W P, where P is a zero-disturbance impulse, the impact does not disturb the base.
TEST(ImpulseMeasures, ImpactWithoutDisturbance) {
  Worst worst("base change over speed of the contacts");
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  const int root = r.model.body_index("base");
  const ImpulseMeasures m = impulse_measures(r.model, r.state, root, r.grasps, {});
  ASSERT_GT(m.zero_disturbance.cols(), 0);
  for (Eigen::Index n = 0; n < m.zero_disturbance.cols(); ++n) {
    // The robot is at rest, the targets move so that -J v = W P.
    State s = r.state;
    std::fill(s.v.begin(), s.v.end(), 0.0);
    const Eigen::VectorXd u = m.contact_inertia * m.zero_disturbance.col(n);
    for (std::size_t i = 0; i < r.grasps.size(); ++i) {
      const Grasp& g = r.grasps[i];
      const auto part = u.segment<6>(6 * static_cast<Eigen::Index>(i));
      const Twistd V{{part[0], part[1], part[2]}, {part[3], part[4], part[5]}};
      set_root_twist(r.model, g.target_body, shift(V, root_pose(r.model, s, g.target_body).p - g.p_WC), s);
    }
    const ImpactSolution solution = plastic_impact(r.model, s, r.grasps);
    const Twistd base = root_twist(r.model, with_velocity(s, solution.velocity), root);
    EXPECT_GT(solution.kinetic_energy_before, 0);
    EXPECT_LT(worst.note((norm(base.angular) + norm(base.linear)) / u.norm(), static_cast<int>(n)),
              1e-11);  // measured 3e-17
  }
}

// --- Lines of impulse. ----------------------------------------------------------------------------------------------

TEST(ImpulseMeasures, ImpulseThroughTheCentreOfMass) {
  Worst momentum("angular momentum gained, over |c - C| |P|"), rate("base turning with joints locked, over |P|");
  Worst free("and with joints free");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    ImpactCase c = random_open_impact(i);
    c.grasps.resize(1);
    const int root = root_of(c);
    const Grasp& g = c.grasps[0];
    const Kinematics k = forward_kinematics(c.model, c.state);
    const Vector3d com = center_of_mass(c.model, k, {&root, 1});
    const Vector3d P = 3.0 * (com - g.p_WC);
    const std::vector<Impulsed> impulses{{Vector3d::zero(), P}};
    const ImpulseMeasures m = impulse_measures(c.model, c.state, root, c.grasps, impulses);
    EXPECT_LT(m.robot_line[0].miss, 1e-13);
    EXPECT_NEAR(m.robot_line[0].couple, 0, 1e-12);

    const auto gained = [&](const std::vector<double>& v) {
      const Momentumd before = momentum_about(c.model, k, com, {&root, 1});
      const Kinematics after = forward_kinematics(c.model, with_velocity(c.state, v));
      return momentum_about(c.model, after, com, {&root, 1}).angular - before.angular;
    };
    const std::vector<double> after = after_impulses(c, impulses, true);
    EXPECT_LT(momentum.note(norm(gained(after)) / norm(P), i), 1e-10);  // measured 2e-13
    const std::vector<HeldRate> held = all_joints(c.model, c.state, root);
    const Eigen::VectorXd locked = base_change(c, after_impulses(c, impulses, true, held));
    EXPECT_LT(rate.note(locked.head<3>().norm() / norm(P), i), 1e-12);  // measured 8e-16
    // The base response matrix gives the same result.
    Grasp rigid = g;
    rigid.model = GraspModel::rigid;
    const ImpulseMeasures h = impulse_measures(c.model, c.state, root, {&rigid, 1}, {}, held);
    EXPECT_LT(rate.note((h.base_response * eigen(impulses[0])).head<3>().norm() / norm(P), i), 1e-12);
    free.note(base_change(c, after).head<3>().norm() / norm(P), i);
  }
  EXPECT_GT(free.value(), 1e-3);  // with free joints the base rotates
}

TEST(ImpulseMeasures, MissMatchesAngularMomentumChange) {
  Worst worst("angular impulse about the centre of mass");
  for (int i = 0; i < 60; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    const int root = root_of(c);
    if (!c.model.has_free_root(root)) continue;
    const ImpactSolution s = plastic_impact(c.model, c.state, c.grasps);
    const ImpulseMeasures m = impulse_measures(c.model, c.state, root, c.grasps, impulses_of(s));
    const Kinematics before = forward_kinematics(c.model, c.state);
    const Kinematics after = forward_kinematics(c.model, with_velocity(c.state, s.velocity));
    const Vector3d com = center_of_mass(c.model, before, {&root, 1});
    const Vector3d gained = momentum_about(c.model, after, com, {&root, 1}).angular -
                            momentum_about(c.model, before, com, {&root, 1}).angular;
    ASSERT_EQ(m.robot_line.size(), c.grasps.size() + 1);
    const ImpulseLine& all = m.robot_line.back();
    double scale = 0;
    for (const ContactImpulse& contact : s.contacts) scale += norm(contact.P_WC.linear) + norm(contact.P_WC.angular);
    EXPECT_LT(worst.note(norm(gained - all.angular_impulse) / scale, i), 1e-10);  // measured 4e-14
    // The couple and the moment of the miss distance are orthogonal.
    const Momentumd h0 = momentum_about(c.model, before, com, {&root, 1}),
                    h1 = momentum_about(c.model, after, com, {&root, 1});
    EXPECT_NEAR(std::hypot(all.couple, all.miss * norm(h1.linear - h0.linear)) / norm(gained), 1, 1e-6);
  }
}

TEST(ImpulseMeasures, LineInClosedForm) {
  // Impulse along y at x = 2, relative to the origin: a couple about y remains, a couple about z shifts the line.
  const Impulsed P{{0, 0.5, 0}, {0, 4, 0}};
  const ImpulseLine line = impulse_line(P, {2, 7, 0}, {0, 0, 0});
  EXPECT_NEAR(line.miss, 2, 1e-15);
  EXPECT_NEAR(line.couple, 0.5, 1e-15);
  EXPECT_NEAR(line.angular_impulse[2], 8, 1e-14);
  EXPECT_NEAR(impulse_line({{0, 0, -8}, {0, 4, 0}}, {2, 7, 0}, {0, 0, 0}).miss, 0, 1e-15);
  EXPECT_EQ(impulse_line({{0, 1, 0}, {0, 0, 0}}, {2, 7, 0}, {0, 0, 0}).miss, INFINITY);
  EXPECT_EQ(impulse_line(Impulsed::zero(), {2, 7, 0}, {0, 0, 0}).miss, 0);
}

// --- Symmetry and redundancy. ---------------------------------------------------------------------------------------

// Thesis robot and targets symmetric about the y axis: both end-effectors have equal, mirrored measures.
TEST(ImpulseMeasures, SymmetricArms) {
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  set_root_pose(r.model, r.model.body_index("base"), Posed::identity(), r.state);
  const double angles[] = {0.5, 0.7, -0.4};
  for (int j = 0; j < 3; ++j) {
    r.state.q[r.model.bodies()[r.model.body_index("arm-1-link-" + std::to_string(j + 1))].q] = angles[j];
    const double mirrored = (j == 0 ? M_PI : 0) - angles[j];
    r.state.q[r.model.bodies()[r.model.body_index("arm-2-link-" + std::to_string(j + 1))].q] = mirrored;
  }
  std::fill(r.state.v.begin(), r.state.v.end(), 0.0);
  const Kinematics k = forward_kinematics(r.model, r.state);
  for (int i = 0; i < 2; ++i) {
    Grasp& g = r.grasps[i];
    g.p_WC = k.X_WB[g.robot_body] * Vector3d{1, 0, 0};
    set_root_pose(r.model, g.target_body, {Rotationd::identity(), g.p_WC + Vector3d{i == 0 ? 0.3 : -0.3, 0.4, 0}},
                  r.state);
    set_root_twist(r.model, g.target_body, {{0, 0, i == 0 ? 0.2 : -0.2}, {i == 0 ? -0.1 : 0.1, -0.05, 0}}, r.state);
  }
  ASSERT_NEAR(r.grasps[0].p_WC[0], -r.grasps[1].p_WC[0], 1e-14);
  const int root = r.model.body_index("base");
  const ImpactSolution s = plastic_impact(r.model, r.state, r.grasps);
  const ImpulseMeasures m = impulse_measures(r.model, r.state, root, r.grasps, impulses_of(s));
  // Reflection x -> -x of axial and polar vectors.
  Matrix6d mirror = Matrix6d::Zero();
  mirror.diagonal() << 1, -1, -1, -1, 1, 1;
  const EndEffectorMeasures &a = m.end_effectors[0], &b = m.end_effectors[1];
  EXPECT_LT(relative_difference(Matrix6d(mirror * a.inverse_inertia * mirror), b.inverse_inertia), 1e-12);
  EXPECT_LT((a.linear.semi_axes - b.linear.semi_axes).norm(), 1e-11);
  EXPECT_NEAR(a.impulse_index, b.impulse_index, 1e-12);
  EXPECT_NEAR(a.pair_effective_mass, b.pair_effective_mass, 1e-12);
  EXPECT_NEAR(m.robot_line[0].miss, m.robot_line[1].miss, 1e-12);
  EXPECT_LT(m.robot_line[2].miss, 1e-12);  // the resultant is along y through the centre of mass
  EXPECT_NEAR(m.system_line[0].miss, m.system_line[1].miss, 1e-12);
  // The base neither rotates nor moves sideways.
  const Eigen::VectorXd change = m.base_response * [&] {
    Eigen::VectorXd P(12);
    P << eigen(s.contacts[0].P_WC), eigen(s.contacts[1].P_WC);
    return P;
  }();
  EXPECT_NEAR(change[2], 0, 1e-14);
  EXPECT_NEAR(change[3], 0, 1e-14);
  EXPECT_GT(std::abs(change[4]), 1e-4);
}

// Two planar arms on one target: three rows are redundant. The measures use the actual rank.
TEST(ImpulseMeasures, RedundantArmsOnOneTarget) {
  ReferenceImpact r = reference_impact(GraspModel::rigid, 0.1);
  r.grasps[1].target_body = r.grasps[0].target_body;
  const int root = r.model.body_index("base");
  const ImpactSolution s = plastic_impact(r.model, r.state, r.grasps);
  const ImpulseMeasures m = impulse_measures(r.model, r.state, root, r.grasps, impulses_of(s));
  ASSERT_EQ(m.contact_inertia.rows(), 12);
  EXPECT_EQ(m.rank, 9);
  EXPECT_EQ(s.rank, 9);
  EXPECT_TRUE(std::isfinite(m.largest_impulse));
  // Self-stresses do not move the base: they are zero-disturbance impulses.
  EXPECT_LT((m.base_response * s.null_space).norm() / (m.base_response.norm() * s.null_space.norm()), 1e-14);
  EXPECT_GE(m.zero_disturbance.cols(), 6);
}

TEST(ImpulseMeasures, Arguments) {
  const ImpactCase c = random_open_impact(0);
  const std::vector<Impulsed> wrong(c.grasps.size() + 1, Impulsed::zero());
  EXPECT_THROW(impulse_measures(c.model, c.state, root_of(c), c.grasps, wrong), std::invalid_argument);
  const ImpulseMeasures nothing = impulse_measures(c.model, c.state, root_of(c), {}, {});
  EXPECT_EQ(nothing.base_response.cols() + nothing.contact_inertia.size(), 0);
  EXPECT_TRUE(nothing.robot_line.empty());
}

}  // namespace impulse_measures_test
}  // namespace grapnel::testing
