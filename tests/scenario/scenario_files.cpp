#include "scenario/scenario_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <sstream>

#include "support/fault_texts.hpp"

namespace grapnel::test {

const char* const kSmallScenario = R"(name: test
robot:
  name: arm
  base: {mass: 100, inertia: [10, 10, 10]}
  links:
    - name: upper
      parent: base
      joint: {name: shoulder, type: revolute, axis: [0, 0, 1], limits: {lower: -2, upper: 2, rate: 1}}
      mass: 5
      com: [0.5, 0, 0]
      inertia: [0.1, 0.5, 0.5]
    - name: lower
      parent: upper
      joint: {name: elbow, type: revolute, axis: [0, 0, 1], origin: {position: [1, 0, 0]}}
      mass: 5
      inertia: [0.1, 0.5, 0.5]
  end_effectors:
    - {name: tip, link: lower, position: [1, 0, 0]}
initial:
  joints: {shoulder: 0.5, elbow: 1}
targets:
  - name: ball
    mass: 10
    inertia: [1, 1, 1]
    state: {position: [2, 0, 0], angular_velocity: [0, 0, 0.2]}
    grasp_points:
      - {name: grip, position: [0, 0.5, 0]}
grasps:
  - {end_effector: tip, target: ball, point: grip}
approach:
  duration: 20
  final_joints: [0.2, -0.4]
  final_rates: {match: velocity}
impact: {duration: 1e-3}
post_impact: {duration: 10}
)";

std::string small_robot() {
  std::istringstream lines(kSmallScenario);
  std::string robot;
  bool inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (line[0] != ' ')
      inside = line == "robot:";
    else if (inside)
      robot += line.substr(2) + "\n";
  }
  return robot;
}

std::filesystem::path TemporaryFolder::write(const std::string& name, std::string_view bytes) const {
  std::ofstream file(path() / name, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return path() / name;
}

std::string edited(std::string text, const std::vector<std::pair<std::string, std::string>>& edits) {
  for (const auto& [from, to] : edits) {
    const std::size_t at = text.find(from);
    if (at == std::string::npos) throw std::logic_error("not in the text: " + from);
    if (text.find(from, at + 1) != std::string::npos) throw std::logic_error("twice in the text: " + from);
    text.replace(at, from.size(), to);
  }
  return text;
}

namespace {
// A mapping in braces with further keys.
Edit with_keys(const std::string& mapping, const std::string& keys) {
  return {mapping, mapping.substr(0, mapping.size() - 1) + ", " + keys + "}"};
}
}  // namespace

Edit with_tip(const std::string& keys) { return with_keys("{name: tip, link: lower, position: [1, 0, 0]}", keys); }
Edit with_point(const std::string& keys) { return with_keys("{name: grip, position: [0, 0.5, 0]}", keys); }
Edit with_grasp(const std::string& keys) { return with_keys("{end_effector: tip, target: ball, point: grip}", keys); }
Edit with_post_impact(const std::string& keys) { return with_keys("{duration: 10}", keys); }
Edit with_approach(const std::string& line) { return {"\nimpact:", "\n  " + line + "\nimpact:"}; }
Edit with_top(const std::string& line) { return {"\nimpact:", "\n" + line + "\nimpact:"}; }
Edit with_wrench(const std::string& wrench) { return with_top("external_wrenches:\n  - " + wrench); }
Edit with_motion(const std::string& lines) {
  return {"  final_joints: [0.2, -0.4]\n  final_rates: {match: velocity}", "  " + lines};
}

std::vector<std::string> faults_of_file(const std::filesystem::path& path, const std::vector<Override>& overrides) {
  return faults_of_loading(path, [&](const auto& file) { load_scenario(file, overrides); });
}

std::vector<std::string> faults_of(std::string_view text, const std::vector<Override>& overrides) {
  const TemporaryFolder folder;
  return faults_of_file(folder.write("scenario.yaml", text), overrides);
}

std::vector<std::string> warnings_of(std::string_view text, const std::vector<Override>& overrides) {
  const TemporaryFolder folder;
  std::vector<Fault> warnings;
  load_scenario(folder.write("scenario.yaml", text), overrides, &warnings);
  std::vector<std::string> result;
  for (Fault doubt : warnings) {
    if (doubt.file.starts_with(folder.path().string())) doubt.file.erase(0, folder.path().string().size() + 1);
    result.push_back(doubt.text());
  }
  return result;
}

std::vector<std::string> robot_faults_of(std::string_view text) {
  const TemporaryFolder folder;
  return faults_of_loading(folder.write("robot.yaml", text), [](const auto& file) { load_robot(file); });
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

namespace {
std::vector<std::filesystem::path> yaml_files_below(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry :
       std::filesystem::recursive_directory_iterator(std::filesystem::path(GRAPNEL_SOURCE_DIR) / folder)) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}
}  // namespace

std::vector<std::filesystem::path> shipped_robots() { return yaml_files_below("robots"); }
std::vector<std::filesystem::path> shipped_scenarios() { return yaml_files_below("scenarios"); }

}  // namespace grapnel::test
