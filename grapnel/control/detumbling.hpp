#pragma once

/// @file
/// Detumbling of a held target through its grasps, with a bound on the torque on the target and limits of joints and
/// grasps (15.3)-(15.8).

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "grapnel/control/held_body.hpp"
#include "grapnel/control/joint_law.hpp"

namespace grapnel {

/// Parameters of a detumbling.
struct DetumblingLaw {
  /// A grasp that transmits the target's loads. Grasps made redundant by another rigid grasp are not listed.
  struct Hold {
    LoopClosure frames;
    int closure = -1;  // in LawScope::closures; -1: the tree joint that carries the target
    double force = std::numeric_limits<double>::infinity();   // limit [N]
    double moment = std::numeric_limits<double>::infinity();  // limit, about the grasp [N m]
  };

  std::vector<int> bodies;  // of the model: the target, followed by its panels
  double torque = 0;        // tau_m: the bound on the torque about the target's centre of mass [N m]
  std::vector<double>
      damping;  // per driven joint, positive [N m s/rad or N s/m]: distributes the efforts, damps the remaining motion
  /// Minimum time in which the momentum may be removed [s], k <= 1/shortest: prevents jerks for slow or sampled
  /// targets.
  double shortest = 1e-5;
  /// Minimum time constant of the damping of the remaining motion [s]; for a sampled law at least the sum of sample
  /// time and delay.
  double settling = 1e-2;
  std::vector<Hold> holds = {};

  int target() const { return bodies.at(0); }
};

/// Output of the law.
struct DetumblingCommand {
  Eigen::VectorXd effort;  // per driven joint, within the joints' limits [N m or N]
  double rate = 0;         // k: decay rate of the target's momenta relative to their values [1/s]
  double scale = 0;        // s: applied share of tau_m
  /// Whether a rate of at least 0 satisfies all limits of efforts and grasps; otherwise all efforts are scaled down.
  bool within_limits = true;
  double condition = 0;  // of the map from efforts to target motion: smallest over largest singular value
  /// Largest share of a limit required before efforts are scaled down, and its index: driven joints first, then force
  /// and moment of each hold; -1: there are no limits.
  double demand = 0;
  int limiting = -1;
};

/// The efforts that reduce the target's momenta by dL_t/dt = -s tau_m L_t/|L_t|, and likewise for the velocity relative
/// to its tree, with s = 1 or the maximum that the limits of joints and grasps allow. The law uses the model, its state
/// and `force`. It selects the efforts with the minimum sum of tau^2/damping, and damps the remaining joint motion.
/// Close to configurations in which no efforts accelerate the target in some direction, that direction is faded out.
/// `response` is updated.
DetumblingCommand detumbling_command(const DetumblingLaw& law, const State& state, std::span<const double> force,
                                     const Vector3d& gravity, EffortResponse& response);

/// The same law as a JointLaw; its scale is s. It continues with a reduced rank.
class Detumbling : public JointLaw {
 public:
  Detumbling(const Model& model, DetumblingLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const DetumblingLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;
  bool goes_on() const override { return true; }

 private:
  DetumblingLaw law_;
};

/// t_f = |L_t| / tau_m (15.4) [s].
double detumbling_time(const Vector3d& angular_momentum, double torque);

}  // namespace grapnel
