// Conflicts of the times at which grasps close, and of the limits of what they hold.
#include <cmath>

#include "grapnel/problem/conflict_finder.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

class GraspConflicts : ConflictFinder {
 public:
  using ConflictFinder::ConflictFinder;

  void find() {
    check_closing();
    check_holding();
  }

 private:
  void check_closing() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.closes == GraspSetup::Closes::together) continue;
      const bool at_time = grasp.closes == GraspSetup::Closes::at_time;
      const bool on_arrival = grasp.closes == GraspSetup::Closes::on_arrival;
      const std::string path = fmt::format("grasps[{}].{}", i,
                                           at_time      ? "closes_at"
                                           : on_arrival ? "closes_on_arrival"
                                                        : "closes_when_settled");
      const EndEffectorSetup* effector = end_effector(grasp.end_effector);
      if (on_arrival && effector && !effector->envelope)
        add(path, "{} needs an 'envelope' at end-effector {}", path, in_quotes(effector->name));
      if (!problem_.impact) {
        add(path, "{} needs 'impact' in the scenario: without it no grasp closes", path);
      } else if (at_time) {
        check_closing_time(grasp.closes_at, path);
      }
    }
  }

  // Limits of what grasps hold, and later closings.
  void check_holding() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      const std::string path = fmt::format("grasps[{}].", i);
      if (grasp.holds) {
        if (grasp.contact) add(path + "holds", "{}holds is for grasps: a contact does not hold; leave it out", path);
        if (!std::isfinite(grasp.holds->force) && !std::isfinite(grasp.holds->moment))
          add(path + "holds", "{}holds states no limit; add force or moment", path).relies_on = path + "holds";
        check_slip(grasp, path + "holds.");
      }
      if (!grasp.closes_again_at.empty()) check_again(grasp, "closes_again_at", path);
      if (grasp.closes_again_on_arrival) check_again(grasp, "closes_again_on_arrival", path);
      check_later_times(grasp, path + "closes_again_at");
    }
  }

  // Limits of slip state nothing where it does not occur.
  void check_slip(const GraspSetup& grasp, const std::string& path) {
    const GraspLimits& limits = *grasp.holds;
    const bool force = std::isfinite(limits.force), moment = std::isfinite(limits.moment);
    if (!limits.slips()) {
      const char* unused = limits.kinetic_ratio != 1             ? "kinetic_ratio"
                           : std::isfinite(limits.lost_distance) ? "lost_distance"
                           : std::isfinite(limits.lost_angle)    ? "lost_angle"
                                                                 : nullptr;
      if (unused) add(path + unused, "{0}{1} is for grasps that slip; add {0}beyond: slips", path, unused);
      return;
    }
    if (!grasp.contact && grasp.model == GraspModel::point && moment)
      add(path + "moment", "{}moment has no effect: a grasp of model point transmits no moment; leave it out", path);
    if (std::isfinite(limits.lost_distance) && !force)
      add(path + "lost_distance", "{0}lost_distance needs {0}force: without a limit the force does not slip", path);
    if (std::isfinite(limits.lost_angle) && !moment)
      add(path + "lost_angle", "{0}lost_angle needs {0}moment: without a limit the moment does not slip", path);
    if (problem_.integration.method == IntegrationSetup::Method::rk4)
      add(path + "beyond",
          "{}beyond: slips does not support integration.method: rk4, whose fixed steps do not resolve the ends of a "
          "slip; use automatic",
          path);
    const bool separate = limits.combined == GraspLimits::Combined::components || !force || !moment;
    if (problem_.integration.loops != IntegrationSetup::Loops::projection && separate &&
        grasp.model != GraspModel::point)
      add(path + "beyond", "{}beyond: slips with one limit, or separate ones, needs integration.loops: projection",
          path);
  }

  void check_again(const GraspSetup& grasp, const char* key, const std::string& path) {
    const bool at_time = key == std::string_view("closes_again_at");
    const EndEffectorSetup* effector = end_effector(grasp.end_effector);
    if (grasp.contact) add(path + key, "{}{} is for grasps: a contact does not close; leave it out", path, key);
    if (!problem_.impact)
      add(path + key, "{}{} needs 'impact' in the scenario: without it no grasp closes", path, key);
    else if (!problem_.post_impact && grasp.closes == GraspSetup::Closes::together)
      add(path + key, "{}{} needs 'post_impact': the run ends at the first closing", path, key);
    if (!at_time && effector && !effector->envelope)
      add(path + key, "{}{} needs an 'envelope' at end-effector {}", path, key, in_quotes(effector->name));
  }

  void check_later_times(const GraspSetup& grasp, const std::string& path) {
    const auto approach = shortest(problem_.approach);
    const bool at_time = grasp.closes == GraspSetup::Closes::at_time;
    double before = at_time ? grasp.closes_at : 0;
    if (grasp.closes == GraspSetup::Closes::together && approach) before = *approach;
    for (std::size_t k = 0; k < grasp.closes_again_at.size(); ++k) {
      const double time = grasp.closes_again_at[k];
      const std::string place = fmt::format("{}[{}]", path, k);
      if (time > 0 && time <= before)
        add(place, "{} is {} [s], must be greater than {}, the {}", place, time, before,
            k > 0     ? "time before"
            : at_time ? "first closing time"
                      : "approach's end");
      before = std::max(before, time);
      if (problem_.impact) check_closing_time(time, place);
    }
  }

  void check_closing_time(double time, const std::string& path) {
    const auto approach = shortest(problem_.approach), after = duration_of(problem_.post_impact);
    if (!(time > 0) || !approach) return;
    if (time > *approach && !problem_.post_impact) {
      const std::string end = *approach > 0 ? fmt::format("after the approach's end at {}", *approach)
                                            : "but without an approach all grasps close at 0";
      add(path, "{} is {} [s], {}; later closing needs 'post_impact'", path, time, end);
    } else if (after && time > *approach + *after) {
      add(path, "{} is {} [s], must be at most {}, the end of post_impact", path, time, *approach + *after);
    }
  }
};

}  // namespace

void find_grasp_conflicts(const CaptureProblem& problem, std::vector<ProblemFault>& found) {
  GraspConflicts(problem, found).find();
}

}  // namespace grapnel
