#pragma once

/// @file
/// Laws that move all their joints together, as controllers.

#include <optional>
#include <variant>
#include <vector>

#include "grapnel/control/base_keeping.hpp"
#include "grapnel/control/detumbling.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// A law, in the indices of one model.
struct JointLaw {
  std::variant<DetumblingLaw, BaseKeepingLaw> law;
  std::vector<int> joints;            // that it drives: positions in Model::joints()
  std::vector<LoopClosure> closures;  // that are closed meanwhile; none with BaseKeepingLaw
  Vector3d gravity = Vector3d::zero();
  std::vector<int> steady = {};  // joints whose own motors keep their rates (gyros): positions in Model::joints()
};

/// What it says at an instant.
struct JointLawCommand {
  Eigen::VectorXd effort;     // per driven joint [N m or N]
  double scale = 1;           // DetumblingCommand::scale, BaseKeepingCommand::share
  bool within_limits = true;  // of both
  double condition = 0;
};

/// Evaluates a law of a model, which must outlive it.
class JointLawEvaluation {
 public:
  JointLawEvaluation(const Model& model, const JointLaw& law);
  /// `force`: generalized forces beside the law's efforts (per velocity; empty: none).
  JointLawCommand at(const State& state, std::span<const double> force);

 private:
  JointLaw law_;
  EffortResponse response_;
};

/// The same as a controller of one piece of motion.
class JointLawController : public Controller {
 public:
  explicit JointLawController(JointLaw law) : law_(std::move(law)) {}
  void begin_piece(const Model& model, double time) override;
  void update(const ControlInput& input, ControlCommand& command) override;

 private:
  JointLaw law_;
  std::optional<JointLawEvaluation> evaluation_;
};

}  // namespace grapnel
