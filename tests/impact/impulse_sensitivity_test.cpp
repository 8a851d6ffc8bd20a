/// Derivatives of the impact by dual numbers against finite differences of plastic_impact() on modified problems: a
/// modified target, a modified target velocity, a modified configuration from Newton's method.

#include "grapnel/impact/impulse_sensitivity.hpp"
#include "grapnel/impact/yielding_drives.hpp"
#include "grapnel/spatial/decompositions.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

#include "impact/impact_case.hpp"
#include "impact/thesis_robot.hpp"
#include "support/sanitizers.hpp"
#include "support/worst.hpp"

namespace grapnel::testing {
namespace impulse_sensitivity_test {

struct Problem {
  Model model;
  State state;
  std::vector<Grasp> grasps;
  std::vector<HeldRate> held;
  int root;
};

// --- Problems. ------------------------------------------------------------------------------------------------------

Problem thesis_problem(GraspModel grasp, bool shared) {
  ReferenceImpact r = reference_impact(grasp, 0.1);
  const int t1 = r.grasps[0].target_body;
  set_root_twist(r.model, t1, {{0, 0, 0.3}, {0.02, -0.05, 0}}, r.state);
  if (shared) {
    r.grasps[1].target_body = t1;
    set_root_pose(r.model, t1, {rotation_about({0, 0, 1}, 0.4), {0.1, 1.2, 0}}, r.state);
  }
  const int root = r.model.body_index("base");
  return {std::move(r.model), std::move(r.state), std::move(r.grasps), {}, root};
}

// Two arms of `joints` revolute joints about random axes on a free base, triaxial bodies, all moving.
Problem spatial_problem(int index, int joints, bool shared, bool free_base = true) {
  Random random(index);
  ModelBuilder builder;
  const auto body = [&](const std::string& name, const std::string& parent, double mass, JointType type) {
    BodyDescription b;
    b.name = b.joint.name = name;
    b.parent = parent;
    b.joint.type = type;
    b.mass = mass;
    b.com = random.vector(0.3);
    b.inertia = random_inertia(mass, 0.5, random);
    if (!parent.empty()) b.X_PF = {random.rotation(), random.vector(0.5)}, b.joint.axis = random.direction();
    builder.add(b);
  };
  body("base", "", 100, free_base ? JointType::free : JointType::fixed);
  for (int arm = 0; arm < 2; ++arm) {
    std::string parent = "base";
    for (int j = 0; j < joints; ++j) {
      const std::string name = "arm" + std::to_string(arm) + "." + std::to_string(j);
      body(name, parent, random.uniform(2, 10), JointType::revolute);
      parent = name;
    }
  }
  const int targets = shared ? 1 : 2;
  for (int t = 0; t < targets; ++t) body("t" + std::to_string(t), "", random.uniform(5, 50), JointType::free);
  Problem p{builder.build(), {}, {}, {}, 0};
  p.root = p.model.body_index("base");
  p.state = random_state(p.model, random, 0.5);
  const Kinematics k = forward_kinematics(p.model, p.state);
  const GraspModel models[] = {GraspModel::rigid, GraspModel::hinge, GraspModel::point};
  for (int arm = 0; arm < 2; ++arm) {
    const int link = p.model.body_index("arm" + std::to_string(arm) + "." + std::to_string(joints - 1));
    const int target = p.model.body_index(shared ? "t0" : "t" + std::to_string(arm));
    const Vector3d C = k.X_WB[link] * random.vector(0.4);
    if (!shared || arm == 0) set_root_pose(p.model, target, {random.rotation(), C + random.vector(0.6)}, p.state);
    p.grasps.push_back({link, target, models[(index + arm) % 3], C, random.direction()});
  }
  return p;
}

int joint_velocity(const Problem& p, const std::string& body) { return p.model.bodies()[p.model.body_index(body)].v; }

// --- The same problems, changed by a finite amount. -----------------------------------------------------------------

Model with_target(const Model& model, int target, double mass, const Symmetric3d& inertia) {
  ModelBuilder builder;
  for (const Body& b : model.bodies()) {
    BodyDescription d = b.description;
    if (&b == &model.bodies()[target]) {
      d.mass += mass;
      for (int i = 0; i < 3; ++i) d.inertia(i, i) += inertia(i, i);
    }
    builder.add(d);
  }
  return builder.build();
}

Twistd twist_at(const Kinematics& k, int body, const Vector3d& p) { return shift(k.V_WB[body], p - k.X_WB[body].p); }

void set_target_motion(Problem& p, const Grasp& g, const Twistd& V_WC) {
  const Vector3d origin = root_pose(p.model, p.state, g.target_body).p;
  set_root_twist(p.model, g.target_body, shift(V_WC, origin - g.p_WC), p.state);
}

// Jacobians of the grasping bodies with respect to the joints; columns of roots are zero.
Eigen::MatrixXd joint_jacobian(const Problem& p, const Kinematics& k) {
  Eigen::MatrixXd J(6 * static_cast<int>(p.grasps.size()), p.model.velocities()), J_E(6, p.model.velocities());
  for (std::size_t i = 0; i < p.grasps.size(); ++i) {
    point_jacobian(p.model, k, p.grasps[i].robot_body, p.grasps[i].p_WC, J_E);
    for (const Body& b : p.model.bodies()) {
      if (b.parent < 0) J_E.middleCols(b.v, velocity_count(b.description.joint.type)).setZero();
    }
    J.middleRows<6>(6 * static_cast<int>(i)) = J_E;
  }
  return J;
}

// Rotates the end-effector by the angle about the contact point. Newton's method uses the initial Jacobian, so that the
// joint displacement stays in its row space (minimum norm). Then sets the rates.
void turn_end_effector(Problem& p, int grasp, const Vector3d& axis, double angle) {
  const Kinematics before = forward_kinematics(p.model, p.state);
  const Eigen::MatrixXd J = joint_jacobian(p, before);
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> inverse;
  inverse.setThreshold(1e-9);
  inverse.compute(J);
  for (int iteration = 0; iteration < 100; ++iteration) {
    const Kinematics k = forward_kinematics(p.model, p.state);
    Eigen::VectorXd missing(J.rows());
    for (std::size_t i = 0; i < p.grasps.size(); ++i) {
      const Grasp& g = p.grasps[i];
      const Posed &X_0 = before.X_WB[g.robot_body], &X = k.X_WB[g.robot_body];
      const Rotationd turn = rotation_about(axis, static_cast<int>(i) == grasp ? angle : 0.0);
      const Posed wanted{turn * X_0.R, g.p_WC + turn * (X_0.p - g.p_WC)};
      const Vector3d rotation = rotation_vector(wanted.R * transpose(X.R));
      const Vector3d travel = wanted.p - X.p + cross(rotation, g.p_WC - X.p);
      missing.segment<6>(6 * static_cast<int>(i)) << eigen(rotation), eigen(travel);
    }
    const Eigen::VectorXd step = inverse.solve(missing);
    for (int j : p.model.joints()) p.state.q[p.model.bodies()[j].q] += step[p.model.bodies()[j].v];
    if (step.norm() < 1e-15) break;
  }
  const Kinematics after = forward_kinematics(p.model, p.state);
  Eigen::VectorXd missing(J.rows());
  for (std::size_t i = 0; i < p.grasps.size(); ++i) {
    const Grasp& g = p.grasps[i];
    missing.segment<6>(6 * static_cast<int>(i)) =
        eigen(twist_at(before, g.robot_body, g.p_WC)) - eigen(twist_at(after, g.robot_body, g.p_WC));
  }
  inverse.compute(joint_jacobian(p, after));
  const Eigen::VectorXd rates = inverse.solve(missing);
  for (int i = 0; i < rates.size(); ++i) p.state.v[i] += rates[i];
  if (p.grasps[grasp].model == GraspModel::hinge)
    p.grasps[grasp].hinge_W = rotation_about(axis, angle) * p.grasps[grasp].hinge_W;
}

int axis_of(const std::string& parameter) { return parameter.back() - 'x'; }
bool is(const ImpulseSensitivity& s, const std::string& name) { return s.parameter.rfind(name, 0) == 0; }

Problem changed(const Problem& original, const ImpulseSensitivity& s, double step) {
  Problem p = original;
  const Grasp& g = p.grasps[s.grasp];
  const Kinematics k = forward_kinematics(p.model, p.state);
  const Twistd V_E = twist_at(k, g.robot_body, g.p_WC), V_T = twist_at(k, g.target_body, g.p_WC);
  const Vector3d axis = s.parameter == "target mass" ? Vector3d::zero() : Vector3d::unit(axis_of(s.parameter));
  if (is(s, "relative velocity")) {
    set_target_motion(p, g, {V_T.angular, V_T.linear - step * axis});
  } else if (is(s, "relative angular velocity")) {
    set_target_motion(p, g, {V_T.angular - step * axis, V_T.linear});
  } else if (is(s, "angle of attack")) {
    set_target_motion(p, g, {V_T.angular, V_E.linear - rotation_about(axis, step) * (V_E.linear - V_T.linear)});
  } else if (is(s, "approach angle")) {
    std::vector<bool> driven;
    for (const HeldRate& h : p.held) driven.push_back(h.after != 0 && h.after == p.state.v[h.velocity]);
    turn_end_effector(p, s.grasp, axis, step);
    for (std::size_t i = 0; i < driven.size(); ++i) {
      if (driven[i]) p.held[i].after = p.state.v[p.held[i].velocity];
    }
  } else if (is(s, "contact offset")) {
    p.grasps[s.grasp].p_WC = g.p_WC + step * axis;
  } else if (s.parameter == "target mass") {
    p.model = with_target(p.model, g.target_body, step, Symmetric3d::zero());
  } else if (is(s, "target inertia")) {
    Symmetric3d I = Symmetric3d::zero();
    I(axis_of(s.parameter), axis_of(s.parameter)) = step;
    p.model = with_target(p.model, g.target_body, 0, I);
  } else {
    ADD_FAILURE() << "unknown parameter " << s.parameter;
  }
  return p;
}

// --- Comparison. ----------------------------------------------------------------------------------------------------

// Angular and linear impulses of all grasps, and the base's angular and linear change: each part is compared in its own
// unit.
struct Outcome {
  std::array<Eigen::VectorXd, 4> part;
};

Outcome stacked(const std::vector<Impulsed>& impulses, const Eigen::Vector3d& turn, const Eigen::Vector3d& travel) {
  const Eigen::Index n = 3 * static_cast<Eigen::Index>(impulses.size());
  Outcome o{{Eigen::VectorXd(n), Eigen::VectorXd(n), turn, travel}};
  for (std::size_t i = 0; i < impulses.size(); ++i) {
    o.part[0].segment<3>(3 * static_cast<Eigen::Index>(i)) = eigen(impulses[i].angular);
    o.part[1].segment<3>(3 * static_cast<Eigen::Index>(i)) = eigen(impulses[i].linear);
  }
  return o;
}

Outcome solved(const Problem& p) {
  const ImpactSolution s = plastic_impact(p.model, p.state, p.grasps, p.held);
  std::vector<Impulsed> impulses;
  for (const ContactImpulse& c : s.contacts) impulses.push_back(c.P_WC);
  const Twistd before = root_twist(p.model, p.state, p.root);
  const Twistd after = root_twist(p.model, with_velocity(p.state, s.velocity), p.root);
  return stacked(impulses, eigen(after.angular - before.angular), eigen(after.linear - before.linear));
}

Outcome combine(double a, Outcome x, double b, const Outcome& y) {
  for (int i = 0; i < 4; ++i) x.part[i] = a * x.part[i] + b * y.part[i];
  return x;
}

// Second order in the step.
Outcome central_difference(const Problem& p, const ImpulseSensitivity& s, double step) {
  return combine(0.5 / step, solved(changed(p, s, step)), -0.5 / step, solved(changed(p, s, -step)));
}
// Fourth order in the step, by Richardson extrapolation.
Outcome extrapolated_difference(const Problem& p, const ImpulseSensitivity& s, double step) {
  return combine(4.0 / 3, central_difference(p, s, step / 2), -1.0 / 3, central_difference(p, s, step));
}

// Largest error of all parts, relative to the magnitude of the derivative. The scale is at least 1e-4 of the outcome of
// that part. It is also at least 1e-6 of the other part of the impulse or velocity (lengths are about 1 m).
double deviation(const Outcome& here, const ImpulseSensitivity& s, const Outcome& numeric) {
  const Outcome exact = stacked(s.impulse, eigen(s.base.angular), eigen(s.base.linear));
  double worst = 0;
  for (int i = 0; i < 4; ++i) {
    const int other = i ^ 1;  // the other part of impulse or of velocity
    const double size = std::max({numeric.part[i].norm(), 1e-4 * here.part[i].norm(), 1e-6 * here.part[other].norm()});
    if (size == 0) continue;  // a fixed base
    const double error = (exact.part[i] - numeric.part[i]).norm() / size;
    worst = std::isnan(error) ? INFINITY : std::max(worst, error);
  }
  return worst;
}

// The unit of the steps. Inertias: a fraction of the margin of the triangle inequality, so that the inertia stays
// physical. Approach angles: near a singular configuration joint displacements are large and nonlinear. The unit is
// therefore proportional to the minimum nonzero singular value of the arms' Jacobian.
double step_unit(const Problem& p, const ImpulseSensitivity& s) {
  if (is(s, "target inertia")) {
    const Eigen::Vector3d moments =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(
            eigen(p.model.bodies()[p.grasps[s.grasp].target_body].description.inertia), Eigen::EigenvaluesOnly)
            .eigenvalues();
    return std::min(1.0, 5 * (moments[0] + moments[1] - moments[2]));
  }
  if (!is(s, "approach angle")) return 1;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(joint_jacobian(p, forward_kinematics(p.model, p.state)));
  double least = 0.2;
  for (double sigma : svd.singularValues()) {
    if (sigma > 1e-9) least = std::min(least, sigma);
  }
  return 5 * least;
}

// Minimum deviation over a sequence of steps: truncation errors dominate for large steps, rounding errors for small
// ones.
double best_deviation(const Problem& p, const ImpulseSensitivity& s) {
  double best = INFINITY;
  const double unit = step_unit(p, s);
  const Outcome here = solved(p);
  for (double step : {2e-2, 6e-3, 2e-3, 3e-4, 4e-5})
    best = std::min(best, deviation(here, s, extrapolated_difference(p, s, unit * step)));
  return best;
}

void compare_all(const Problem& p, Worst& worst, int where, std::set<std::string>* names = nullptr) {
  for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps, p.held)) {
    SCOPED_TRACE(s.parameter + " of grasp " + std::to_string(s.grasp));
    ASSERT_EQ(s.undefined, "");
    ASSERT_EQ(s.impulse.size(), p.grasps.size());
    EXPECT_LT(worst.note(best_deviation(p, s), where), 1e-6);  // measured 1.3e-7, planar; 5e-9, spatial arms
    if (names) names->insert(s.parameter);
  }
}

// --- Tests. ---------------------------------------------------------------------------------------------------------

TEST(ImpulseSensitivity, ThesisRobotWithTwoTargets) {
  Worst worst("thesis robot, two targets");
  for (GraspModel grasp : {GraspModel::rigid, GraspModel::hinge, GraspModel::point}) {
    std::set<std::string> names;
    compare_all(thesis_problem(grasp, false), worst, static_cast<int>(grasp), &names);
    // A planar arm rotates its end-effector about z only.
    EXPECT_EQ(names.count("approach angle x") + names.count("approach angle y"), 0u);
    EXPECT_EQ(names.count("approach angle z"), 1u);
    EXPECT_EQ(names.size(), 9u + 1 + 3 + 4);
  }
}

TEST(ImpulseSensitivity, SpatialArms) {
  Worst worst("two arms of 7 joints, a target each");
  std::set<std::string> names;
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    compare_all(spatial_problem(i, 7, false), worst, i, &names);
  }
  EXPECT_EQ(names.size(), 9u + 3 + 3 + 4);
}

TEST(ImpulseSensitivity, SharedTarget) {
  Worst worst("two arms of 7 joints on one target");
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    compare_all(spatial_problem(i, 7, true), worst, i);
  }
}

TEST(ImpulseSensitivity, FixedBase) {
  Worst worst("two arms of 6 joints on a fixed base");
  for (int i = 0; i < 4; ++i) {
    const Problem p = spatial_problem(i, 6, i % 2 == 0, false);
    compare_all(p, worst, i);
    for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps))
      EXPECT_EQ(norm(s.base.angular) + norm(s.base.linear), 0);
  }
}

// Planar arms on one target: out-of-plane rows are redundant, and the impulse has minimum norm. No parameter changes
// the rank of rigid grasps.
TEST(ImpulseSensitivity, RedundantGrasps) {
  Worst worst("thesis robot, two rigid grasps on one target");
  const Problem p = thesis_problem(GraspModel::rigid, true);
  const ImpactSolution s = plastic_impact(p.model, p.state, p.grasps);
  ASSERT_LT(s.rank, s.rows);
  compare_all(p, worst, 0);
}

// One body has two grasps on the target: self-stresses exist in all directions. Stresses of the minimum-norm solution
// depend on the parameter through D and the null space.
TEST(ImpulseSensitivity, MinimumNormSelfStressChanges) {
  Worst worst("two grasps of one hand on one target");
  for (int i = 0; i < 9; ++i) {
    SCOPED_TRACE(seed_note(i));
    Problem p = spatial_problem(i, 7, true);
    Random random(1000 + i);
    p.grasps[1].robot_body = p.grasps[0].robot_body;
    p.grasps[1].p_WC = p.grasps[0].p_WC + random.vector(0.5);
    p.grasps[0].model = GraspModel::rigid;
    const ImpactSolution s = plastic_impact(p.model, p.state, p.grasps);
    ASSERT_EQ(s.rows - s.rank, row_count(p.grasps[1].model));
    // No approach angles: each would move the other grasp of the same body.
    std::set<std::string> names;
    compare_all(p, worst, i, &names);
    EXPECT_EQ(names.size(), 9u + 3 + 4);
  }
}

// Brakes, drives or both, on either arm.
TEST(ImpulseSensitivity, HeldJoints) {
  Worst worst("joints braked or driven during the impact");
  for (int i = 0; i < 8; i += test::kSanitized ? 5 : 1) {
    SCOPED_TRACE(seed_note(i));
    Problem p = spatial_problem(20 + i, 7, i % 2 == 1);
    const int driven[] = {joint_velocity(p, "arm0.2"), joint_velocity(p, "arm1.5")};
    for (int v : driven) p.held.push_back({v, p.state.v[v]});
    p.held.push_back({joint_velocity(p, "arm0.4"), 0});
    if (i >= 4) {
      // All joints of arm 1 keep their rates.
      p.held.clear();
      for (int j = 0; j < 7; ++j) {
        const int v = joint_velocity(p, "arm1." + std::to_string(j));
        p.held.push_back({v, p.state.v[v]});
      }
    }
    compare_all(p, worst, i);
  }
}

// With all joints held, brakes and grasps share the redundant impulses: D includes the brakes, whose block depends on
// M.
TEST(ImpulseSensitivity, RedundantBrakes) {
  Worst worst("all joints of both arms braked on one target");
  int redundant = 0;
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE(seed_note(i));
    Problem p = spatial_problem(40 + i, 4, true);
    for (int arm = 0; arm < 2; ++arm) {
      for (int j = 0; j < 4; ++j)
        p.held.push_back({joint_velocity(p, "arm" + std::to_string(arm) + "." + std::to_string(j)), 0});
    }
    const ImpactSolution s = plastic_impact(p.model, p.state, p.grasps, p.held);
    redundant += s.rank < s.rows;
    compare_all(p, worst, i);
  }
  EXPECT_GT(redundant, 3);
}

TEST(ImpulseSensitivity, RandomRobots) {
  Worst worst("random branched robots, grasps anywhere");
  int rows = 0, undefined = 0;
  for (int i = 0; i < test::repetitions(24); ++i) {
    SCOPED_TRACE(seed_note(i));
    const ImpactCase c = random_impact(i);
    if (i % 4 == 1) continue;  // spherical joints: the modified configuration below supports angles only
    int root = c.grasps[0].robot_body;
    root = c.model.bodies()[root].root;
    const Problem p{c.model, c.state, c.grasps, {}, root};
    const int rank = plastic_impact(p.model, p.state, p.grasps).rank;
    for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
      SCOPED_TRACE(s.parameter + " of grasp " + std::to_string(s.grasp));
      ++rows;
      if (s.undefined.empty()) {
        EXPECT_LT(worst.note(best_deviation(p, s), i), 1e-6);  // measured 8e-8
      } else {
        ++undefined;
        const Problem q = changed(p, s, 1e-2);
        EXPECT_NE(plastic_impact(q.model, q.state, q.grasps).rank, rank);
        EXPECT_TRUE(std::isnan(s.base.angular[0]) && std::isnan(s.impulse[0].linear[2]));
      }
    }
  }
  std::printf("[ measured ] %d derivatives, of which %d undefined\n", rows, undefined);
}

// The error of central differences is proportional to the square of the step until rounding dominates; if the outcome
// is linear in the parameter it is at rounding level from the start.
TEST(ImpulseSensitivity, CentralDifferencesConvergeQuadratically) {
  const Problem p = spatial_problem(3, 7, false);
  const Outcome here = solved(p);
  for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
    SCOPED_TRACE(s.parameter + " of grasp " + std::to_string(s.grasp));
    const double unit = step_unit(p, s);
    const double coarse = deviation(here, s, central_difference(p, s, 4e-3 * unit));
    const double fine = deviation(here, s, central_difference(p, s, 2e-3 * unit));
    if (is(s, "relative")) {
      EXPECT_LT(fine, 1e-9);
    } else if (coarse > 1e-6) {
      EXPECT_NEAR(coarse / fine, 4, 0.2) << coarse << " " << fine;
    }
  }
}

// P is linear in the relative motion: its derivatives times u- give P up to rounding.
TEST(ImpulseSensitivity, LinearInRelativeMotion) {
  Worst worst("P against sum of dP/du u");
  for (int i = 0; i < 6; ++i) {
    Problem p = spatial_problem(60 + i, 7, false);
    const Kinematics k = forward_kinematics(p.model, p.state);
    Eigen::VectorXd P = Eigen::VectorXd::Zero(12);
    for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
      if (!is(s, "relative")) continue;
      const Grasp& g = p.grasps[s.grasp];
      const Twistd u = twist_at(k, g.robot_body, g.p_WC) - twist_at(k, g.target_body, g.p_WC);
      const double part = is(s, "relative velocity") ? u.linear[axis_of(s.parameter)] : u.angular[axis_of(s.parameter)];
      for (int n = 0; n < 2; ++n) P.segment<6>(6 * n) += part * eigen(s.impulse[n]);
    }
    const ImpactSolution solution = plastic_impact(p.model, p.state, p.grasps);
    Eigen::VectorXd wanted(12);
    wanted << eigen(solution.contacts[0].P_WC), eigen(solution.contacts[1].P_WC);
    EXPECT_LT(worst.note(relative_difference(P, wanted), i), 1e-11);  // measured 5e-15
  }
}

// For a rigid grasp the contact point is only a reference point: only P's angular part changes.
TEST(ImpulseSensitivity, RigidGraspsIndependentOfContactPoint) {
  Worst worst("d P/d offset against -e x P");
  for (int i = 0; i < 6; ++i) {
    Problem p = spatial_problem(80 + i, 7, i % 2 == 0);
    for (Grasp& g : p.grasps) g.model = GraspModel::rigid;
    const ImpactSolution solution = plastic_impact(p.model, p.state, p.grasps);
    for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
      if (!is(s, "contact offset")) continue;
      for (int n = 0; n < 2; ++n) {
        const Impulsed& P = solution.contacts[n].P_WC;
        const Vector3d wanted =
            n == s.grasp ? -cross(Vector3d::unit(axis_of(s.parameter)), P.linear) : Vector3d::zero();
        EXPECT_LT(worst.note(norm(s.impulse[n].angular - wanted) / norm(P.linear), i), 1e-10);
        EXPECT_LT(worst.note(norm(s.impulse[n].linear) / norm(P.linear), i), 1e-10);
      }
      EXPECT_LT(worst.note(norm(s.base.angular) + norm(s.base.linear), i), 1e-10);  // measured 3e-14, all three
    }
  }
}

// Base and target only: P = -m_r u with the reduced mass m_r, so dP/dm = -u (m_r / m)^2.
TEST(ImpulseSensitivity, ReducedMassInClosedForm) {
  ModelBuilder builder;
  for (const char* name : {"base", "target"}) {
    BodyDescription b = thesis_target(name);
    b.mass = name[0] == 'b' ? 30 : 12;
    builder.add(b);
  }
  Problem p{builder.build(), {}, {}, {}, 0};
  p.state = zero_state(p.model);
  const int target = p.model.body_index("target");
  p.root = p.model.body_index("base");
  set_root_pose(p.model, target, {Rotationd::identity(), {1, 0, 0}}, p.state);
  set_root_twist(p.model, target, {{0, 0, 0}, {-0.4, 0, 0}}, p.state);
  p.grasps = {{p.root, target, GraspModel::point, {0.5, 0, 0}, {0, 0, 1}}};
  const double reduced = 30.0 * 12 / 42, u = 0.4;
  for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
    if (s.parameter == "target mass") {
      EXPECT_NEAR(s.impulse[0].linear[0], -u * (reduced / 12) * (reduced / 12), 1e-14);
      EXPECT_NEAR(s.base.linear[0], -u * (reduced / 12) * (reduced / 12) / 30, 1e-14);
    }
    if (s.parameter == "relative velocity x") {
      EXPECT_NEAR(s.impulse[0].linear[0], -reduced, 1e-13);
    }
    if (is(s, "target inertia")) {
      EXPECT_NEAR(norm(s.impulse[0].linear), 0, 1e-14);
    }
  }
}

// Two point grasps at one point are redundant. At different points they also constrain rotation, except about the line
// between them. The rank therefore changes with the offset of either grasp, and P has no derivative with respect to it.
// All other derivatives exist.
TEST(ImpulseSensitivity, ReportsRankChange) {
  Problem p = spatial_problem(5, 7, true);
  p.grasps[0].model = GraspModel::point;
  p.grasps[1] = p.grasps[0];
  ASSERT_EQ(plastic_impact(p.model, p.state, p.grasps).rank, 3);
  int undefined = 0;
  for (const ImpulseSensitivity& s : impulse_sensitivities(p.model, p.state, p.root, p.grasps)) {
    SCOPED_TRACE(s.parameter);
    const Problem q = changed(p, s, 1e-2);
    EXPECT_EQ(plastic_impact(q.model, q.state, q.grasps).rank, is(s, "contact offset") ? 5 : 3);
    if (is(s, "contact offset")) {
      ++undefined;
      EXPECT_EQ(s.undefined, "the rank of the constraints changes with this parameter");
      EXPECT_TRUE(std::isnan(s.impulse[1].linear[0]) && std::isnan(s.base.angular[2]));
    } else {
      EXPECT_EQ(s.undefined, "");
      EXPECT_LT(best_deviation(p, s), 1e-6);
    }
  }
  EXPECT_EQ(undefined, 6);
}

// Two arms with all joints driven on one rigid target: the commanded rates contradict the grasps.
TEST(ImpulseSensitivity, ReportsContradictoryDrives) {
  Problem p = spatial_problem(6, 3, true);
  for (Grasp& g : p.grasps) g.model = GraspModel::rigid;
  for (int j : p.model.joints()) p.held.push_back({p.model.bodies()[j].v, p.state.v[p.model.bodies()[j].v]});
  const ImpactSolution s = plastic_impact(p.model, p.state, p.grasps, p.held);
  const std::vector<bool> was_overpowered = which_was_overpowered(p.model, p.held, s.velocity);
  ASSERT_TRUE(std::find(was_overpowered.begin(), was_overpowered.end(), true) != was_overpowered.end());
  for (const ImpulseSensitivity& d : impulse_sensitivities(p.model, p.state, p.root, p.grasps, p.held)) {
    EXPECT_EQ(d.undefined, "the held rates contradict the grasps");
    EXPECT_TRUE(std::isnan(d.base.linear[0]));
  }
}

TEST(ImpulseSensitivity, TargetsMustBeFree) {
  Problem p = thesis_problem(GraspModel::rigid, false);
  p.grasps[0].target_body = p.model.body_index("arm-2-link-1");
  EXPECT_THROW(impulse_sensitivities(p.model, p.state, p.root, p.grasps), std::invalid_argument);
  EXPECT_TRUE(impulse_sensitivities(p.model, p.state, p.root, {}).empty());
}

}  // namespace impulse_sensitivity_test
}  // namespace grapnel::testing
