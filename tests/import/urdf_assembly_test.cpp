// Robots from URDF files: values against independent computations, and texts of the import decisions.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "grapnel/dynamics/kinematics.hpp"
#include "grapnel/dynamics/mass_matrix.hpp"
#include "grapnel/import/assembly_steps.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "import/urdf_files.hpp"
#include "support/eigen_values.hpp"

namespace grapnel {
namespace urdf_assembly_test {

using testing::body_of;
using testing::carried_by;
using testing::eigen;
using ::testing::HasSubstr;
using testing::import_corpus;
using testing::import_text;
using testing::Imported;
using ::testing::Not;
using testing::robot_of;

// Independent implementation of Rz(y) Ry(p) Rx(r).
Eigen::Isometry3d pose(double x, double y, double z, double r, double p, double w) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() = Eigen::Vector3d(x, y, z);
  X.linear() = (Eigen::AngleAxisd(w, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(p, Eigen::Vector3d::UnitY()) *
                Eigen::AngleAxisd(r, Eigen::Vector3d::UnitX()))
                   .toRotationMatrix();
  return X;
}

// A body's mass as points with the same mass, centre and inertia: six points along its principal axes.
struct Cloud {
  double mass = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  Eigen::Matrix3d second = Eigen::Matrix3d::Zero();

  // Second moments S with I = tr(S) 1 - S; inertia about the centre of mass in the axes of X.
  void add(const Eigen::Isometry3d& X, double m, const Eigen::Matrix3d& I) {
    const Eigen::Matrix3d S = 0.5 * I.trace() * Eigen::Matrix3d::Identity() - I;
    mass += m;
    moment += m * X.translation();
    second += X.linear() * S * X.linear().transpose() + m * X.translation() * X.translation().transpose();
  }
  Eigen::Vector3d com() const { return moment / mass; }
  Eigen::Matrix3d inertia() const {
    const Eigen::Matrix3d S = second - mass * com() * com().transpose();
    return S.trace() * Eigen::Matrix3d::Identity() - S;
  }
};

TEST(UrdfAssembly, ABaseIsAllThatIsFixedToTheRoot) {
  const Imported imported = import_corpus("massless-root.urdf");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  ASSERT_EQ(robot.bodies.size(), 3u);
  EXPECT_EQ(robot.base, "base_link");

  const Eigen::Isometry3d body = pose(0, 0, 0.1, 0, 0, 0.25), battery = body * pose(-0.3, 0.1, 0, 0.4, 0, 0);
  Cloud cloud;
  cloud.add(body * pose(0.1, -0.05, 0.2, 0.3, -0.2, 0.5), 40,
            (Eigen::Matrix3d() << 3, 0.1, -0.2, 0.1, 4, 0.3, -0.2, 0.3, 5).finished());
  cloud.add(battery * pose(0, 0, 0.05, 0, 0, 0), 6, Eigen::Vector3d(0.05, 0.06, 0.04).asDiagonal());
  EXPECT_DOUBLE_EQ(robot.bodies[0].mass, 46);
  EXPECT_LT((eigen(robot.bodies[0].com) - cloud.com()).norm(), 1e-14);          // measured 6e-17
  EXPECT_LT((eigen(robot.bodies[0].inertia) - cloud.inertia()).norm(), 1e-13);  // measured 2e-15
  EXPECT_GT(std::abs(robot.bodies[0].inertia.xy), 0.01);

  // A rotated inertial frame: R I R^T.
  const Eigen::Matrix3d R = pose(0, 0, 0, 0, 0, 1).linear();
  const Eigen::Matrix3d I = (Eigen::Matrix3d() << 0.02, 0.01, 0, 0.01, 0.15, 0, 0, 0, 0.16).finished();
  EXPECT_LT((eigen(body_of(robot, "upper").inertia) - R * I * R.transpose()).norm(), 1e-15);

  // Values that need no computation are exact.
  EXPECT_EQ(body_of(robot, "lower").inertia.xx, 0.05);
  EXPECT_EQ(body_of(robot, "lower").com[1], 0.2);

  const BodyDescription& upper = carried_by(robot, "shoulder");
  const Eigen::Isometry3d joint = body * pose(0.3, 0, 0.2, 0, 0.5, 0);
  EXPECT_LT((eigen(upper.X_PF.p) - joint.translation()).norm(), 1e-15);
  EXPECT_EQ(upper.joint.axis[2], 1);
  EXPECT_EQ(upper.joint.limits.lower, -2);
  EXPECT_EQ(upper.joint.limits.effort, 60);
  EXPECT_EQ(upper.joint.friction.viscous, 0.4);
  EXPECT_EQ(upper.joint.friction.coulomb, 0.2);
  EXPECT_EQ(upper.joint.gear_ratio, 100);
  EXPECT_EQ(upper.joint.rotor_inertia, 2e-5);
  EXPECT_EQ(carried_by(robot, "elbow").joint.type, JointType::prismatic);

  ASSERT_EQ(robot.end_effectors.size(), 1u);
  EXPECT_EQ(robot.end_effectors[0].name, "tool0");
  EXPECT_EQ(robot.end_effectors[0].body, "lower");
  EXPECT_EQ(robot.end_effectors[0].X_BE.p[1], 0.4);
  EXPECT_THAT(imported.decisions,
              HasSubstr("the base is link 'base_link', with the links fixed to it: base_body, battery"));
  EXPECT_THAT(imported.decisions, HasSubstr("the axis has length 2 and is normalised"));
  EXPECT_THAT(imported.decisions, HasSubstr("transmissions of 1 joint"));
  EXPECT_THAT(imported.decisions, HasSubstr("end-effectors: tool0, the outermost frames"));
}

TEST(UrdfAssembly, WrittenFileReadsBackAsTheSameRobotWithDecisions) {
  const Imported imported = import_corpus("massless-root.urdf");
  ASSERT_TRUE(imported.robot);
  const std::string text = yaml_text(imported.robot->tree, imported.robot->comment);
  EXPECT_THAT(text,
              HasSubstr("name: massless-root\n# the base is link 'base_link', with the links fixed to it: base_body, "
                        "battery (massless-root.urdf:6)\n# 'base_link' and the links fixed to it form one body"));
  EXPECT_THAT(text, HasSubstr("together (massless-root.urdf:6)\nbase:\n"));
  EXPECT_THAT(text, HasSubstr("    # joint 'shoulder': the axis has length 2"));
  EXPECT_THAT(text, HasSubstr("# end-effectors: tool0"));
  const testing::ModelFolder folder;
  const RobotSetup back = load_robot(folder.write("robot.yaml", text)), direct = robot_of(imported);
  ASSERT_EQ(back.bodies.size(), direct.bodies.size());
  for (std::size_t i = 0; i < back.bodies.size(); ++i) {
    EXPECT_EQ(back.bodies[i].mass, direct.bodies[i].mass);
    EXPECT_EQ(eigen(back.bodies[i].inertia), eigen(direct.bodies[i].inertia));
    EXPECT_EQ(eigen(back.bodies[i].X_PF.p), eigen(direct.bodies[i].X_PF.p));
  }
}

// Joint values and rates; the pose and twist of one body complete the state for the kinetic energy.
struct Motion {
  std::map<std::string, double> q, rate;  // by joint
};

State state_of(const Model& model, const Motion& motion, const Posed& X_WB, const Twistd& V_WB) {
  State state = zero_state(model);
  set_root_pose(model, 0, X_WB, state);
  set_root_twist(model, 0, V_WB, state);
  for (const int body : model.joints()) {
    const std::string& joint = model.bodies()[body].description.joint.name;
    state.q[model.bodies()[body].q] = motion.q.at(joint);
    state.v[model.bodies()[body].v] = motion.rate.at(joint);
  }
  return state;
}

double energy(const Model& model, const State& state) {
  const Eigen::MatrixXd M = mass_matrix(model, state);
  const Eigen::Map<const Eigen::VectorXd> v(state.v.data(), static_cast<Eigen::Index>(state.v.size()));
  return 0.5 * v.dot(M * v);
}

TEST(UrdfAssembly, AnotherBaseIsTheSameMechanism) {
  ImportOptions options;
  options.end_effectors = {{"bus", {}}, {"l1", {}}, {"l2", {}}, {"l3", {}}, {"panel", {}}};
  const Imported from_root = import_corpus("chain.urdf", options);
  ASSERT_EQ(from_root.faults, "");
  CaptureProblem problem;
  problem.robot = robot_of(from_root);
  const CaptureSystem root_system = make_servicer(problem);
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> number(-0.2, 0.3);
  for (const std::string base : {"l3", "l2", "l1", "flange", "panel"}) {
    options.base = {base, {}};
    const Imported from_base = import_corpus("chain.urdf", options);
    ASSERT_EQ(from_base.faults, "") << base;
    CaptureProblem other;
    other.robot = robot_of(from_base);
    EXPECT_EQ(other.robot.base, base);
    const CaptureSystem base_system = make_servicer(other);
    // Limits and rotors belong to the same joint values.
    EXPECT_EQ(carried_by(other.robot, "j1").joint.limits.lower, -1);
    EXPECT_EQ(carried_by(other.robot, "j1").joint.rotor_inertia, 0.01);

    Motion motion;
    for (const char* joint : {"j1", "j2", "j3", "side"})
      motion.q[joint] = number(random), motion.rate[joint] = number(random);
    const Posed X{rotation_from_rpy(number(random), number(random), 1), {1, 2, 3}};
    const Twistd V{{number(random), number(random), 0.4}, {0.3, number(random), number(random)}};
    const State a = state_of(root_system.model, motion, X, V);
    const Kinematics ka = forward_kinematics(root_system.model, a);
    const int base_frame = root_system.model.frame_index(base == "flange" ? "l1" : base);
    Posed X_base = frame_pose(root_system.model, ka, base_frame);
    Twistd V_base = frame_twist(root_system.model, ka, base_frame);
    if (base == "flange") {
      const Posed X_LF{rotation_from_rpy(0, 0.4, 0), {0.3, 0, 0.1}};
      V_base = shift(V_base, X_base.R * X_LF.p);
      X_base = X_base * X_LF;
    }
    const State b = state_of(base_system.model, motion, X_base, V_base);
    const Kinematics kb = forward_kinematics(base_system.model, b);
    for (const StatedName& frame : options.end_effectors) {
      const Posed Xa = frame_pose(root_system.model, ka, root_system.model.frame_index(frame.name));
      const Posed Xb = frame_pose(base_system.model, kb, base_system.model.frame_index(frame.name));
      EXPECT_LT(norm(Xa.p - Xb.p), 1e-13) << base << " " << frame.name;  // measured 2e-15
      EXPECT_LT(rotation_angle(transpose(Xa.R) * Xb.R), 1e-7) << base << " " << frame.name;
    }
    const double Ta = energy(root_system.model, a), Tb = energy(base_system.model, b);
    EXPECT_GT(Ta, 1);
    EXPECT_NEAR(Ta, Tb, 1e-12 * Ta) << base;  // measured 1e-15
  }
}

TEST(UrdfAssembly, ReversedJointIsReported) {
  ImportOptions options;
  options.base = {"l2", {}};
  const Imported imported = import_corpus("chain.urdf", options);
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'j2' is reversed, 'l2' carries 'flange'"));
  EXPECT_THAT(imported.decisions, HasSubstr("the frame of 'l1' is at the joint"));
  EXPECT_EQ(carried_by(robot_of(imported), "j2").joint.axis[1], -0.6);
  EXPECT_EQ(carried_by(robot_of(imported), "j3").joint.axis[2], -1);
}

TEST(UrdfAssembly, LimitsThatAreNone) {
  const Imported imported = import_corpus("limits.urdf");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  EXPECT_EQ(robot.base, "bus");
  const double inf = std::numeric_limits<double>::infinity();
  const auto limits = [&](const char* joint) { return carried_by(robot, joint).joint.limits; };
  EXPECT_EQ(limits("none").upper, inf);
  EXPECT_EQ(limits("none").effort, inf);
  EXPECT_EQ(limits("zero").lower, -inf);
  EXPECT_EQ(limits("zero").rate, inf);
  EXPECT_EQ(limits("zero").effort, inf);
  EXPECT_EQ(limits("partial").lower, 0);
  EXPECT_EQ(limits("partial").upper, 0.5);
  EXPECT_EQ(limits("partial").rate, inf);
  EXPECT_EQ(limits("partial").effort, 20);
  EXPECT_EQ(limits("round").upper, inf);
  EXPECT_EQ(limits("round").rate, 2);
  EXPECT_EQ(limits("only_effort").upper, inf);
  EXPECT_EQ(limits("only_effort").effort, 7);
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'none': no <limit>; it moves without bounds"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'zero': lower and upper limit are 0; no limits are assumed"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'zero': the velocity limit is 0 rad/s; no limit is assumed"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'zero': the effort limit is 0 N m; no limit is assumed"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'partial': <limit> has no lower; it is 0, URDF's default"));
  EXPECT_THAT(imported.decisions, HasSubstr("limits of a continuous joint have no meaning"));
  EXPECT_THAT(imported.decisions,
              HasSubstr("joint 'only_effort': <limit> has no lower and no upper; no limits are assumed"));
  EXPECT_TRUE(robot.geometry.empty());  // the floor of the world link is not part of the robot

  ImportOptions locked;
  locked.locked = {{"zero", 0, {}}};
  const RobotSetup shorter = robot_of(import_corpus("limits.urdf", locked));
  EXPECT_EQ(shorter.bodies.size(), robot.bodies.size() - 1);
  EXPECT_EQ(carried_by(shorter, "partial").parent, "a");
}

// The reflected inertia is the rotor inertia times the squared gear ratio; the file may state either inertia.
TEST(UrdfAssembly, RotorsAsTheyAreOrAsTheJointFeelsThem) {
  const auto rotor = [](const std::string& dynamics, const std::string& actuator) {
    return import_text(
        "<robot><link name='b'><inertial><mass value='9'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
        "<link name='a'><inertial><mass value='9'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
        "<joint name='j' type='continuous'><parent link='b'/><child link='a'/><dynamics " +
        dynamics + "/></joint><transmission name='t'><joint name='j'/><actuator name='m'>" + actuator +
        "</actuator></transmission></robot>");
  };
  const auto felt = [](const Imported& imported) {
    const JointDescription joint = carried_by(robot_of(imported), "j").joint;
    return joint.rotor_inertia * joint.gear_ratio * joint.gear_ratio;
  };
  const std::string geared = "<mechanicalReduction>-50</mechanicalReduction>";
  EXPECT_DOUBLE_EQ(felt(rotor("", geared + "<rotorInertia>2e-4</rotorInertia>")), 0.5);
  EXPECT_DOUBLE_EQ(felt(rotor("rotor_inertia='2e-4'", geared)), 0.5);
  EXPECT_DOUBLE_EQ(felt(rotor("armature='0.3'", geared)), 0.3);
  EXPECT_DOUBLE_EQ(felt(rotor("armature='0.3'", "")), 0.3);
  const Imported both = rotor("armature='0.3'", geared + "<motorInertia>2e-4</motorInertia>");
  EXPECT_DOUBLE_EQ(felt(both), 0.3);
  EXPECT_THAT(both.decisions,
              HasSubstr("joint 'j': armature and the rotor's inertia are both given, armature is used"));
}

TEST(UrdfAssembly, JointsThatFollowOthersMoveOrAreLockedWithThem) {
  const Imported imported = import_corpus("gripper.urdf");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  ASSERT_EQ(robot.bodies.size(), 5u);  // bus, hand, fingers, tip
  const std::vector<CouplingTerm>& right = body_of(robot, "right_finger").joint.mimic;
  ASSERT_EQ(right.size(), 1u);
  EXPECT_EQ(right[0].joint, "left");
  EXPECT_EQ(right[0].ratio, -1);
  EXPECT_EQ(right[0].offset, -0.005);
  const std::vector<CouplingTerm>& tip = body_of(robot, "right_tip").joint.mimic;
  ASSERT_EQ(tip.size(), 1u);
  EXPECT_EQ(tip[0].joint, "right");
  EXPECT_TRUE(body_of(robot, "left_finger").joint.mimic.empty());
  EXPECT_THAT(
      imported.decisions,
      HasSubstr("joint 'right' follows 'left' (mimic) with ratio -1 and offset -0.005 m, without a separate motor"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'tip' follows 'right' (mimic) with ratio 20 and offset 0.3 rad"));
  EXPECT_THAT(imported.decisions, HasSubstr("<gazebo> (2 elements): omitted, for the Gazebo simulator"));
  EXPECT_THAT(imported.decisions, HasSubstr("<ros2_control> (1 element): omitted"));
  EXPECT_THAT(imported.decisions, HasSubstr("<safety_controller> (1 element): omitted"));
  EXPECT_THAT(imported.decisions, HasSubstr("<tendon> (1 element): omitted, its meaning is unknown"));
  EXPECT_THAT(imported.decisions, HasSubstr("transmission 'both' couples 2 joints: omitted"));
  std::vector<std::string> tips;
  for (const EndEffectorSetup& one : robot.end_effectors) tips.push_back(one.name);
  EXPECT_THAT(tips, ::testing::UnorderedElementsAre("tcp", "right_tip", "left_finger"));

  // A locked master moves its mimic joints; a locked joint does not follow others.
  ImportOptions options;
  options.locked = {{"left", 0.03, {}}};
  const Imported closed = import_corpus("gripper.urdf", options);
  EXPECT_THAT(closed.decisions,
              HasSubstr("joint 'right' follows 'left' (mimic) and is locked at -0.035 m, its value for 'left' = 0.03"));
  const RobotSetup rigid = robot_of(closed);
  ASSERT_EQ(rigid.bodies.size(), 2u);  // bus, hand with all that it carries
  Cloud gripper;
  gripper.add(pose(0, 0, 0, 0, 0, 0), 2, Eigen::Vector3d(0.02, 0.02, 0.01).asDiagonal());
  gripper.add(pose(0.02 + 0.03, 0, 0.1, 0, 0, 0), 0.2, Eigen::Vector3d(2e-4, 2e-4, 1e-4).asDiagonal());
  const Eigen::Isometry3d finger = pose(-0.02 - 0.035, 0, 0.1, 0, 0, 0);
  gripper.add(finger, 0.2, Eigen::Vector3d(2e-4, 2e-4, 1e-4).asDiagonal());
  gripper.add(finger * pose(0, 0, 0, 0, 20 * -0.035 + 0.3, 0), 0.05, Eigen::Vector3d(2e-5, 2e-5, 1e-5).asDiagonal());
  EXPECT_LT((eigen(body_of(rigid, "hand").com) - gripper.com()).norm(), 1e-15);
  EXPECT_LT((eigen(body_of(rigid, "hand").inertia) - gripper.inertia()).norm(), 1e-15);
  options.locked = {{"right", -0.01, {}}, {"left", 0.05, {}}};
  const std::string decisions = import_corpus("gripper.urdf", options).decisions;
  EXPECT_THAT(decisions, HasSubstr("joint 'right' is locked at -0.01 m, as requested\n"));
  EXPECT_THAT(decisions, HasSubstr("joint 'left' is locked at 0.05 m, as requested, which is outside its limits"));
  EXPECT_THAT(decisions, HasSubstr("joint 'tip' follows 'right' (mimic) and is locked at 0.1 rad"));
}

TEST(UrdfAssembly, InertiasThatNoBodyHasAreRefusedOrRepaired) {
  const Imported refused = import_corpus("impossible-inertia.urdf");
  EXPECT_FALSE(refused.robot);
  EXPECT_THAT(refused.faults,
              HasSubstr("3:21: link 'bus' has the principal moments of inertia 1, 2, 4 kg m^2, and the largest exceeds "
                        "the sum of the others, which is physically impossible (triangle inequality); the option "
                        "repair_inertia (--repair-inertia) uses the nearest"));
  EXPECT_THAT(refused.faults,
              HasSubstr("link 'arm' has the principal moments of inertia -0.1, 0.1, 0.3 kg m^2, and one "
                        "of them is negative"));
  ImportOptions options;
  options.repair_inertia = true;
  const Imported repaired = import_corpus("impossible-inertia.urdf", options);
  ASSERT_EQ(repaired.faults, "");
  const RobotSetup robot = robot_of(repaired);
  // (1, 2, 4) violates c <= a + b by 1. The nearest point of the plane c = a + b is 1/3 along (1, 1, -1).
  EXPECT_NEAR(robot.bodies[0].inertia.xx, 4.0 / 3, 1e-14);
  EXPECT_NEAR(robot.bodies[0].inertia.yy, 7.0 / 3, 1e-14);
  EXPECT_NEAR(robot.bodies[0].inertia.zz, 11.0 / 3, 1e-14);
  EXPECT_THAT(repaired.decisions, HasSubstr("the nearest possible tensor is used, [1.33333, 2.33333, 3.66667"));
}

// The set of possible tensors is a cone, whose edges are points at n: 1 - n n^T. The nearest point P to A is the one
// with (A - P).P = 0 and (A - P).(1 - n n^T) <= 0 for all n (Moreau).
TEST(UrdfAssembly, TheRepairedTensorIsTheNearest) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> number;
  int changed = 0;
  for (int k = 0; k < 300; ++k) {
    const Symmetric3d A{number(random), number(random), number(random), number(random), number(random), number(random)};
    const Symmetric3d P = nearest_possible_inertia(A);
    EXPECT_TRUE(is_possible_inertia(P));
    const Eigen::Matrix3d r = eigen(A) - eigen(P);
    changed += r.norm() > 1e-9 ? 1 : 0;
    EXPECT_LT(std::abs((r.array() * eigen(P).array()).sum()), 1e-13);
    double worst = -1;
    for (int i = 0; i < 200; ++i) {
      const Eigen::Vector3d n = Eigen::Vector3d(number(random), number(random), number(random)).normalized();
      const Eigen::Matrix3d edge = Eigen::Matrix3d::Identity() - n * n.transpose();
      worst = std::max(worst, (r.array() * edge.array()).sum());
    }
    EXPECT_LT(worst, 1e-13);
    EXPECT_EQ(eigen(nearest_possible_inertia(Symmetric3d{2, 3, 4, 0.1, 0.2, 0.3})),
              eigen(Symmetric3d{2, 3, 4, 0.1, 0.2, 0.3}));
  }
  EXPECT_GT(changed, 200);
}

TEST(UrdfAssembly, PlanarModelRetainsItsMomentAndGetsTheOthers) {
  const Imported imported = import_corpus("planar.urdf");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  EXPECT_EQ(robot.base, "bus");
  EXPECT_DOUBLE_EQ(robot.bodies[0].inertia.zz, 0.2);
  EXPECT_DOUBLE_EQ(robot.bodies[0].inertia.xx, 0.1);
  EXPECT_DOUBLE_EQ(body_of(robot, "arm").inertia.yy, 0.005);
  EXPECT_THAT(imported.decisions, HasSubstr("about one axis only, 0.2 kg m^2, as in planar models"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'floor' is planar and becomes the free joint of the base"));
}

TEST(UrdfAssembly, FreeJointsAtTheRoot) {
  const Imported several = import_corpus("floating.urdf");
  EXPECT_THAT(several.faults, HasSubstr("there are 2 free bodies, bus, debris: select the robot's base"));
  ImportOptions options;
  options.base = {"bus", {}};
  const Imported chosen = import_corpus("floating.urdf", options);
  ASSERT_EQ(chosen.faults, "");
  EXPECT_EQ(robot_of(chosen).bodies.size(), 2u);
  EXPECT_THAT(chosen.decisions, HasSubstr("joint 'free' is the free joint of the base"));
  EXPECT_THAT(chosen.decisions, HasSubstr("link 'debris' and its child links are omitted"));
}

TEST(UrdfAssembly, ShapesAndTheirFiles) {
  const Imported imported = import_corpus("shapes.urdf");
  ASSERT_EQ(imported.faults, "");
  const Node& bus = *imported.robot->tree.find("base")->find("geometry");
  ASSERT_TRUE(bus.is_sequence());
  ASSERT_EQ(bus.items.size(), 3u);  // two of the bus, one of the mast
  EXPECT_EQ(flow_text(bus.items[0]), "{shape: box, size: [1, 1, 1], position: [0, 0, 0.1]}");
  EXPECT_EQ(flow_text(bus.items[1]), "{shape: sphere, radius: 0.4}");
  EXPECT_EQ(bus.items[2].find("shape")->text, "capsule");
  EXPECT_THAT(flow_text(*bus.items[2].find("position")), HasSubstr(", 0, 1.035"));
  EXPECT_FALSE(imported.link("l1").find("geometry"));
  EXPECT_FALSE(imported.link("l2").find("geometry"));
  EXPECT_THAT(imported.decisions, HasSubstr("link 'l1': the collision shape 'package://some_robot/meshes/link.dae' is "
                                            "omitted, package 'some_robot' was not found near the file"));
  EXPECT_THAT(imported.decisions, HasSubstr("link 'l1': the visual shape 'package://some_robot/meshes/link.stl' is "
                                            "omitted, package 'some_robot' was not found near the file"));
  EXPECT_THAT(imported.decisions, HasSubstr("'meshes/missing.stl' is omitted, there is no such file"));
  EXPECT_THAT(imported.decisions, HasSubstr("its scale -1 mirrors it"));
  EXPECT_THAT(imported.decisions, HasSubstr("link 'l2': the visual shape is omitted, a dimension of 0 is not valid"));
  EXPECT_THAT(imported.decisions, HasSubstr("link 'l2' has no supported shape"));
  EXPECT_THAT(imported.decisions, Not(HasSubstr("bus.dae")));  // its collision shapes suffice

  // With the folder of the package.
  const testing::ModelFolder written;
  const std::filesystem::path& folder = written.path();
  written.write("some_robot/meshes/link.stl", "solid");
  std::filesystem::create_directories(folder / "work/urdf");
  ImportOptions options;
  options.packages = {{"some_robot", folder / "some_robot"}};
  options.place = folder / "out/robot.yaml";
  const auto file_of = [](const Imported& one) {
    const Node* geometry = one.link("l1").find("geometry");
    return geometry ? geometry->find("file")->text + " " + flow_text(*geometry->find("scale")) : one.decisions;
  };
  EXPECT_EQ(file_of(import_corpus("shapes.urdf", options)), "../some_robot/meshes/link.stl [0.001, 0.001, 0.002]");
  // The package folder is a sibling of a parent folder of the file.
  ImportOptions beside;
  beside.source = folder / "work/urdf/shapes.urdf";
  beside.place = folder / "robot.yaml";
  const std::string text = testing::bytes_of(testing::corpus("shapes.urdf"));
  EXPECT_EQ(file_of(import_text(text, beside)), "some_robot/meshes/link.stl [0.001, 0.001, 0.002]");
  options.mesh_fault = [](const std::filesystem::path&) { return "the mesh is flat"; };
  EXPECT_THAT(import_corpus("shapes.urdf", options).decisions, HasSubstr("link.stl' is omitted, the mesh is flat"));
}

TEST(UrdfAssembly, NamesAndLimitsAsTheyAreInTheWild) {
  const Imported imported = import_corpus("expanded.urdf");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  EXPECT_EQ(robot.base, "arm_base");
  const JointLimits& limits = carried_by(robot, "arm_j1").joint.limits;
  EXPECT_EQ(limits.upper, 1.5);
  EXPECT_TRUE(std::isinf(limits.lower));
  EXPECT_TRUE(std::isinf(limits.effort));
  EXPECT_EQ(limits.rate, 3);
  EXPECT_THAT(imported.decisions,
              HasSubstr("link 'arm/base' is renamed to 'arm_base': results are stored under names"));
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'arm/j1': the lower limit -1e+06 means no limit"));
}

TEST(UrdfAssembly, ArithmeticInAttributes) {
  const auto value = [](const char* text) { return arithmetic_value(text).value_or(-99); };
  EXPECT_EQ(value("pi/2"), std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(value("35.2644*pi/180"), 35.2644 * std::numbers::pi / 180);
  EXPECT_EQ(value("-(1+2)*3-4/8"), -9.5);
  EXPECT_EQ(value("2^3^2"), 512);
  EXPECT_EQ(value("-2^2"), -4);
  EXPECT_EQ(value("1e-3*2.5E2"), 0.25);
  EXPECT_DOUBLE_EQ(value("sqrt(2)*cos(pi/4)"), 1);
  EXPECT_DOUBLE_EQ(value("-atan(1) * 4 + +pi"), 0);
  for (const char* none : {"", "pi2", "2pi", "1/0", "(1", "1)", "1 2", "p", "sqrt", "sqrt 4", "1//2", "nan", "inf", "e",
                           "2*", "exit(1)", "1,5"})
    EXPECT_FALSE(arithmetic_value(none)) << none;
  EXPECT_FALSE(arithmetic_value(std::string(100'000, '(')));
  EXPECT_FALSE(arithmetic_value(std::string(100'000, '-') + "1"));

  const auto imported = import_text(
      "<robot name='spart'><link name='bus'><inertial><mass value='2*10'/>"
      "<inertia ixx='1' iyy='1' izz='1'/></inertial></link>\n"
      "<link name='arm'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>\n"
      "<joint name='j' type='revolute'><parent link='bus'/><child link='arm'/>\n"
      "<origin xyz='0 1/2 0' rpy='0 0 pi/2'/><axis xyz='1 0 0'/><limit lower='- pi / 3' upper='pi'/></joint></robot>");
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  EXPECT_EQ(robot.bodies[0].mass, 20);
  const JointDescription& joint = carried_by(robot, "j").joint;
  EXPECT_DOUBLE_EQ(joint.limits.lower, -std::numbers::pi / 3);
  EXPECT_EQ(carried_by(robot, "j").X_PF.p[1], 0.5);
  EXPECT_THAT(imported.decisions, HasSubstr("5 arithmetic expressions in place of a number"));
}

TEST(UrdfAssembly, FilesInOtherEncodings) {
  // A name with e acute, a non-ASCII character.
  const std::string text =
      "<link name='b\xc3\xa9'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link></robot>";
  const std::string latin =
      "<link name='b\xe9'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link></robot>";
  const auto head = [](const std::string& encoding) {
    return "<?xml version=\"1.0\" encoding=\"" + encoding + "\"?>\n<robot name='r'>";
  };
  const auto name_in = [](const std::string& bytes) {
    const Imported imported = import_text(bytes);
    EXPECT_EQ(imported.faults, "");
    return imported.robot ? imported.robot->tree.find("base")->find("name")->text : std::string();
  };
  EXPECT_EQ(name_in(head("UTF-8") + text), "b\xc3\xa9");
  EXPECT_EQ(name_in("\xef\xbb\xbf" + head("utf-8") + text), "b\xc3\xa9");
  for (const char* encoding : {"ISO-8859-1", "iso_8859-1", "latin1", "Windows-1252", "cp1252", "ISO-8859-15"})
    EXPECT_EQ(name_in(head(encoding) + latin), "b\xc3\xa9") << encoding;
  // The code of the euro sign differs between encodings.
  const std::string euro =
      "<link name='\x80'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link></robot>";
  EXPECT_EQ(name_in(head("windows-1252") + euro), "\xe2\x82\xac");
  std::string other = euro;
  other[other.find('\x80')] = '\xa4';
  EXPECT_EQ(name_in(head("ISO-8859-15") + other), "\xe2\x82\xac");
  // UTF-16 in both byte orders, with and without a byte order mark.
  std::u16string wide;
  for (const char c : head("UTF-16") + "<link name='b") wide += static_cast<char16_t>(c);
  wide += u'\u00e9';
  for (const char c : latin.substr(latin.find('\xe9') + 1)) wide += static_cast<char16_t>(c);
  for (const bool is_big : {false, true}) {
    std::string bytes;
    for (const char16_t c : wide) {
      const char low = static_cast<char>(c & 0xff), high = static_cast<char>(c >> 8);
      bytes += is_big ? high : low;
      bytes += is_big ? low : high;
    }
    EXPECT_EQ(name_in(bytes), "b\xc3\xa9");
    EXPECT_EQ(name_in((is_big ? "\xfe\xff" : "\xff\xfe") + bytes), "b\xc3\xa9");
  }
  // A file with a missing or wrong declaration is read as Windows-1252, with a note.
  std::string note;
  FaultList faults;
  EXPECT_EQ(xml_in_utf8("a.urdf", "<robot name='\xe9'/>", note, faults), "<robot name='\xc3\xa9'/>");
  EXPECT_THAT(note, HasSubstr("is read as Windows-1252"));
  EXPECT_EQ(name_in(head("utf-8") + latin), "b\xc3\xa9");
  // Errors state character positions; other encodings are rejected only for non-ASCII text.
  EXPECT_THAT(import_text(head("ISO-8859-1") + "<!-- \xe9\xe9 --><link/></robot>").faults,
              HasSubstr("2:29: <link> has no"));
  EXPECT_THAT(import_text(head("shift_jis") + latin).faults, HasSubstr("1:31: the encoding 'shift_jis' is not read"));
  EXPECT_EQ(
      name_in(head("shift_jis") +
              "<link name='b'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link></robot>"),
      "b");
}

TEST(UrdfAssembly, AWorldThatIsNotDeclared) {
  const auto imported = import_text(
      "<robot name='r'><joint name='w' type='fixed'><parent link='world'/><child link='bus'/></joint>"
      "<link name='bus'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link></robot>");
  ASSERT_EQ(imported.faults, "");
  EXPECT_EQ(imported.robot->tree.find("base")->find("name")->text, "bus");
  EXPECT_THAT(imported.decisions, HasSubstr("link 'world' is not declared and becomes an empty root"));
}

std::string satellite_with_wheel(const std::string& origin_of_inertia, const std::string& further = {}) {
  return "<robot name='r'><link name='bus'><inertial><mass value='100'/><inertia ixx='10' iyy='10' "
         "izz='10'/></inertial>"
         "</link><link name='rotor'><inertial><origin " +
         origin_of_inertia +
         "/><mass value='4'/><inertia ixx='0.01' iyy='0.01' izz='0.02'/></inertial></link>"
         "<joint name='w' type='continuous'><parent link='bus'/><child link='rotor'/><origin xyz='0.5 0 0' rpy='0 pi/2 "
         "0'/>"
         "<axis xyz='0 0 1'/><limit effort='0.2' velocity='400'/><dynamics damping='1e-4'/></joint>" +
         further + "</robot>";
}

TEST(UrdfAssembly, JointsThatBecomeWheels) {
  ImportOptions options;
  options.wheels = {{"w", {}}};
  const auto imported = import_text(satellite_with_wheel("xyz='0 0 0.1'"), options);
  ASSERT_EQ(imported.faults, "");
  const RobotSetup robot = robot_of(imported);
  ASSERT_EQ(robot.bodies.size(), 1u);
  ASSERT_EQ(robot.wheels.size(), 1u);
  const WheelSetup& wheel = robot.wheels[0];
  EXPECT_EQ(wheel.name, "w");
  EXPECT_LT(norm(wheel.axis - Vector3d{1, 0, 0}), 1e-15);
  EXPECT_NEAR(wheel.inertia, 0.02, 1e-15);
  EXPECT_EQ(wheel.torque, 0.2);
  EXPECT_EQ(wheel.rate, 400);
  EXPECT_EQ(wheel.friction.viscous, 1e-4);
  // The base is the same as with the wheel at rest in it.
  EXPECT_EQ(robot.bodies[0].mass, 104);
  EXPECT_NEAR(robot.bodies[0].com[0], 4 * 0.6 / 104, 1e-15);
  EXPECT_NEAR(robot.bodies[0].inertia.xx, 10.02, 1e-12);
  EXPECT_THAT(imported.decisions, HasSubstr("joint 'w' becomes a reaction wheel of 0.02 kg m^2"));

  const auto fault = [&](const std::string& text, const std::string& joint) {
    options.wheels = {{joint, {}}};
    return import_text(text, options).faults;
  };
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0.1 0 0'"), "w"),
              HasSubstr("its centre of mass is 0.1 m from the axis"));
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0 0 0' rpy='0 0.3 0'"), "w"), HasSubstr("which is a balanced rotor"));
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0 0 0'"), "v"), HasSubstr("unknown joint 'v' for a wheel"));
  const std::string beyond =
      "<link name='arm'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
      "<joint name='a' type='revolute'><parent link='rotor'/><child link='arm'/></joint>";
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0 0 0'", beyond), "w"),
              HasSubstr("link 'arm' beyond it moves by itself"));
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0 0 0'", beyond), "a"),
              HasSubstr("link 'rotor', which carries it, is no part of the base"));
  options.locked = {{"w", 0, {}, LockedJoint::WrittenAs::number}};
  EXPECT_THAT(fault(satellite_with_wheel("xyz='0 0 0'"), "w"), HasSubstr("is locked or selected already"));
}

}  // namespace urdf_assembly_test
}  // namespace grapnel
