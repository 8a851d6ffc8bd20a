#pragma once

/// @file
/// Control laws for all joints of a robot: their interface, and the controller that evaluates them. Each law is a file
/// in this folder.

#include <memory>
#include <span>
#include <vector>

#include "grapnel/control/effort_response.hpp"
#include "grapnel/simulate/controller.hpp"

namespace grapnel {

/// Scope of a law, in the indices of one model.
struct LawScope {
  std::vector<int> joints = {};            // driven joints: positions in Model::joints()
  std::vector<LoopClosure> closures = {};  // closed during the law's action
  Vector3d gravity = Vector3d::zero();
  std::vector<int> steady =
      {};  // joints whose rates are held by their own motors (gyros): positions in Model::joints()
};

/// Output of a law.
struct JointLawCommand {
  Eigen::VectorXd effort = {};  // per driven joint, within the joints' limits [N m or N]
  double scale = 1;             // applied share of the law's lowest-priority part, as effort limits allow
  bool within_limits = true;    // else efforts are clipped and the demand is not met
  double condition = 1;         // near 0 the demand exceeds the joints' capability
  /// Largest share of a limit required before efforts are scaled down, and its index: driven joints first, then further
  /// limits of the law; -1: none.
  double demand = 0;
  int limiting = -1;
};

/// A control law of one model, which must outlive it. Thread safety: one thread at a time.
class JointLaw {
 public:
  JointLaw(const Model& model, LawScope scope)
      : gravity_(scope.gravity), response_(model, std::move(scope.joints), std::move(scope.closures), scope.steady) {}
  JointLaw(const JointLaw&) = delete;
  JointLaw& operator=(const JointLaw&) = delete;
  virtual ~JointLaw() = default;

  /// Driven joints: positions in Model::joints(), in the order of the efforts.
  const std::vector<int>& joints() const { return response_.joints(); }
  /// `force`: generalized forces in addition to the law's efforts (per velocity; empty: none).
  virtual JointLawCommand at(double time, const State& state, std::span<const double> force) = 0;
  /// Whether the law continues with a reduced rank if the condition falls, so that only its completion ends it.
  virtual bool goes_on() const { return false; }
  /// The efforts alone, without further forces.
  virtual Eigen::VectorXd efforts(double time, const State& state) { return at(time, state, {}).effort; }
  /// Sets the contact and grasp wrenches that act from now on, for laws that measure them.
  virtual void sense(std::span<const ExternalWrench> wrenches) { static_cast<void>(wrenches); }

 protected:
  Vector3d gravity_;
  EffortResponse response_;
};

/// A law as the controller of one motion segment.
class JointLawController : public Controller {
 public:
  explicit JointLawController(std::shared_ptr<JointLaw> law) : law_(std::move(law)) {}
  void update(const ControlInput& input, ControlCommand& command) override;

 private:
  std::shared_ptr<JointLaw> law_;
};

}  // namespace grapnel
