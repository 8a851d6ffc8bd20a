#pragma once

/// @file
/// A target that several grasps hold: its motion and the forces inside it, controlled separately (21.10)-(21.15), after
/// Walker, Freeman and Marcus (1991).

#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"

namespace grapnel {

/// What the grasps of one target do to it, f = G_M^+ W + (1 - G_M^+ G) f_int: stacked wrenches [moment; force] on the
/// target at the grasps, moments over the metric's length, in the directions that the grasps pass on.
struct GraspMap {
  Eigen::MatrixXd passes;    // 6 grasps x directions that are passed on, orthonormal columns
  Eigen::MatrixXd internal;  // 1 - G_M^+ G (21.11), of these directions
  Eigen::MatrixXd pairs;     // directions x pairs: what a squeeze of 1 N is
  /// Of stacked wrenches, moments over the length: their internal part.
  Eigen::VectorXd internal_part(const Eigen::VectorXd& f) const { return internal * (passes.transpose() * f); }
};

struct GraspForceLaw {
  struct Hold {
    int closure = -1;                // of LawScope::closures; -1: it carries the target in the tree
    Posed X_TC = Posed::identity();  // of the grasp, in the target's body
    GraspModel model = GraspModel::rigid;
    Vector3d hinge_C{0, 0, 1};
  };
  struct Pair {
    std::size_t a = 0, b = 0;  // of `holds`
    double force = 0;          // [N]; positive: they push towards each other
    double begin = 0, ramp = 0;
  };
  int target = -1, base = -1;  // bodies
  std::vector<Hold> holds;
  std::vector<Pair> pairs;
  bool brakes = false;  // else the target is held relative to the base
  Posed X_BT = Posed::identity();
  double rate = 0.5;            // [1/s]
  double torque = 0;            // of braking [N m]
  double moment_length = 0.5;   // [m]
  std::vector<double> damping;  // per driven joint, above 0: shares the efforts, stills the rest
};

/// The reference of a pair's force at a time: smooth over its ramp [N].
double squeeze_at(const GraspForceLaw::Pair& pair, double time);

/// At poses of the bodies.
GraspMap grasp_map(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics);

/// How far the target is from where it is held [m], [rad].
struct HoldDeviation {
  double distance = 0, angle = 0;
};
HoldDeviation hold_deviation(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics);

/// The law: the target moves as asked for, whatever the internal force; as far as the joints' efforts beside that
/// allow, the internal part of the grasps' wrenches is the reference's, and what joints move besides is damped. Among
/// the efforts those with the least sum of tau^2/damping are taken. Its scale is the part of the internal force that
/// effort limits let pass.
class GraspForce : public JointLaw {
 public:
  GraspForce(const Model& model, GraspForceLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const GraspForceLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;
  /// Internal directions that the efforts reach beside the target's motion, in the last at().
  int internal_rank() const { return internal_rank_; }

 private:
  struct Motion;
  struct Wrenches;
  Motion target_motion_rows() const;
  Wrenches wrenches() const;

  GraspForceLaw law_;
  int internal_rank_ = 0;
};

}  // namespace grapnel
