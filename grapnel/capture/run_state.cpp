#include "grapnel/capture/run_state.hpp"

#include <fmt/format.h>

namespace grapnel {

RunState::RunState(const CaptureProblem& the_problem, const MovingFrame& the_frame, CaptureResult& the_result,
                   CaptureDetail the_detail)
    : problem(the_problem),
      frame(the_frame),
      result(the_result),
      detail(the_detail),
      free(make_capture_system(problem)),
      system(free),
      bookkeeper(problem, free),
      watches(problem),
      loads(problem),
      schedule(problem) {
  if (detail == CaptureDetail::full) recorder.emplace(problem, free, frame, result.series);
}

std::string RunState::next_name(const std::string& phase) {
  const int count = ++pieces[phase];
  return count == 1 ? phase : fmt::format("{}_{}", phase, count);
}

bool RunState::holds_by(PostImpactSetup::Joints joints) const {
  return problem.post_impact && problem.post_impact->joints == joints;
}

const Body& RunState::joint_body(const CaptureSystem& of, std::size_t joint) const {
  return of.model.bodies()[of.model.joints()[of.robot_joints[joint]]];
}

void RunState::to_free() {
  if (system.grips.empty()) return;
  state = take_apart(free, system, state);
  system = free;
  bookkeeper.set_system(system);
}
void RunState::to_joined() {
  if (grips.empty()) return;
  CapturedSystem joined = join_targets(free, state, grips);
  system = std::move(joined.system);
  state = std::move(joined.state);
  bookkeeper.set_system(system);
}

}  // namespace grapnel
