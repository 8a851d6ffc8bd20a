#include "grapnel/control/joint_law.hpp"

namespace grapnel {

void JointLawController::update(const ControlInput& input, ControlCommand& command) {
  const JointLawCommand law_command = law_->at(input.time, input.state, input.force);
  const std::vector<int>& joints = law_->joints();
  for (std::size_t j = 0; j < joints.size(); ++j) command.effort[joints[j]] = law_command.effort[j];
}

}  // namespace grapnel
