// A damaged file is accepted or rejected with an InputError; no other exception is allowed.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <sstream>

#include "scenario/scenario_files.hpp"
#include "support/sanitizers.hpp"

namespace grapnel::test {
namespace mutation_test {

using Random = std::mt19937_64;

// GRAPNEL_TEST_SEED, or a fixed seed.
std::uint64_t seed() {
  const char* text = std::getenv("GRAPNEL_TEST_SEED");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : 20240607;
}

std::size_t below(Random& random, std::size_t limit) { return static_cast<std::size_t>(random() % limit); }

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line + "\n");
  return lines;
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += line;
  return text;
}

// The text with one small random error.
std::string damaged(std::string text, Random& random) {
  if (text.empty()) return text;
  static const std::vector<std::string> kFragments{"[",        "]",
                                                   "{",        "}",
                                                   ":",        "- ",
                                                   "&a ",      "*a",
                                                   "!!str ",   "\"",
                                                   "'",        "|",
                                                   ">",        "#",
                                                   "\n",       "  ",
                                                   "\t",       ".nan",
                                                   "-.inf",    "1e308",
                                                   "-1e308",   "1e-320",
                                                   "010",      "0x1",
                                                   "~",        "null",
                                                   "true",     "%",
                                                   "---\n",    "...\n",
                                                   "?",        "<<: *a",
                                                   "\xc3\xa9", "\xff",
                                                   ",",        "0",
                                                   "-",        "99999999999999999999"};
  const std::size_t at = below(random, text.size());
  switch (below(random, 8)) {
    case 0:
      text[at] = static_cast<char>(random() & 0xff);
      return text;
    case 1:
      text[at] = static_cast<char>(text[at] ^ (1 << below(random, 8)));
      return text;
    case 2:
      return text.substr(0, at);
    case 3:
      return text.erase(at, 1 + below(random, 20));
    case 4:
      return text.insert(at, kFragments[below(random, kFragments.size())]);
    default:
      break;
  }
  std::vector<std::string> lines = lines_of(text);
  const std::size_t a = below(random, lines.size()), b = below(random, lines.size());
  switch (below(random, 3)) {
    case 0:
      lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(b), lines[a]);
      break;
    case 1:
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(a));
      break;
    default:
      std::swap(lines[a], lines[b]);
      break;
  }
  return joined(lines);
}

struct Tally {
  int accepted = 0, refused = 0;
};

template <class Load>
void try_to(Load load, const std::string& text, Tally& tally) {
  try {
    load();
    ++tally.accepted;
  } catch (const InputError& error) {
    ++tally.refused;
    EXPECT_FALSE(error.faults().empty());
    EXPECT_EQ(std::string(error.what()).find("error: "), std::string(error.what()).find(": error: ") + 2)
        << error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << "another exception: " << error.what() << "\n" << text;
  }
}

// A scenario with the keys that kSmallScenario omits.
std::string rich_scenario() {
  return edited(kSmallScenario,
                {{"    grasp_points",
                  "    geometry: [{shape: sphere, radius: 0.5}, {shape: box, size: [1, 2, 3]}]\n"
                  "    grasp_points"},
                 with_tip("approach_axis: [1, 0, 0], envelope: {position: 0.1, angle: 0.2}"),
                 with_point("approach_direction: [0, -1, 0]"),
                 with_grasp("orientation: axis"),
                 with_motion("profile: quintic\n  plan: {objective: nearest, guess: [0, 0], starts: 3, seed: 1}\n"
                             "  straight_in: {stand_off: 0.5, duration: 4, final_speed: 0.02}\n"
                             "  waypoints:\n"
                             "    - {time: 5, joints: {shoulder: 0.3, elbow: 0.4}, rates: {elbow: 0.5}}\n"
                             "    - {time: 9, end_effectors: {tip: {position: [1, 2, 3], target: ball}}}\n"
                             "  tracking: {mode: computed_torque, kp: 1, kd: [2, 3], noise: {position: 1e-3}}\n"
                             "  base_control: {kp: 4, kd: [5, 6, 7], limit: 8, rpy: [0, 0, 0.3]}\n"
                             "  capture_at: envelope"),
                 with_post_impact("base_control: {kp: 1, kd: 1}"),
                 with_wrench("{body: base, force: [1, 0, 0], time: {shape: sine, frequency: 1}}\n"
                             "  - target: ball\n"
                             "    time: {shape: table, values: [[0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0, 0]]}\n"
                             "clearance: {required: 0.1, ignore: [[base, upper], [lower, ball]]}")});
}

TEST(Mutation, OnlySuccessOrInputError) {
  SKIP_UNDER_SANITIZERS();  // the fuzzer covers damaged files there
  const TemporaryFolder folder;
  Random random(seed());
  std::vector<std::string> originals{kSmallScenario, rich_scenario()};
  EXPECT_TRUE(faults_of(originals[1]).empty());
  for (const auto& path : shipped_scenarios()) originals.push_back(bytes_of(path));
  for (const auto& path : shipped_robots()) originals.push_back(bytes_of(path));
  // Folders in which the shipped scenarios find their robots.
  std::filesystem::create_directories(folder.path() / "scenarios" / "thesis");
  for (const char* place : {"robots", "scenarios/robots"}) {
    std::filesystem::create_directories(folder.path() / place);
    for (const auto& path : shipped_robots()) std::filesystem::copy(path, folder.path() / place);
  }
  Tally tally;
  for (int i = 0; i < 4000; ++i) {
    // Half of the mutations use the small scenarios, which contain their robot inline.
    std::string text = originals[i % 2 == 0 ? static_cast<std::size_t>(i / 2 % 2) : below(random, originals.size())];
    const std::size_t damages = i % 3 == 0 ? 3 : 1;
    for (std::size_t k = 0; k < damages; ++k) text = damaged(std::move(text), random);
    const auto path = folder.write("scenarios/thesis/mutant.yaml", text);
    std::vector<Fault> warnings;
    try_to([&] { load_scenario(path, {}, &warnings); }, text, tally);
    if (i % 4 == 0) try_to([&] { load_robot(path); }, text, tally);
    if (HasFailure()) return;
  }
  // Both outcomes must occur; otherwise the damage is too large or too small for a test.
  EXPECT_GT(tally.accepted, 100);
  EXPECT_GT(tally.refused, 1000);
}

TEST(Mutation, OverridesToo) {
  SKIP_UNDER_SANITIZERS();  // the fuzzer covers damaged files there
  const TemporaryFolder folder;
  const auto path = folder.write("scenario.yaml", kSmallScenario);
  Random random(seed());
  const std::vector<std::string> originals{"approach.duration=10",
                                           "targets[0].mass=12",
                                           "targets.ball.state.position=[1, 2, 3]",
                                           "robot.links.upper.mass=3",
                                           "approach.final_rates={match: twist}",
                                           "initial.joints={shoulder: 0.1, elbow: 0.2}"};
  Tally tally;
  for (int i = 0; i < 3000; ++i) {
    const std::string argument = damaged(originals[below(random, originals.size())], random);
    try_to(
        [&] {
          const std::vector<Override> overrides{parse_override(argument)};
          load_scenario(path, overrides);
        },
        argument, tally);
    if (HasFailure()) return;
  }
  EXPECT_GT(tally.accepted, 100);
  EXPECT_GT(tally.refused, 100);
}

}  // namespace mutation_test
}  // namespace grapnel::test
