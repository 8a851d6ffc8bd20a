#include "grapnel/scenario/grip_times.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/text/message_text.hpp"
#include "grapnel/text/yaml_values.hpp"

namespace grapnel {
namespace {

// A phase's duration; 0 without the phase. Empty where a fault leaves it in doubt.
std::optional<double> duration_of(const Reading& reading, std::string_view phase) {
  if (!reading.root.entry(phase)) return 0.0;
  const CaptureProblem& problem = reading.problem;
  const double duration = phase == "approach" ? (problem.approach ? problem.approach->duration : 0)
                                              : (problem.post_impact ? problem.post_impact->duration : 0);
  if (!(duration > 0) || !std::isfinite(duration)) return {};
  return duration;
}

void check_closing_time(double time, const Mark& mark, const std::string& path, Reading& reading) {
  const auto approach = duration_of(reading, "approach"), after = duration_of(reading, "post_impact");
  if (!(time > 0) || !approach) return;
  if (time > *approach && !reading.root.entry("post_impact")) {
    const std::string end = *approach > 0 ? fmt::format("after the approach's end at {}", *approach)
                                          : "but without an approach all is at 0";
    reading.faults.add(
        mark, fmt::format("{}.closes_at is {} [s], {}; what closes later needs 'post_impact'", path, time, end));
  } else if (after && time > *approach + *after) {
    reading.faults.add(mark, fmt::format("{}.closes_at is {} [s], must be at most {}, the end of post_impact", path,
                                         time, *approach + *after));
  }
}

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
    release.after = number_at(node, "after").value_or(0);
    if (release.after > 0) check_time(release.after, part(node, "after").mark, path);
    before_ = std::max(before_, release.after);
    for (const Node& name : part(node, "end_effectors").items) {
      if (!is_text(name) || name.text.empty()) continue;
      check_name(name, release.after, index, path);
      release.end_effectors.push_back(name.text);
    }
    return release;
  }

 private:
  void check_time(double after, const Mark& mark, const std::string& path) {
    const double duration = reading_.problem.post_impact->duration;
    if (after <= before_) {
      faults_.add(
          mark, fmt::format("{}.after is {} [s], must be greater than {} of the release before", path, after, before_));
    } else if (duration > 0 && after >= duration) {
      faults_.add(
          mark, fmt::format("{}.after is {} [s], must be less than {}, post_impact's duration", path, after, duration));
    }
  }

  void check_name(const Node& name, double after, std::size_t index, const std::string& path) {
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
    } else if (grasp->closes == GraspSetup::Closes::at_time) {
      check_order(grasp->closes_at, after, name, here);
    }
  }

  // With capture_at: envelope post_impact may begin, and the grip let go, still earlier than this.
  void check_order(double closes_at, double after, const Node& name, const std::string& here) {
    const auto approach = duration_of(reading_, "approach");
    if (!approach || !(after > 0) || closes_at < *approach + after) return;
    faults_.add(name.mark, fmt::format("end-effector {} in {} closes at {} [s], must close before it lets go at {}",
                                       in_quotes(name.text), here, closes_at, *approach + after));
  }

  Reading& reading_;
  FaultList& faults_;
  std::vector<std::string> grippers_;
  bool doubtful_ = false;
  double before_ = 0;                                           // the latest time so far
  std::map<std::string, std::size_t, std::less<>> release_of_;  // by end-effector
};

}  // namespace

void read_closing(const Node& node, const std::string& path, GraspSetup& grasp, Reading& reading) {
  if (node.find("closes_at")) {
    grasp.closes = GraspSetup::Closes::at_time;
    grasp.closes_at = number_at(node, "closes_at").value_or(0);
  } else if (boolean_at(node, "closes_on_arrival")) {
    grasp.closes = GraspSetup::Closes::on_arrival;
    const EndEffectorSetup* end_effector = end_effector_named(reading, grasp.end_effector);
    if (!end_effector || end_effector->envelope) return;
    reading.faults.add(part(node, "closes_on_arrival").mark,
                       fmt::format("{}.closes_on_arrival needs an 'envelope' at end-effector {}", path,
                                   in_quotes(end_effector->name)));
  }
}

void check_closing_times(Reading& reading) {
  const Node& list = part(reading.root, "grasps");
  const std::vector<GraspSetup>& grasps = reading.problem.grasps;
  for (std::size_t i = 0; i < grasps.size() && i < list.items.size(); ++i) {
    if (grasps[i].closes == GraspSetup::Closes::together) continue;
    const bool at_time = grasps[i].closes == GraspSetup::Closes::at_time;
    const char* key = at_time ? "closes_at" : "closes_on_arrival";
    const Mark& mark = part(list.items[i], key).mark;
    const std::string path = item("grasps", i);
    if (!reading.root.entry("impact")) {
      reading.faults.add(mark,
                         fmt::format("{}.{} needs 'impact' in the scenario: without it nothing closes", path, key));
    } else if (at_time) {
      check_closing_time(grasps[i].closes_at, mark, path, reading);
    }
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
