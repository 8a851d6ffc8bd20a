#pragma once

/// @file
/// One segment of an approach: the joints follow a profile from where they are to final values and rates, the base
/// answers by conservation of momentum, and where it ends depends on those values: the integral of (2.3) with its
/// sensitivities.
///
/// With x = (final values, final rates) the joints move as theta(t) = ... + a(t) final + b(t) final_rate. A
/// displacement xi of the base, in B, obeys (FloatingBase)
///   d(dxi/dx)/dt = A dxi/dx + dV_B/dtheta dtheta/dx + dV_B/dtheta_dot dtheta_dot/dx,   dxi/dx = 0 at the start, which
/// is integrated beside the pose.

#include <cstdint>
#include <string>

#include "grapnel/integrate/dormand_prince_853.hpp"
#include "grapnel/plan/floating_base.hpp"
#include "grapnel/simulate/joint_trajectory.hpp"

namespace grapnel {

/// What the servicer's momentum and centre of mass do while nothing but uniform gravity acts from outside.
struct FreeMotion {
  double time = 0;                      // when the rest was taken [s]
  Vector3d p_WCom = Vector3d::zero();   // centre of mass in W [m]
  Momentumd h = Momentumd::zero();      // [about the centre of mass; linear] in W
  double mass = 1;                      // [kg]
  Vector3d gravity = Vector3d::zero();  // in W [m/s^2]

  /// Momentum about B's origin in B, at time t, for a base at X_WB.
  Momentumd in_base(double t, const Posed& X_WB) const;
};
/// Of a servicer's state.
FreeMotion free_motion(const Model& model, const State& state, double time, const Vector3d& gravity);

/// Where a segment begins.
struct SegmentStart {
  double begin = 0, end = 0;  // [s]
  JointProfile profile = JointProfile::quintic;
  std::vector<double> position, rate;  // per joint
  Posed X_WB = Posed::identity();
  std::int64_t most_steps = 10'000'000;  // of one integration
};

/// Where it ends.
struct SegmentEnd {
  bool finished = false;
  std::string failure;
  Posed X_WB = Posed::identity();
  Matrix6Xd per_position;  // displacement of the base, in B, per final joint value; with sensitivities only
  Matrix6Xd per_rate;      // per final joint rate
};

class PathSegment {
 public:
  /// `base` is shared scratch and must outlive the segment. Tolerances are those of the integration of the base's pose.
  PathSegment(FloatingBase& base, SegmentStart start, FreeMotion motion, double relative_tolerance,
              double absolute_tolerance);

  /// Flies it to these final values and rates (one per joint).
  SegmentEnd fly(std::span<const double> position, std::span<const double> rate, bool sensitivities);

  const SegmentStart& start() const { return start_; }
  const FreeMotion& motion() const { return motion_; }
  FloatingBase& base() const { return base_; }
  /// The path of joint j for these final values.
  JointPath path(int j, double position, double rate) const;
  long rhs_evaluations() const { return evaluations_; }

 private:
  void rates(double t, std::span<const double> y, std::span<double> dydt, bool sensitivities);

  FloatingBase& base_;
  SegmentStart start_;
  FreeMotion motion_;
  Tolerances tolerances_;
  DormandPrince853<double> plain_, with_sensitivities_;
  std::vector<double> final_, final_rate_, theta_, theta_dot_;
  long evaluations_ = 0;
};

}  // namespace grapnel
