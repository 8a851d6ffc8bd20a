#include "grapnel/control/joint_law.hpp"

namespace grapnel {

JointLawEvaluation::JointLawEvaluation(const Model& model, const JointLaw& law)
    : law_(law), response_(model, law.joints, law.closures, law.steady) {}

JointLawCommand JointLawEvaluation::at(const State& state, std::span<const double> force) {
  if (const auto* detumbling = std::get_if<DetumblingLaw>(&law_.law)) {
    DetumblingCommand c = detumbling_command(*detumbling, state, force, law_.gravity, response_);
    return {std::move(c.effort), c.scale, c.within_limits, c.condition};
  }
  BaseKeepingCommand c =
      base_keeping_command(std::get<BaseKeepingLaw>(law_.law), state, force, law_.gravity, response_);
  return {std::move(c.effort), c.share, c.within_limits, c.condition};
}

void JointLawController::begin_piece(const Model& model, double) { evaluation_.emplace(model, law_); }

void JointLawController::update(const ControlInput& input, ControlCommand& command) {
  if (!evaluation_) evaluation_.emplace(input.model, law_);
  const JointLawCommand said = evaluation_->at(input.state, input.force);
  for (std::size_t j = 0; j < law_.joints.size(); ++j)
    command.effort[static_cast<std::size_t>(law_.joints[j])] = said.effort[static_cast<Eigen::Index>(j)];
}

}  // namespace grapnel
