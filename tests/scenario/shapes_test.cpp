// A body's geometry: one shape, or a list of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/scenario/problem_setter.hpp"
#include "grapnel/scenario/scenario_files.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace shapes_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Edit of_ball(const std::string& shapes) {
  return {"    grasp_points", "    geometry: " + shapes + "\n    grasp_points"};
}
Edit of_base(const std::string& shapes) {
  return {"inertia: [10, 10, 10]}", "inertia: [10, 10, 10], geometry: " + shapes + "}"};
}
Edit of_upper(const std::string& shapes) {
  return {"      com: [0.5, 0, 0]", "      geometry: " + shapes + "\n      com: [0.5, 0, 0]"};
}

const std::string kBus = "{shape: box, size: [1, 2, 3]}";
const std::string kPanel = "{shape: box, size: [0.1, 4, 2], position: [0, 3, 0], rpy: [0, 0.5, 0]}";
const std::string kDish = "{shape: cylinder, radius: 0.4, length: 0.2}";

std::string scenario_with(const std::string& ball, const std::string& base, const std::string& upper) {
  return edited(kSmallScenario, {of_ball(ball), of_base(base), of_upper(upper)});
}

CaptureProblem loaded(const std::string& text, const std::vector<Override>& overrides = {}) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text), overrides);
}

TEST(Shapes, ComeInTheirOrder) {
  const CaptureProblem p =
      loaded(scenario_with("[" + kBus + ", " + kPanel + "]", "[" + kDish + ", " + kBus + "]", kPanel));
  ASSERT_EQ(p.targets[0].geometry.size(), 2u);
  EXPECT_EQ(p.targets[0].geometry[0].size[2], 3);
  EXPECT_EQ(p.targets[0].geometry[1].X_BG.p[1], 3);
  EXPECT_NEAR(p.targets[0].geometry[1].X_BG.R(0, 2), std::sin(0.5), 1e-15);
  ASSERT_EQ(p.robot.geometry.size(), 3u);
  const std::vector<Geometry> base = shapes_of(p.robot, "base"), upper = shapes_of(p.robot, "upper");
  ASSERT_EQ(base.size(), 2u);
  EXPECT_EQ(base[0].shape, Geometry::Shape::cylinder);
  EXPECT_EQ(base[0].size[0], 0.4);
  EXPECT_EQ(base[1].shape, Geometry::Shape::box);
  ASSERT_EQ(upper.size(), 1u);
  EXPECT_EQ(upper[0].X_BG.p[1], 3);
  EXPECT_TRUE(shapes_of(p.robot, "lower").empty());
}

TEST(Shapes, AListOfOneIsThatShapeAndAnEmptyOneNone) {
  const CaptureProblem alone = loaded(scenario_with(kBus, kDish, kPanel));
  const CaptureProblem listed = loaded(scenario_with("[" + kBus + "]", "[" + kDish + "]", "[" + kPanel + "]"));
  EXPECT_TRUE(problem_bytes(alone) == problem_bytes(listed));
  EXPECT_NE(alone.sha256, listed.sha256);  // the hash of the text
  const CaptureProblem none = loaded(scenario_with("[]", "[]", "[]"));
  EXPECT_TRUE(problem_bytes(none) == problem_bytes(loaded(kSmallScenario)));
}

TEST(Shapes, ErrorsHaveTheirLocations) {
  EXPECT_THAT(
      faults_of(scenario_with("[" + kBus + ", {shape: sphere, size: [1, 1, 1]}]", "[{shape: boks, size: [1, 1, 1]}]",
                              "[{shape: capsule, radius: -1, length: 1}, " + kBus + "]")),
      ElementsAre(
          "scenario.yaml:4:63: error: unknown value 'boks' for robot.base.geometry[0].shape; allowed are box, "
          "cylinder, "
          "capsule, sphere, mesh",
          "scenario.yaml:10:43: error: robot.links[0].geometry[0].radius is -1, must be greater than 0 [m]",
          "scenario.yaml:27:47: error: missing key 'radius' in targets[0].geometry[1], needed with shape: sphere",
          "scenario.yaml:27:63: error: 'size' in targets[0].geometry[1] has no meaning with shape: sphere"));
  const auto faults = [](const std::string& ball) { return faults_of(edited(kSmallScenario, {of_ball(ball)})); };
  EXPECT_THAT(faults("box"),
              ElementsAre("scenario.yaml:26:15: error: targets[0].geometry must be a mapping of one shape or a list of "
                          "shapes, not the text 'box'"));
  EXPECT_THAT(faults("[" + kBus + ", box]"),
              ElementsAre("scenario.yaml:26:47: error: targets[0].geometry[1] must be a mapping, not the text 'box'"));
  EXPECT_THAT(faults("[[" + kBus + "]]"),
              ElementsAre("scenario.yaml:26:16: error: targets[0].geometry[0] must be a mapping, not a list"));
  EXPECT_THAT(faults("[{shape: mesh, file: none.stl}]"),
              ElementsAre("scenario.yaml:26:36: error: cannot read the file 'none.stl': no such file"));
}

TEST(Shapes, OverridesNameThemByTheirNumber) {
  const std::string text = scenario_with(kBus, "[" + kDish + ", " + kBus + "]", kPanel);
  const CaptureProblem p = loaded(text, {{"robot.base.geometry[0].radius", "0.25"},
                                         {"robot.links.upper.geometry.size[1]", "5"},
                                         {"targets.ball.geometry", "[" + kDish + ", " + kBus + "]"},
                                         {"targets.ball.geometry[0].length", "0.75"}});
  EXPECT_EQ(shapes_of(p.robot, "base")[0].size[0], 0.25);
  EXPECT_EQ(shapes_of(p.robot, "upper")[0].size[1], 5);
  EXPECT_EQ(p.targets[0].geometry.at(0).size[1], 0.75);
  EXPECT_THAT(faults_of(text, {{"robot.base.geometry[2].radius", "1"}}),
              ElementsAre(HasSubstr("robot.base.geometry has 2 items, so there is no [2]")));
  EXPECT_THAT(faults_of(text, {{"targets.ball.geometry[0].size", "[1, 1, 1]"}}),
              ElementsAre(HasSubstr("targets.ball.geometry is not a list")));
  EXPECT_THAT(faults_of(text, {{"robot.base.geometry.radius", "1"}}), testing::SizeIs(1));
}

// Values that campaigns set in place agree with the reader bit for bit.
TEST(Shapes, NumbersAreSetInPlace) {
  const TemporaryFolder folder;
  const auto path = folder.write(
      "scenario.yaml", scenario_with("[" + kBus + ", " + kPanel + "]", "[" + kDish + ", " + kBus + "]", kDish));
  ScenarioFiles files;
  const CaptureProblem problem = load_scenario(path, std::span<const Change>(), files);
  Node tree = changed_tree(path, {}, files);
  fill_defaults(tree, scenario_schema_document());
  FaultList faults;
  for (const char* name :
       {"robot.base.geometry[0].radius", "robot.base.geometry[1].size", "robot.base.geometry[1].size[2]",
        "robot.links.upper.geometry.length", "targets.ball.geometry[0].size", "targets.ball.geometry[1].size[1]",
        "targets.ball.geometry[1].position", "targets.ball.geometry[1].rpy"}) {
    SCOPED_TRACE(name);
    const auto form = value_at(tree, name);
    ASSERT_TRUE(form);
    const ProblemSetter set = problem_setter(path_steps(tree, name, {}, faults), *form, problem);
    ASSERT_TRUE(set);
    std::vector<double> numbers = *numbers_in(*form);
    for (double& x : numbers) x = 1.25 * x;
    CaptureProblem quick = problem;
    ASSERT_TRUE(set(quick, numbers));
    const Node value = with_numbers(*form, numbers, {});
    const std::vector<Change> changes{{name, {}, value, flow_text(value)}};
    EXPECT_FALSE(problem_bytes(quick) == problem_bytes(problem));
    EXPECT_TRUE(problem_bytes(quick) == problem_bytes(load_scenario(path, changes, files)));
  }
  EXPECT_TRUE(faults.empty());
}

// A scenario written by a study contains its changes of shapes.
TEST(Shapes, ChangesAreWrittenBack) {
  for (const std::string& ball : {kBus, "[" + kDish + ", " + kBus + "]", "[" + kBus + ", " + kDish + "]"}) {
    const TemporaryFolder folder;
    const auto path = folder.write("scenario.yaml", scenario_with(ball, kDish, kDish));
    ScenarioFiles files;
    const CaptureProblem before = load_scenario(path, std::span<const Change>(), files);
    CaptureProblem after = before;
    after.targets[0].geometry.back().size[1] = 7;
    after.targets[0].geometry.back().X_BG.p = {0.5, 0.25, 0.125};
    const std::string text = changed_scenario_text({path, changed_tree(path, {}, files), before}, after, path, "", "");
    const CaptureProblem written = loaded(text);
    EXPECT_TRUE(problem_bytes(written) == problem_bytes(after));
  }
}

TEST(Shapes, MeshesOfAListAreReadAndMoved) {
  const TemporaryFolder folder;
  folder.write("part.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const auto path = folder.write(
      "scenario.yaml",
      edited(kSmallScenario, {of_ball("[" + kBus + ", {shape: mesh, file: part.obj, scale: 0.5}]"),
                              of_base("[{shape: mesh, file: part.obj}, {shape: mesh, file: part.obj, scale: 2}]")}));
  ScenarioFiles files;
  const CaptureProblem p = load_scenario(path, std::span<const Change>(), files);
  ASSERT_EQ(p.robot.geometry.size(), 2u);
  EXPECT_EQ(p.robot.geometry[1].second.size[0], 2);
  ASSERT_TRUE(p.targets[0].geometry.at(1).mesh);
  EXPECT_EQ(p.targets[0].geometry[1].mesh, p.robot.geometry[0].second.mesh);
  std::filesystem::create_directory(folder.path() / "out");
  const std::string text =
      changed_scenario_text({path, changed_tree(path, {}, files), p}, p, folder.path() / "out" / "moved.yaml", "", "");
  const CaptureProblem moved = load_scenario(folder.write("out/moved.yaml", text));
  ASSERT_TRUE(moved.targets[0].geometry.at(1).mesh);
  EXPECT_EQ(moved.targets[0].geometry[1].mesh->name, "part.obj");
  EXPECT_EQ(moved.robot.geometry.size(), 2u);
}

// The number of shape pairs grows with the square of the number of shapes.
TEST(Shapes, ThereIsALimitToTheirNumber) {
  SKIP_UNDER_SANITIZERS();
  const auto many = [](std::size_t count) {
    std::string list = "[";
    for (std::size_t i = 0; i < count; ++i) list += (i == 0 ? "" : ", ") + std::string("{shape: sphere, radius: 1}");
    return list + "]";
  };
  EXPECT_THAT(faults_of(scenario_with(many(2500), many(2499), kDish)), IsEmpty());
  EXPECT_THAT(faults_of(scenario_with(many(2500), many(2500), kDish)),
              ElementsAre(HasSubstr("error: targets and robot have 5001 shapes in total, at most 5000 are allowed")));
  EXPECT_THAT(faults_of(scenario_with(kDish, many(5000), kDish)),
              ElementsAre(HasSubstr("error: the robot's bodies have 5001 shapes in total, at most 5000 are allowed")));
}

// A target that is one sphere has a known surface normal; a target with further shapes does not.
TEST(Shapes, TheNormalOfASphereIsThatOfItsOnlyShape) {
  const std::string ball = "{shape: sphere, radius: 0.5}";
  const CaptureProblem one = loaded(edited(kSmallScenario, {of_ball("[" + ball + "]")}));
  const CaptureProblem two = loaded(edited(kSmallScenario, {of_ball("[" + ball + ", " + kBus + "]")}));
  const auto normal = contact_normal(one.targets[0], one.targets[0].grasp_points[0]);
  ASSERT_TRUE(normal);
  EXPECT_EQ((*normal)[1], 1);
  EXPECT_FALSE(contact_normal(two.targets[0], two.targets[0].grasp_points[0]));
}

}  // namespace shapes_test
}  // namespace grapnel::test
