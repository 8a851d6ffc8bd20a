#pragma once

/// @file
/// A target held by several grasps: separate control of its motion and the internal forces (21.10)-(21.15), after
/// Walker, Freeman and Marcus (1991).

#include <span>
#include <vector>

#include "grapnel/control/joint_law.hpp"

namespace grapnel {

/// Grasp map of one target, f = G_M^+ W + (1 - G_M^+ G) f_int: stacked wrenches [moment; force] on the target at the
/// grasps, moments divided by the metric's length, in the directions that the grasps transmit.
struct GraspMap {
  Eigen::MatrixXd passes;    // 6 grasps x transmitted directions, orthonormal columns
  Eigen::MatrixXd internal;  // 1 - G_M^+ G (21.11), of these directions
  Eigen::MatrixXd pairs;     // directions x pairs: internal force per 1 N of squeeze
  /// Internal part of stacked wrenches, moments divided by the length.
  Eigen::VectorXd internal_part(const Eigen::VectorXd& f) const { return internal * (passes.transpose() * f); }
};

struct GraspForceLaw {
  struct Hold {
    int closure = -1;                // index in LawScope::closures; -1: carries the target in the tree
    Posed X_TC = Posed::identity();  // of the grasp, in the target's body
    GraspModel model = GraspModel::rigid;
    Vector3d hinge_C{0, 0, 1};
  };
  struct Pair {
    std::size_t a = 0, b = 0;  // of `holds`
    double force = 0;          // [N]; positive: compression
    double begin = 0, ramp = 0;
  };
  int target = -1, base = -1;  // bodies
  std::vector<Hold> holds;
  std::vector<Pair> pairs;
  bool brakes = false;  // else the target is held relative to the base
  Posed X_BT = Posed::identity();
  double rate = 0.5;            // [1/s]
  double torque = 0;            // braking torque [N m]
  double moment_length = 0.5;   // [m]
  std::vector<double> damping;  // per driven joint, positive: distributes the efforts, damps the remaining motion
};

/// Reference force of a pair at a time, with a smooth ramp [N].
double squeeze_at(const GraspForceLaw::Pair& pair, double time);

/// Grasp map at the given poses.
GraspMap grasp_map(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics);

/// Position and attitude error of a held target [m], [rad].
struct HoldDeviation {
  double distance = 0, angle = 0;
};
HoldDeviation hold_deviation(const GraspForceLaw& law, const Model& model, const Kinematics& kinematics);

/// The law. The target moves as demanded for any internal force. As far as the remaining joint efforts allow, the
/// internal part of the grasps' wrenches follows the reference. The remaining joint motion is damped. The law selects
/// the efforts with the minimum sum of tau^2/damping. Its scale is the share of the internal force that effort limits
/// allow.
class GraspForce : public JointLaw {
 public:
  GraspForce(const Model& model, GraspForceLaw law, LawScope scope)
      : JointLaw(model, std::move(scope)), law_(std::move(law)) {}
  const GraspForceLaw& law() const { return law_; }
  JointLawCommand at(double time, const State& state, std::span<const double> force) override;
  /// Number of internal directions controllable in addition to the target's motion, in the last at().
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
