// What of an MJCF file MuJoCo's mass matrix does not show: efforts, couplings, names, and what MuJoCo 2.2 does not
// know.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "import/mjcf_files.hpp"
#include "support/eigen_values.hpp"
#include "support/random_robot.hpp"

namespace grapnel {
namespace mjcf_read_test {

using namespace testing;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

// A bus with four joints in a row, "a" to "d", of which "c" slides.
std::string chain(const std::string& rest, const std::string& of_a = "") {
  std::string text = "<mujoco><compiler angle='radian'/><worldbody><body name='bus'><freejoint/><geom size='1'/>";
  for (const std::string name : {"a", "b", "c", "d"}) {
    text += "<body name='" + name + "'><joint name='" + name + "'" + (name == "c" ? " type='slide'" : "") +
            (name == "a" ? of_a : "") + "/><geom size='1'/>";
  }
  return text + "</body></body></body></body></body></worldbody>\n" + rest + "</mujoco>";
}

// ---- Efforts ----

TEST(MjcfEffort, IsGearTimesTheActuatorsRange) {
  const ReadMjcf robot = read_mjcf_at(corpus("mjcf/free_two_arms.xml"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("left_shoulder").effort, 80);   // gear of the default class, ctrlrange -1 to 1
  EXPECT_EQ(robot.joint("left_elbow").effort, 20);      // own gear 40, forcerange -0.5 to 0.5
  EXPECT_EQ(robot.joint("left_wrist").effort, 12.5);    // gear of its class
  EXPECT_EQ(robot.joint("right_slide").effort, 2400);   // a servo: forcerange times the gear, which <motor> gave to all
  EXPECT_EQ(robot.joint("right_shoulder").effort, 80);  // gain 2, gear -50: -100 to 80
  EXPECT_FALSE(robot.joint("right_wrist").effort.has_value());
  EXPECT_THAT(robot.decisions("right_shoulder"),
              ElementsAre(HasSubstr("its drives give -100 to 80 N m; taken is 80 both ways")));
  EXPECT_THAT(robot.decisions("without an actuator"), ElementsAre(HasSubstr("are: right_wrist")));
}

TEST(MjcfEffort, OfSeveralDrivesAddsUp) {
  const ReadMjcf robot =
      read_mjcf_text(chain("<actuator><motor joint='a' ctrlrange='-2 2'/><motor joint='a' gear='3' "
                           "ctrlrange='-1 1'/><motor joint='b'/><motor joint='b' ctrlrange='-1 1'/>"
                           "<motor joint='c' ctrlrange='0 4'/><motor joint='d' ctrlrange='-1 1' "
                           "gear='0'/></actuator>"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("a").effort, 5);
  EXPECT_FALSE(robot.joint("b").effort.has_value());  // one of them has no limit
  EXPECT_EQ(robot.joint("c").effort, 4);
  EXPECT_THAT(robot.decisions("joint 'c'"), ElementsAre(HasSubstr("give 0 to 4 N; taken is 4 both ways")));
  EXPECT_FALSE(robot.joint("d").effort.has_value());  // its gear takes everything away
  EXPECT_THAT(robot.decisions("joint 'd'"), ElementsAre(HasSubstr("its drives give 0 N m; no limit is assumed")));
}

TEST(MjcfEffort, IsLimitedAtTheJointToo) {
  const ReadMjcf robot =
      read_mjcf_text(chain("<actuator><motor joint='a' ctrlrange='-20 20'/></actuator>", " actuatorfrcrange='-15 15'"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("a").effort, 15);
  EXPECT_EQ(read_mjcf_text(chain("", " actuatorfrcrange='-15 15'")).joint("a").effort, 15);
}

// A range beyond another one: MuJoCo clamps, so that what remains is the nearest bound.
TEST(MjcfEffort, OfRangesApartIsTheBoundBetweenThem) {
  const ReadMjcf robot = read_mjcf_text(
      chain("<actuator><motor joint='a' ctrlrange='2 4' forcerange='-1 1.5'/><motor joint='b' ctrlrange='-9 "
            "-7'/></actuator>",
            " actuatorfrcrange='-1 1'"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("a").effort, 1);
  EXPECT_EQ(robot.joint("b").effort, 9);
}

TEST(MjcfEffort, OfServosComesFromForcesOnly) {
  const ReadMjcf robot =
      read_mjcf_text(chain("<default><position kp='5' forcerange='-7 7'/></default><actuator><position joint='a' "
                           "ctrlrange='-3 3'/><general joint='b' ctrlrange='-3 3'/><motor joint='c' ctrlrange='-3 3'/>"
                           "<general joint='d' ctrlrange='-3 3' biastype='none' forcelimited='false'/></actuator>"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("a").effort, 7);
  EXPECT_EQ(robot.joint("b").effort, 7);  // the class made it a servo
  EXPECT_EQ(robot.joint("c").effort, 3);
  EXPECT_EQ(robot.joint("d").effort, 3);
  EXPECT_THAT(robot.decisions("control law"), SizeIs(1));
}

TEST(MjcfEffort, OfMotorsHasNoGainOfTheirClass) {
  const ReadMjcf robot =
      read_mjcf_text(chain("<default><general gainprm='2'/></default><actuator><motor joint='a' ctrlrange='-3 3'/>"
                           "<general joint='b' ctrlrange='-3 3'/></actuator>"));
  ASSERT_THAT(robot.faults, IsEmpty());
  EXPECT_EQ(robot.joint("a").effort, 3);  // <motor> says gain 1
  EXPECT_EQ(robot.joint("b").effort, 6);
}

// ---- Couplings ----

TEST(MjcfCoupling, IsAMimicJoint) {
  const ReadMjcf robot = read_mjcf_at(corpus("mjcf/gripper.xml"));
  ASSERT_THAT(robot.faults, IsEmpty());
  ASSERT_TRUE(robot.joint("finger2").mimic.has_value());
  const SourceMimic& mimic = *robot.joint("finger2").mimic;
  EXPECT_EQ(mimic.joint, "finger1");
  EXPECT_EQ(mimic.multiplier, 1.5);
  // q2 - 0.02 = 0.001 + 1.5 (q1 - 0.01)
  EXPECT_NEAR(mimic.offset, 0.006, 1e-15);
  EXPECT_THAT(robot.decisions("<fixed> (1): a tendon without stiffness"), SizeIs(1));
  EXPECT_THAT(robot.decisions("<general> (1): it does not drive a joint directly"), SizeIs(1));
}

TEST(MjcfCoupling, ThatIsNotActiveIsPassedOver) {
  const ReadMjcf robot = read_mjcf_text(
      chain("<equality><joint joint1='a' joint2='b' active='false'/><weld body1='a' active='false'/></equality>"));
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_FALSE(robot.joint("a").mimic.has_value());
  EXPECT_THAT(robot.decisions("not active"), SizeIs(2));
}

// ---- Names ----

TEST(MjcfNames, AreMadeUpWhereThereAreNone) {
  const ReadMjcf robot = read_mjcf_text(
      "<mujoco><worldbody><body><freejoint/><geom size='1'/><body><joint/><geom size='1'/><body name='body_2'>"
      "<joint name='body_3_joint'/><geom size='1'/><body><geom "
      "size='1'/></body></body></body></body></worldbody></mujoco>");
  ASSERT_THAT(robot.faults, IsEmpty());
  std::vector<std::string> links, joints;
  for (const SourceLink& link : robot.model.links) links.push_back(link.name);
  for (const SourceJoint& joint : robot.model.joints) joints.push_back(joint.name);
  EXPECT_THAT(links, ElementsAre("body_1", "body_3", "body_2", "body_4"));
  EXPECT_THAT(joints, ElementsAre("body_3_joint_2", "body_3_joint", "body_4_fixed"));
  EXPECT_THAT(robot.decisions("without a name"), SizeIs(1));
  EXPECT_EQ(robot.model.name, "robot");  // of the file
}

// ---- <frame>, which MuJoCo has since 3.0 ----

TEST(MjcfFrames, MoveTheirContents) {
  const auto text = [](const std::string& body, const std::string& geom, const std::string& site) {
    return "<mujoco><compiler angle='radian'/><default><default class='heavy'><geom "
           "density='5000'/></default></default>"
           "<worldbody><body name='bus'><freejoint/><geom size='1'/>" +
           body + "<joint axis='1 0 0' pos='0.1 0.2 0.3'/>" + geom + site + "</worldbody></mujoco>";
  };
  // A quarter turn about z within a quarter turn about x: x to y to z, y to -x, z to -y.
  const ReadMjcf framed = read_mjcf_text(
      text("<frame pos='1 2 3' euler='1.5707963267948966 0 0' childclass='heavy'><frame pos='0 0 1' "
           "euler='0 0 1.5707963267948966'><body name='b' pos='0.5 0 0'>",
           "<frame pos='0 0 1'><geom type='box' size='1 2 3'/></frame>",
           "<frame euler='1.5707963267948966 0 0'><site name='s' pos='1 2 3'/></frame></body></frame></frame></body>"));
  const ReadMjcf plain = read_mjcf_text(text("<body name='b' pos='1 1 3.5' xyaxes='0 0 1 -1 0 0'>",
                                             "<geom type='box' size='1 2 3' pos='0 0 1' density='5000'/>",
                                             "<site name='s' pos='1 -3 2' xyaxes='1 0 0 0 0 1'/></body></body>"));
  ASSERT_THAT(framed.faults, IsEmpty());
  ASSERT_THAT(plain.faults, IsEmpty());
  const auto expect_same = [](const Posed& a, const Posed& b) {
    EXPECT_LT((eigen(a.p) - eigen(b.p)).norm(), 1e-14);
    EXPECT_LT((eigen(a.R) - eigen(b.R)).norm(), 1e-14);
  };
  expect_same(framed.model.joints[0].X_PJ, plain.model.joints[0].X_PJ);
  expect_same(framed.model.frames[0].X_LF, plain.model.frames[0].X_LF);
  const SourceLink &f = framed.link("b"), &p = plain.link("b");
  expect_same(f.shapes.at(0).shape.X_BG, p.shapes.at(0).shape.X_BG);
  EXPECT_EQ(f.inertia->mass, 8 * 6 * 5000);
  EXPECT_EQ(p.inertia->mass, f.inertia->mass);
  EXPECT_LT((eigen(f.inertia->inertia) - eigen(p.inertia->inertia)).norm(), 1e-9 * eigen(p.inertia->inertia).norm());
  EXPECT_LT((eigen(f.inertia->com) - eigen(p.inertia->com)).norm(), 1e-14);
}

// ---- Files ----

TEST(MjcfIncludes, AreFoundInTheFolderOfTheIncludingFile) {
  const ModelFolder folder;
  folder.write("parts/arm.xml", "<m><include file='hand.xml'/></m>");
  folder.write("parts/hand.xml", "<m><site name='hand'/></m>");
  const ReadMjcf robot = read_mjcf_at(folder.write(
      "robot.xml",
      "<mujoco><worldbody><body><geom size='1'/><include file='parts/arm.xml'/></body></worldbody></mujoco>"));
  EXPECT_THAT(robot.faults, IsEmpty());
  EXPECT_THAT(robot.model.frames, SizeIs(1));
  EXPECT_THAT(robot.decisions("include 'hand.xml'"), SizeIs(1));
}

TEST(MjcfMeshes, ArePathsAsMujocoResolvesThem) {
  const auto path_of = [](const std::string& compiler, const std::string& file) {
    const ReadMjcf robot = read_mjcf_text("<mujoco><compiler " + compiler + "/><asset><mesh file='" + file +
                                          "'/></asset><worldbody><body><geom size='1'/><geom type='mesh' mesh='m' "
                                          "mass='0'/></body></worldbody></mujoco>");
    EXPECT_THAT(robot.faults, IsEmpty());
    return robot.model.links.at(0).shapes.at(1).mesh_file;
  };
  EXPECT_EQ(path_of("", "sub/m.obj"), "sub/m.obj");
  EXPECT_EQ(path_of("meshdir='assets'", "sub/m.stl"), "assets/sub/m.stl");
  EXPECT_EQ(path_of("assetdir='assets/'", "m.STL"), "assets/m.STL");
  EXPECT_EQ(path_of("assetdir='a' meshdir='b'", "m.stl"), "b/m.stl");
  EXPECT_EQ(path_of("meshdir='b' strippath='true'", "/home/me/m.stl"), "b/m.stl");
  EXPECT_EQ(path_of("meshdir='b'", "/home/me/m.stl"), "/home/me/m.stl");
}

// ---- Damage ----

std::string damaged(std::string text, Random& random) {
  static const std::vector<std::string> kPieces{"<",
                                                ">",
                                                "/>",
                                                "'",
                                                "\"",
                                                "&",
                                                "&amp;",
                                                "=",
                                                "<!--",
                                                "-->",
                                                "<body>",
                                                "</body>",
                                                "nan",
                                                "inf",
                                                "1e308",
                                                "-1e308",
                                                "1e-320",
                                                "0",
                                                "-1",
                                                "<include file='robot.xml'/>",
                                                "\xff",
                                                "\xc3\xa9",
                                                "<![CDATA[",
                                                "]]>",
                                                "<?xml?>",
                                                "<default class='x'>",
                                                "99999999999999999999"};
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random.integer(0, static_cast<int>(n) - 1));
  };
  for (int i = random.integer(1, 2); i > 0 && !text.empty(); --i) {
    const std::size_t at = below(text.size());
    switch (random.integer(0, 5)) {
      case 0:
        text[at] = static_cast<char>(random.integer(0, 255));
        break;
      case 1:
        text.resize(at);
        break;
      case 2:
        text.erase(at, 1 + below(40));
        break;
      case 3:
        text.insert(at, kPieces[below(kPieces.size())]);
        break;
      case 4:
        text.insert(at, text.substr(below(text.size()), below(200)));
        break;
      default: {  // a number becomes another
        const std::size_t digit = text.find_first_of("0123456789", at);
        if (digit != std::string::npos)
          text.replace(digit, 1, std::vector<std::string>{"-7", "0", "1e300", "1e-300", "3"}[below(5)]);
      }
    }
  }
  return text;
}

bool is_finite(const Posed& X) { return eigen(X.p).allFinite() && eigen(X.R).allFinite(); }

// Whatever happens to a file, it is read, or refused with a fault; what is read is finite and hangs together.
TEST(MjcfMutations, AreReadOrRefused) {
  const ModelFolder folder;
  std::filesystem::copy(corpus("mjcf/parts"), folder.path() / "parts");
  int read = 0, refused = 0;
  for (const char* name : {"free_two_arms", "anchors", "geoms", "bounds", "includes", "fixed_arm", "two_on_world",
                           "target_beside", "gripper"}) {
    const std::string text = bytes_of(corpus("mjcf/" + std::string(name) + ".xml"));
    ASSERT_FALSE(text.empty());
    for (int i = 0; i < 120; ++i) {
      SCOPED_TRACE(std::string(name) + ", " + seed_note(i));
      Random random(i);
      const ReadMjcf robot = read_mjcf_at(folder.write("robot.xml", damaged(text, random)));
      (robot.faults.empty() ? read : refused)++;
      for (const std::string& fault : robot.faults) EXPECT_EQ(fault.find('\n'), std::string::npos);
      if (!robot.faults.empty()) continue;
      std::set<std::string> links, joints;
      for (const SourceLink& link : robot.model.links) {
        EXPECT_TRUE(links.insert(link.name).second);
        if (link.inertia) {
          EXPECT_TRUE(std::isfinite(link.inertia->mass) && eigen(link.inertia->com).allFinite() &&
                      eigen(link.inertia->inertia).allFinite());
        }
      }
      EXPECT_FALSE(links.empty());
      for (const SourceJoint& joint : robot.model.joints) {
        EXPECT_TRUE(joints.insert(joint.name).second);
        EXPECT_TRUE(links.contains(joint.parent) && links.contains(joint.child));
        EXPECT_TRUE(is_finite(joint.X_PJ));
        EXPECT_NEAR(eigen(joint.axis).norm(), 1, 1e-12);
      }
      for (const SourceFrame& frame : robot.model.frames)
        EXPECT_TRUE(links.contains(frame.link) && is_finite(frame.X_LF));
    }
  }
  std::printf("[ measured ] %d read, %d refused\n", read, refused);
  EXPECT_GT(read, 80);
  EXPECT_GT(refused, 300);
}

}  // namespace mjcf_read_test
}  // namespace grapnel
