// Materials, obstacles and rules of contact in scenarios: what is read, and input errors, one at a time.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/problem_conflicts.hpp"
#include "grapnel/problem/problem_scene.hpp"
#include "scenario/scenario_files.hpp"

namespace grapnel::test {
namespace contacts_test {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// kSmallScenario with shapes on base, lower link and ball. Materials begin in line 36: `pad` in 37, a further one in
// 38, then the line of the obstacles, of which one is a floor, and the line of the rules.
std::string touching(const std::string& contacts, const std::string& material = {}, const std::string& obstacle = {},
                     const std::string& further = {}) {
  const std::string ball = "geometry: {shape: sphere, radius: 0.1}";
  std::string lines = "materials:\n  - {name: pad, stiffness: 2.0e4, damping: 50}\n";
  if (!material.empty()) lines += "  - " + material + "\n";
  lines += "obstacles: [{name: floor, half_space: true, position: [0, 0, -9]}" +
           (obstacle.empty() ? "" : ", " + obstacle) + "]\n";
  lines += "contacts: " + contacts + further;
  return edited(kSmallScenario,
                {{"base: {mass: 100, inertia: [10, 10, 10]}", "base: {mass: 100, inertia: [10, 10, 10], " + ball + "}"},
                 {"parent: upper", "parent: upper\n      " + ball},
                 {"    state: {position: [2, 0, 0]", "    " + ball + "\n    state: {position: [2, 0, 0]"},
                 with_top(lines)});
}

CaptureProblem read(const std::string& text) {
  const TemporaryFolder folder;
  return load_scenario(folder.write("scenario.yaml", text));
}

const BodyName kBall = BodyName::of_target(0), kFloor = BodyName::of_obstacle(0), kPost = BodyName::of_obstacle(1);
using Pair = std::pair<BodyName, BodyName>;

TEST(Contacts, HardMaterialsAreRead) {
  const CaptureProblem p =
      read(touching("{pairs: [[lower, ball]], materials: [rim, pad]}",
                    "{name: rim, stiffness: 2e4, hard: true, restitution: 0, rest_speed: 2 mm/s, friction: 0.2}"));
  EXPECT_TRUE(p.materials[1].surface.hard);
  EXPECT_EQ(p.materials[1].restitution, 0);
  EXPECT_EQ(p.materials[1].surface.rest_speed, 2e-3);
  EXPECT_FALSE(p.materials[0].surface.hard);
}

TEST(Contacts, EveryKeyIsRead) {
  const CaptureProblem p = read(touching(
      "\n  - {pairs: [[lower, ball], [floor, base]], material: pad}"
      "\n  - {between: [[lower, base], [ball, post]], materials: [rubbery, steel], exclude: [[post, base]]}"
      "\n  - {all: true, material: steel, exclude: [[ball, floor]]}",
      "{name: rubbery, youngs_modulus: 2 MPa, poisson_ratio: 0.5, damping: 3, damping_depth: 1 mm, restitution: 0.5, "
      "restitution_speed: 0.2, friction: {static: 0.4, kinetic: 0.3}, stiction_speed: 1e-3, stiction_displacement: "
      "1e-5, rolling_length: 2 mm, "
      "torsional_length: 3 mm, stiction_rate: 0.01}",
      "{name: post, geometry: [{shape: sphere, radius: 0.2}, {shape: box, size: [1, 2, 3]}], position: [5, 6, 7], rpy: "
      "[0, 0, 1.5707963267948966]}"));
  ASSERT_EQ(p.materials.size(), 3U);  // the ready-made one that is used is added
  EXPECT_EQ(p.materials[0].name, "pad");
  EXPECT_EQ(p.materials[0].surface.stiffness, 2e4);
  EXPECT_EQ(p.materials[0].surface.damping, 50);
  EXPECT_FALSE(p.materials[0].restitution);
  const MaterialSetup& m = p.materials[1];
  EXPECT_EQ(m.surface.modulus, 2e6);
  EXPECT_EQ(m.surface.poisson_ratio, 0.5);
  EXPECT_EQ(m.surface.stiffness, 0);
  EXPECT_EQ(m.surface.damping, 3);
  EXPECT_EQ(m.surface.damping_depth, 1e-3);
  EXPECT_EQ(m.restitution, 0.5);
  EXPECT_EQ(m.restitution_speed, 0.2);
  EXPECT_EQ(m.surface.static_friction, 0.4);
  EXPECT_EQ(m.surface.kinetic_friction, 0.3);
  EXPECT_EQ(m.surface.stiction_speed, 1e-3);
  EXPECT_EQ(m.surface.stiction_displacement, 1e-5);
  EXPECT_EQ(m.surface.rolling_length, 2e-3);
  EXPECT_EQ(m.surface.torsional_length, 3e-3);
  EXPECT_EQ(m.surface.stiction_rate, 0.01);
  EXPECT_EQ(p.materials[2].name, "steel");
  EXPECT_EQ(p.materials[2].surface.modulus, published_material("steel")->material.modulus);

  ASSERT_EQ(p.obstacles.size(), 2U);
  EXPECT_THAT(p.obstacles[0].geometry, IsEmpty());
  EXPECT_EQ(p.obstacles[0].X_WO.p[2], -9);
  EXPECT_EQ(p.obstacles[1].name, "post");
  ASSERT_EQ(p.obstacles[1].geometry.size(), 2U);
  EXPECT_EQ(p.obstacles[1].geometry[1].size[2], 3);
  EXPECT_EQ(p.obstacles[1].X_WO.p[1], 6);
  EXPECT_NEAR((p.obstacles[1].X_WO.R * Vector3d::unit(0))[1], 1, 1e-15);

  ASSERT_EQ(p.contacts.size(), 3U);
  EXPECT_THAT(p.contacts[0].pairs, ElementsAre(Pair{"lower", kBall}, Pair{kFloor, "base"}));
  EXPECT_THAT(p.contacts[0].materials, ElementsAre("pad"));
  EXPECT_THAT(p.contacts[1].first_group, ElementsAre(BodyName("lower"), BodyName("base")));
  EXPECT_THAT(p.contacts[1].second_group, ElementsAre(kBall, kPost));
  EXPECT_THAT(p.contacts[1].materials, ElementsAre("rubbery", "steel"));
  EXPECT_THAT(p.contacts[1].exclude, ElementsAre(Pair{kPost, "base"}));
  EXPECT_TRUE(p.contacts[2].all);
  EXPECT_THAT(p.contacts[2].exclude, ElementsAre(Pair{kBall, kFloor}));
}

TEST(Contacts, OneRuleNeedsNoListAndOneNumberIsBothFrictions) {
  const CaptureProblem p =
      read(touching("{pairs: [[lower, ball]], material: rim}", "{name: rim, like: aluminium, friction: 0.2}"));
  ASSERT_EQ(p.contacts.size(), 1U);
  const ContactMaterial& rim = p.materials[1].surface;
  EXPECT_EQ(rim.modulus, published_material("aluminium")->material.modulus);
  EXPECT_EQ(rim.static_friction, 0.2);
  EXPECT_EQ(rim.kinetic_friction, 0.2);
  const CaptureProblem linear =
      read(touching("{pairs: [[lower, ball]], material: rim}", "{name: rim, like: steel, stiffness: 100}"));
  EXPECT_EQ(linear.materials[1].surface.modulus, 0);
  EXPECT_EQ(linear.materials[1].surface.stiffness, 100);
  EXPECT_EQ(linear.materials[1].surface.static_friction, published_material("steel")->material.static_friction);
  EXPECT_THAT(faults_of(touching("{pairs: [[lower, ball]], material: aluminium}")), IsEmpty());
}

// Contact forces depend on shapes, which need not be symmetric.
TEST(Contacts, AreNotPlanar) {
  CaptureProblem p = read(touching("{pairs: [[lower, ball]], material: pad}"));
  EXPECT_FALSE(scene_of(p).planar);
  p.contacts.clear();
  EXPECT_TRUE(scene_of(p).planar);
}

struct Case {
  const char* name;
  std::string text;
  std::vector<std::string> faults;
};
void PrintTo(const Case& fault, std::ostream* out) { *out << fault.name; }

class ContactsFault : public testing::TestWithParam<Case> {};

TEST_P(ContactsFault, IsReportedWithItsPlace) { EXPECT_EQ(faults_of(GetParam().text), GetParam().faults); }

const std::string kRule = "{pairs: [[lower, ball]], material: pad}";
const std::vector<Case> kCases{
    {"no_selection",
     touching("{material: pad}"),
     {"scenario.yaml:39:11: error: missing key in contacts: give 'pairs', 'between' or 'all'"}},
    {"two_selections",
     touching("{all: true, pairs: [[lower, ball]], material: pad}"),
     {"scenario.yaml:39:23: error: contacts has both 'all' and 'pairs', only one is allowed"}},
    {"all_off",
     touching("{all: false, material: pad}"),
     {"scenario.yaml:39:17: error: contacts.all is false, so this rule selects no pair; remove the rule"}},
    {"unknown_body",
     touching("{pairs: [[lowe, ball]], material: pad}"),
     {"scenario.yaml:39:21: error: unknown body 'lowe' in contacts.pairs[0]; did you mean 'lower'?"}},
    {"unknown_body_of_group",
     touching("[{between: [[lower], [ball, flor]], material: pad}, {all: true, material: pad}]"),
     {"scenario.yaml:39:39: error: unknown body 'flor' in contacts[0].between[1]; did you mean 'floor'?"}},
    {"unknown_material",
     touching("{pairs: [[lower, ball]], material: pat}"),
     {"scenario.yaml:39:46: error: unknown material 'pat' in contacts.material; did you mean 'pad'?"}},
    {"unknown_second_material",
     touching("{pairs: [[lower, ball]], materials: [pad, stel]}"),
     {"scenario.yaml:39:53: error: unknown material 'stel' in contacts.materials; did you mean 'steel'?"}},
    {"mixed_elasticity",
     touching("{pairs: [[lower, ball]], materials: [pad, steel]}"),
     {"scenario.yaml:39:47: error: contacts.materials: 'steel' has a Young's modulus and 'pad' a stiffness; both need "
      "the same kind of elasticity"}},
    {"materials_of_all",
     touching("{all: true, materials: [pad, pad]}"),
     {"scenario.yaml:39:23: error: contacts has both 'all' and 'materials', only one is allowed"}},
    {"same_body",
     touching("{pairs: [[lower, lower]], material: pad}"),
     {"scenario.yaml:39:20: error: contacts.pairs[0] names 'lower' twice"}},
    {"connected_through_a_link_without_shape",
     touching("{pairs: [[base, lower]], material: pad}"),
     {"scenario.yaml:39:20: error: contacts.pairs[0]: 'base' and 'lower' are connected by joint 'elbow', and their "
      "shapes may overlap there"}},
    {"no_geometry",
     touching("{pairs: [[upper, ball], [upper, floor]], material: pad}"),
     {"scenario.yaml:39:20: error: contacts.pairs[0]: 'upper' has no geometry, so it cannot touch anything"}},
    {"two_obstacles",
     touching("{pairs: [[floor, wall]], material: pad}", {}, "{name: wall, half_space: true}"),
     {"scenario.yaml:39:20: error: contacts.pairs[0]: 'floor' and 'wall' are both fixed in W, so they cannot touch"}},
    {"fixed_base_on_floor",
     edited(touching("{pairs: [[base, floor], [lower, floor]], material: pad}"),
            {{"base: {mass", "base: {mode: fixed, mass"}}),
     {"scenario.yaml:39:20: error: contacts.pairs[0]: 'base' and 'floor' are both fixed in W, so they cannot touch"}},
    {"groups_without_pair",
     touching("{between: [[lower, base], [base, lower]], material: pad}"),
     {"scenario.yaml:39:21: error: contacts.between selects no pair: every two of these bodies are one, or are "
      "connected, or are both fixed"}},
    {"other_material_for_the_same_pair",
     touching("[{pairs: [[lower, ball]], material: pad}, {pairs: [[ball, lower]], material: steel}]"),
     {"scenario.yaml:39:62: error: contacts[1].pairs[0]: 'ball' and 'lower' are a pair with other materials in "
      "contacts[0].pairs[0]"}},
    {"kinetic_above_static",
     touching(kRule, "{name: rim, stiffness: 1, friction: {static: 0.3, kinetic: 0.4}}"),
     {"scenario.yaml:38:41: error: materials[1].friction: kinetic is 0.4, must be at most static, 0.3"}},
    {"no_elasticity",
     touching(kRule, "{name: rim, friction: 0.1}"),
     {"scenario.yaml:38:5: error: missing key in materials[1]: give 'stiffness', or 'youngs_modulus' with "
      "'poisson_ratio', or 'like'"}},
    {"two_elasticities",
     touching(kRule, "{name: rim, stiffness: 1, youngs_modulus: 1 MPa, poisson_ratio: 0.3}"),
     {"scenario.yaml:38:31: error: materials[1] has both 'stiffness' and 'youngs_modulus', only one is allowed",
      "scenario.yaml:38:54: error: materials[1] has both 'stiffness' and 'poisson_ratio', only one is allowed"}},
    {"modulus_alone",
     touching(kRule, "{name: rim, youngs_modulus: 1 MPa}"),
     {"scenario.yaml:38:17: error: missing key 'poisson_ratio' in materials[1], needed with youngs_modulus"}},
    {"poisson_ratio_out_of_range",
     touching(kRule, "{name: rim, youngs_modulus: 1 MPa, poisson_ratio: 0.6}"),
     {"scenario.yaml:38:55: error: materials[1].poisson_ratio is 0.6, must be greater than -1 and at most 0.5"}},
    {"negative_stiffness",
     touching(kRule, "{name: rim, stiffness: -1}"),
     {"scenario.yaml:38:28: error: materials[1].stiffness is -1, must be greater than 0 and at most 1000000000000 "
      "[N/m]"}},
    {"restitution_and_dissipation",
     touching(kRule, "{name: rim, stiffness: 1, restitution: 0.5, dissipation: 1}"),
     {"scenario.yaml:38:49: error: materials[1] has both 'restitution' and 'dissipation', only one is allowed"}},
    {"hard_without_restitution",
     touching(kRule, "{name: rim, stiffness: 1, hard: true}"),
     {"scenario.yaml:38:5: error: missing key 'restitution' in materials[1], needed with hard"}},
    {"plastic_but_not_hard",
     touching(kRule, "{name: rim, stiffness: 1, restitution: 0}"),
     {"scenario.yaml:38:44: error: materials[1].restitution is 0, must be greater than 0 unless the material is hard"}},
    {"rest_speed_without_hard",
     touching(kRule, "{name: rim, stiffness: 1, rest_speed: 1 mm/s}"),
     {"scenario.yaml:38:31: error: 'rest_speed' needs 'hard' in materials[1]"}},
    {"unknown_ready_made",
     touching(kRule, "{name: rim, like: aluminum}"),
     {"scenario.yaml:38:23: error: unknown value 'aluminum' for materials[1].like; did you mean 'aluminium'?"}},
    {"friction_without_kinetic",
     touching(kRule, "{name: rim, stiffness: 1, friction: {static: 0.3}}"),
     {"scenario.yaml:38:41: error: missing key 'kinetic' in materials[1].friction"}},
    {"duplicate_material",
     touching(kRule, "{name: pad, stiffness: 1}"),
     {"scenario.yaml:38:12: error: duplicate name 'pad' in materials[1]: material names must be unique; first given in "
      "line 37"}},
    {"obstacle_named_as_a_target",
     touching(kRule, {}, "{name: ball, half_space: true}"),
     {"scenario.yaml:38:75: error: obstacles[1].name: there is a target 'ball'; obstacles need other names"}},
    {"obstacle_without_shape",
     touching(kRule, {}, "{name: wall}"),
     {"scenario.yaml:38:68: error: missing key in obstacles[1]: give 'half_space' or 'geometry'"}},
    {"obstacle_without_any_shape",
     touching(kRule, {}, "{name: wall, geometry: []}"),
     {"scenario.yaml:38:91: error: obstacles[1].geometry is empty; state a shape, or half_space: true in its place"}},
    {"obstacle_no_half_space",
     touching(kRule, {}, "{name: wall, half_space: false}"),
     {"scenario.yaml:38:93: error: obstacles[1].half_space is false; leave it out and state obstacles[1].geometry, or "
      "set it to true"}},
    {"obstacle_in_orbit",
     touching(kRule, {}, {}, "\norbit: {altitude: 400 km}"),
     {"scenario.yaml:38:1: error: obstacles: they are fixed in W, which falls with 'orbit', where an obstacle would "
      "fall as a free body; state it as a target, or leave out one of both"}},
    {"several_at_once",
     touching("{pairs: [[lower, ball], [ball, ball], [flor, lower]], material: pat}",
              "{name: rim, stiffness: 1, friction: {static: 0.3, kinetic: 0.4}}"),
     {"scenario.yaml:38:41: error: materials[1].friction: kinetic is 0.4, must be at most static, 0.3",
      "scenario.yaml:40:50: error: unknown body 'flor' in contacts.pairs[2]; did you mean 'floor'?",
      "scenario.yaml:40:75: error: unknown material 'pat' in contacts.material; did you mean 'pad'?"}},
};
INSTANTIATE_TEST_SUITE_P(Contacts, ContactsFault, testing::ValuesIn(kCases),
                         [](const auto& one) { return std::string(one.param.name); });

// In a capture, a target without a grasp must be one that contacts select.
TEST(Contacts, TargetsWithoutAGraspNeedAContact) {
  const auto faults = [](const std::string& contacts) {
    return faults_of(edited(touching(contacts), {{"grasps:",
                                                  "  - {name: other, mass: 1, inertia: [1, 1, 1], geometry: {shape: "
                                                  "sphere, radius: 0.1}, state: {position: [0, 0, 9]}}\ngrasps:"}}));
  };
  EXPECT_THAT(faults("{pairs: [[ball, other]], material: pad}"), IsEmpty());
  EXPECT_THAT(faults("{pairs: [[lower, ball]], material: pad}"),
              ElementsAre(testing::EndsWith("no grasp and no contact refers to target 'other'; add a grasp, a contact, "
                                            "or remove the target")));
}

// With stages, every error of the file keeps its place, and is reported once.
TEST(Contacts, ErrorsOfScenariosWithStagesAreReportedOnceWithTheirPlaces) {
  const std::string cubesat = bytes_of(std::filesystem::path(GRAPNEL_SOURCE_DIR) / "scenarios/cubesat-two-finger.yaml");
  const std::vector<std::pair<Edit, std::string>> cases{
      {{"speed: 0.5 mm/s", "speed: 0.5 mm"}, "stages.settled.speed is '0.5 mm', a length"},
      {{"for: 1}", "for: -1}"}, "stages.settled.for is -1, must be greater than 0 [s]"},
      {{"stages:\n", "stages:\n  gripper: [lefft]\n"}, "unknown link 'lefft' in stages.gripper[0]"},
      {{"stages:\n", "stages:\n  relative_to: buss\n"}, "unknown link 'buss' in stages.relative_to"},
      {{"link: bus, position", "link: bos, position"}, "'bos'"},
      {{"mass: 150", "mass: -1"}, "mass is -1"},
      {{"materials:\n", "materials:\n  - {name: pad, stiffness: 1}\n"}, "duplicate name 'pad' in materials[1]"},
      {{"closes_when_settled: true", "closes_when_settled: true, closes_at: 3"}, "'closes_when_settled'"},
  };
  for (const auto& [edit, message] : cases)
    EXPECT_THAT(faults_of(edited(cubesat, {edit})),
                ElementsAre(testing::AllOf(testing::StartsWith("scenario.yaml:"), HasSubstr(message))))
        << edit.second;
}

// Programs state problems without the reader: the same errors, and those that files cannot have.
TEST(Contacts, ProblemsOfProgramsAreChecked) {
  const CaptureProblem sound = read(touching(kRule));
  const auto conflicts = [&](auto change) {
    CaptureProblem p = sound;
    change(p);
    std::string all;
    for (const ProblemFault& fault : problem_conflicts(p)) all += fault.message + "\n";
    return all;
  };
  EXPECT_EQ(conflicts([](CaptureProblem&) {}), "");
  EXPECT_EQ(conflicts([](CaptureProblem& p) { p.materials[0].surface.damping = -1; }),
            "materials[0]: ContactMaterial: a value is negative or not finite\n");
  EXPECT_THAT(conflicts([](CaptureProblem& p) { p.materials[0].restitution = 2; }), HasSubstr("restitution must be"));
  EXPECT_THAT(conflicts([](CaptureProblem& p) { p.materials[0].surface.poisson_ratio = 0.7; }),
              HasSubstr("poisson_ratio must be within"));
  EXPECT_EQ(conflicts([](CaptureProblem& p) { p.contacts[0].materials = {"pat"}; }),
            "unknown material 'pat' in contacts.material; did you mean 'pad'?\n");
  EXPECT_EQ(conflicts([](CaptureProblem& p) { p.contacts[0].materials = {}; }),
            "contacts has 0 materials, must have 1 or 2\n");
  const auto built = [&](auto change) -> std::string {
    CaptureProblem p = sound;
    change(p);
    try {
      make_capture_system(p);
      return {};
    } catch (const CaptureProblemError& error) {
      return error.what();
    }
  };
  EXPECT_EQ(built([](CaptureProblem&) {}), "");
  EXPECT_EQ(built([](CaptureProblem& p) { p.contacts[0].pairs[0].second = BodyName::of_obstacle(7); }),
            "contacts: there is no obstacle 7");
  EXPECT_EQ(built([](CaptureProblem& p) { p.contacts[0].pairs[0].first = "elbow"; }), "contacts: unknown body 'elbow'");
  EXPECT_EQ(built([](CaptureProblem& p) { p.contacts[0].all = true; }),
            "contacts: give one of pairs, two groups and all");
  EXPECT_EQ(built([](CaptureProblem& p) { p.obstacles.push_back(p.obstacles[0]); }),
            "obstacles: duplicate name 'floor'");
  EXPECT_EQ(built([](CaptureProblem& p) {
              p.clearance.ignore = {{"lower", kFloor}};
            }),
            "clearance: obstacle 0 is not allowed");
}

}  // namespace contacts_test
}  // namespace grapnel::test
