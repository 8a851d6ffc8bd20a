#include "grapnel/problem/problem_conflicts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

// More samples than this are a slip of the pen: 10 million of a seven-joint dual arm are some 10 GB.
constexpr double kMostSamples = 1e7;

class Conflicts {
 public:
  explicit Conflicts(const CaptureProblem& problem) : problem_(problem) {}

  std::vector<ProblemFault> find() {
    if (problem_.approach) check_approach(*problem_.approach);
    check_closing_times();
    if (problem_.post_impact) check_releases(*problem_.post_impact);
    for (std::size_t i = 0; i < problem_.loads.size(); ++i)
      check_profile(problem_.loads[i].profile, fmt::format("external_wrenches[{}].time", i));
    check_lengths();
    return std::move(found_);
  }

 private:
  template <class... Arguments>
  void add(std::string path, fmt::format_string<Arguments...> form, Arguments&&... arguments) {
    found_.push_back({std::move(path), fmt::format(form, std::forward<Arguments>(arguments)...)});
  }

  // A phase's duration; 0 without the phase. Empty where it is in doubt.
  template <class Phase>
  static std::optional<double> duration_of(const std::optional<Phase>& phase) {
    if (!phase) return 0.0;
    if (!(phase->duration > 0) || !std::isfinite(phase->duration)) return {};
    return phase->duration;
  }

  void check_approach(const ApproachSetup& approach) {
    const double straight = approach.straight_in ? approach.straight_in->duration : 0;
    if (approach.straight_in && approach.duration > 0 && straight >= approach.duration) {
      add("approach.straight_in.duration",
          "approach.straight_in.duration is {} [s], must be less than the approach's {}", straight, approach.duration);
    }
    const double end = approach.duration - straight;
    double before = 0;
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const double time = approach.waypoints[i].time;
      const std::string path = fmt::format("approach.waypoints[{}].time", i);
      if (time > 0 && time <= before) {
        add(path, "{} is {} [s], must be greater than {} of the waypoint before", path, time, before);
      } else if (time > 0 && end > 0 && time >= end) {
        add(path, "{} is {} [s], must be less than {}, {}", path, time, end,
            straight > 0 ? "where straight_in begins" : "the approach's duration");
      }
      before = std::max(before, time);
    }
    if (!approach.sampled && approach.pieces.empty()) check_start(approach);
  }

  // The thesis's profile has no initial rate in it, so neither joints that follow it exactly nor its later pieces can
  // have one.
  void check_start(const ApproachSetup& approach) {
    if (approach.profile != JointProfile::quartic) return;
    const auto at_rest = [](const std::vector<double>& rates) {
      return std::all_of(rates.begin(), rates.end(), [](double r) { return r == 0; });
    };
    if (approach.tracking.mode == JointControl::prescribed && !at_rest(problem_.joint_rate)) {
      add("approach.profile",
          "approach.profile: the quartic profile starts from rest; with initial.joint_rates use quintic or cycloidal");
    }
    for (std::size_t i = 0; i < approach.waypoints.size(); ++i) {
      const Waypoint& waypoint = approach.waypoints[i];
      if (waypoint.places.empty() && at_rest(waypoint.rates.value_or(std::vector<double>{}))) continue;
      add("approach.profile",
          "approach.profile: the quartic profile starts from rest, and so cannot leave approach.waypoints[{}], which "
          "is passed with rates; use quintic or cycloidal",
          i);
      return;
    }
  }

  void check_closing_times() {
    for (std::size_t i = 0; i < problem_.grasps.size(); ++i) {
      const GraspSetup& grasp = problem_.grasps[i];
      if (grasp.closes == GraspSetup::Closes::together) continue;
      const bool at_time = grasp.closes == GraspSetup::Closes::at_time;
      const std::string path = fmt::format("grasps[{}].{}", i, at_time ? "closes_at" : "closes_on_arrival");
      if (!problem_.impact) {
        add(path, "{} needs 'impact' in the scenario: without it nothing closes", path);
      } else if (at_time) {
        check_closing_time(grasp.closes_at, path);
      }
    }
  }

  void check_closing_time(double time, const std::string& path) {
    const auto approach = duration_of(problem_.approach), after = duration_of(problem_.post_impact);
    if (!(time > 0) || !approach) return;
    if (time > *approach && !problem_.post_impact) {
      const std::string end = *approach > 0 ? fmt::format("after the approach's end at {}", *approach)
                                            : "but without an approach all is at 0";
      add(path, "{} is {} [s], {}; what closes later needs 'post_impact'", path, time, end);
    } else if (after && time > *approach + *after) {
      add(path, "{} is {} [s], must be at most {}, the end of post_impact", path, time, *approach + *after);
    }
  }

  void check_releases(const PostImpactSetup& post) {
    double before = 0;
    std::set<std::string_view> released;
    for (std::size_t i = 0; i < post.releases.size(); ++i) {
      const PostImpactSetup::Release& release = post.releases[i];
      const double after = release.after;
      const std::string path = fmt::format("post_impact.release[{}]", i);
      if (after > 0 && after <= before) {
        add(path + ".after", "{}.after is {} [s], must be greater than {} of the release before", path, after, before);
      } else if (after > 0 && post.duration > 0 && after >= post.duration) {
        add(path + ".after", "{}.after is {} [s], must be less than {}, post_impact's duration", path, after,
            post.duration);
      }
      before = std::max(before, after);
      for (std::size_t k = 0; k < release.end_effectors.size(); ++k) {
        const std::string& name = release.end_effectors[k];
        if (released.insert(name).second) check_release_after_closing(name, after, path + ".end_effectors", k);
      }
    }
  }

  // With capture_at: envelope post_impact may begin, and the grasp be released, still earlier than this.
  void check_release_after_closing(const std::string& name, double after, const std::string& path, std::size_t k) {
    const auto grasp = std::find_if(problem_.grasps.begin(), problem_.grasps.end(),
                                    [&](const GraspSetup& g) { return g.end_effector == name; });
    const auto approach = duration_of(problem_.approach);
    if (grasp == problem_.grasps.end() || grasp->closes != GraspSetup::Closes::at_time) return;
    if (!approach || !(after > 0) || grasp->closes_at < *approach + after) return;
    add(fmt::format("{}[{}]", path, k), "end-effector {} in {} closes at {} [s], must close before it lets go at {}",
        in_quotes(name), path, grasp->closes_at, *approach + after);
  }

  void check_profile(const LoadProfile& profile, const std::string& path) {
    const bool ends = profile.shape != LoadProfile::Shape::table && std::isfinite(profile.end);
    if (ends && !(profile.end > profile.start))
      add(path + ".end", "{} ends at {} [s], must end after its start at {}", path, profile.end, profile.start);
  }

  // Sample and step counts that cannot be meant.
  void check_lengths() {
    const double approach = duration_of(problem_.approach).value_or(0);
    const double post = duration_of(problem_.post_impact).value_or(0);
    const double samples = (approach + post) / problem_.output_interval;
    if (problem_.output_interval > 0 && samples > kMostSamples) {
      add("output.interval",
          "output.interval is {} [s], which gives {:.3g} samples over {:.6g} s; at most {:.0f} are allowed",
          problem_.output_interval, samples, approach + post, kMostSamples);
    }
    const IntegrationSetup& integration = problem_.integration;
    const bool fixed_step = integration.method == IntegrationSetup::Method::rk4 && integration.step > 0;
    const double steps = fixed_step ? std::max(approach, post) / integration.step : 0;
    if (steps > static_cast<double>(integration.max_steps)) {
      add("integration.step", "integration.step is {} [s], which gives {:.3g} steps; integration.max_steps allows {}",
          integration.step, steps, integration.max_steps);
    }
  }

  const CaptureProblem& problem_;
  std::vector<ProblemFault> found_;
};

}  // namespace

std::vector<ProblemFault> problem_conflicts(const CaptureProblem& problem) { return Conflicts(problem).find(); }

}  // namespace grapnel
