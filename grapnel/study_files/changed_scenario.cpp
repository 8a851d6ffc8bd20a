#include "grapnel/study_files/changed_scenario.hpp"

#include "grapnel/scenario/mesh_files.hpp"
#include "grapnel/scenario/write_back.hpp"
#include "grapnel/text/write_yaml.hpp"
#include "grapnel/text/yaml_paths.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

bool is_inside_robot(const Change& change) {
  return change.path.starts_with("robot.") || change.path.starts_with("robot[");
}

// A file that the scenario names, as another place has to name it.
void move_path(const std::filesystem::path& scenario, const std::filesystem::path& place, Node* named) {
  if (!named || !is_text(*named) || named->text.empty()) return;
  const std::filesystem::path file = std::filesystem::absolute(path_beside(scenario, named->text));
  named->text = std::filesystem::proximate(file, std::filesystem::absolute(place).parent_path()).generic_string();
}

}  // namespace

void include_robot(Node& root, const std::filesystem::path& scenario, const ScenarioFiles& files) {
  Node* robot = root.find("robot");
  if (!robot || !is_text(*robot)) return;
  const std::filesystem::path path = path_beside(scenario, robot->text);
  const auto file = files.find(path);
  if (!file) return;
  *robot = file->tree;
  for (Node* mesh : mesh_file_nodes(*robot)) move_path(path, scenario, mesh);
}

Node changed_tree(const std::filesystem::path& scenario, std::span<const Change> changes, const ScenarioFiles& files) {
  Node root = files.find(scenario)->tree;
  FaultList unexpected;  // the changes have been applied before
  std::filesystem::path robot_file;
  for (const Change& change : changes) {
    Node* robot = root.find("robot");
    if (is_inside_robot(change) && robot && is_text(*robot)) {
      const std::filesystem::path path = path_beside(scenario, robot->text);
      if (const auto file = files.find(path)) *robot = file->tree, robot_file = path;
    }
    apply_change(root, change, unexpected);
  }
  if (Node* robot = root.find("robot"); robot && !robot_file.empty()) {
    for (Node* mesh : mesh_file_nodes(*robot)) move_path(robot_file, scenario, mesh);
  }
  return root;
}

void keep_normals(const CaptureProblem& before, StudyCase& point) {
  for (std::size_t g = 0; g < point.problem.grasps.size(); ++g) {
    const GraspSetup& grasp = point.problem.grasps[g];
    if (grasp.grasp_point == before.grasps[g].grasp_point) continue;
    for (TargetSetup& target : point.problem.targets) {
      if (target.name != grasp.target) continue;
      for (GraspPoint& one : target.grasp_points) {
        if (one.name == grasp.grasp_point && !one.normal) one.normal = -point.inward_normals[g];
      }
    }
  }
}

std::string changed_scenario_text(const std::filesystem::path& scenario, Node tree, const CaptureProblem& before,
                                  const CaptureProblem& after, const std::filesystem::path& place,
                                  const std::string& suffix, const std::string& comment) {
  write_back(before, after, tree);
  move_path(scenario, place, tree.find("robot"));
  for (Node* mesh : mesh_file_nodes(tree)) move_path(scenario, place, mesh);
  if (Node* approach = tree.find("approach")) move_path(scenario, place, approach->find("trajectory"));
  if (Node* name = tree.find("name")) {
    name->text += suffix;
    name->plain = name->plain && is_text(*name);
  }
  return yaml_text(tree, comment);
}

}  // namespace grapnel
