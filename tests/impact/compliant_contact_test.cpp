// Contacts of robots and of several bodies: the rigid limit, friction, repeated contacts, rejected arguments.
#include <gtest/gtest.h>

#include <array>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "impact/compliant_case.hpp"
#include "impact/impact_case.hpp"
#include "support/eigen_values.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace compliant_contact_test {

using Status = ImpactSolution::Status;

// One contact of a random robot, and its rigid impulse P = -2 u_n / W_nn for restitution one.
TEST(CompliantContacts, BecomeRigidWithRestitutionOne) {
  Worst energy("energy residual"), momentum("momentum error");
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_open_impact(2 * i);
    Grasp g = c.grasps[0];
    g.model = GraspModel::point;
    const Vector3d u = relative_velocity(c.model, c.state, g.robot_body, g.target_body, g.p_WC);
    Vector3d n = -u + 0.6 * norm(u) * Random(i).direction();
    n = (1 / norm(n)) * n;
    const Eigen::MatrixXd J = grasp_jacobian(c.model, forward_kinematics(c.model, c.state), {&g, 1});
    const Eigen::RowVectorXd J_n = eigen(n).transpose() * J;
    const double W = J_n * mass_matrix(c.model, c.state).llt().solve(J_n.transpose());
    const double P = -2 * dot(n, u) / W;
    ASSERT_GT(P, 0);
    double last = 0;
    for (const double k : {1e8, 1e10, 1e12}) {
      CompliantContact contact{g.robot_body, g.target_body, g.p_WC, n};
      contact.stiffness = k;
      const ImpactSolution o = compliant_impact(c.model, c.state, {&contact, 1}, {}, {});
      ASSERT_EQ(o.status, Status::separated) << o.message;
      EXPECT_LT(energy.note(o.energy_residual, i), 2e-9);                             // measured 9.5e-11
      EXPECT_LT(momentum.note(momentum_error(c.model, c.state, o.after), i), 1e-12);  // measured 4.7e-15
      const double error = norm(o.forces[0].impulse.linear - P * n) / P;
      std::printf("[ measured ] %d, k = %.0e: impulse off by %.3g\n", i, k, error);
      if (last > 0) {
        EXPECT_NEAR(std::log10(last / error) / 2, 0.5, 0.02);  // measured 0.4985 to 0.5003
      }
      last = error;
    }
    EXPECT_LT(last, 1e-3);
  }
}

// Adds a speed of the first body along the contact; returns its direction.
Vector3d slide(CentralPair& c, double speed) {
  Vector3d t = cross(c.contact.n_W, Vector3d{0, 0, 1});
  t = (1 / norm(t)) * t;
  const Twistd V = root_twist(c.model, c.state, 0);
  set_root_twist(c.model, 0, {V.angular, V.linear + speed * t}, c.state);
  return t;
}

// Two bodies in continuous slip: the tangential impulse is mu P_n against the slip, up to the regularization of
// friction.
TEST(CompliantContacts, SlidingFrictionImpulseIsMuTimesTheNormalImpulse) {
  CentralPair c = central_pair();
  const Vector3d n = c.contact.n_W, t = slide(c, 1.0);
  c.contact.friction = 0.2;
  c.contact.stiffness = 1e9;  // short impact: the normal barely rotates
  const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
  ASSERT_EQ(o.status, Status::separated) << o.message;
  const Vector3d P = o.forces[0].impulse.linear;
  const double P_n = dot(P, n), P_t = dot(P, t);
  ASSERT_GT(dot(relative_velocity(c.model, o.after, 0, 1, c.contact.p_WC), t), 0.1);  // the slip never stops
  std::printf("[ measured ] -P_t / (mu P_n) - 1 = %.3g\n", -P_t / (0.2 * P_n) - 1);
  EXPECT_NEAR(-P_t / (0.2 * P_n), 1, 2e-4);  // measured -4.2e-5: the normal rotates slightly
  EXPECT_LT(momentum_error(c.model, c.state, o.after), 1e-13);
  EXPECT_LT(o.energy_residual, 1e-8);
  EXPECT_GT(o.forces[0].energy_lost, 0);
  for (const Vector3d& f : o.forces[0].force) EXPECT_LE(norm(f - dot(f, n) * n), 0.2 * dot(f, n) * (1 + 1e-3) + 1e-3);
}

// Strong friction stops the slip: the remaining velocity is of the order of the slip speed.
TEST(CompliantContacts, StrongFrictionStopsTheSlip) {
  CentralPair c = central_pair();
  const Vector3d t = slide(c, 0.1);
  c.contact.friction = 2;
  const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
  ASSERT_EQ(o.status, Status::separated) << o.message;
  EXPECT_LT(std::abs(dot(relative_velocity(c.model, o.after, 0, 1, c.contact.p_WC), t)), 2e-2 * 0.1);
  EXPECT_LT(momentum_error(c.model, c.state, o.after), 1e-13);
  EXPECT_LT(o.energy_residual, 1e-8);
}

// A slip speed far below the bodies' speeds: rounding errors of derivatives must not determine the step size.
TEST(CompliantContacts, TinySlipSpeedsOnSoftSprings) {
  CentralPair c = central_pair();
  const Vector3d t = slide(c, 0.1);
  c.contact.friction = 2;
  c.contact.stiffness = 1e3;
  double slip[2], impulse[2];
  for (int i = 0; i < 2; ++i) {
    c.contact.slip_speed = i == 0 ? 1e-6 : 1e-7;
    const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
    ASSERT_EQ(o.status, Status::separated) << o.message;
    EXPECT_LT(o.energy_residual, 1e-10);  // measured 3.0e-11
    EXPECT_LT(o.steps, 12000);            // measured 1141 and 6244; by differences of 1e-7 slip speeds 28149
    slip[i] = dot(relative_velocity(c.model, o.after, 0, 1, c.contact.p_WC), t);
    impulse[i] = dot(o.forces[0].impulse.linear, t);
  }
  // The remaining velocity is of the order of the slip speed.
  EXPECT_NEAR(slip[0], slip[1], 1e-5);        // measured 1.1e-6
  EXPECT_NEAR(impulse[0], impulse[1], 1e-5);  // measured 8.1e-7
}

// Three balls on a line with unilateral springs, integrated here by the Runge-Kutta method with very small steps.
struct Line {
  std::array<double, 3> m;
  std::array<double, 2> k;
  std::array<double, 3> after{};
  std::array<int, 2> touches{};
};
void solve(Line& line, double speed, double step, double until) {
  using Y = std::array<double, 6>;
  const auto rates = [&](const Y& y) {
    const double f01 = std::max(0.0, line.k[0] * (y[0] - y[1])), f12 = std::max(0.0, line.k[1] * (y[1] - y[2]));
    return Y{y[3], y[4], y[5], -f01 / line.m[0], (f01 - f12) / line.m[1], f12 / line.m[2]};
  };
  Y y{0, 0, 0, speed, 0, 0};
  std::array<bool, 2> touching{};
  for (double t = 0; t < until; t += step) {
    const auto at = [&](const Y& k, double h) {
      Y z = y;
      for (int i = 0; i < 6; ++i) z[i] += h * k[i];
      return z;
    };
    const Y k1 = rates(y), k2 = rates(at(k1, step / 2)), k3 = rates(at(k2, step / 2)), k4 = rates(at(k3, step));
    for (int i = 0; i < 6; ++i) y[i] += step / 6 * (k1[i] + 2 * k2[i] + 2 * k3[i] + k4[i]);
    for (int i = 0; i < 2; ++i) {
      const bool now = y[i] > y[i + 1];
      line.touches[i] += now && !touching[i];
      touching[i] = now;
    }
  }
  line.after = {y[3], y[4], y[5]};
}

void expect_line(std::array<double, 3> masses, std::array<double, 2> stiffness, int touches) {
  Line line{masses, stiffness};
  solve(line, 0.5, 2e-7, 0.3);
  ModelBuilder builder;
  for (int i = 0; i < 3; ++i) {
    builder.add(free_body("ball " + std::to_string(i), masses[i], Symmetric3d::diagonal(0.1, 0.1, 0.1)));
  }
  const Model model = builder.build();
  State state = zero_state(model);
  for (int i = 0; i < 3; ++i) set_root_pose(model, i, {Rotationd::identity(), {4.0 + 0.2 * i, -7, 1}}, state);
  set_root_twist(model, 0, {Vector3d::zero(), {0.5, 0, 0}}, state);
  // The second contact is at rest until the force of the first one moves the middle ball.
  std::array<CompliantContact, 2> contacts;
  for (int i = 0; i < 2; ++i) {
    contacts[i] = {i, i + 1, {4.1 + 0.2 * i, -7, 1}, {-1, 0, 0}};
    contacts[i].stiffness = line.k[i];
  }
  const ImpactSolution o = compliant_impact(model, state, contacts, {}, {});
  ASSERT_EQ(o.status, Status::separated) << o.message;
  Worst velocity("velocities against Runge and Kutta's method, over the first speed");
  for (int i = 0; i < 3; ++i) {
    EXPECT_LT(velocity.note(std::abs(root_twist(model, o.after, i).linear[0] - line.after[i]) / 0.5, i),
              1e-7);  // measured 2.4e-9
  }
  for (int i = 0; i < 2; ++i) EXPECT_EQ(o.forces[i].touches, line.touches[i]);
  EXPECT_EQ(o.forces[0].touches, touches);
  EXPECT_LT(o.energy_residual, 1e-8);
  EXPECT_LT(momentum_error(model, state, o.after), 1e-13);
}

TEST(CompliantContacts, RestingContactIsPushedTogether) { expect_line({1, 1, 1}, {1e5, 1e5}, 1); }
TEST(CompliantContacts, LightBodyBetweenHeavyOnesTouchesRepeatedly) { expect_line({5, 0.5, 4}, {1e6, 1e4}, 4); }

// Two bodies move towards each other at held velocities: the drives do the work, f = k v t.
TEST(CompliantContacts, HeldBodiesFollowDrives) {
  const CentralPair c = central_pair();
  const int held[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};
  const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {.longest = 1e-3}, held);
  ASSERT_EQ(o.status, Status::time_over) << o.message;
  EXPECT_EQ(o.after.v, c.state.v);
  const double k = c.contact.stiffness, d = CentralPair::speed * 1e-3;
  EXPECT_NEAR(o.forces[0].peak_force, k * d, 1e-9 * k * d);  // measured 2e-13
  EXPECT_NEAR(norm(o.forces[0].impulse.linear), 0.5 * k * d * 1e-3,
              1e-8 * k * d * 1e-3);  // measured 2.3e-10, equal for the work
  EXPECT_NEAR(o.held_work, 0.5 * k * d * d, 1e-8 * k * d * d);
  EXPECT_LT(o.energy_residual, 1e-11);
  // The held velocities transmit the impulse to the environment, in the bodies' axes, which are parallel to W's.
  const Vector3d P{o.held_impulses[3], o.held_impulses[4], o.held_impulses[5]};
  EXPECT_LT(norm(P + o.forces[0].impulse.linear), 1e-8 * norm(P));
  std::printf("[ measured ] held: impulse %.3g, work %.3g, energy %.3g\n",
              norm(o.forces[0].impulse.linear) / (0.5 * k * d * 1e-3) - 1, o.held_work / (0.5 * k * d * d) - 1,
              o.energy_residual);
}

// A plate touches a body at two symmetric points.
TEST(CompliantContacts, SymmetricContactsShareEqually) {
  CentralPair c = central_pair();
  Vector3d t = cross(c.contact.n_W, Vector3d{0, 0, 1});
  t = (1 / norm(t)) * t;
  std::array<CompliantContact, 2> two{c.contact, c.contact};
  two[0].p_WC += 0.3 * t, two[1].p_WC -= 0.3 * t;
  for (CompliantContact& contact : two) contact.stiffness *= 0.5;
  const ImpactSolution o = compliant_impact(c.model, c.state, two, {}, {});
  const ImpactSolution one = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
  ASSERT_EQ(o.status, Status::separated) << o.message;
  const Vector3d P = one.forces[0].impulse.linear;
  for (const ForceHistory& h : o.forces) EXPECT_LT(norm(h.impulse.linear - 0.5 * P), 1e-8 * norm(P));
  EXPECT_NEAR(o.duration, one.duration, 1e-8 * one.duration);
}

// Very high stiffness: deformations of nanometres, five metres from the origin.
TEST(CompliantContacts, DeformationsResolvedAtLargePositions) {
  CentralPair c = central_pair();
  c.contact.stiffness = 1e15;
  const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
  ASSERT_EQ(o.status, Status::separated) << o.message;
  const double d = CentralPair::speed * std::sqrt(CentralPair::m_eff / c.contact.stiffness);
  std::printf("[ measured ] deformation %.3g m off by %.3g, energy %.3g\n", d, o.forces[0].largest_deformation / d - 1,
              o.energy_residual);
  EXPECT_NEAR(o.forces[0].largest_deformation, d, 2e-9 * d);  // measured 8.4e-11
  EXPECT_LT(o.energy_residual, 1e-8);
}

TEST(CompliantContacts, EndWithoutWork) {
  CentralPair c = central_pair();
  const Twistd V = root_twist(c.model, c.state, 0);
  State apart = c.state;
  set_root_twist(c.model, 0, {V.angular, V.linear + 2 * CentralPair::speed * c.contact.n_W}, apart);
  const ImpactSolution leaves = compliant_impact(c.model, apart, {&c.contact, 1}, {}, {});
  EXPECT_EQ(leaves.status, Status::separated);
  EXPECT_EQ(leaves.duration, 0);
  EXPECT_EQ(leaves.forces[0].touches, 0);
  State rests = c.state;
  set_root_twist(c.model, 0, root_twist(c.model, c.state, 1), rests);
  const ImpactSolution nothing = compliant_impact(c.model, rests, {&c.contact, 1}, {}, {});
  EXPECT_EQ(nothing.status, Status::separated);
  EXPECT_LT(relative_difference(eigen(nothing.after.v), eigen(rests.v)), 1e-15);
  EXPECT_EQ(compliant_impact(c.model, c.state, {}, {}, {}).status, Status::separated);
}

TEST(CompliantContacts, TimeAndStepLimits) {
  const CentralPair c = central_pair();
  const ImpactSolution late = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {.longest = 0.005});
  EXPECT_EQ(late.status, Status::time_over);
  EXPECT_EQ(late.duration, 0.005);
  EXPECT_GT(late.elastic_energy_after, 0);
  EXPECT_LT(late.energy_residual, 1e-8);
  const ImpactSolution tired = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {.max_steps = 20});
  EXPECT_EQ(tired.status, Status::failed);
  EXPECT_NE(tired.message.find("the maximum number of steps, 20,"), std::string::npos) << tired.message;
  EXPECT_EQ(tired.times.back(), tired.duration);
}

// Stiffnesses beyond the range of doubles: the integrator fails and reports time and reason.
TEST(CompliantContacts, OverflowFailsWithMessage) {
  CentralPair c = central_pair();
  c.contact.stiffness = 1e300;
  c.contact.damping = 1e308;
  const ImpactSolution o = compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {});
  EXPECT_EQ(o.status, Status::failed);
  EXPECT_NE(o.message.find("at 0 s"), std::string::npos) << o.message;
}

TEST(CompliantContacts, RejectBadArguments) {
  const CentralPair c = central_pair();
  const auto refuses = [&](auto&& change, const char* word) {
    CentralPair bad = c;
    CompliantSetup setup;
    change(bad, setup);
    try {
      compliant_impact(bad.model, bad.state, {&bad.contact, 1}, {}, setup);
      ADD_FAILURE() << "accepted: " << word;
    } catch (const std::invalid_argument& e) {
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
  };
  refuses([](CentralPair& p, auto&) { p.contact.n_W = {1, 1, 0}; }, "contact 1: the normal must be a unit vector");
  refuses([](CentralPair& p, auto&) { p.contact.stiffness = 0; }, "stiffness");
  refuses([](CentralPair& p, auto&) { p.contact.stiffness = NAN; }, "stiffness");
  refuses([](CentralPair& p, auto&) { p.contact.damping = -1; }, "damping");
  refuses([](CentralPair& p, auto&) { p.contact.friction = -0.1; }, "friction");
  refuses([](CentralPair& p, auto&) { p.contact.friction = 0.1, p.contact.slip_speed = 0; }, "slip_speed");
  refuses([](CentralPair& p, auto&) { p.contact.model = ContactForceModel::hunt_crossley, p.contact.exponent = 0.5; },
          "exponent");
  refuses([](CentralPair& p, auto&) { p.contact.target_body = 0; }, "both sides are the same body");
  refuses([](CentralPair& p, auto&) { p.contact.robot_body = 9; }, "a body is not in the model");
  refuses([](CentralPair& p, auto&) { p.contact.p_WC = {NAN, 0, 0}; }, "the point is not finite");
  refuses([](CentralPair& p, auto&) { p.state.v.pop_back(); }, "size differs from the model");
  refuses([](CentralPair& p, auto&) { p.state.v[3] = NAN; }, "not finite");
  refuses([](auto&, CompliantSetup& s) { s.longest = 0; }, "longest");
  refuses([](auto&, CompliantSetup& s) { s.settled = 1; }, "settled");
  refuses([](auto&, CompliantSetup& s) { s.relative_tolerance = 0; }, "relative_tolerance");
  refuses([](auto&, CompliantSetup& s) { s.samples = 1; }, "samples");
  for (const std::vector<int>& held : {std::vector<int>{12}, {0, 0}, {0, 1}}) {
    EXPECT_THROW(compliant_impact(c.model, c.state, {&c.contact, 1}, {}, {}, held), std::invalid_argument);
  }
  const Grasp grasp{0, 1, GraspModel::hinge, c.contact.p_WC, {0, 0, 2}};
  for (const CompliantGrasp& g : {CompliantGrasp{grasp, 1e5, 0, 1e4, 0}, CompliantGrasp{grasp, 0, 0, 1e4, 0},
                                  CompliantGrasp{grasp, 1e5, -1, 1e4, 0}, CompliantGrasp{grasp, 1e5, 0, 0, 0}}) {
    EXPECT_THROW(compliant_impact(c.model, c.state, {}, {&g, 1}, {}), std::invalid_argument);
  }
}

}  // namespace compliant_contact_test
}  // namespace grapnel::testing
