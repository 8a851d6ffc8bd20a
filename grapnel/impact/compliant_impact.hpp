#pragma once

/// @file
/// An impact resolved in time: contacts and grasps are springs and dampers, and the whole system moves during the
/// impact; gives force histories.
///
/// Momenta of free trees are integrated as the impulses of contacts and grasps, and the roots' velocities follow from
/// them: momentum is conserved to rounding at any tolerance, and the energy balance checks everything else. Radau
/// method of order 9 with events at touch and separation; docs/theory, section 12. Springs at joints
/// (JointDescription::spring) and their dampers are included. Limitations: motors give only the efforts of an
/// ImpactDrive; other joint friction and gravity are neglected; a contact is a point against a plane, besides contacts
/// between shapes (compliant_shapes.hpp); grasps turn by less than half a turn.

#include <functional>
#include <span>
#include <string>

#include "grapnel/constraint/loop_closure.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/impact/compliant_tables.hpp"
#include "grapnel/impact/impact_solution.hpp"

namespace grapnel {

/// A point of a robot's body against the tangent plane of a target's surface; both are fixed to their bodies at the
/// start of the impact. Unilateral: the bodies separate when the force reaches zero, and the energy of the remaining
/// deformation is lost. Action and reaction apply at the robot's point.
struct CompliantContact {
  int robot_body;
  int target_body;
  Vector3d p_WC;  // point of contact at the start
  Vector3d n_W;   // unit, from the target to the robot's body, at the start
  ContactForceModel model = ContactForceModel::kelvin_voigt;
  double stiffness = 0;      // k [N/m; N/m^1.5; N/m^n]
  double damping = 0;        // c [N s/m]; for hunt_crossley a [s/m]; not read for hertz
  double exponent = 1.5;     // n >= 1 of hunt_crossley
  double friction = 0;       // mu of -mu f_n u_t / sqrt(|u_t|^2 + slip_speed^2)
  double slip_speed = 1e-4;  // [m/s]
};

/// A compliant grasp: a spring and a damper in every direction that the grasp model constrains, unstressed at the start
/// of the impact. Springs act on the distance of the two points and on the angle between the two frames (hinge: between
/// the two axes), dampers on the relative twist at the robot's point, where action and reaction apply.
struct CompliantGrasp {
  Grasp grasp;
  double linear_stiffness = 0;   // [N/m]
  double linear_damping = 0;     // [N s/m]
  double angular_stiffness = 0;  // [N m/rad]; like the damping, not used for a point
  double angular_damping = 0;    // [N m s/rad]
};

/// Efforts of joints during the impact. They are internal: they do not change momenta, and their work is part of the
/// energy balance.
class ImpactDrive {
 public:
  ImpactDrive() = default;
  ImpactDrive(const ImpactDrive&) = delete;
  ImpactDrive& operator=(const ImpactDrive&) = delete;
  virtual ~ImpactDrive() = default;

  /// The first time after t at which efforts may jump; infinite: none. Times are relative to the impact's beginning
  /// [s].
  virtual double next_break(double t) const = 0;
  /// Begins a smooth piece at the time t. `wrenches`: of contacts and grasps, on both bodies.
  virtual void begin_segment(double t, const State& state, std::span<const ExternalWrench> wrenches) = 0;
  /// Per velocity [N m or N], of joints only; `effort` is zero on call. A smooth function of the other arguments.
  virtual void efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
                       std::span<double> effort) = 0;
};

struct ImpactShapes;

/// Integrates until every contact has separated and moves apart and every grasp has come to rest, or until `longest`.
/// `held`: velocities (indices into State::v) that keep their values with any effort; either all or none of a free root
/// or a spherical joint; no drive acts on them. `each_step` is called with the time reached and may throw to end the
/// integration. `shapes`: contacts between shapes, with the forces of theory section 23 and, of hard pairs, the
/// impacts in an instant; null: none. `loops`: closures that hold exactly throughout, such as grasps that already hold
/// and close loops; held velocities must not contradict them. @throws std::invalid_argument for coefficients out of
/// range, invalid normals or the state of another model; std::runtime_error if GRAPNEL_LANES names no instruction set
/// available here (lanes::best_instruction_set()).
ImpactSolution compliant_impact(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                                std::span<const CompliantGrasp> grasps, const CompliantSetup& setup,
                                std::span<const int> held = {}, const std::function<void(double t)>& each_step = {},
                                ImpactDrive* drive = nullptr, ImpactShapes* shapes = nullptr,
                                std::span<const LoopClosure> loops = {});

}  // namespace grapnel
