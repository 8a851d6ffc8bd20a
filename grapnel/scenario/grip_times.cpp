#include "grapnel/scenario/grip_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// Releases while they are read.
class ReleaseReader {
 public:
  explicit ReleaseReader(Reading& reading) : reading_(reading), faults_(reading.faults) {
    const NameTable& known = reading.robot.end_effectors;
    for (const GraspSetup& grasp : reading.problem.grasps) {
      doubtful_ = doubtful_ || !known.contains(grasp.end_effector);
      if (known.contains(grasp.end_effector)) grippers_.push_back(grasp.end_effector);
    }
    doubtful_ = doubtful_ || grippers_.empty();  // grasps are missing or no list, which is a fault of its own
  }

  PostImpactSetup::Release read(const Node& node, std::size_t index) {
    const std::string path = item("post_impact.release", index);
    PostImpactSetup::Release release;
    read_members(node, "post_impact.release", &release);
    for (const Node& name : part(node, "end_effectors").items) {
      if (!is_text(name) || name.text.empty()) continue;
      check_name(name, index, path);
      release.end_effectors.push_back(name.text);
    }
    return release;
  }

 private:
  void check_name(const Node& name, std::size_t index, const std::string& path) {
    const std::string here = below(path, "end_effectors");
    if (!reading_.robot.end_effectors.expect(name.text, name.mark, here, faults_)) return;
    const auto [first, fresh] = release_of_.emplace(name.text, index);
    if (!fresh) {
      faults_.add(name.mark, first->second == index
                                 ? fmt::format("{} names {} twice", here, in_quotes(name.text))
                                 : fmt::format("end-effector {} in {} has let go before, in {}", in_quotes(name.text),
                                               here, item("post_impact.release", first->second)));
      return;
    }
    const auto& grasps = reading_.problem.grasps;
    const auto grasp =
        std::find_if(grasps.begin(), grasps.end(), [&](const GraspSetup& g) { return g.end_effector == name.text; });
    if (grasp == grasps.end()) {
      if (doubtful_) return;
      faults_.add(name.mark, fmt::format("end-effector {} in {} grips nothing{}", in_quotes(name.text), here,
                                         suggestion(name.text, grippers_, "grips")));
    }
  }

  Reading& reading_;
  FaultList& faults_;
  std::vector<std::string> grippers_;
  bool doubtful_ = false;
  std::map<std::string, std::size_t, std::less<>> release_of_;  // by end-effector
};

}  // namespace

void read_closing(const Node& node, const std::string& path, GraspSetup& grasp, Reading& reading) {
  if (node.find("closes_at")) {
    grasp.closes = GraspSetup::Closes::at_time;
  } else if (boolean_at(node, "closes_on_arrival")) {
    grasp.closes = GraspSetup::Closes::on_arrival;
    const EndEffectorSetup* end_effector = end_effector_named(reading, grasp.end_effector);
    if (!end_effector || end_effector->envelope) return;
    reading.faults.add(part(node, "closes_on_arrival").mark,
                       fmt::format("{}.closes_on_arrival needs an 'envelope' at end-effector {}", path,
                                   in_quotes(end_effector->name)));
  }
}

void read_releases(const Node& post_impact, Reading& reading) {
  const Node& list = part(post_impact, "release");
  ReleaseReader reader(reading);
  for (std::size_t i = 0; i < list.items.size() && !reading.faults.full(); ++i) {
    reading.problem.post_impact->releases.push_back(reader.read(list.items[i], i));
  }
}

}  // namespace grapnel
