#include "grapnel/api/scenario.hpp"

#include "grapnel/campaign/changed_scenario.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/result/atomic_file.hpp"
#include "grapnel/scenario/scenario_files.hpp"

namespace grapnel {

Servicer servicer_of(const CaptureProblem& problem) {
  CaptureSystem system = make_moving_servicer(problem);
  Servicer servicer{{}, initial_servicer_state(problem, system), system.base, {}, system.end_effectors};
  for (const int joint : system.robot_joints) servicer.joints.push_back(system.model.joints()[joint]);
  servicer.model = std::move(system.model);
  return servicer;
}

void save_scenario(const std::filesystem::path& scenario, std::span<const Override> overrides,
                   const std::filesystem::path& file) {
  FaultList faults;
  const std::vector<Change> changes = changes_of(overrides, faults);
  faults.throw_if_any();
  ScenarioFiles files;
  const CaptureProblem problem = load_scenario(scenario, changes, files);
  write_file_atomically(
      file, changed_scenario_text({scenario, changed_tree(scenario, changes, files), problem}, problem, file, {}, {}));
}

}  // namespace grapnel
