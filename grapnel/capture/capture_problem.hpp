#pragma once

/// @file
/// A capture to be simulated, as plain data: what a scenario file says after units and names are resolved, or what a
/// program sets up itself. Thread safety: plain values.

#include <optional>
#include <string>
#include <vector>

#include "grapnel/constraint/grasp_model.hpp"
#include "grapnel/model/model.hpp"
#include "grapnel/simulate/integration_setup.hpp"
#include "grapnel/simulate/joint_path.hpp"

namespace grapnel {

/// For drawing (and, later, clearance): a primitive shape centred on the frame X_BG of its body.
struct Geometry {
  enum class Shape { none, box, cylinder, sphere };
  Shape shape = Shape::none;
  Vector3d size{0, 0, 0};  // box: edge lengths; cylinder: radius, length (along z); sphere: radius [m]
  Posed X_BG = Posed::identity();
};

/// A servicer: its bodies (the base first in meaning: the one root), end-effector frames, and shapes for drawing.
struct RobotSetup {
  std::string name;
  std::string base;  // name of the root body
  enum class Base { free, held, fixed };
  /// free: floats. held: kept at its initial pose by an ideal wrench during the approach, free from the impact on.
  /// fixed: bolted to the ground in all phases.
  Base base_mode = Base::free;
  std::vector<BodyDescription> bodies;  // joint of the base: free, or fixed with its pose in X_PF
  std::vector<FrameDescription> end_effectors;
  std::vector<std::pair<std::string, Geometry>> geometry;  // by body name
};

struct GraspPoint {
  std::string name;
  Posed X_TG = Posed::identity();  // in the target's frame
};

/// A free rigid body to be caught.
struct TargetSetup {
  std::string name;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the target's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, target's axes [kg m^2]
  Geometry geometry;
  enum class Instant { start, capture };
  Instant given_at = Instant::capture;  // when pose and twist below hold; propagated from there free of torque
  Posed X_WT = Posed::identity();
  Twistd V_WT = Twistd::zero();  // at the target frame's origin, in W
  std::vector<GraspPoint> grasp_points;
};

/// An end-effector meets a grasp point and holds it.
struct GraspSetup {
  std::string end_effector;
  std::string target;
  std::string grasp_point;
  GraspModel model = GraspModel::rigid;
  Vector3d hinge_axis{0, 0, 1};  // unit, in the end-effector's frame; for model hinge
};

/// How final joint rates are found from the grasp points' motion through the generalized Jacobian.
enum class RateMatch { velocity, twist, velocity_least_rates };

struct TrackingSetup {
  enum class Mode { ideal, pd };
  Mode mode = Mode::ideal;
  std::vector<double> kp;  // per joint, in the order of Model::joints() [N m/rad or N/m]
  std::vector<double> kd;  // [N m s/rad or N s/m]
};

struct ApproachSetup {
  double duration = 0;  // T [s]
  JointProfile profile = JointProfile::quartic;
  std::vector<double> final_position;              // per joint
  std::optional<std::vector<double>> final_rates;  // given; else by `match`; else zero
  std::optional<RateMatch> match;
  TrackingSetup tracking;
};

/// What to do about the distance between an end-effector and its grasp point at the instant of capture.
struct ContactSetup {
  enum class Gap { weld_as_found, translate_target, refuse };
  Gap gap = Gap::weld_as_found;
  double refuse_beyond = 0;  // [m], for refuse
};

struct ImpactSetup {
  double duration = 1e-3;  // over which mean forces are taken [s]
};

struct PostImpactSetup {
  double duration = 0;  // [s]
  enum class Joints { free, pd, braked };
  Joints joints = Joints::free;
  std::vector<double> kp, kd;  // for pd: per joint; holds the angles found at the impact, rates zero
};

/// Everything `simulate_capture()` needs. Phases that are absent are not simulated; with no approach the initial state
/// is the state at capture (t = 0).
struct CaptureProblem {
  std::string name;
  std::string sha256;  // of the input it came from; empty for a program's own
  RobotSetup robot;
  Vector3d gravity = Vector3d::zero();  // uniform, in W [m/s^2]
  std::vector<TargetSetup> targets;
  std::vector<GraspSetup> grasps;

  Posed X_WB = Posed::identity();  // initial base pose
  /// The base's initial motion: its twist at B's origin in W, or the robot's total momentum [angular about its centre
  /// of mass; linear] in W, from which the twist follows by (2.3).
  std::optional<Twistd> V_WB;
  std::optional<Momentumd> momentum;
  std::vector<double> joint_position;  // per joint
  std::vector<double> joint_rate;      // per joint; empty: zero

  std::optional<ApproachSetup> approach;
  ContactSetup contact;
  std::optional<ImpactSetup> impact;
  std::optional<PostImpactSetup> post_impact;
  IntegrationSetup integration;
  double output_interval = 0.05;  // [s]
};

}  // namespace grapnel
