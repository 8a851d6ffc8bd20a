// Conflicts of the stages of captures by contacts.
#include <set>
#include <stdexcept>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/stage_pairs.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

class StageConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void check() {
    const std::size_t before = found_.size();
    for (std::size_t i = 0; i < problem_.stages.size(); ++i) check_stages(problem_.stages[i], path_of(i));
    check_grasps();
    // The pairs need a problem without other faults.
    if (found_.size() == before && found_.empty() && !problem_.stages.empty()) check_pairs();
  }

 private:
  std::string path_of(std::size_t i) const {
    return problem_.stages.size() == 1 ? "stages" : fmt::format("stages[{}]", i);
  }

  void check_stages(const StagesSetup& stages, const std::string& path) {
    check_target(stages, path);
    for (const auto& [key, value] :
         {std::pair{"speed", stages.speed}, std::pair{"rate", stages.rate}, std::pair{"for", stages.time}}) {
      if (!(value > 0) || !std::isfinite(value))
        add(fmt::format("{}.settled.{}", path, key), "{}.settled.{} is {}, must be positive", path, key, value)
            .relies_on = path + ".settled";
    }
    if (problem_.contacts.empty())
      add_key(path, "{}: without 'contacts' no gripper touches a target; state 'contacts', or leave out 'stages'",
              path);
    const bool has_phase = problem_.post_impact.any([&](const auto& phase) { return phase.name == stages.closing; });
    if (!stages.closing.empty() && !has_phase)
      add(path + ".closing", "{}.closing: there is no phase of motion {}; name a phase of '{}'", path,
          in_quotes(stages.closing), phases_key(problem_));
    for (const std::string& link : stages.gripper) check_link(link, path + ".gripper");
    if (!stages.relative_to.empty()) check_link(stages.relative_to, path + ".relative_to");
  }

  void check_target(const StagesSetup& stages, const std::string& path) {
    if (stages.target.empty() && problem_.targets.size() != 1) {
      add_key(path, "{}: 'target' is needed, since there {}", path,
              problem_.targets.empty() ? "is none" : "are several");
      return;
    }
    if (!stages.target.empty() && !find_named(problem_.targets, stages.target)) {
      add(path + ".target", "{}.target: there is no target {}", path, in_quotes(stages.target)).relies_on =
          path + ".target";
      return;
    }
    const std::string& name = stages.target.empty() ? problem_.targets[0].name : stages.target;
    if (!seen_.insert(name).second) add_key(path, "{}: target {} has stages already", path, in_quotes(name));
  }

  void check_link(const std::string& link, const std::string& path) {
    if (!find_named(problem_.robot.bodies, link))
      add(path, "{}: there is no link {}", path, in_quotes(link)).relies_on = path;
  }

  void check_grasps() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.closes != GraspSetup::Closes::when_settled) continue;
      const std::string path = fmt::format("grasps[{}].closes_when_settled", i);
      const bool any = std::ranges::any_of(problem_.stages, [&](const StagesSetup& stages) {
        return stages.target.empty() || stages.target == grasp.target;
      });
      if (!any)
        add(path, "{} needs 'stages' of target {}, which state when it is settled", path, in_quotes(grasp.target))
            .relies_on = "stages";
      if (grasp.contact) add(path, "{}: a contact does not hold; leave out 'contact'", path);
      if (!problem_.post_impact)
        add(path, "{} needs 'post_impact': targets settle in the motion after the approach", path);
    }
  }

  void check_pairs() {
    std::vector<ContactPair> pairs;
    try {
      pairs = contact_pairs(problem_, make_capture_system(problem_));
    } catch (const std::logic_error&) {
      return;  // errors of robot, targets or names, which the reader and simulate_capture() report
    }
    for (std::size_t i = 0; i < problem_.stages.size(); ++i) {
      if (!stage_pairs(problem_, problem_.stages[i], pairs).empty()) continue;
      add_key(path_of(i), "{}: by 'contacts' no link of the gripper may touch target {}", path_of(i),
              in_quotes(problem_.targets[stage_target(problem_, problem_.stages[i])].name));
    }
  }

  std::set<std::string> seen_;
};

}  // namespace

void find_stage_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  StageConflicts(problem, found).check();
}

std::size_t stage_target(const CaptureProblem& problem, const StagesSetup& stages) {
  return stages.target.empty() ? 0 : target_index(problem, stages.target);
}

std::vector<std::size_t> stage_pairs(const CaptureProblem& problem, const StagesSetup& stages,
                                     const std::vector<ContactPair>& pairs) {
  const std::size_t target = stage_target(problem, stages);
  const auto in_gripper = [&](const BodyName& body) {
    if (body.target || body.obstacle) return false;
    return stages.gripper.empty() || std::ranges::find(stages.gripper, body.name) != stages.gripper.end();
  };
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const ContactPair& pair = pairs[i];
    if ((pair.a.target == target && in_gripper(pair.b)) || (pair.b.target == target && in_gripper(pair.a)))
      found.push_back(i);
  }
  return found;
}

}  // namespace grapnel
