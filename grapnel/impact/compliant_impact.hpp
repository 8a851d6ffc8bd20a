#pragma once

/// @file
/// An impact resolved in time: contacts and grasps as springs and dampers, the whole system moving meanwhile, for force
/// histories.
///
/// Momenta of free trees are integrated as the impulses that contacts and grasps pass on, and the roots' velocities
/// follow from them: momentum is kept to rounding at any tolerance, and the energy balance is a check on everything
/// else. Radau's method of order 9 with events at touch and separation; docs/theory, section 12.
/// Springs at joints (JointDescription::spring) and their dampers work meanwhile.
/// Limitations: motors do nothing meanwhile but what an ImpactDrive says; other joint friction and gravity do nothing;
/// a contact is a point against a plane; grasps turn by less than half a turn.

#include <functional>
#include <span>
#include <string>

#include "grapnel/constraint/grasp.hpp"
#include "grapnel/dynamics/forward_dynamics.hpp"
#include "grapnel/dynamics/state.hpp"
#include "grapnel/impact/compliant_tables.hpp"

namespace grapnel {

/// A point of a robot's body against the tangent plane of a target's surface; both fixed on their bodies as they are
/// when the impact begins. Unilateral: the bodies part when the force reaches zero, and what the surface is still
/// dented by then is lost. Action and reaction are taken at the robot's point.
struct CompliantContact {
  int robot_body;
  int target_body;
  Vector3d p_WC;  // where they touch at the beginning
  Vector3d n_W;   // unit, from the target to the robot's body, then
  ContactForceModel model = ContactForceModel::kelvin_voigt;
  double stiffness = 0;      // k [N/m; N/m^1.5; N/m^n]
  double damping = 0;        // c [N s/m]; for hunt_crossley a [s/m]; not read for hertz
  double exponent = 1.5;     // n >= 1 of hunt_crossley
  double friction = 0;       // mu of -mu f_n u_t / sqrt(|u_t|^2 + slip_speed^2)
  double slip_speed = 1e-4;  // [m/s]
};

/// A grasp that yields: a spring and a damper in every direction that the grasp model constrains, unstressed when the
/// impact begins. Springs act on the distance of the two points and on the angle between the two frames (hinge: between
/// the two axes), dampers on the relative twist at the robot's point, where action and reaction are taken.
struct CompliantGrasp {
  Grasp grasp;
  double linear_stiffness = 0;   // [N/m]
  double linear_damping = 0;     // [N s/m]
  double angular_stiffness = 0;  // [N m/rad]; not read for a point, as is the damping
  double angular_damping = 0;    // [N m s/rad]
};

/// Efforts of joints during the impact. They are internal: momenta stay what they are, and their work is part of the
/// balance of energy.
class ImpactDrive {
 public:
  ImpactDrive() = default;
  ImpactDrive(const ImpactDrive&) = delete;
  ImpactDrive& operator=(const ImpactDrive&) = delete;
  virtual ~ImpactDrive() = default;

  /// The first time after t at which efforts may jump; infinite: never. Times are from the impact's beginning on [s].
  virtual double next_break(double t) const = 0;
  /// The time is t, where a smooth piece begins. `wrenches`: of contacts and grasps, on both bodies.
  virtual void begin_piece(double t, const State& state, std::span<const ExternalWrench> wrenches) = 0;
  /// Per velocity [N m or N], of joints alone; `effort` is zero when asked. A smooth function of the rest.
  virtual void efforts(double t, const State& state, std::span<const ExternalWrench> wrenches,
                       std::span<double> effort) = 0;
};

struct CompliantSetup {
  double longest = 1;  // the integration ends at the latest after this time [s]
  /// Grasps have come to rest when the kinetic energy of their relative motion stays below this fraction of what it was
  /// at the beginning, for a whole period of the slowest spring. (Springs stay stressed where the joined bodies turn.)
  double settled = 1e-8;
  /// About the error of velocities, impulses, and of these times the shortest time scale of the springs, of what a
  /// rigid impact would change at most; forces between steps' ends are less accurate.
  double relative_tolerance = 1e-12;
  int samples = 400;  // of the histories, at least (if the impact lasts that long), up to twice that; and two at events
  long most_steps = 2'000'000;
};

/// One contact or grasp over time; forces act on the robot at its own point, in W.
struct ForceHistory {
  std::vector<Vector3d> point;      // where force and moment act, common to both bodies, in W, per sample [m]
  std::vector<Vector3d> force;      // [N]
  std::vector<Vector3d> moment;     // about the robot's point; zero for contacts [N m]
  std::vector<double> deformation;  // of contacts along the normal, of grasps the distance of the two points [m]
  double peak_force = 0, peak_force_time = 0;    // over all steps, not only samples [N, s]
  double peak_moment = 0, peak_moment_time = 0;  // [N m, s]
  double largest_deformation = 0;                // [m]
  double duration = 0;                           // of contacts: time in touch, of grasps: until at rest [s]
  Impulsed impulse = Impulsed::zero();           // integral, about the contact point at the beginning [N m s; N s]
  double energy_lost = 0;                        // by its damper and friction [J]
  int touches = 0;                               // how often it came into touch; 1 for grasps
};

struct CompliantOutcome {
  enum class Status { separated, settled, time_over, failed };
  Status status = Status::failed;
  std::string message;        // with the time and the condition, if failed
  double duration = 0;        // [s]
  State after;                // coordinates too: the system moves
  std::vector<double> times;  // of the samples, from 0, never falling; an event has two: just before and just after
  std::vector<State> states;  // at the samples
  std::vector<std::vector<double>> accelerations;  // at the samples: rates of State::v, per velocity
  std::vector<ForceHistory> contacts, grasps;
  std::vector<double> held_impulses;  // per held velocity: integral of the effort that keeps it [N m s or N s]
  double held_work = 0;               // [J] done by these efforts
  double drive_work = 0;              // [J] done by an ImpactDrive's
  double kinetic_energy_before = 0, kinetic_energy_after = 0, elastic_energy_after = 0;
  double spring_energy_before = 0, spring_energy_after = 0;  // of springs at joints, of the trees that take part [J]
  double spring_energy_lost = 0;                             // by their dampers [J]
  double kinetic_energy_taking_part = 0;  // before, of the trees that an interface or a held velocity acts on [J]
  /// |T+ + V+ + lost - held_work - drive_work - T-| of these trees, with what springs at joints hold and lose, over
  /// their T- or T+, whichever is larger.
  double energy_residual = 0;
  long rhs_evaluations = 0, steps = 0;
};

/// Integrates until every contact has separated and moves apart and every grasp has come to rest, or the time is over.
/// `held`: velocities (indices into State::v) that keep the value they have, whatever effort that takes; of a free root
/// or a spherical joint all or none; no drive acts on them. `each_step` is called with the time reached and may throw
/// to end it.
/// @throws std::invalid_argument for coefficients out of range, bad normals or another model's state;
/// std::runtime_error where GRAPNEL_LANES names no instruction set that runs here (lanes::best_instruction_set()).
CompliantOutcome compliant_impact(const Model& model, const State& state, std::span<const CompliantContact> contacts,
                                  std::span<const CompliantGrasp> grasps, const CompliantSetup& setup,
                                  std::span<const int> held = {}, const std::function<void(double t)>& each_step = {},
                                  ImpactDrive* drive = nullptr);

}  // namespace grapnel
