/// grapnel modes: from the shipped matrices to a robot that vibrates as they do, and what it says to mistakes.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

#include "app/program_run.hpp"
#include "finite_elements/frame_model.hpp"

namespace grapnel::testing {
namespace modes_command_test {

using ::testing::HasSubstr;

using ModesCommand = grapnel::test::ProgramRun;

const std::string kExamples = GRAPNEL_SOURCE_DIR "/examples/finite_elements/";
const std::string kMast =
    fmt::format("modes --mass '{0}mast-mass.mtx' --stiffness '{0}mast-stiffness.mtx' ", kExamples);

TEST_F(ModesCommand, ReadsTheShippedMatrices) {
  // They are what their head says.
  const FrameModel mast = bent_mast(2);
  FaultList faults;
  const auto mass = read_element_matrix(kExamples + "mast-mass.mtx", "", 'M', faults),
             stiffness = read_element_matrix(kExamples + "mast-stiffness.mtx", "", 'K', faults);
  ASSERT_TRUE(mass && stiffness);
  EXPECT_LT((Eigen::MatrixXd(mass->A) - mast.M).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((Eigen::MatrixXd(stiffness->A) - mast.K).cwiseAbs().maxCoeff(), 1e-8);

  const auto made = run(kMast + "--units m-kg-s --modes 6 --damping 0.005 -o mast.yaml");
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("mass 7.08387 kg"));
  EXPECT_THAT(made.out, HasSubstr("modes from 19.4046 Hz on left out by --modes 6"));
  // A robot with the mast: the file's content is a link's.
  std::istringstream lines(grapnel::test::read_text(folder_ / "mast.yaml"));
  std::string robot = R"(name: robot
base: {name: base, mass: 100, inertia: [20, 20, 20]}
links:
  - name: mast
    parent: base
    joint: {name: root, type: fixed, origin: {position: [0.5, 0, 0]}}
)";
  for (std::string line; std::getline(lines, line);) robot += "    " + line + "\n";
  robot += R"(  - name: arm
    parent: base
    joint: {name: shoulder, type: revolute, axis: [0, 0, 1], origin: {position: [0, 0.5, 0]}}
    mass: 5
    com: [0.5, 0, 0]
    inertia: [0.1, 0.5, 0.5]
end_effectors:
  - {name: hand, link: arm, position: [1, 0, 0]}
)";
  write("robot.yaml", robot);
  const auto info = run("info robot.yaml");
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_THAT(info.out, HasSubstr("0.717974 Hz"));  // the base held, which is clamped
  EXPECT_THAT(info.out, HasSubstr("10.4388 Hz"));
}

// A Craig and Bampton model of one mode: six motions of a determinate interface, whose stiffness is rounding.
TEST_F(ModesCommand, AllModesOfSmallModel) {
  write("m.csv",
        "10 0 0 0 0 0 1\n0 10 0 0 0 0 2\n0 0 10 0 0 0 0\n0 0 0 4 0 0 0\n0 0 0 0 5 0 0\n0 0 0 0 0 6 0\n"
        "1 2 0 0 0 0 1\n");
  write("k.csv",
        "1e-13 2e-14 0 0 0 0 0\n9e-14 1e-13 0 0 0 0 0\n0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n0 0 0 0 0 0 0\n"
        "0 0 0 0 0 0 88.8264396\n");
  const std::string command = "modes --mass m.csv --stiffness k.csv --units m-kg-s ";
  const auto made = run(command + "--expect 1.5");
  EXPECT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.out, HasSubstr("1.5 Hz"));
  EXPECT_EQ(run(command + "--modes 7").code, 0);
  const auto many = run(command + "--modes 8");
  EXPECT_EQ(many.code, 2);
  EXPECT_THAT(many.err, HasSubstr("--modes 8: error: the matrices have 7 rows only"));
  // With names beside the matrices, or in one file for both.
  write("m.dof", "1 1\n1 2\n1 3\n1 4\n1 5\n1 6\n1001 0\n");
  EXPECT_THAT(run(command).err, HasSubstr("the rows have no names, those of 'm.csv' have"));
  EXPECT_EQ(run(command + "--row-names m.dof --interface 1 --expect 1.5").code, 0);
}

TEST_F(ModesCommand, ReportsErrors) {
  const auto fails = [&](const std::string& arguments, const std::string& text) {
    const auto o = run(arguments);
    EXPECT_EQ(o.code, 2) << arguments;
    EXPECT_THAT(o.err, HasSubstr(text)) << arguments;
  };
  fails(kMast, "--units is required");
  fails(kMast + "--units SI", "--units SI: error: must be the model's units as LENGTH-MASS-s");
  fails(kMast + "--units m-kg-s --interface 1", "the rows of these matrices have no names");
  fails(kMast + "--units m-kg-s --interface-rows 1 2 3 4 5 31", "six different rows from 1 to 30; 31 is not one");
  fails(kMast + "--units m-kg-s --interface-rows 1 2 3 4 5 5", "5 is not one");
  fails(kMast + "--units m-kg-s --modes 31", "the matrices have only 30 rows");
  fails(kMast + "--units m-kg-s --below 0.1", "the first mode is at 0.717974 Hz");
  fails(kMast + "--units m-kg-s --expect 0.72 1.5", "mode 2 is at 0.991342 Hz, expected 1.5 Hz");
  fails(kMast + "--units m-kg-s --interface-nodes nowhere.csv", "nowhere.csv");
  fails("modes --mass nowhere.mtx --stiffness b.sti --units mm-t-s", "nowhere.mtx");
  write("three.csv", "1 0 0\n0 1 0\n0 0 1\n");
  fails(fmt::format("modes --mass three.csv --stiffness '{}mast-stiffness.mtx' --units m-kg-s", kExamples),
        "they are not of the same model");
  EXPECT_EQ(run(kMast + "--units m-kg-s --expect 0.72 0.99").code, 0);
  EXPECT_EQ(run(kMast + "--units m-kg-s -o nowhere/mast.yaml").code, 1);
}

}  // namespace modes_command_test
}  // namespace grapnel::testing
