// Everything in an MJCF file that would change the motion and is not supported is an error at its place; what has no
// influence is said.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "import/mjcf_files.hpp"

namespace grapnel {
namespace mjcf_faults_test {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A robot of two bodies, modified by each test. The joint's attributes are in line 7 from column 14
// on, the arm's other contents in line 8, what else the model has in line 10.
struct Changed {
  std::string root = {};                    // after <mujoco>, line 2
  std::string free_joint = "<freejoint/>";  // line 5
  std::string joint = "name='elbow' axis='0 1 0'";
  std::string arm = {};  // line 8
  std::string inertial = "<inertial pos='0 0 0.1' mass='2' diaginertia='0.1 0.1 0.1'/>";
  std::string rest = {};  // line 10
};

std::string text_of(const Changed& c) {
  return "<mujoco model='changed'>\n" + c.root +
         "\n<worldbody>\n"
         "<body name='bus'>\n" +
         c.free_joint +
         "<inertial pos='0 0 0' mass='50' diaginertia='5 6 7'/>\n<body name='arm' pos='1 0 0'>\n<joint " + c.joint +
         "/>\n" + c.arm + "\n" + c.inertial + "</body></body></worldbody>\n" + c.rest + "\n</mujoco>\n";
}

ReadMjcf read(const Changed& changed) { return read_mjcf_text(text_of(changed)); }

TEST(MjcfFaults, TheUnchangedRobotHasNone) {
  const ReadMjcf robot = read({});
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.model.name, "changed");
  EXPECT_THAT(robot.model.links, SizeIs(2));
  EXPECT_THAT(robot.model.joints, SizeIs(1));
}

struct Refused {
  const char* name;
  Changed changed;
  std::string place;
  std::string words;
};

class MjcfRefuses : public ::testing::TestWithParam<Refused> {};

TEST_P(MjcfRefuses, WithThePlace) {
  const ReadMjcf robot = read(GetParam().changed);
  ASSERT_THAT(robot.faults, SizeIs(1)) << ::testing::PrintToString(robot.faults);
  EXPECT_THAT(robot.faults[0], ::testing::StartsWith(GetParam().place + ": "));
  EXPECT_THAT(robot.faults[0], HasSubstr(GetParam().words));
}

const Refused kRefused[] = {
    // What acts on joints.
    {"stiffness", {.joint = "name='elbow' stiffness='3'"}, "7:21", "stiffness of <joint> is 3: springs"},
    {"stiffness_of_a_class",
     {.root = "<default><joint stiffness='3'/></default>"},
     "2:17",
     "stiffness of <joint> is 3: springs"},
    {"springdamper", {.joint = "springdamper='1 1'"}, "7:8", "springdamper of <joint>: springs"},
    {"negative_damping", {.joint = "damping='-1'"}, "7:8", "damping of <joint> is -1, expected 0 or more"},
    {"ball", {.joint = "type='ball'"}, "7:8", "the joint of body 'arm' is a ball joint"},
    {"free_inside", {.joint = "type='free'"}, "7:2", "body 'arm' has a free joint inside of a tree"},
    {"unknown_type", {.joint = "type='hing'"}, "7:8", "type of <joint> is 'hing'; did you mean 'hinge'?"},
    {"several_joints", {.arm = "<joint name='second' type='slide'/>"}, "8:2", "body 'arm' has 2 joints"},
    {"no_axis", {.joint = "axis='0 0 0'"}, "7:8", "axis of <joint> is zero"},
    {"reversed_range", {.joint = "range='1 -1'"}, "7:8", "range of <joint> goes from 1 to -1"},
    {"limited_without_range", {.joint = "limited='true'"}, "7:8", "has limited=\"true\" without range"},
    {"autolimits",
     {.root = "<compiler autolimits='false'/>", .joint = "range='-1 1'"},
     "7:8",
     "range of <joint> without limited, which autolimits=\"false\" asks for"},
    {"armature_of_a_free_joint",
     {.root = "<default><joint armature='2'/></default>", .free_joint = "<joint type='free'/>"},
     "2:17",
     "the free joint of the base has armature 2"},
    {"damping_of_a_free_joint", {.free_joint = "<joint type='free' damping='0.1'/>"}, "5:20", "has damping 0.1"},
    // Constraints and tendons.
    {"weld", {.rest = "<equality><weld body1='arm'/></equality>"}, "10:12", "<weld> in <equality> is not supported"},
    {"connect", {.rest = "<equality><connect body1='arm' anchor='0 0 0'/></equality>"}, "10:12", "closed loops"},
    {"held_joint",
     {.rest = "<equality><joint joint1='elbow' polycoef='0.5'/></equality>"},
     "10:12",
     "joint 'elbow' is held at a value"},
    {"curved_coupling",
     {.rest = "<equality><joint joint1='elbow' joint2='elbow' polycoef='0 1 2'/></equality>"},
     "10:48",
     "polynomial of higher degree"},
    {"coupling_of_nothing",
     {.rest = "<equality><joint joint1='elbow' joint2='elbo'/></equality>"},
     "10:33",
     "there is no joint 'elbo'; did you mean 'elbow'?"},
    {"springy_tendon",
     {.rest = "<tendon><fixed stiffness='4'><joint joint='elbow' coef='1'/></fixed></tendon>"},
     "10:16",
     "stiffness of a tendon is 4"},
    {"limited_tendon", {.rest = "<tendon><spatial range='0 1'/></tendon>"}, "10:18", "limits of tendons"},
    // Drives.
    {"muscle", {.rest = "<actuator><muscle joint='elbow'/></actuator>"}, "10:12", "driven by a <muscle>"},
    {"drive_of_nothing", {.rest = "<actuator><motor joint='elbo'/></actuator>"}, "10:18", "there is no joint 'elbo'"},
    {"unknown_drive", {.rest = "<actuator><moto joint='elbow'/></actuator>"}, "10:12", "did you mean 'motor'?"},
    // What makes more than the file shows.
    {"composite", {.arm = "<composite type='cable'/>"}, "8:2", "<composite> is not supported"},
    {"flexcomp", {.arm = "<flexcomp type='grid'/>"}, "8:2", "<flexcomp> is not supported"},
    {"replicate", {.arm = "<replicate count='3'/>"}, "8:2", "<replicate> is not supported"},
    {"attach", {.arm = "<attach model='m'/>"}, "8:2", "<attach> is not supported"},
    {"plugin", {.arm = "<plugin instance='p'/>"}, "8:2", "<plugin> is not supported"},
    {"replicate_in_world",
     {.root = "<worldbody><replicate count='3'/></worldbody>"},
     "2:13",
     "<replicate> in the worldbody is not supported"},
    {"flex", {.rest = "<deformable><flex name='f'/></deformable>"}, "10:14", "<flex> is a deformable body"},
    // The compiler and the medium.
    {"global", {.root = "<compiler coordinate='global'/>"}, "2:11", "global coordinates are not supported"},
    {"eulerseq", {.root = "<compiler eulerseq='xyw'/>"}, "2:11", "eulerseq is 'xyw', expected three of"},
    {"angle", {.root = "<compiler angle='degrees'/>"}, "2:11", "did you mean 'degree'?"},
    {"fluid", {.root = "<option density='1.2'/>"}, "2:9", "density of the medium is 1.2"},
    // Inertia.
    {"mesh_inertia",
     {.root = "<asset><mesh name='m' file='m.stl'/></asset>", .arm = "<geom type='mesh' mesh='m'/>", .inertial = ""},
     "8:19",
     "the inertia of body 'arm' would come from a mesh"},
    {"shell_inertia",
     {.arm = "<geom size='1' shellinertia='true'/>", .inertial = ""},
     "8:16",
     "shellinertia is not supported"},
    {"no_mass", {.inertial = "<inertial pos='0 0 0' diaginertia='1 1 1'/>"}, "9:2", "<inertial> has no 'mass'"},
    {"no_pos", {.inertial = "<inertial mass='1' diaginertia='1 1 1'/>"}, "9:2", "<inertial> has no 'pos'"},
    {"no_moments", {.inertial = "<inertial pos='0 0 0' mass='1'/>"}, "9:2", "neither diaginertia nor fullinertia"},
    {"two_moments",
     {.inertial = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1' fullinertia='1 1 1 0 0 0'/>"},
     "9:52",
     "both diaginertia and fullinertia"},
    {"turned_full",
     {.inertial = "<inertial pos='0 0 0' mass='1' euler='1 2 3' fullinertia='1 1 1 0 0 0'/>"},
     "9:32",
     "excludes an orientation"},
    {"negative_mass",
     {.inertial = "<inertial pos='0 0 0' mass='-1' diaginertia='1 1 1'/>"},
     "9:23",
     "mass of <inertial> is -1"},
    {"two_inertials",
     {.arm = "<inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"},
     "9:2",
     "body 'arm' has two <inertial>"},
    // Shapes.
    {"no_size", {.arm = "<geom type='capsule' size='1'/>"}, "8:22", "needs 2 numbers above 0, found 0"},
    {"sphere_between_points", {.arm = "<geom fromto='0 0 0 1 1 1'/>"}, "8:7", "not supported for a sphere"},
    {"same_points", {.arm = "<geom type='capsule' size='1' fromto='0 0 0 0 0 0'/>"}, "8:31", "two points are the same"},
    {"pos_and_fromto",
     {.arm = "<geom type='capsule' size='1' pos='1 0 0' fromto='0 0 0 0 0 1'/>"},
     "8:31",
     "both pos and fromto"},
    {"unknown_mesh",
     {.root = "<asset><mesh name='palm' file='m.stl'/></asset>", .arm = "<geom type='mesh' mesh='plam'/>"},
     "8:19",
     "there is no mesh 'plam' in <asset>; did you mean 'palm'?"},
    {"two_orientations", {.arm = "<site name='s' quat='1 0 0 0' euler='1 2 3'/>"}, "8:31", "two orientations"},
    {"two_orientations_by_class",
     {.root = "<default><site zaxis='1 0 0'/></default>", .arm = "<site name='s' euler='1 2 3'/>"},
     "8:16",
     "two orientations, zaxis and euler"},
    {"no_direction", {.arm = "<site name='s' zaxis='0 0 0'/>"}, "8:16", "gives no direction"},
    // Names, classes, places.
    {"same_bodies", {.arm = "<body name='bus'/>"}, "8:7", "there are two bodies 'bus'"},
    {"same_joints",
     {.arm = "<body><joint name='elbow'/><geom size='1'/></body>"},
     "8:14",
     "there are two joints 'elbow'"},
    {"same_sites", {.arm = "<site name='s'/><site name='s'/>"}, "8:23", "there are two sites 's'"},
    {"unknown_class", {.joint = "class='amr'"}, "7:8", "there is no default class 'amr'"},
    {"same_classes",
     {.root = "<default><default class='a'/><default class='a'/></default>"},
     "2:39",
     "there are two default classes 'a'"},
    {"unknown_attribute",
     {.joint = "dampin='1'"},
     "7:8",
     "<joint> has no attribute 'dampin' in MJCF; did you mean 'damping'?"},
    {"unknown_attribute_of_a_class",
     {.root = "<default><default class='a'><joint dampin='1'/></default></default>"},
     "2:36",
     "<joint> has no attribute 'dampin'"},
    {"unknown_attribute_of_a_tendon",
     {.rest = "<tendon><fixed stifness='1'/></tendon>"},
     "10:16",
     "did you mean 'stiffness'?"},
    {"unknown_attribute_of_a_coupling",
     {.rest = "<equality><joint joint1='elbow' joint2='elbow' polycoeff='0 1'/></equality>"},
     "10:48",
     "did you mean 'polycoef'?"},
    {"unknown_element", {.arm = "<gem/>"}, "8:2", "<gem> is not allowed in a body; did you mean 'geom'?"},
    {"unknown_section", {.rest = "<actuators/>"}, "10:2", "did you mean 'actuator'?"},
    {"no_number", {.joint = "damping='much'"}, "7:8", "'much' is no finite number"},
    {"joint_in_a_frame",
     {.arm = "<body name='b'><frame><joint/></frame><geom size='1'/></body>"},
     "8:24",
     "a joint inside of <frame>"},
    {"joint_of_the_world",
     {.root = "<worldbody><joint/></worldbody>"},
     "2:13",
     "the world neither moves nor has a mass"},
    {"two_robots",
     {.root = "<worldbody><body name='other'><freejoint/><body name='b'><joint/></body></body></worldbody>"},
     "4:2",
     "bodies other, bus float and carry joints"},
    {"no_include", {.arm = "<include file='nowhere.xml'/>"}, "8:10", "no such file"},
    {"include_of_itself",
     {.arm = "<include file='robot.xml'/>"},
     "8:10",
     "has been included before or includes itself"},
};

INSTANTIATE_TEST_SUITE_P(Mjcf, MjcfRefuses, ::testing::ValuesIn(kRefused),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(MjcfFaults, AllAtOnce) {
  const ReadMjcf robot = read({.root = "<option density='1' viscosity='2'/>", .joint = "stiffness='1' damping='x'"});
  EXPECT_THAT(robot.faults, ElementsAre(HasSubstr("2:9: density"), HasSubstr("2:21: viscosity"),
                                        HasSubstr("7:8: stiffness"), HasSubstr("7:22: damping")));
}

TEST(MjcfFaults, InOtherFilesNameThem) {
  const ModelFolder folder;
  folder.write("parts/arm.xml", "<mujoco>\n<joint type='ball'/></mujoco>");
  Changed changed;
  changed.arm = "<body name='b'><include file='parts/arm.xml'/></body>";
  const ReadMjcf robot = read_mjcf_at(folder.write("robot.xml", text_of(changed)));
  EXPECT_THAT(robot.faults, ElementsAre(HasSubstr("arm.xml:2:8: the joint of body 'b' is a ball joint")));
}

TEST(MjcfFaults, IncludesIncludeOnce) {
  const ModelFolder folder;
  folder.write("a.xml", "<mujoco><include file='b.xml'/></mujoco>");
  folder.write("b.xml", "<mujoco>\n<include file='a.xml'/></mujoco>");
  Changed changed;
  changed.arm = "<include file='a.xml'/>";
  const ReadMjcf robot = read_mjcf_at(folder.write("robot.xml", text_of(changed)));
  EXPECT_THAT(robot.faults, ElementsAre(HasSubstr("b.xml:2:10: 'a.xml' has been included before")));
}

TEST(MjcfFaults, FilesThatAreNone) {
  EXPECT_THAT(read_mjcf_text("").faults, ElementsAre(HasSubstr("no well-formed XML")));
  EXPECT_THAT(read_mjcf_text("<mujoco><worldbody></mujoco>").faults, ElementsAre(HasSubstr("no well-formed XML")));
  EXPECT_THAT(read_mjcf_text("<robot name='r'/>").faults, ElementsAre(HasSubstr("1:2: this is a URDF file")));
  EXPECT_THAT(read_mjcf_text("<sdf/>").faults, ElementsAre(HasSubstr("1:2: the outermost element is <sdf>")));
  EXPECT_THAT(read_mjcf_text("<mujoco/>").faults, ElementsAre(HasSubstr("there is no <worldbody>")));
  EXPECT_THAT(read_mjcf_text("<mujoco><worldbody/></mujoco>").faults, ElementsAre(HasSubstr("there is no <body>")));
}

TEST(MjcfFaults, DeepAndLongFilesAreRefused) {
  std::string deep = "<mujoco><worldbody>", end;
  for (int i = 0; i < 100000; ++i) deep += "<body>", end += "</body>";
  EXPECT_THAT(read_mjcf_text(deep + end + "</worldbody></mujoco>").faults,
              ElementsAre(HasSubstr("nested deeper than 200 levels")));
  std::string many = "<mujoco><worldbody><body name='b'>";
  for (int i = 0; i < 250000; ++i) many += "<geom size='1'/>";
  EXPECT_THAT(read_mjcf_text(many + "</body></worldbody></mujoco>").faults,
              ElementsAre(HasSubstr("more than 200000 elements")));
}

// ---- What is passed over, and said ----

TEST(MjcfDecisions, IgnoredElementsAreReportedOncePerKind) {
  const ReadMjcf robot = read({.root = "<option timestep='0.002'/><visual/>",
                               .joint = "name='elbow' margin='0.1'",
                               .arm = "<camera/><light/><light/><geom size='1' rgba='1 0 0 1' friction='1 0 0'/>"
                                      "<geom size='1' rgba='1 0 0 1'/><geom type='ellipsoid' size='1 2 3'/><site/>",
                               .rest = "<sensor/><contact><exclude body1='bus' body2='arm'/></contact>"});
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_THAT(robot.decisions("<light>"), ElementsAre("8:11: <light> (2): only visual, not read"));
  EXPECT_THAT(robot.decisions("<camera>"), ElementsAre("8:2: <camera> (1): only visual, not read"));
  EXPECT_THAT(robot.decisions("<geom>: without"),
              ElementsAre(HasSubstr("<geom>: without influence on the motion, not read: friction (1), rgba (2)")));
  EXPECT_THAT(robot.decisions("<joint>: without"), ElementsAre(HasSubstr("not read: margin (1)")));
  EXPECT_THAT(robot.decisions("<option>: without"), ElementsAre(HasSubstr("timestep (1)")));
  for (const char* kind :
       {"<visual> (1)", "<sensor> (1)", "<exclude> (1)", "<site> (1)", "<geom> (1): an ellipsoid is replaced"})
    EXPECT_THAT(robot.decisions(kind), SizeIs(1)) << kind;
  EXPECT_THAT(robot.link("arm").shapes, SizeIs(3));
}

TEST(MjcfDecisions, TextIsPassedOverAsByMujoco) {
  const ReadMjcf robot = read({.arm = "0 0 1", .rest = "<sensor>-- end -></sensor>"});
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_THAT(robot.decisions("text"), ElementsAre("6:2: text in <body> and 1 other element is ignored, as by MuJoCo"));
}

TEST(MjcfDecisions, OmittedBodiesAreNamed) {
  // What would be refused in the robot is no fault there.
  const ReadMjcf robot =
      read({.root = "<worldbody><geom type='plane' size='1 1 1'/><body name='chair'><joint type='ball'/>"
                    "</body><body name='target'><freejoint/></body></worldbody>"});
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_THAT(
      robot.decisions("left out"),
      ElementsAre(HasSubstr("2:46: not part of the robot and omitted, with their child bodies: chair, target")));
  EXPECT_THAT(robot.decisions("surroundings"), ElementsAre(HasSubstr("<geom> (1)")));
  EXPECT_THAT(robot.decisions("is the base"), ElementsAre("4:2: body 'bus' is the base; the scenario sets its pose"));
  EXPECT_THAT(robot.model.links, SizeIs(2));
}

TEST(MjcfDecisions, MassesOfMeshesThatDoNotMove) {
  const ReadMjcf arm = read_mjcf_text(
      "<mujoco><asset><mesh file='m.stl'/></asset><worldbody><body name='base'>\n<geom type='mesh' mesh='m'/>"
      "<body><joint/><geom size='1'/></body></body></worldbody></mujoco>");
  EXPECT_THAT(arm.faults, IsEmpty());
  EXPECT_FALSE(arm.link("base").inertia.has_value());
  EXPECT_THAT(arm.decisions("would come from a mesh"),
              ElementsAre(HasSubstr("2:19: body 'base' does not move in the file, and its mass would come from")));
}

TEST(MjcfDecisions, MeshesThatCannotBeShown) {
  const ReadMjcf robot = read({.root = "<asset><mesh file='a.msh'/><mesh name='b' vertex='0 0 0'/>"
                                       "<mesh name='c' file='c.STL' scale='1 2 3' refquat='1 1 0 0'/></asset>",
                               .arm = "<geom type='mesh' mesh='a'/><geom type='mesh' mesh='b'/>"
                                      "<geom type='mesh' mesh='c'/><geom type='box' mesh='c'/>"});
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_THAT(robot.decisions("shape omitted"),
              ::testing::UnorderedElementsAre(HasSubstr("neither .stl nor .obj"), HasSubstr("its mesh has no file"),
                                              HasSubstr("refquat"), HasSubstr("primitives fitted to meshes")));
  EXPECT_THAT(robot.link("arm").shapes, IsEmpty());
}

}  // namespace mjcf_faults_test
}  // namespace grapnel
