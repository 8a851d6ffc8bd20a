// grapnel import as its users run it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "app/program_run.hpp"

namespace grapnel {
namespace import_program_test {

using test::Outcome;
using ::testing::AllOf;
using ::testing::HasSubstr;

class ImportProgram : public test::ProgramRun {
 protected:
  static std::string corpus(const std::string& name) { return GRAPNEL_SOURCE_DIR "/tests/import/corpus/" + name; }
};

TEST_F(ImportProgram, WritesARobotFileThatInfoReads) {
  const Outcome made = run("import " + corpus("massless-root.urdf") + " -o robot.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(made.err, "");
  EXPECT_THAT(made.out,
              AllOf(HasSubstr("massless-root.urdf:6:4: the base is link 'base_link', with the links fixed to it: "
                              "base_body, battery\n"),
                    HasSubstr("robot.yaml: 3 bodies, 1 end-effector, ")));
  const std::string text = test::read_text(folder_ / "robot.yaml");
  EXPECT_THAT(text, AllOf(HasSubstr("# Made by grapnel import from massless-root.urdf."),
                          HasSubstr("# 'base_link' and the links fixed to it form one body"),
                          HasSubstr("schema: grapnel-robot/1")));
  const Outcome info = run("info robot.yaml");
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_THAT(info.out, AllOf(HasSubstr("3 bodies, 2 joints, 1 end-effectors"), HasSubstr("mass 54 kg")));
  const Outcome direct = run("info " + corpus("massless-root.urdf"));
  EXPECT_EQ(direct.out, info.out);
}

TEST_F(ImportProgram, SaysAllFaultsWithTheirPlaces) {
  const Outcome refused = run("import " + corpus("impossible-inertia.urdf") + " -o robot.yaml");
  EXPECT_EQ(refused.code, 2);
  EXPECT_EQ(refused.out, "");
  EXPECT_THAT(refused.err, AllOf(HasSubstr("impossible-inertia.urdf:3:21: error: link 'bus'"),
                                 HasSubstr("impossible-inertia.urdf:6:6: error: link 'arm'")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "robot.yaml"));
  EXPECT_EQ(run("import " + corpus("impossible-inertia.urdf") + " --repair-inertia -o robot.yaml").code, 0);

  const Outcome options = run("import " + corpus("gripper.urdf") +
                              " --base buss --lock left --lock right=x --lock wrist=1 --lock wrist=2 -o robot.yaml");
  EXPECT_EQ(options.code, 2);
  EXPECT_THAT(options.err, AllOf(HasSubstr("--lock left: error: must be JOINT=VALUE\n"),
                                 HasSubstr("--lock wrist=2: error: 'wrist' is given twice\n")));
  EXPECT_THAT(run("import " + corpus("gripper.urdf") + " --lock right=x -o robot.yaml").err,
              HasSubstr("--lock right=x: error: import.lock.right must be a number"));
  EXPECT_THAT(run("import " + corpus("gripper.urdf") + " --base buss -o robot.yaml").err,
              HasSubstr("--base buss: error: unknown link 'buss' for the base; did you mean 'bus'?\n"));
  EXPECT_THAT(run("import none.urdf -o robot.yaml").err, HasSubstr("none.urdf: error: "));
  EXPECT_THAT(run("import none.yaml -o robot.yaml").err, HasSubstr("a model to be imported ends in .urdf or .xml"));
  EXPECT_THAT(run("import " + corpus("gripper.urdf") + " -o none/robot.yaml").err,
              HasSubstr("none/robot.yaml: error: there is no folder 'none'\n"));
  const std::string model =
      "<robot name='r'><link name='b'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>"
      "</robot>";
  write("m.urdf", model);
  EXPECT_THAT(run("import m.urdf -o m.urdf").err, HasSubstr("m.urdf: error: must not be replaced"));
}

TEST_F(ImportProgram, NamesInLatin1AndLongOnes) {
  const std::string inertial = "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1'/></inertial></link>";
  const std::string longest = "an_arm_with_a_name_of_more_than_forty_characters";
  write("m.urdf", "<robot name='r'><link name='b\xe9'>" + inertial + "<link name='" + longest + "'>" + inertial +
                      "<joint name='" + longest + "_joint' type='continuous'><parent link='b\xe9'/><child link='" +
                      longest + "'/></joint></robot>");
  const Outcome made = run("import m.urdf -o robot.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("m.urdf:1:1: the file is not the UTF-8 that it must be"));
  const Outcome info = run("info robot.yaml");
  ASSERT_EQ(info.code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("\nb\xc3\xa9 "));
  EXPECT_EQ(run("info m.urdf").out, info.out);
  // Columns begin where their headings do.
  const auto line_with = [&](const std::string& begin) {
    const std::size_t at = info.out.find("\n" + begin) + 1;
    return info.out.substr(at, info.out.find('\n', at) - at);
  };
  const std::string head = line_with("body "), body = line_with(longest + " ");
  EXPECT_EQ(head.find("parent"), body.find("b\xc3\xa9"));
  // Behind it by a byte more: the character has two.
  EXPECT_EQ(head.find("joint") + 1, body.find(longest + "_joint"));
  EXPECT_EQ(head.find("type") + 1, body.find("continuous"));
  EXPECT_EQ(head.size() + 1, body.size());
}

TEST_F(ImportProgram, MakesWheelsOfJoints) {
  write("m.urdf",
        "<robot name='r'><link name='bus'><inertial><mass value='50'/><inertia ixx='5' iyy='5' "
        "izz='5'/></inertial></link>"
        "<link name='rotor'><inertial><mass value='2'/><inertia ixx='0.005' iyy='0.005' izz='0.01'/></inertial></link>"
        "<joint name='w' type='continuous'><parent link='bus'/><child link='rotor'/><axis xyz='0 0 1'/>"
        "<limit effort='0.1' velocity='300'/></joint></robot>");
  const Outcome made = run("import m.urdf --wheel w -o robot.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(test::read_text(folder_ / "robot.yaml"), AllOf(HasSubstr("wheels:"), HasSubstr("torque: 0.1")));
  EXPECT_THAT(run("info robot.yaml").out, HasSubstr("1 bodies, 0 joints"));
  EXPECT_THAT(run("import m.urdf --wheel v -o robot.yaml").err, HasSubstr("--wheel v: error: there is no joint 'v'"));
  EXPECT_THAT(run("import m.urdf --wheel w --bus ets-vii -o robot.yaml").err, HasSubstr("wheels"));
}

TEST_F(ImportProgram, TakesInertiaFromMeshes) {
  const Outcome made = run("import " + corpus("mjcf/meshes.xml") + " -o robot.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  // Boxes of 0.5^3 m with 800 and 1000 kg/m^3, a sphere of 0.2 m with 1000 kg/m^3, and 3 kg.
  EXPECT_THAT(run("info robot.yaml").out, HasSubstr("mass 261.51 kg"));
  write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\n");
  write(
      "m.xml",
      "<mujoco><asset><mesh file='m.obj'/></asset><worldbody><body name='b'><freejoint/>\n<geom type='mesh' mesh='m'/>"
      "</body></worldbody></mujoco>");
  EXPECT_THAT(run("import m.xml -o robot.yaml").err,
              HasSubstr("m.xml:2:19: error: the inertia of body 'b' would come"));
}

TEST_F(ImportProgram, PutsAnArmOnABus) {
  write("bus.yaml", "base: {mass: 300, inertia: [30, 40, 50]}\n");
  const Outcome made =
      run("import " + corpus("arm.urdf") +
          " --bus bus.yaml --mount '{position: [0.4, 0, 0]}' --prefix a- --lock elbow=0.5 -o robot.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  const Outcome info = run("info robot.yaml");
  EXPECT_THAT(info.out,
              AllOf(HasSubstr("2 bodies, 1 joints, 1 end-effectors"), HasSubstr("mass 310 kg"), HasSubstr("a-tool")));
  const Outcome ready_made = run("import " + corpus("arm.urdf") + " --bus ets-vii -o robot.yaml");
  ASSERT_EQ(ready_made.code, 0) << ready_made.err;
  EXPECT_THAT(run("info robot.yaml").out, HasSubstr("9 bodies, 8 joints, 2 end-effectors"));
  EXPECT_THAT(run("import " + corpus("arm.urdf") + " --bus ets-vi -o robot.yaml").err,
              HasSubstr("--bus ets-vi: error: no ready-made robot 'ets-vi'; did you mean 'ets-vii'?"));
}

}  // namespace import_program_test
}  // namespace grapnel
