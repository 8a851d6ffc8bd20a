// All errors are reported together with their locations; no invalid input causes a crash.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "import/urdf_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace urdf_faults_test {

using ::testing::HasSubstr;
using testing::import_text;

constexpr const char* kBus =
    R"(<link name="bus"><inertial><mass value="9"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>)";

// A robot of a bus and what is given, which begins in line 3.
std::string robot(const std::string& text) {
  return "<robot name=\"r\">\n" + std::string(kBus) + "\n" + text + "\n</robot>\n";
}
std::string faults(const std::string& text, ImportOptions options = {}) {
  return import_text(text, std::move(options)).faults;
}
std::string joint(const std::string& name, const std::string& type, const std::string& parent, const std::string& child,
                  const std::string& more = {}) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent + "\"/><child link=\"" + child +
         "\"/>" + more + "</joint>\n";
}
std::string link(const std::string& name, double mass = 1) {
  return "<link name=\"" + name + "\"><inertial><mass value=\"" + std::to_string(mass) +
         "\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\"/></inertial></link>\n";
}

TEST(UrdfFaults, FilesOtherThanUrdf) {
  EXPECT_THAT(faults(""), HasSubstr("this is no well-formed XML"));
  EXPECT_THAT(faults("<robot><link name='a'></robot>"), HasSubstr("this is no well-formed XML"));
  EXPECT_EQ(faults("\n <sdf/>"),
            "2:3: the outermost element is <sdf>, expected <robot>; SDF files are not supported, use a URDF of the "
            "same robot\n");
  EXPECT_EQ(faults("<robot/>"), "1:2: the robot has no <link>\n");
}

TEST(UrdfFaults, XacroIsRefusedWithAdvice) {
  const std::string advice = "this is a xacro file, which has to be expanded first: xacro test.urdf > robot.urdf\n";
  EXPECT_EQ(faults(robot("<xacro:include filename='a'/>")), "3:2: " + advice);
  EXPECT_EQ(faults(robot("<xacro:property name='a' value='1'/><link name='${a}'/>")), "3:2: " + advice);
  EXPECT_THAT(import_text(robot(""), {}, "r.urdf.xacro").faults, HasSubstr("xacro r.urdf.xacro > robot.urdf"));
}

// A file that xacro has been through: what it left is named, and running it again would not help.
TEST(UrdfFaults, UnexpandedMacrosAreNamed) {
  EXPECT_EQ(
      faults(robot("<xacro:gripper parent='bus'/>")),
      "3:2: the macro <xacro:gripper> was left over when xacro expanded the file: define it there, or remove it\n");
  EXPECT_EQ(faults(robot("<link name='${prefix}a'/>\n<xacro:tool/>")),
            "3:7: name of <link> is '${prefix}a': xacro left an expression that it did not expand\n"
            "4:2: the macro <xacro:tool> was left over when xacro expanded the file: define it there, or remove it\n");
}

TEST(UrdfFaults, NamesAndTheTree) {
  EXPECT_EQ(faults(robot(link("bus"))), "3:2: link 'bus' occurs twice, first in line 2; names must be unique\n");
  EXPECT_EQ(faults(robot("<link/>")), "3:2: <link> has no 'name'\n");
  EXPECT_THAT(faults(robot(link("a") + joint("j", "fixed", "bus", "a") + joint("j", "fixed", "bus", "a"))),
              HasSubstr("5:2: joint 'j' occurs twice, first in line 4"));
  EXPECT_EQ(faults(robot(link("arm") + joint("j", "fixed", "buss", "arm"))),
            "4:31: joint 'j' has the unknown parent link 'buss'; did you mean 'bus'?\n");
  EXPECT_THAT(faults(robot(link("a") + joint("j", "fixed", "bus", "a") + joint("k", "fixed", "bus", "a"))),
              HasSubstr("joint 'k' carries link 'a', which joint 'j' carries already"));
  EXPECT_THAT(
      faults(robot(link("a") + link("b") + joint("j", "fixed", "bus", "a"))),
      HasSubstr(
          "4:2: links 'b' and 'bus' are not children of a joint: a robot must have one root; there are 2: bus, b"));
  EXPECT_THAT(faults(robot(link("a") + link("b") + joint("j", "fixed", "a", "b") + joint("k", "fixed", "b", "a"))),
              HasSubstr("the joints of b, a form a cycle"));
  EXPECT_THAT(faults(robot(joint("k", "fixed", "bus", "bus"))),
              HasSubstr("there is no root link: the joints form a cycle"));
  EXPECT_THAT(faults(robot(link("a") + "<joint name='j' type='revolut'><parent link='bus'/></joint>")),
              HasSubstr("4:17: joint 'j' has the unknown type 'revolut'; did you mean 'revolute'?"));
  EXPECT_THAT(faults(robot(link("a") + "<joint name='j' type='fixed'><parent link='bus'/></joint>")),
              HasSubstr("joint 'j' has no <child link="));
}

TEST(UrdfFaults, Numbers) {
  EXPECT_THAT(faults(robot("<link name='a'><inertial><mass value='1,5'/></inertial></link>")),
              HasSubstr("value of <mass>: '1,5' is no finite number"));
  EXPECT_THAT(faults(robot("<link name='a'><inertial><origin xyz='1 2'/><mass value='1'/></inertial></link>")),
              HasSubstr("xyz of <origin> has 2 numbers, expected 3"));
  EXPECT_THAT(faults(robot("<link name='a'><inertial><inertia ixx='1'/></inertial></link>")),
              HasSubstr("3:17: <inertial> of link 'a' has no mass"));
  EXPECT_THAT(faults(robot(link("a", -2) + joint("j", "fixed", "bus", "a"))),
              HasSubstr("link 'a' has a negative mass, -2 kg"));
  EXPECT_THAT(faults(robot(link("a") + joint("j", "revolute", "bus", "a", "<axis xyz='0 0 0'/>"))),
              HasSubstr("the axis of joint 'j' has no direction"));
  EXPECT_THAT(faults(robot(link("a") + joint("j", "revolute", "bus", "a", "<limit lower='1' upper='-1'/>"))),
              HasSubstr("joint 'j': the lower limit 1 is above the upper limit -1"));
  EXPECT_THAT(faults(robot(link("a") + joint("j", "revolute", "bus", "a", "<limit effort='-5' velocity='1'/>"))),
              HasSubstr("joint 'j': the effort limit is -5, must be greater than 0"));
  EXPECT_THAT(faults(robot(link("a") + joint("j", "continuous", "bus", "a", "<dynamics damping='-1'/>"))),
              HasSubstr("damping of joint 'j' is -1, must not be negative"));
  EXPECT_THAT(faults(robot("<link name='a'><collision><geometry><box/></geometry></collision></link>")),
              HasSubstr("<box> has no 'size'"));
  EXPECT_EQ(faults(robot("<link name='a'><collision><geometry><sphere radius=''/></geometry></collision></link>" +
                         joint("j", "fixed", "bus", "a"))),
            "3:45: <sphere> has no 'radius'\n");
}

TEST(UrdfFaults, BodiesThatCannotMove) {
  const std::string massless = robot("<link name='a'/>" + joint("j", "revolute", "bus", "a"));
  EXPECT_EQ(faults(massless), "3:18: joint 'j' moves link 'a', which has no mass: give it one, or lock the joint\n");
  ImportOptions locked;
  locked.locked = {{"j", 0.5, {}}};
  EXPECT_EQ(faults(massless, locked), "");
  const std::string point =
      robot("<link name='a'><inertial><mass value='2'/></inertial></link>" + joint("j", "continuous", "bus", "a"));
  EXPECT_THAT(faults(point),
              HasSubstr("link 'a' has a mass of 2 kg but no inertia: add an inertia, or lock joint 'j'"));
  EXPECT_EQ(faults(point, locked), "");
  const std::string rod = robot(
      "<link name='a'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='0'/></inertial>"
      "</link>" +
      joint("j", "continuous", "bus", "a"));
  EXPECT_THAT(faults(rod), HasSubstr("which means a body without thickness"));
  ImportOptions repair;
  repair.repair_inertia = true;
  EXPECT_EQ(faults(rod, repair), "");
  const std::string root =
      "<robot><link name='root'/>" + link("a") + joint("j", "continuous", "root", "a") + "</robot>";
  EXPECT_THAT(faults(root), HasSubstr("the base, link 'root', has no mass: mount the robot on a satellite (bus: "
                                      "FILE.yaml; --bus FILE.yaml), or select another base (base: LINK; --base LINK), "
                                      "such as 'a'"));
}

TEST(UrdfFaults, FreeJointsInsideTheRobot) {
  EXPECT_THAT(faults(robot(link("a") + joint("j", "floating", "bus", "a"))),
              HasSubstr("there are 2 free bodies, bus, a: select the robot's base"));
  const std::string text =
      robot(link("a") + joint("j", "continuous", "bus", "a") + link("b") + joint("k", "floating", "a", "b"));
  EXPECT_THAT(faults(text),
              HasSubstr("joint 'k' is floating: this is possible only between an empty root and the base; "
                        "lock it at 0 to fix it"));
  ImportOptions options;
  options.locked = {{"k", 0, {}}};
  EXPECT_EQ(faults(text, options), "");
}

TEST(UrdfFaults, MimicJoints) {
  const auto follows = [](const char* master, const char* more = "") {
    return robot(link("a") +
                 joint("j", "continuous", "bus", "a", std::string("<mimic joint='") + master + "' " + more + "/>"));
  };
  EXPECT_THAT(faults(follows("k")), HasSubstr("joint 'j' follows the unknown joint 'k' (mimic)"));
  EXPECT_THAT(faults(follows("j")), HasSubstr("joint 'j' follows itself (mimic)"));
  EXPECT_THAT(faults(follows("j", "multiplier='x'")), HasSubstr("multiplier of <mimic>: 'x' is no finite number"));
}

TEST(UrdfFaults, ChoicesThatDoNotExist) {
  const Mark mark{std::make_shared<const std::string>("--base"), 0, 0};
  ImportOptions options;
  options.base = {"buss", mark};
  EXPECT_EQ(faults(robot(""), options), "0:0: unknown link 'buss' for the base; did you mean 'bus'?\n");
  options = {};
  options.locked = {{"j", 1, mark}};
  EXPECT_THAT(faults(robot(""), options), HasSubstr("unknown joint 'j' in lock"));
  options = {};
  options.end_effectors = {{"tip", mark}};
  EXPECT_THAT(faults(robot(""), options), HasSubstr("unknown link or frame 'tip' for an end-effector"));
  options.end_effectors = {{"bus", mark}, {"bus", mark}};
  EXPECT_EQ(faults(robot(""), options), "0:0: end-effector 'bus' is chosen twice\n");
}

TEST(UrdfFaults, AreCountedInCharactersAndQuickInOneLongLine) {
  EXPECT_THAT(faults("<robot><!-- äöü --><link/></robot>"), HasSubstr("1:21: <link> has no 'name'"));
  std::string text = "<robot>";
  for (int i = 0; i < 9000; ++i) {
    text += "<link name='a" + std::to_string(i) + "' x='" + std::string(300, 'x') + "'><inertial/></link>";
  }
  EXPECT_THAT(faults(text + "</robot>"), HasSubstr("has no mass"));
}

TEST(UrdfFaults, TooManyAndTooDeep) {
  std::string many = "<robot>", chain = "<robot>" + link("l0");
  for (int i = 0; i < 11000; ++i) many += "<link name='a" + std::to_string(i) + "'/>";
  EXPECT_THAT(faults(many + "</robot>"), HasSubstr("the robot has more than 10000 links or joints"));
  for (int i = 1; i < 3000; ++i)
    chain += link("l" + std::to_string(i)) +
             joint("j" + std::to_string(i), "fixed", "l" + std::to_string(i - 1), "l" + std::to_string(i));
  EXPECT_EQ(faults(chain + "</robot>"), "");
  std::string deep = "<robot>";
  for (int i = 0; i < 100000; ++i) deep += "<a>";
  EXPECT_NE(faults(deep), "");
  for (int i = 0; i < 100000; ++i) deep += "</a>";
  EXPECT_NE(faults(deep + "</robot>"), "");
}

// Cut off, with bytes changed, doubled and left out: faults or a robot, and what is written can be read.
TEST(UrdfFaults, DamagedFilesAreReadOrRefused) {
  std::vector<std::string> texts;
  for (const auto& entry : std::filesystem::directory_iterator(testing::corpus(""))) {
    if (entry.path().extension() == ".urdf") texts.push_back(testing::bytes_of(entry.path()));
  }
  ASSERT_GE(texts.size(), 9u);
  std::mt19937 random(3);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  int read = 0, refused = 0;
  for (int k = 0; k < test::repetitions(3000); ++k) {
    std::string text = texts[below(texts.size())];
    const std::size_t at = below(text.size());
    switch (below(6)) {
      case 0:
        text.resize(at);
        break;
      case 1:
        text[at] = static_cast<char>(random());
        break;
      case 2:
        text.erase(at, below(30));
        break;
      case 3:
        text.insert(at, text.substr(below(text.size()), below(60)));
        break;
      default: {  // a number
        const std::size_t digit = text.find_first_of("0123456789", at);
        static constexpr const char* kNumbers[] = {"-1", "0", "1e308", "1e-308", "-0", "nan", "", "1e5"};
        if (digit != std::string::npos) text.replace(digit, 1, kNumbers[below(8)]);
      }
    }
    ImportOptions options;
    options.repair_inertia = below(2) == 0;
    options.is_carried = below(4) == 0;
    const testing::Imported imported = import_text(text, options);
    EXPECT_NE(imported.robot.has_value(), !imported.faults.empty());
    if (!imported.robot) {
      ++refused;
      continue;
    }
    try {
      if (!options.is_carried) testing::robot_of(imported);
      ++read;
    } catch (const InputError&) {
      ++refused;
    }
  }
  EXPECT_GT(read, test::repetitions(500));
  EXPECT_GT(refused, test::repetitions(500));
}

}  // namespace urdf_faults_test
}  // namespace grapnel
