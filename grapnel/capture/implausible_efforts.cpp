#include "grapnel/capture/implausible_efforts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

constexpr double kMostMoment = 1e4;  // [N m]
constexpr double kMostForce = 1e5;   // [N]

const JointDescription* joint_of(const CaptureProblem& problem, const std::string& name) {
  for (const BodyDescription& body : problem.robot.bodies) {
    if (body.joint.name == name) return &body.joint;
  }
  return nullptr;
}

// Impacts and brakes are separate phases, whose loads depend on an assumed duration.
bool is_motion(const PeakLoad& load) {
  return !load.assumed_duration && !load.phase.starts_with("contact") && !load.phase.starts_with("brake");
}

}  // namespace

std::vector<std::string> implausible_efforts(const CaptureProblem& problem, const CaptureResult& result) {
  std::vector<const PeakLoad*> found;  // the maximum of each joint
  for (const PeakLoad& load : result.peak_loads) {
    if (load.quantity != "driving" || !is_motion(load)) continue;
    const JointDescription* joint = joint_of(problem, load.of);
    if (!joint || std::isfinite(joint->limits.effort)) continue;
    if (!(load.peak > (slides_along_axis(joint->type) ? kMostForce : kMostMoment))) continue;
    const auto same = std::find_if(found.begin(), found.end(), [&](const PeakLoad* f) { return f->of == load.of; });
    if (same == found.end()) {
      found.push_back(&load);
    } else if (load.peak > (*same)->peak) {
      *same = &load;
    }
  }
  std::vector<std::string> warnings;
  for (const PeakLoad* load : found) {
    const bool slides = slides_along_axis(joint_of(problem, load->of)->type);
    warnings.push_back(
        fmt::format("implausible effort: joint '{}' has no effort limit and gives {:.3g} {} at t = {:.6g} s ({}), more "
                    "than {:.0g} {}; "
                    "no real drive gives such an effort, so the motion from then on is not realistic: state "
                    "limits.effort of the joint",
                    load->of, load->peak, slides ? "N" : "N m", load->time, load->phase,
                    slides ? kMostForce : kMostMoment, slides ? "N" : "N m"));
  }
  return warnings;
}

}  // namespace grapnel
