#pragma once

/// @file
/// Bringing a held target to rest through its grasps, with a bound on the torque that it is given (15.3)-(15.8).

#include <Eigen/Core>
#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"

namespace grapnel {

/// What a detumbling is to be.
struct DetumblingLaw {
  int target = -1;              // body of the model that is brought to rest
  double torque = 0;            // tau_m: the bound on the torque about the target's centre of mass [N m]
  std::vector<double> damping;  // per driven joint, above 0 [N m s/rad or N s/m]: shares the efforts, stills the rest
  /// Momentum is taken as if it were gone after this time at the earliest [s], so that a target that hardly turns, or
  /// that is sampled, is not jerked about: k <= 1/shortest.
  double shortest = 1e-5;
};

/// How the target moves.
struct TargetMotion3d {
  Vector3d angular_momentum;  // L_t, about its centre of mass, in W [N m s]
  Vector3d velocity;          // of its centre of mass, relative to that of its tree, in W [m/s]
};
TargetMotion3d target_motion(const Model& model, const Kinematics& kinematics, int target);

/// What the law says at an instant.
struct DetumblingCommand {
  Eigen::VectorXd effort;     // per driven joint, within the joints' limits [N m or N]
  double rate = 0;            // k: how fast the target's momenta fall, relative to what they are [1/s]
  double scale = 0;           // s: the part of tau_m that is passed
  bool within_limits = true;  // whether a rate of 0 or more keeps all efforts within their limits; else they are cut
  double condition = 0;       // of the target's motion by the efforts: least singular value over the largest
};

/// The efforts with which the target's momenta fall by dL_t/dt = -s tau_m L_t/|L_t| and likewise relative to its tree,
/// s = 1 or as large as the joints' effort limits allow. The law knows the model, its state and `force`. Among the
/// efforts that do it those with the least sum of tau^2/damping are taken, and what joints move besides is damped.
/// `response` is updated.
DetumblingCommand detumbling_command(const DetumblingLaw& law, const State& state, std::span<const double> force,
                                     const Vector3d& gravity, EffortResponse& response);

/// The same as a law of all joints; its scale is s.
class Detumbling : public JointLaw {
 public:
  Detumbling(const Model& model, DetumblingLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const DetumblingLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;

 private:
  DetumblingLaw law_;
};

/// t_f = |L_t| / tau_m (15.4) [s].
double detumbling_time(const Vector3d& angular_momentum, double torque);

}  // namespace grapnel
