#pragma once

/// @file
/// Bringing a held target to rest through its grasps, with a bound on the torque that it is given and limits of joints
/// and grasps (15.3)-(15.8).

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "grapnel/control/held_body.hpp"
#include "grapnel/control/joint_law.hpp"

namespace grapnel {

/// What a detumbling is to be.
struct DetumblingLaw {
  /// What passes the target's loads on. A redundant grasp, which holds what another one holds rigidly already, is none.
  struct Hold {
    LoopClosure frames;
    int closure = -1;  // in LawScope::closures; -1: the joint of the tree that carries the target
    double force = std::numeric_limits<double>::infinity();   // limit [N]
    double moment = std::numeric_limits<double>::infinity();  // limit, about the grasp [N m]
  };

  std::vector<int> bodies;      // of the model: the target that is brought to rest, then its panels
  double torque = 0;            // tau_m: the bound on the torque about the target's centre of mass [N m]
  std::vector<double> damping;  // per driven joint, above 0 [N m s/rad or N s/m]: shares the efforts, stills the rest
  /// Momentum is taken as if it were gone after this time at the earliest [s], so that a target that hardly turns, or
  /// that is sampled, is not jerked about: k <= 1/shortest.
  double shortest = 1e-5;
  /// The shortest time constant with which the rest is damped [s]; of a sampled law at least period and delay.
  double settling = 1e-2;
  std::vector<Hold> holds = {};

  int target() const { return bodies.at(0); }
};

/// What the law says at an instant.
struct DetumblingCommand {
  Eigen::VectorXd effort;  // per driven joint, within the joints' limits [N m or N]
  double rate = 0;         // k: how fast the target's momenta fall, relative to what they are [1/s]
  double scale = 0;        // s: the part of tau_m that is passed
  /// Whether a rate of 0 or more keeps all efforts and grasps within their limits; else all efforts are scaled down.
  bool within_limits = true;
  double condition = 0;  // of the target's motion by the efforts: least singular value over the largest
  /// The largest share of its limit that an effort or a grasp takes before efforts are scaled down, and whose:
  /// driven joints first, then force and moment of each hold; -1: nothing has a limit.
  double demand = 0;
  int limiting = -1;
};

/// The efforts with which the target's momenta fall by dL_t/dt = -s tau_m L_t/|L_t| and likewise relative to its tree,
/// s = 1 or as large as the limits of joints and grasps allow. The law knows the model, its state and `force`. Among
/// the efforts that do it those with the least sum of tau^2/damping are taken, and what joints move besides is damped.
/// Near configurations in which no efforts accelerate the target in some direction, that direction is left out
/// gradually. `response` is updated.
DetumblingCommand detumbling_command(const DetumblingLaw& law, const State& state, std::span<const double> force,
                                     const Vector3d& gravity, EffortResponse& response);

/// The same as a law of all joints; its scale is s. It goes on with the rank that is left.
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
