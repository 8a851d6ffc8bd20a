/// Impedance control of an end-effector: exact oscillators of free-floating arms, the contact that stops its target,
/// with and without sampling.

#include "grapnel/control/impedance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "control/arm_case.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "impact/compliant_case.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::testing {
namespace impedance_test {

constexpr double kMass = 30, kDamping = 12, kStiffness = 5;             // [kg], [N s/m], [N/m]
constexpr double kInertia = 4, kTurnDamping = 1.5, kTurnStiffness = 2;  // [kg m^2], ...

// Solution e(t) of m e'' + d e' + k e = 0, underdamped.
double oscillator(double m, double d, double k, double e, double v, double t) {
  const double decay = d / (2 * m), w = std::sqrt(k / m - decay * decay);
  return std::exp(-decay * t) * (e * std::cos(w * t) + (v + decay * e) / w * std::sin(w * t));
}

ImpedanceLaw gains() {
  ImpedanceLaw law;
  law.mass = {kMass, kMass, kMass}, law.damping = {kDamping, kDamping, kDamping};
  law.stiffness = {kStiffness, kStiffness, kStiffness};
  law.inertia = {kInertia, kInertia, kInertia}, law.angular_damping = {kTurnDamping, kTurnDamping, kTurnDamping};
  law.angular_stiffness = {kTurnStiffness, kTurnStiffness, kTurnStiffness};
  return law;
}

// A floating base with an arm of random links; in the planar case all axes are z and the motion is planar.
Model random_arm(Random& random, int joints, bool plane) {
  ModelBuilder builder;
  BodyDescription base;
  base.name = base.joint.name = "base", base.joint.type = JointType::free;
  base.mass = random.uniform(100, 400), base.inertia = Symmetric3d::diagonal(40, 50, 45);
  if (!plane) base.com = random.vector(0.1);
  builder.add(base);
  std::string parent = "base";
  for (int j = 0; j < joints; ++j) {
    BodyDescription link;
    link.name = "link-" + std::to_string(j + 1), link.joint.name = "joint-" + std::to_string(j + 1);
    link.parent = parent, link.X_PF.p = {random.uniform(0.4, 0.7), plane ? 0 : random.uniform(-0.1, 0.1), 0};
    link.joint.type = JointType::revolute;
    const Vector3d axes[] = {{0, 0, 1}, {0, 1, 0}, {1, 0, 0}};
    const Vector3d tilted = axes[j % 3] + random.vector(0.2);
    link.joint.axis = plane ? Vector3d{0, 0, 1} : (1 / norm(tilted)) * tilted;
    link.mass = random.uniform(3, 20), link.com = {0.25, 0, 0}, link.inertia = Symmetric3d::diagonal(0.1, 0.5, 0.5);
    builder.add(link);
    parent = link.name;
  }
  return builder.build();
}

// In the planar case the state has no out-of-plane components.
State moving(const Model& model, Random& random, bool plane, double rates) {
  State s = zero_state(model);
  const double bent[] = {0.5, -0.9, 0.7, 1.1, -0.9, 0.6, 0.8};
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.bodies()[model.joints()[j]];
    s.q[body.q] = bent[j] + random.uniform(-0.1, 0.1), s.v[body.v] = random.uniform(-rates, rates);
  }
  for (int k = 0; k < 6; ++k) s.v[k] = plane && k != 2 && k != 3 && k != 4 ? 0 : random.uniform(-rates, rates);
  return s;
}

std::shared_ptr<Impedance> law_of(const Model& model, const State& start, ImpedanceLaw law, const Vector3d& off,
                                  const Vector3d& velocity) {
  ImpedanceEndEffector end_effector;
  end_effector.body = static_cast<int>(model.bodies().size()) - 1,
  end_effector.X_BE = {Rotationd::identity(), {0.4, 0, 0}};
  const Kinematics k = forward_kinematics(model, start);
  end_effector.reference.X_D = k.X_WB[end_effector.body] * end_effector.X_BE;
  end_effector.reference.X_D.p -= off, end_effector.reference.velocity = velocity;
  law.end_effectors = {end_effector};
  return std::make_shared<Impedance>(model, std::move(law), LawScope{arm_joints(model)});
}

// The end-effector is an oscillator with M, D and K for any motion of base and arm, with momentum in the system.
TEST(Impedance, EndEffectorIsAnOscillator) {
  for (int index = 0; index < 6; ++index) {
    SCOPED_TRACE(seed_note(index));
    Random random(index);
    const bool plane = index % 3 == 2;
    const Model model = random_arm(random, plane ? 3 : 6 + index % 3, plane);
    const State start = moving(model, random, plane, 0.03);
    ImpedanceLaw law = gains();
    law.motion = plane ? ImpedanceLaw::Motion::plane : ImpedanceLaw::Motion::pose;
    const Vector3d off{0.05, -0.04, plane ? 0 : 0.03}, velocity{0.01, 0.02, plane ? 0 : -0.01};
    const auto impedance = law_of(model, start, law, off, velocity);
    const ImpedanceEndEffector& end_effector = impedance->law().end_effectors[0];
    const auto apart = [&](const State& s, double t) {
      const Kinematics k = forward_kinematics(model, s);
      return (k.X_WB[end_effector.body] * end_effector.X_BE).p - end_effector.reference.X_D.p - t * velocity;
    };
    const Kinematics k = forward_kinematics(model, start);
    const Vector3d arm = k.X_WB[end_effector.body].R * end_effector.X_BE.p;
    const Vector3d v = shift(k.V_WB[end_effector.body], arm).linear - velocity;
    PhaseDynamics dynamics(model, with_law(model, impedance));
    IntegrationSetup integration;
    integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
    double error = 0;
    const PhaseOutcome o = simulate_phase(
        dynamics, {start, 0, 8, 0.5}, integration, {.observe = [&](const PhaseSample& s) {
          const Vector3d e = apart(s.state, s.time);
          for (int i = 0; i < 3; ++i)
            error = std::max(error, std::abs(e[i] - oscillator(kMass, kDamping, kStiffness, off[i], v[i], s.time)));
        }});
    ASSERT_TRUE(o.finished) << o.failure;
    std::printf("  joints %zu: off the oscillator by %.2g m\n", model.joints().size(), error);
    EXPECT_LT(error, 1e-9);  // measured 2e-12
  }
}

// D's velocity and acceleration are the derivatives of its pose; it begins with the end-effector's motion and arrives
// as commanded.
TEST(Impedance, ReferenceOnABodyHasConsistentDerivatives) {
  BodyDescription body;
  body.name = body.joint.name = "target", body.joint.type = JointType::free;
  body.mass = 100, body.inertia = Symmetric3d::diagonal(20, 20, 20);
  ModelBuilder builder;
  builder.add(body);
  const Model model = builder.build();
  double of_velocity = 0, of_acceleration = 0;
  for (int index = 0; index < 20; ++index) {
    SCOPED_TRACE(seed_note(index));
    Random random(index);
    // A free ball: it translates and rotates uniformly.
    const Vector3d p_0 = random.vector(1), v = random.vector(0.2), w = random.vector(0.6);
    const auto at = [&](double t) {
      Kinematics k(model);
      const double angle = norm(w) * t;
      const Vector3d n = (std::sin(0.5 * angle) / norm(w)) * w;
      k.X_WB[0] = {rotation_matrix(Quaterniond{std::cos(0.5 * angle), n[0], n[1], n[2]}), p_0 + t * v};
      k.V_WB[0] = {w, v};
      return k;
    };
    const double begin = 2, arrival = 9;
    EndEffectorReference r;
    r.body = 0, r.begin = begin, r.X_D = {at(1.3).X_WB[0].R, random.vector(0.5)};
    r.offset = random.vector(1), r.turn = random.vector(index % 2 == 0 ? 0.3 : 1.5);
    r.departure = random.vector(0.3), r.turn_rate = random.vector(0.4);
    r.remaining_fraction = {begin, JointPath{JointProfile::quintic, arrival - begin, 1, 0}};
    r.arrival = random.vector(0.1), r.arrival_time = arrival;
    const std::vector<BodyAcceleration> none(1, {Vector3d::zero(), Vector3d::zero()});
    const auto D = [&](double t) { return end_effector_motion(r, at(t), none, t); };
    const double h = 1e-4;
    for (const double t : {begin + 0.2, 4.0, 6.5, 8.9}) {
      const EndEffectorState a = D(t - h), b = D(t), c = D(t + h);
      const double half = 0.5 / h;
      const Vector3d turned = b.X_WD.R * rotation_vector(transpose(a.X_WD.R) * c.X_WD.R);
      of_velocity =
          std::max({of_velocity, norm(half * (c.X_WD.p - a.X_WD.p) - b.V.linear), norm(half * turned - b.V.angular)});
      of_acceleration = std::max({of_acceleration, norm(half * (c.V.linear - a.V.linear) - b.A.linear),
                                  norm(half * (c.V.angular - a.V.angular) - b.A.angular)});
    }
    const EndEffectorState first = D(begin), last = D(arrival);
    const Kinematics k = at(begin), end = at(arrival);
    const Vector3d arm = k.X_WB[0].R * (r.X_D.p + r.offset), left = end.X_WB[0].R * r.X_D.p;
    EXPECT_LT(norm(first.V.linear - v - cross(w, arm) - k.X_WB[0].R * r.departure), 1e-14);
    const Vector3d relative = transposed_times(k.X_WB[0].R * r.X_D.R, first.V.angular - w);
    EXPECT_LT(norm(rotation_vector_rate(r.turn, relative) - r.turn_rate), 1e-14);
    EXPECT_LT(norm(last.X_WD.p - end.X_WB[0] * r.X_D.p), 1e-14);
    EXPECT_LT(norm(last.V.linear - v - cross(w, left) - r.arrival), 1e-14);
    EXPECT_LT(norm(last.V.angular - w), 1e-14);
  }
  std::printf("  from differences: velocity %.2g, acceleration %.2g\n", of_velocity, of_acceleration);
  EXPECT_LT(of_velocity, 1e-7);
  EXPECT_LT(of_acceleration, 1e-7);
}

// From rest an end-effector rotated off its reference about one axis returns as an oscillator about that axis.
TEST(Impedance, EndEffectorRotationIsAnOscillator) {
  const Model model = arm_with_target({.joints = 7});
  const State start = moving_state(model, 0);
  ImpedanceLaw law = gains();
  ImpedanceEndEffector end_effector;
  end_effector.body = model.body_index("target");
  const Posed X_WE = forward_kinematics(model, start).X_WB[end_effector.body];
  const Vector3d axis{2.0 / 7, -3.0 / 7, 6.0 / 7};
  const double angle = 0.2;
  const Vector3d half = std::sin(angle / 2) * axis;
  end_effector.reference.X_D = {
      X_WE.R * transpose(rotation_matrix(Quaterniond{std::cos(angle / 2), half[0], half[1], half[2]})), X_WE.p};
  law.end_effectors = {end_effector};
  const auto impedance = std::make_shared<Impedance>(model, law, LawScope{arm_joints(model)});
  PhaseDynamics dynamics(model, with_law(model, impedance));
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  double error = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 6, 0.5}, integration, {.observe = [&](const PhaseSample& s) {
                       const double exact = oscillator(kInertia, kTurnDamping, kTurnStiffness, angle, 0, s.time);
                       error = std::max(error, std::abs(impedance->deviation(s.time, s.state).angle - std::abs(exact)));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  off by %.2g rad\n", error);
  EXPECT_LT(error, 1e-9);
}

// The transpose law uses no model: its work is that of a spring and a damper at the end-effector.
TEST(Impedance, TransposeLawActsAsASpring) {
  const Model model = arm_with_target({.joints = 7});
  const State start = moving_state(model, 0);
  ImpedanceLaw law = gains();
  law.law = ImpedanceGains::Law::transpose, law.null_rate = 0;
  law.damping = law.angular_damping = Vector3d::zero();
  const auto impedance = law_of(model, start, law, {0.2, -0.1, 0.15}, Vector3d::zero());
  const auto energy_of = [&](const State& s) {
    const Impedance::Deviation d = impedance->deviation(0, s);
    return kinetic_energy(model, forward_kinematics(model, s), s) + 0.5 * kStiffness * d.distance * d.distance +
           0.5 * kTurnStiffness * d.angle * d.angle;
  };
  PhaseDynamics dynamics(model, with_law(model, impedance));
  IntegrationSetup integration;
  integration.relative_tolerance = integration.absolute_tolerance = 1e-12;
  const double before = energy_of(start);
  double error = 0, moving = 0;
  const PhaseOutcome o =
      simulate_phase(dynamics, {start, 0, 20, 1}, integration, {.observe = [&](const PhaseSample& s) {
                       error = std::max(error, std::abs(energy_of(s.state) - before));
                       moving = std::max(moving, kinetic_energy(model, forward_kinematics(model, s.state), s.state));
                     }});
  ASSERT_TRUE(o.finished) << o.failure;
  std::printf("  energy off by %.2g of %.3g J, kinetic up to %.3g J\n", error, before, moving);
  EXPECT_LT(error, 1e-9 * before);
  EXPECT_GT(moving, 0.1 * before);
}

// Efforts of the law during a contact.
class Drive : public ImpactDrive {
 public:
  Drive(const Model& model, std::shared_ptr<Impedance> law) : model_(model), law_(std::move(law)) {}
  double next_break(double) const override { return std::numeric_limits<double>::infinity(); }
  void begin_segment(double, const State&, std::span<const ExternalWrench>) override {}
  void efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
               std::span<double> effort) override {
    law_->sense(wrenches);
    const JointLawCommand command = law_->at(t, state, {});
    for (std::size_t j = 0; j < law_->joints().size(); ++j)
      effort[model_.bodies()[model_.joints()[law_->joints()[j]]].v] = command.effort[static_cast<Eigen::Index>(j)];
  }

 private:
  const Model& model_;
  std::shared_ptr<Impedance> law_;
};

struct BallContact {
  Model model;
  State state;
  CompliantContact contact;
  double speed;
};

// A ball hits the end-effector of an arm at rest centrally.
BallContact ball_against_arm(const CompliantContact& like) {
  Random random(3);
  const Model arm = random_arm(random, 7, false);
  ModelBuilder builder;
  for (const Body& b : arm.bodies()) builder.add(b.description);
  builder.add(free_body("ball", 12, Symmetric3d::diagonal(0.4, 0.4, 0.4)));
  BallContact m{builder.build(), {}, like, 0.04};
  Random again(4);
  const State posture = moving(arm, again, false, 0);
  m.state = zero_state(m.model);
  for (const Body& b : arm.bodies()) {
    const Body& to = m.model.bodies()[m.model.body_index(b.description.name)];
    const int count = b.description.joint.type == JointType::free ? 7 : 1;
    for (int k = 0; k < count; ++k) m.state.q[to.q + k] = posture.q[b.q + k];
  }
  const int end_effector = m.model.body_index("link-7"), ball = m.model.body_index("ball");
  m.contact.robot_body = end_effector, m.contact.target_body = ball;
  m.contact.n_W = {3.0 / 7, -2.0 / 7, 6.0 / 7};
  m.contact.p_WC = forward_kinematics(m.model, m.state).X_WB[end_effector] * Vector3d{0.4, 0, 0};
  set_root_pose(m.model, ball, {Rotationd::identity(), m.contact.p_WC - 0.3 * m.contact.n_W}, m.state);
  set_root_twist(m.model, ball, {Vector3d::zero(), m.speed * m.contact.n_W}, m.state);
  return m;
}

std::shared_ptr<Impedance> matched(const BallContact& m, double mass) {
  ImpedanceLaw law;
  ImpedanceEndEffector end_effector;
  end_effector.body = m.contact.robot_body, end_effector.X_BE = {Rotationd::identity(), {0.4, 0, 0}};
  end_effector.reference.X_D = forward_kinematics(m.model, m.state).X_WB[end_effector.body] * end_effector.X_BE;
  end_effector.normal = m.contact.n_W, end_effector.matched_mass = mass;
  law.end_effectors = {end_effector};
  return std::make_shared<Impedance>(m.model, std::move(law), LawScope{arm_joints(m.model)});
}

// v_t' = v_t (m_t - e m) / (m_t + m): with e m = m_t the ball is stopped, for any contact law.
TEST(Impedance, MatchedContactStopsTheTarget) {
  CompliantContact soft;
  soft.stiffness = 800, soft.damping = 2;
  CompliantContact hertz;
  hertz.model = ContactForceModel::hertz, hertz.stiffness = 4e4;
  CompliantContact crossley;
  crossley.model = ContactForceModel::hunt_crossley, crossley.stiffness = 4e4, crossley.damping = 5;
  for (const CompliantContact& like : {soft, hertz, crossley}) {
    if (test::kSanitized && like.model != soft.model) continue;  // their forces are in tests/impact
    const BallContact m = ball_against_arm(like);
    const double mass = matching_mass(m.contact, 12, m.speed);
    const double e = restitution_of(m.contact, mass * 12 / (mass + 12), m.speed);
    EXPECT_NEAR(e * mass, 12, 1e-10);
    const auto run = [&](double apparent) {
      const auto law = matched(m, apparent);
      Drive drive(m.model, law);
      CompliantSetup setup;
      setup.longest = 20;
      return compliant_impact(m.model, m.state, {&m.contact, 1}, {}, setup, {}, {}, &drive);
    };
    const ImpactSolution o = run(mass);
    ASSERT_EQ(o.status, ImpactSolution::Status::separated) << o.message;
    const int ball = m.contact.target_body;
    const double left = dot(root_twist(m.model, o.after, ball).linear, m.contact.n_W);
    std::printf("  e %.4f, mass %.4f kg: left %.2g of %.2g m/s; energy %.2g, work %.3g J, momentum %.2g\n", e, mass,
                left, m.speed, o.energy_residual, o.drive_work, momentum_error(m.model, m.state, o.after));
    EXPECT_LT(std::abs(left), 1e-7 * m.speed);
    EXPECT_LT(o.energy_residual, 1e-9);
    EXPECT_GT(std::abs(o.drive_work), 1e-4 * o.kinetic_energy_before);
    EXPECT_LT(momentum_error(m.model, m.state, o.after), 1e-13);
    // With another mass the ball's final speed follows from the formula.
    const double other = 0.4 * mass, e_other = restitution_of(m.contact, other * 12 / (other + 12), m.speed);
    const double expected = m.speed * (12 - e_other * other) / (12 + other);
    const ImpactSolution p = run(other);
    const double after = dot(root_twist(m.model, p.after, ball).linear, m.contact.n_W);
    EXPECT_NEAR(after, expected, 1e-7 * m.speed);
    EXPECT_GT(expected, 0.2 * m.speed);
  }
}

// J M^-1 J^T of the whole is J* H*^-1 J*^T: the generalized Jacobian, block by block.
TEST(Impedance, EffectiveMassAgreesWithTheGeneralizedJacobian) {
  Random random(5);
  const Model model = random_arm(random, 7, false);
  const State s = moving(model, random, false, 0);
  const Vector3d n{2.0 / 7, 6.0 / 7, -3.0 / 7};
  const Kinematics k = forward_kinematics(model, s);
  const int end_effector = model.body_index("link-7");
  const Vector3d p = k.X_WB[end_effector] * Vector3d{0.4, 0, 0};
  Eigen::MatrixXd J(6, model.velocities());
  point_jacobian(model, k, end_effector, p, J);
  const Eigen::MatrixXd H = mass_matrix(model, s), H_b = H.topLeftCorner(6, 6), H_bm = H.topRightCorner(6, 7);
  const Eigen::MatrixXd back = lu_solution(H_b, H_bm);
  const Eigen::MatrixXd J_star = J.rightCols(7) - J.leftCols(6) * back;
  const Eigen::MatrixXd H_star = H.bottomRightCorner(7, 7) - H_bm.transpose() * back;
  const Eigen::VectorXd row = J_star.bottomRows<3>().transpose() * Eigen::Vector3d(n[0], n[1], n[2]);
  const double expected_joints = row.dot(lu_solution(H_star, row));
  // Rigid motion of a free base adds n^T J_b H_b^-1 J_b^T n.
  const Eigen::VectorXd base = J.leftCols(6).bottomRows<3>().transpose() * Eigen::Vector3d(n[0], n[1], n[2]);
  const double whole = expected_joints + base.dot(lu_solution(H_b, base));
  EXPECT_NEAR(effective_mass(model, s, end_effector, p, n), 1 / whole, 1e-10 / whole);
  EXPECT_GT(expected_joints, whole - expected_joints);
}

// A limit clips the efforts for the end-effector, and this is reported; the damping is reduced first.
TEST(Impedance, ReportsClippedEfforts) {
  const Model strong = arm_with_target({.joints = 7});
  const State start = moving_state(strong, 0.02);
  const auto full = law_of(strong, start, gains(), {0.3, 0.1, 0.2}, Vector3d::zero())->at(0, start, {});
  EXPECT_TRUE(full.within_limits);
  const Model weak = arm_with_target({.joints = 7, .effort = 0.5 * full.effort.cwiseAbs().maxCoeff()});
  const auto cut = law_of(weak, start, gains(), {0.3, 0.1, 0.2}, Vector3d::zero())->at(0, start, {});
  EXPECT_FALSE(cut.within_limits);
  EXPECT_GT(cut.scale, 0.3);
  EXPECT_LT(cut.scale, 0.8);
}

// A fully extended planar arm cannot move its end-effector along the arm: the reported condition is near zero.
TEST(Impedance, ConditionDropsNearRankLoss) {
  Random random(9);
  const Model model = random_arm(random, 3, true);
  State s = zero_state(model);
  ImpedanceLaw law = gains();
  law.motion = ImpedanceLaw::Motion::plane;
  const double straight = law_of(model, s, law, {0, 0, 0}, {0, 0, 0})->at(0, s, {}).condition;
  s = moving(model, random, true, 0);
  const double bent = law_of(model, s, law, {0, 0, 0}, {0, 0, 0})->at(0, s, {}).condition;
  EXPECT_LT(straight, 1e-12);
  EXPECT_GT(bent, 1e-2);
}

}  // namespace impedance_test
}  // namespace grapnel::testing
