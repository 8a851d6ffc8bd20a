// What names, magnitudes, texts and files may be: what is accepted can be run and written.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <thread>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace inputs_test {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

std::vector<std::string> faults_with(const std::vector<Edit>& edits) {
  return faults_of(edited(kSmallScenario, edits));
}

// --- Names
// ------------------------------------------------------------------------------------------------------------

TEST(Names, MustBeFitToFileResultsUnder) {
  const auto named = [](const std::string& name) {
    return faults_with({{"name: upper", "name: " + name}, {"parent: upper", "parent: " + name}});
  };
  EXPECT_THAT(named("."), ElementsAre("scenario.yaml:6:13: error: robot.links[0].name '.' is not a valid name, because "
                                      "results are stored under names; this is a folder's name"));
  EXPECT_THAT(named(".."), SizeIs(1));
  EXPECT_THAT(named("a/"), ElementsAre("scenario.yaml:6:13: error: robot.links[0].name 'a/' is not a valid name, "
                                       "because results are stored under names and must not contain '/'"));
  EXPECT_THAT(named("/a"), SizeIs(1));
  EXPECT_THAT(named("a/position"), SizeIs(1));
  EXPECT_THAT(named(std::string(201, 'x')), ElementsAre(HasSubstr("may have 200 bytes, not 201")));
  EXPECT_THAT(named(std::string(200, 'x')), IsEmpty());
  EXPECT_THAT(named("'...'"), IsEmpty());
  EXPECT_THAT(named("arm 1.left (α)"), IsEmpty());
}

TEST(Names, OfAllKinds) {
  EXPECT_THAT(faults_with({{"base: {mass", "base: {name: a/b, mass"}, {"parent: base", "parent: a/b"}}), SizeIs(1));
  EXPECT_THAT(faults_with({{"name: elbow", "name: a/b"}, {"elbow: 1}", "a/b: 1}"}}), SizeIs(1));
  EXPECT_THAT(faults_with({{"name: tip", "name: a/b"}, {"end_effector: tip", "end_effector: a/b"}}), SizeIs(1));
  EXPECT_THAT(faults_with({{"name: ball", "name: a/b"}, {"target: ball", "target: a/b"}}), SizeIs(1));
  EXPECT_THAT(faults_with({{"name: grip", "name: a/b"}, {"point: grip", "point: a/b"}}), SizeIs(1));
  // Of the whole it is only shown.
  EXPECT_THAT(faults_with({{"name: test", "name: 2 m/s"}}), IsEmpty());
}

TEST(Names, HoldNoControlCharacters) {
  for (const char* escape : {"\\0", "\\e[31m", "\\a", "\\x9b31m", "\\u202e", "\\x7f"}) {
    const auto faults =
        faults_with({{"name: ball", std::string("name: \"b") + escape + "\""}, {"target: ball", "target: bell"}});
    ASSERT_THAT(faults, testing::Not(IsEmpty())) << escape;
    EXPECT_THAT(faults[0], HasSubstr("targets[0].name must not hold control characters: 'b?")) << escape;
    for (const std::string& fault : faults)
      EXPECT_THAT(fault, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\a")), Not(HasSubstr("\xc2\x9b")),
                               Not(HasSubstr("\u202e"))))
          << escape;
  }
  EXPECT_THAT(faults_with({{"name: test", "name: \"a\\eb\""}}), SizeIs(1));
  EXPECT_THAT(faults_with({{"name: test", "name: test\ndescription: \"two\\nlines, a\\ttab\""}}), IsEmpty());
  // Unescaped: C1, and characters that change the direction of writing.
  EXPECT_THAT(faults_of("name: a\xc2\x9b"
                        "31mz"),
              ElementsAre("scenario.yaml:1:8: error: control character 0xc29b is not allowed in the file"));
  EXPECT_THAT(faults_of("name: a\u202ez"),
              ElementsAre("scenario.yaml:1:8: error: control character 0xe280ae is not allowed in the file"));
}

// --- Messages
// ---------------------------------------------------------------------------------------------------------

TEST(Messages, StayShort) {
  std::string links;
  for (int i = 0; i < test::repetitions(3000); ++i) {
    const std::string name = std::string(150, 'n') + std::to_string(i);
    links += "    - {name: " + name + ", parent: base, joint: {name: " + name +
             ", type: revolute, axis: [0, 0, 1]}, mass: 1, inertia: [1, 1, 1]}\n";
  }
  const TemporaryFolder folder;
  folder.write("motion.csv", "time,shoulder\n0,0\n1,0\n");
  const auto path = folder.write(
      "scenario.yaml", edited(kSmallScenario, {{"  links:\n", "  links:\n" + links}, way("trajectory: motion.csv")}));
  const auto faults = faults_of_file(path);
  ASSERT_THAT(faults, testing::Not(IsEmpty()));
  for (const std::string& fault : faults)
    EXPECT_LT(fault.size(), 3000u) << "without a list of 3000 names of 154 bytes each";
}

// --- Magnitudes
// -------------------------------------------------------------------------------------------------------

TEST(Magnitudes, HaveStatedLimits) {
  EXPECT_THAT(
      faults_with({{"com: [0.5, 0, 0]", "com: [4.3e9, 0, 0]"}}),
      ElementsAre(
          "scenario.yaml:10:13: error: robot.links[0].com[0] is 4.3e9, must be at most 10000 in magnitude [m]"));
  EXPECT_THAT(
      faults_with({{"position: [2, 0, 0]", "position: [4e9, 0, 0]"}}),
      ElementsAre(
          "scenario.yaml:25:24: error: targets[0].state.position[0] is 4e9, must be at most 1e+09 in magnitude [m]"));
  EXPECT_THAT(
      faults_with({{"elbow: 1}", "elbow: 1e7}"}}),
      ElementsAre(
          "scenario.yaml:20:34: error: initial.joints.elbow is 1e7, must be at most 10000 in magnitude [rad or m]"));
  EXPECT_THAT(faults_with({{"duration: 20", "duration: 1e10"}}),
              testing::UnorderedElementsAre(HasSubstr("must be at most 1e+09 in magnitude [s]"), HasSubstr("samples")));
  EXPECT_THAT(faults_with({{"mass: 10\n", "mass: 1e-300\n"}}), ElementsAre(HasSubstr("must be at least 1e-09 [kg]")));
  EXPECT_THAT(faults_with({{"lower: -2, upper: 2", "lower: -1e5, upper: .inf"}}),
              ElementsAre(HasSubstr("must be at most 10000 in magnitude or .inf [rad or m]")));
  // Of the base and of targets the position in W may be that of an orbit.
  EXPECT_THAT(faults_with({{"position: [2, 0, 0]", "position: [4.2e7, 0, 0]"}}), IsEmpty());
}

TEST(Magnitudes, InertiaThatRoundingTakes) {
  EXPECT_THAT(
      faults_with({{"com: [0.5, 0, 0]\n      inertia: [0.1, 0.5, 0.5]",
                    "com: [9e3, 0, 0]\n      inertia: [1e-6, 1e-6, 1e-6]"}}),
      ElementsAre(
          "scenario.yaml:10:12: error: robot.links[0].com is 9000 m from the body's origin: compared with mass times "
          "its square, 4.05e+08 kg m^2, the inertia is lost to rounding; move the origin closer to the body"));
}

// --- Inertia as a matrix
// ----------------------------------------------------------------------------------------------

TEST(InertiaMatrix, IsReadEverywhere) {
  const auto inertia_of = [](const std::string& text) {
    const TemporaryFolder folder;
    return load_scenario(folder.write(
        "scenario.yaml",
        edited(kSmallScenario, {{"inertia: [1, 1, 1]", "inertia: " + text},
                                {"inertia: [10, 10, 10]", "inertia: [[10, 0, 0], [0, 10, 0], [0, 0, 10]]"}})));
  };
  const CaptureProblem p = inertia_of("[[3, 0.1, -0.2], [0.1, 4, 0.3], [-0.2, 0.3, 5]]");
  const Symmetric3d& I = p.targets[0].inertia;
  EXPECT_THAT((std::vector<double>{I.xx, I.yy, I.zz, I.xy, I.xz, I.yz}), ElementsAre(3, 4, 5, 0.1, -0.2, 0.3));
  EXPECT_EQ(p.robot.bodies[0].inertia.zz, 10);
  // Six digits of a table.
  const CaptureProblem rounded = inertia_of("[[3, 0.100001, 0], [0.1, 4, 0], [0, 0, 5]]");
  EXPECT_DOUBLE_EQ(rounded.targets[0].inertia.xy, 0.1000005);
}

TEST(InertiaMatrix, FaultsNameTheEntries) {
  const auto faults = [](const std::string& text) { return faults_with({{"inertia: [1, 1, 1]", "inertia: " + text}}); };
  EXPECT_THAT(
      faults("[[3, 0.1, 0], [-0.1, 4, 0], [0, 0, 5]]"),
      ElementsAre("scenario.yaml:24:29: error: targets[0].inertia is not symmetric: [0][1] is 0.1 and [1][0] is -0.1"));
  EXPECT_THAT(faults("[[3, 0], [0, 4], [0, 0]]"),
              ElementsAre(HasSubstr("targets[0].inertia[0] has 2 items, must have exactly 3"), HasSubstr("inertia[1]"),
                          HasSubstr("inertia[2]")));
  EXPECT_THAT(faults("[[3, 0, 0], [0, 4, 0]]"), ElementsAre(HasSubstr("targets[0].inertia has 2 items, must be")));
  EXPECT_THAT(faults("[[3, 0, 0], [0, 4, 0], [0, 0, 9]]"), ElementsAre(HasSubstr("triangle inequality")));
}

// --- Files that another file names
// --------------------------------------------------------------------------------------

const Edit kRobotFile{"robot:\n  name: arm\n", "robot: secret\nunused:\n  name: arm\n"};

std::vector<std::string> faults_with_secret(const std::string& bytes, const Edit& named) {
  const TemporaryFolder folder;
  folder.write("secret", bytes);
  return faults_of_file(folder.write("scenario.yaml", edited(kSmallScenario, {named})));
}

TEST(NamedFiles, DoNotRevealTheirContents) {
  for (const std::string& content :
       {std::string("root:$6$salt$hash:19000:0:99999:7:::\ndaemon:*:19000:0:99999:7:::\n"),
        std::string("password = hunter2, hash\n"), std::string("hash: hunter2\nsalt: [1, 2]\n"),
        std::string("-----BEGIN KEY-----\nhash hunter2\n"), std::string("[\"hash\", hunter2]"),
        std::string("'hash': {hunter2\n"), std::string("\"hash \"hunter2\"\n")}) {
    for (const Edit& named : {kRobotFile, way("trajectory: secret")}) {
      const auto faults = faults_with_secret(content, named);
      ASSERT_THAT(faults, testing::Not(IsEmpty())) << content;
      for (const std::string& fault : faults)
        EXPECT_THAT(fault, AllOf(Not(HasSubstr("hash")), Not(HasSubstr("hunter2")), Not(HasSubstr("root")))) << content;
    }
  }
  EXPECT_THAT(
      faults_with_secret("root:x:0:0\n", kRobotFile),
      testing::Contains(testing::StartsWith(
          "secret:1:1: error: this is not a robot file: no line begins with one of its keys, such as schema, name")));
  EXPECT_THAT(faults_with_secret("root:x:0:0\n", way("trajectory: secret")),
              ElementsAre("secret:1:1: error: not a trajectory: the first line must be time,<joint>,..."));
  // What is meant as a robot still gets all help.
  EXPECT_THAT(faults_with_secret("base: {mass: 1, inertia: [1, 1, 1]}\nlinks :[]\n", kRobotFile),
              testing::Not(ElementsAre(HasSubstr("no robot file"))));
}

TEST(NamedFiles, AreRegularFiles) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder.path() / "secret").c_str(), 0600), 0);
  const auto faults = faults_of_file(folder.write("scenario.yaml", edited(kSmallScenario, {kRobotFile})));
  EXPECT_THAT(faults, testing::Contains(AllOf(HasSubstr(
                          "scenario.yaml:2:8: error: cannot read the file 'secret': it is not a regular file"))));
}

TEST(NamedFiles, APersonMayNameAPipe) {
  const TemporaryFolder folder;
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { folder.write("pipe", kSmallScenario); });
  EXPECT_THAT(faults_of_file(pipe), IsEmpty());
  writer.join();
}

}  // namespace inputs_test
}  // namespace grapnel::test
