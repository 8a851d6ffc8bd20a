#pragma once

/// @file
/// Laws that move all their joints together: what such a law is, and the controller that asks it. Each law is a file of
/// its own in this folder.

#include <memory>
#include <span>
#include <vector>

#include "grapnel/control/effort_response.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// On what a law works, in the indices of one model.
struct LawScope {
  std::vector<int> joints = {};            // that it drives: positions in Model::joints()
  std::vector<LoopClosure> closures = {};  // that are closed meanwhile
  Vector3d gravity = Vector3d::zero();
  std::vector<int> steady = {};  // joints whose own motors keep their rates (gyros): positions in Model::joints()
};

/// What a law says at an instant.
struct JointLawCommand {
  Eigen::VectorXd effort = {};  // per driven joint, within the joints' limits [N m or N]
  double scale = 1;             // the part that effort limits let pass of what the law gives up first
  bool within_limits = true;    // else efforts are cut, and what is asked for is not done
  double condition = 1;         // near 0 what is asked for takes more than joints can do
  /// The largest share of a limit that is asked for before efforts are scaled down, and whose: driven joints first,
  /// then what else the law knows limits of; -1: of none.
  double demand = 0;
  int limiting = -1;
};

/// A law of one model, which must outlive it. Thread safety: one thread at a time.
class JointLaw {
 public:
  JointLaw(const Model& model, LawScope scope)
      : gravity_(scope.gravity), response_(model, std::move(scope.joints), std::move(scope.closures), scope.steady) {}
  JointLaw(const JointLaw&) = delete;
  JointLaw& operator=(const JointLaw&) = delete;
  virtual ~JointLaw() = default;

  /// That it drives: positions in Model::joints(), in the order of the efforts.
  const std::vector<int>& joints() const { return response_.joints(); }
  /// `force`: generalized forces beside the law's efforts (per velocity; empty: none).
  virtual JointLawCommand at(double time, const State& state, std::span<const double> force) = 0;
  /// Whether it goes on with the rank that is left where the condition falls, so that only its work ends it.
  virtual bool goes_on() const { return false; }
  /// Its efforts alone, where nothing acts beside them.
  virtual Eigen::VectorXd efforts(double time, const State& state) { return at(time, state, {}).effort; }
  /// From now on these wrenches of contacts and yielding grasps act, as a law that senses them knows them.
  virtual void sense(std::span<const ExternalWrench> wrenches) { static_cast<void>(wrenches); }

 protected:
  Vector3d gravity_;
  EffortResponse response_;
};

/// A law as the controller of one piece of motion.
class JointLawController : public Controller {
 public:
  explicit JointLawController(std::shared_ptr<JointLaw> law) : law_(std::move(law)) {}
  void update(const ControlInput& input, ControlCommand& command) override;

 private:
  std::shared_ptr<JointLaw> law_;
};

}  // namespace grapnel
