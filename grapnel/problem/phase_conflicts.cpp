// Conflicts of the sequence of phases after the approach: names, end conditions, and phases that need a capture.
#include <cmath>
#include <map>

#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/problem/enumeration_names.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// Names of other parts of a run in results.
constexpr std::string_view kReserved[] = {"approach", "contact", "brake", kPlanning};

class PhaseConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void find() {
    if (problem_.post_impact.empty()) return;
    if (!problem_.impact && !problem_.grasps.empty())
      add_key("motion", "motion is for scenarios without grasps: after a capture, give 'impact' and 'post_impact'");
    for (std::size_t k = 0; k < problem_.post_impact.size(); ++k) {
      const PostImpactSetup& phase = problem_.post_impact[k];
      const std::string place = place_of(k);
      check_name(k, place);
      if (phase.until) check_until(phase, *phase.until, place + ".until");
      if (k > 0) check_knowledge(phase, place);
      if (!problem_.impact) check_without_capture(phase, place);
    }
  }

 private:
  std::string place_of(std::size_t k) const {
    const std::string key = phases_key(problem_);
    return problem_.post_impact.size() > 1 ? fmt::format("{}[{}]", key, k) : key;
  }

  // Names must be unique, since they are keys in results.
  void check_name(std::size_t k, const std::string& place) {
    const std::string name = phase_name(problem_, k);
    for (const std::string_view other : kReserved) {
      if (name == other) add(place + ".name", "{}.name is {}, a reserved name; choose another", place, in_quotes(name));
    }
    for (std::size_t before = 0; before < k; ++before) {
      if (phase_name(problem_, before) != name) continue;
      add(problem_.post_impact[k].name.empty() ? place : place + ".name",
          "{}.name is {}, as that of {}: names of phases must differ", place, in_quotes(name), place_of(before));
      return;
    }
  }

  // Checks that the quantities of an end condition exist.
  void check_until(const PostImpactSetup& phase, const PhaseUntil& until, const std::string& place) {
    const auto refuse = [&](const char* key, const std::string& why) {
      add_key(fmt::format("{}.{}", place, key), "{}.{}: {}", place, key, why);
    };
    if (until.base_rate && problem_.robot.base_mode == RobotSetup::Base::fixed)
      refuse("base_rate", "the robot's base is fixed and does not turn");
    for (const auto& [given, key] : {std::pair{until.target_rate.has_value(), "target_rate"},
                                     std::pair{until.relative_rate.has_value(), "relative_rate"}}) {
      if (given && problem_.targets.empty()) refuse(key, "there are no targets");
    }
    if (until.joint_rate && problem_.joint_position.empty()) refuse("joint_rate", "the robot has no driven joints");
    if (until.wheel_momentum_below) check_wheels("wheel_momentum_below", place);
    if (until.wheel_momentum_above) check_wheels("wheel_momentum_above", place);
    if (until.event == PhaseUntil::Event::law_ended && !is_law(phase.joints))
      refuse("event",
             fmt::format("requires joints with a law that ends, such as detumble; they are {}", name_of(phase.joints)));
    const auto waits = [](const GraspSetup& grasp) { return grasp.closes == GraspSetup::Closes::when_settled; };
    if (until.event == PhaseUntil::Event::latched && std::ranges::none_of(problem_.grasps, waits))
      refuse("event", "requires a grasp with closes_when_settled");
  }

  void check_wheels(const char* key, const std::string& place) {
    if (problem_.robot.wheels.empty()) {
      add_key(fmt::format("{}.{}", place, key), "{}.{}: the robot has no wheels", place, key);
      return;
    }
    for (const WheelSetup& wheel : problem_.robot.wheels) {
      if (std::isfinite(wheel.rate)) continue;
      add_key(fmt::format("{}.{}", place, key),
              "{}.{}: wheel {} has no maximum rate ('rate' in the robot file), so its momentum is unlimited", place,
              key, in_quotes(wheel.name));
      return;
    }
  }

  // The knowledge of a held target is stated once.
  void check_knowledge(const PostImpactSetup& phase, const std::string& place) {
    for (const auto& [given, key] :
         {std::pair{phase.assumed.has_value(), "assumed"}, std::pair{phase.identify.has_value(), "identify"},
          std::pair{phase.model.has_value(), "model"}}) {
      if (given) add_key(fmt::format("{}.{}", place, key), "{}.{} is allowed only in the first phase", place, key);
    }
  }

  void check_without_capture(const PostImpactSetup& phase, const std::string& place) {
    const auto refuse = [&](const char* key) {
      add_key(fmt::format("{}.{}", place, key), "{}.{} needs a held target, but the scenario has no capture", place,
              key);
    };
    using Joints = PostImpactSetup::Joints;
    if (phase.joints == Joints::detumble || phase.joints == Joints::grasp_force)
      add(place + ".joints", "{}.joints is {}, which needs a held target, but the scenario has no capture", place,
          name_of(phase.joints));
    if (phase.assumed) refuse("assumed");
    if (phase.identify) refuse("identify");
    if (phase.model) refuse("model");
    if (!phase.releases.empty()) refuse("release");
  }
};

}  // namespace

void find_phase_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  PhaseConflicts(problem, found).find();
}

}  // namespace grapnel
