#include "grapnel/scenario/problem_setter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/scenario/schema.hpp"
#include "grapnel/text/parse_yaml.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_values.hpp"
#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel {
namespace campaign_setter_test {

// A scenario with changes: its tree with the schema's defaults, and the problem from the reader.
class Base {
 public:
  Base(const std::string& scenario, const std::vector<std::pair<std::string, std::string>>& set)
      : path_(std::string(GRAPNEL_SOURCE_DIR "/") + scenario) {
    FaultList faults;
    for (const auto& [path, text] : set) changes_.push_back({path, {}, *parse_value(text, {}, faults), text});
    problem = load_scenario(path_, changes_, files_);
    tree = changed_tree(path_, changes_, files_);
    include_robot(tree, path_, files_);
    given = tree;
    fill_defaults(tree, scenario_schema_document());
  }

  CaptureProblem read(const std::string& path, const Node& value) {
    std::vector<Change> changes = changes_;
    changes.push_back({path, {}, value, flow_text(value)});
    return load_scenario(path_, changes, files_);
  }

  ProblemSetter setter(const std::string& path, const Node& form) const {
    FaultList faults;
    return problem_setter(path_steps(tree, path, {}, faults), form, problem);
  }

  Node tree, given;  // with defaults and without
  CaptureProblem problem;

 private:
  std::filesystem::path path_;
  ScenarioFiles files_;
  std::vector<Change> changes_;
};

// Expects a setter that changes the problem and agrees with the reader bit for bit.
void expect_set(Base& base, const std::string& path, const std::vector<double>& numbers) {
  SCOPED_TRACE(path);
  const auto form = value_at(base.tree, path);
  ASSERT_TRUE(form);
  const ProblemSetter set = base.setter(path, *form);
  ASSERT_TRUE(set);
  CaptureProblem quick = base.problem;
  ASSERT_TRUE(set(quick, numbers));
  EXPECT_FALSE(problem_bytes(quick) == problem_bytes(base.problem));
  EXPECT_TRUE(problem_bytes(quick) == problem_bytes(base.read(path, with_numbers(*form, numbers, {}))));
}

void expect_set(Base& base, const std::string& path, double factor = 1.001953125, double offset = 0) {
  std::vector<double> numbers = *numbers_in(*value_at(base.tree, path));
  for (double& x : numbers) x = x * factor + offset;
  expect_set(base, path, numbers);
}

Base thesis() {
  return {"scenarios/thesis/open-loop-case-1.yaml",
          {{"approach.tracking.noise", "{position: 1e-3, bandwidth: 2, seed: 7}"},
           {"targets[0].com", "[0.01, 0.02, 0.03]"},
           {"targets[0].inertia", "{xx: 1, yy: 1.1, zz: 1.2, xy: 0.1, xz: 0, yz: 0}"},
           {"targets[0].state.quaternion_wxyz", "[0.6, 0, 0.8, 0]"},
           {"targets[0].state.velocity", "[0.01, 0.02, 0.03]"},
           {"targets[0].grasp_points[0].quaternion_wxyz", "[0.8, 0.6, 0, 0]"},
           {"initial.base",
            "{position: [1, 2, 3], quaternion_wxyz: [1, 0, 0, 0], velocity: [0.1, 0, 0], "
            "angular_velocity: [0, 0, 0.1]}"},
           {"approach.final_rates", "[0.01, 0.02, 0.03, 0.04, 0.05, 0.06]"},
           {"robot.links[0].joint.friction", "{viscous: 0.1, coulomb: 0.2}"},
           {"integration", "{relative_tolerance: 1e-9, absolute_tolerance: 1e-10}"}}};
}

TEST(ProblemSetter, MatchesTheReader) {
  Base base = thesis();
  for (const char* path : {"targets.target-1.mass",
                           "targets.target-1.com",
                           "targets.target-1.com[1]",
                           "targets.target-1.inertia",
                           "targets.target-1.inertia.xx",
                           "targets.target-2.inertia",
                           "targets.target-2.inertia[2]",
                           "targets.target-1.state.position",
                           "targets.target-1.state.position[0]",
                           "targets.target-1.state.velocity",
                           "targets.target-1.state.angular_velocity",
                           "targets.target-1.state.angular_velocity[2]",
                           "targets.target-1.grasp_points.grip.position",
                           "targets.target-1.grasp_points.grip.position[1]",
                           "initial.joints",
                           "initial.joints.arm-2-joint-1",
                           "initial.base.position",
                           "initial.base.velocity",
                           "initial.base.angular_velocity",
                           "robot.base.mass",
                           "robot.base.inertia",
                           "robot.links.arm-1-link-1.mass",
                           "robot.links.arm-1-link-1.com",
                           "robot.links.arm-1-link-1.inertia",
                           "robot.links.arm-1-link-1.joint.friction.viscous",
                           "robot.links.arm-1-link-1.joint.friction.coulomb",
                           "approach.final_joints",
                           "approach.final_joints.arm-1-joint-2",
                           "approach.final_rates",
                           "approach.final_rates[3]",
                           "approach.tracking.kp",
                           "approach.tracking.kd",
                           "approach.tracking.noise.position",
                           "approach.tracking.noise.bandwidth",
                           "impact.duration",
                           "integration.relative_tolerance",
                           "integration.absolute_tolerance"}) {
    expect_set(base, path);
  }
  expect_set(base, "approach.tracking.noise.seed", 1, 5);
  expect_set(base, "targets.target-2.com", 1, 0.01);
  expect_set(base, "gravity", 1, 0.25);
  // Quaternions must have length 1 within 1e-6; the setter and the reader normalise them equally.
  const std::vector<double> q{0.5, 0.5, -0.5, 0.5 + 1e-7};
  for (const char* path : {"targets.target-1.state.quaternion_wxyz",
                           "targets.target-1.grasp_points.grip.quaternion_wxyz", "initial.base.quaternion_wxyz"})
    expect_set(base, path, q);
}

TEST(ProblemSetter, OfContacts) {
  Base base{
      "scenarios/thesis/open-loop-case-1.yaml",
      {{"materials",
        "[{name: pad, stiffness: 2e4, damping: 50, restitution: 0.5, friction: {static: 0.4, kinetic: 0.3}}, "
        "{name: rim, youngs_modulus: 7e10, poisson_ratio: 0.3, dissipation: 0.1, friction: 0.2}]"},
       {"obstacles", "[{name: post, geometry: {shape: sphere, radius: 0.1}, position: [9, 9, 0], rpy: [0, 0, 0.1]}]"},
       {"contacts", "{all: true, material: pad}"}}};
  for (const char* path :
       {"materials.pad.stiffness", "materials[0].damping", "materials.pad.friction.kinetic", "materials.pad.friction",
        "materials.rim.youngs_modulus", "materials.rim.poisson_ratio", "materials.rim.dissipation",
        "materials.rim.friction", "materials.pad.restitution", "obstacles.post.position", "obstacles.post.position[1]",
        "obstacles.post.rpy", "obstacles.post.geometry.radius"})
    expect_set(base, path);
}

TEST(ProblemSetter, OfImpactLaws) {
  Base contact("scenarios/contact-rebound.yaml", {});
  expect_set(contact, "impact.restitution", 0.9375);
  expect_set(contact, "impact.friction", 1.125);
  Base compliant("scenarios/compliant-grip.yaml", {});
  expect_set(compliant, "impact.grasp.linear_stiffness");
  expect_set(compliant, "impact.grasp.linear_damping");
  expect_set(compliant, "impact.grasp.angular_stiffness");
  expect_set(compliant, "impact.grasp.angular_damping");
  Base momentum("scenarios/thesis/open-loop-case-1.yaml",
                {{"initial.base.momentum", "{linear: [1, 2, 3], angular: [0.1, 0.2, 0.3]}"},
                 {"contact", "{gap: refuse, limit: 1, largest_gap: 2}"}});
  expect_set(momentum, "initial.base.momentum.linear");
  expect_set(momentum, "initial.base.momentum.angular[1]");
  expect_set(momentum, "contact.limit");
  expect_set(momentum, "contact.largest_gap");
}

// The setter declines values that the reader may reject.
TEST(ProblemSetter, LeavesDoubtfulValuesToTheReader) {
  const Base base = thesis();
  const auto refuses = [&](const std::string& path, const std::vector<double>& numbers) {
    const auto form = value_at(base.tree, path);
    const ProblemSetter set = base.setter(path, *form);
    ASSERT_TRUE(set) << path;
    CaptureProblem problem = base.problem;
    EXPECT_FALSE(set(problem, numbers)) << path;
  };
  refuses("targets.target-1.mass", {0});
  refuses("targets.target-1.mass", {-1});
  refuses("targets.target-1.mass", {NAN});
  refuses("targets.target-1.mass", {1, 2});
  refuses("targets.target-1.com", {1, 2, HUGE_VAL});
  refuses("targets.target-2.inertia", {1, 1, 3});
  refuses("targets.target-1.inertia.xx", {-1});
  refuses("targets.target-1.state.quaternion_wxyz", {1, 0, 0, 0.01});
  refuses("approach.tracking.noise.seed", {0.5});
  refuses("approach.tracking.noise.seed", {-1});
  refuses("approach.tracking.noise.position", {-1e-3});
  refuses("integration.relative_tolerance", {0});
}

// There is no setter for values that must agree with other keys or have no meaning alone.
TEST(ProblemSetter, KnowsItsLimits) {
  const Base base = thesis();
  for (const char* path : {"targets.target-1.state.quaternion_wxyz[0]", "initial.joint_rates", "name"}) {
    const auto form = value_at(base.tree, path);
    EXPECT_FALSE(base.setter(path, form.value_or(number_node(1)))) << path;
  }
}

struct Place {
  std::string path;
  const Node* value;
};

// All numbers of a tree, and all lists and mappings of numbers.
void collect_numbers(const Node& node, const std::string& path, std::vector<Place>& places) {
  if (numbers_in(node)) places.push_back({path, &node});
  for (std::size_t i = 0; i < node.items.size(); ++i)
    collect_numbers(node.items[i], path + "[" + std::to_string(i) + "]", places);
  for (const NodeEntry& entry : node.entries)
    collect_numbers(entry.value, path.empty() ? entry.key : path + "." + entry.key, places);
}

// Whether a changed number requires reading the scenario again: a part of an orientation, a matrix, a piecewise motion,
// the instants of a table, an actuator array, a value that must agree with other keys.
bool is_left_to_the_reader(const std::string& path, const CaptureProblem& problem) {
  const auto has = [&](const char* part) { return path.find(part) != std::string::npos; };
  const bool is_stated = problem.approach && (problem.approach->sampled || !problem.approach->pieces.empty());
  return has("_array.") || has("quaternion_wxyz[") || has("rpy[") || has(".pieces[") || has("].time.values[") ||
         has("inertia[") || (is_stated && (has("initial.joint") || path == "approach.duration" || has(".limits")));
}

// Every number of every shipped scenario can be set in place and gives the same problem as the reader.
TEST(ProblemSetter, OfEveryNumberShipped) {
  SKIP_UNDER_SANITIZERS();
  std::size_t count = 0, set_in_place = 0;
  std::set<std::string> seen;
  for (const std::filesystem::path& file : test::shipped_scenarios()) {
    const std::string name = std::filesystem::relative(file, GRAPNEL_SOURCE_DIR).string();
    SCOPED_TRACE(name);
    Base base(name, {});
    std::vector<Place> places;
    collect_numbers(base.tree, "", places);
    for (const auto& [path, value] : places) {
      SCOPED_TRACE(path);
      const bool is_part_of_default = path.ends_with("]") && !value_at(base.given, path);
      if (is_left_to_the_reader(path, base.problem) || is_part_of_default) continue;
      const Node& form = *value;  // value_at() copies the tree
      const ProblemSetter set = base.setter(path, form);
      if (!set) {
        EXPECT_THROW(base.read(path, form), InputError);
        continue;
      }
      ++count;
      // Every key of every file, but only some of the paths that differ by an index.
      std::string kind = path;
      std::erase_if(kind, [](char c) { return c >= '0' && c <= '9'; });
      if (!seen.insert(kind + (count % 7 == 0 ? name : "")).second) continue;
      std::vector<double> numbers = *numbers_in(form);
      for (double& x : numbers) x = x == std::floor(x) && std::abs(x) > 1 ? x - 1 : x * 0.998046875;
      CaptureProblem quick = base.problem;
      const bool done = set(quick, numbers);
      set_in_place += done;
      if (!done) continue;
      EXPECT_TRUE(problem_bytes(quick) == problem_bytes(base.read(path, with_numbers(form, numbers, {}))));
    }
  }
  EXPECT_GT(count, 3000);
  EXPECT_GT(set_in_place, 300);
}

}  // namespace campaign_setter_test
}  // namespace grapnel
