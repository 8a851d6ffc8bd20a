#pragma once

/// @file
/// Plain data that describe bodies, joints and frames, as given by a file or a program. ModelBuilder converts them to
/// an immutable Model. Public, kept stable.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/model/joint_type.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// Stop at the ends of a joint's range: an impact reverses the rate, multiplied by `restitution`. Below the rate
/// `rest_rate` the joint comes to rest at the stop.
struct JointStop {
  double restitution = 0;   // from 0 to 1
  double rest_rate = 1e-4;  // [rad/s or m/s]
};

/// Position limits [rad or m], rate limit [rad/s or m/s], effort limit [N m or N]; infinite: no limit. Without a stop
/// no force enforces the position limits.
struct JointLimits {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double rate = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
  std::optional<JointStop> stop = {};
};

/// Friction torque -(viscous rate + coulomb tanh(rate / transition_rate)). The smooth transition replaces the jump of
/// dry friction, so a joint creeps where a real one sticks; the user chooses the transition rate. With the model
/// `sticking` the torque is -(viscous rate + coulomb sign(rate)) in motion. At rest it is the torque that holds the
/// joint, up to breakaway(): docs/theory, (19.1).
struct JointFriction {
  enum class Model { smooth, sticking };
  double viscous = 0;             // [N m s/rad or N s/m]
  double coulomb = 0;             // [N m or N]
  double transition_rate = 1e-3;  // of the model smooth [rad/s or m/s]
  Model model = Model::smooth;
  std::optional<double> static_effort = {};  // of the model sticking, at least coulomb [N m or N]; absent: coulomb

  /// The maximum friction effort of a sticking joint at rest.
  double breakaway() const { return static_effort.value_or(coulomb); }
};

/// Torque ripple: the motor's effort is multiplied by 1 + amplitude sin(per_turn gear_ratio q + phase).
struct TorqueRipple {
  double amplitude = 0;  // from 0 to 1
  double per_turn = 1;   // periods per motor revolution
  double phase = 0;      // [rad]
};

/// Capability and consumption of a motor, in terms of its joint.
struct JointMotor {
  /// No-load rate: the maximum effort in the direction of motion decreases linearly from limits.effort at rest to zero
  /// at this rate [rad/s or m/s].
  double no_load_rate = std::numeric_limits<double>::infinity();
  std::optional<TorqueRipple> ripple = {};
  double torque_constant = 0;  // of the motor, effort over gear_ratio and current [N m/A]; 0: unknown
  double resistance = 0;       // of its winding [Ohm]
};

/// A linear spring and damper at a joint with one axis: effort -stiffness (q - rest) - damping rate, (22.1) of
/// docs/theory. With backlash the spring acts beyond half of it on either side. Joints with a spring are not driven:
/// panel hinges, elastic gears, segments of flexible links.
struct JointSpring {
  double stiffness = 0;  // [N m/rad or N/m]
  double damping = 0;    // [N m s/rad or N s/m]
  double rest = 0;       // [rad or m]
  double backlash = 0;   // range centred on `rest` without spring force [rad or m]

  /// Deflection of the spring.
  double deflection(double q) const {
    const double x = q - rest, half = 0.5 * backlash;
    return x > half ? x - half : x < -half ? x + half : backlash > 0 ? 0 : x;
  }
  double effort(double q) const { return -stiffness * deflection(q); }                       // of the spring alone
  double energy(double q) const { return 0.5 * stiffness * deflection(q) * deflection(q); }  // [J]
};

/// Elasticity of the gear between motor and body of a driven joint (flexible_robot() converts it to a joint with a
/// spring; a Model treats it as rigid).
struct JointElasticity {
  double stiffness = 0;  // seen at the joint [N m/rad or N/m]
  double damping = 0;    // likewise [N m s/rad or N s/m]
  double backlash = 0;   // free motion of the link with a locked motor [rad or m]
};

/// A joint with one axis that belongs to a modal chain: its rate is modes . eta', with the same few eta for all joints
/// of the chain. The joints of a chain are consecutive, each on the body of the previous one. A flexible link with mode
/// shapes is such a chain.
struct ModalJoint {
  std::string chain;
  std::vector<double> rates;  // of the joint, per rate of every mode; equal length for all joints of a chain
};

/// One term of a coupling: a coupled joint has the value sum of ratio (value of `joint`) + offset over its terms.
struct CouplingTerm {
  std::string joint;
  double ratio = 1;   // [1], or [m/rad], [rad/m] between a sliding and a turning joint
  double offset = 0;  // [rad or m]
};

/// A joint between a body and its parent.
struct JointDescription {
  std::string name;
  JointType type = JointType::fixed;
  Vector3d axis{0, 0, 1};  // unit vector in the joint's frame
  JointLimits limits;
  JointFriction friction;
  double rotor_inertia = 0;  // of the motor about its own axis [kg m^2]
  double gear_ratio = 1;     // motor revolutions per joint revolution [1, or rad/m for a prismatic joint]
  /// The rotor's axis, a unit vector in the joint's frame, which is fixed to the parent. The parent carries the rotor,
  /// which rotates about this axis gear_ratio times as fast as the joint. Absent: the rotor only adds to the joint's
  /// inertia. Present: its spin contributes to the momentum, (19.6) of docs/theory.
  std::optional<Vector3d> rotor_axis = {};
  std::optional<JointMotor> motor = {};
  std::optional<JointSpring> spring = {};
  std::optional<JointElasticity> elasticity = {};
  std::optional<ModalJoint> modal = {};
  /// A gear, belt or linkage ties the joint to these joints. It has no motor: the coupling moves it. Empty:
  /// independent.
  std::vector<CouplingTerm> mimic = {};

  /// Contribution of the rotor to the joint's diagonal entry of the mass matrix [kg m^2 or kg].
  double reflected_inertia() const { return gear_ratio * gear_ratio * rotor_inertia; }
  /// The rotor's spin momentum per joint rate, in the joint's frame [kg m^2, or kg m]; zero without an axis.
  Vector3d rotor_momentum() const { return rotor_axis ? gear_ratio * rotor_inertia * *rotor_axis : Vector3d::zero(); }
};

/// Material of a beam: isotropic and linear.
struct BeamMaterial {
  double young_modulus = 0;  // E [Pa]
  double shear_modulus = 0;  // G [Pa]
  double density = 0;        // [kg/m^3]
};

/// Cross section of a beam: a circle, or a rectangle along its principal axes; solid, or hollow with constant wall
/// thickness.
struct BeamSection {
  std::optional<double> diameter = {};        // outer, of a circle [m]
  std::optional<double> width = {};           // outer, of a rectangle along y [m]
  std::optional<double> height = {};          // likewise along z [m]
  std::optional<double> wall_thickness = {};  // absent: solid [m]
};

/// Properties of a beam at a station. Properties not given at stations are constant along the beam.
struct BeamStation {
  double at = 0;  // from the beam's beginning [m]
  std::optional<double> mass_per_length = {};
  std::optional<double> rotary_inertia = {};
  std::optional<double> bending_stiffness_y = {};
  std::optional<double> bending_stiffness_z = {};
  std::optional<double> torsional_stiffness = {};
  std::optional<double> axial_stiffness = {};
  std::optional<BeamSection> section = {};
};

/// A straight flexible beam within a body, for bending and torsion (flexible_robot() converts it to segments on
/// springs; a Model treats it as rigid). x: along the beam; y and z: principal axes of its section. Parts of the body
/// before the beam's begin move with the begin, parts beyond its end with the end.
struct BeamDescription {
  Vector3d from = Vector3d::zero(), to = Vector3d::zero();  // its ends, in the body's frame [m]
  /// Direction of y; its component across the beam is used. Absent: the body's y axis, or its z axis for a beam along
  /// y.
  std::optional<Vector3d> section_y = {};
  std::optional<double> mass_per_length = {};      // absent: the beam has the whole mass of the body [kg/m]
  double rotary_inertia = 0;                       // of the section about the beam, per length [kg m]
  std::optional<double> bending_stiffness_y = {};  // E I about y; absent: rigid [N m^2]
  std::optional<double> bending_stiffness_z = {};  // E I about z; absent: rigid [N m^2]
  std::optional<double> torsional_stiffness = {};  // G J; absent: rigid [N m^2]
  std::optional<double> axial_stiffness = {};      // E A; absent: inextensible [N]
  std::optional<BeamMaterial> material = {};       // with sections, instead of the six values above
  bool stretches = false;                          // with sections: whether E A counts
  std::optional<BeamSection> section = {};         // all along it
  std::vector<BeamStation> stations = {};  // from end to end: numbers, or sizes of sections, are linear between them
  double damping_ratio = 0;                // of its first mode of each kind, for the beam alone clamped at `from`
  int segments = 4;                        // equal lengths, each of which yields at its two Gauss points
  /// It yields only by so many of its slowest modes of each kind, bending about y, about z, stretching, twisting, that
  /// it has when it is clamped where it begins and carries what hangs on its link; absent: by all that segments allow.
  std::optional<int> modes = {};
  double fastest_mode = 100;  // none of these may be faster [Hz]
};

/// A vibration mode of a structure clamped at a body's frame, as specified by manufacturers of solar panels and
/// computed by finite-element programs. With modal coordinates of unit modal mass, a modal rate of 1 has these momenta
/// about the frame's origin (flexible_robot() converts it to a mass and a rotor on a spring; a Model treats it as
/// rigid).
struct VibrationMode {
  double frequency = 0;  // [Hz]
  double damping_ratio = 0;
  Vector3d translation = Vector3d::zero();  // participation [kg^(1/2)]
  Vector3d rotation = Vector3d::zero();     // [kg^(1/2) m]
};

/// A rigid body and the joint that carries it. The body's frame is at the joint: X_PB(q) = X_PF * joint motion(q).
struct BodyDescription {
  std::string name;
  std::string parent;              // name of the parent body; empty: the world
  Posed X_PF = Posed::identity();  // joint frame in the parent's frame
  JointDescription joint;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the body's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in the body's axes [kg m^2]
  std::optional<BeamDescription> beam = {};
  std::vector<VibrationMode> modes = {};  // alternative to a beam
  /// Name of the flexible link of which it is a part, or an intermediate body between two joints; empty: it is none.
  /// Its mass, or its inertia about some axis, may be zero if attached parts have it, or negative if the carrying part
  /// compensates.
  std::string part_of = {};
};

/// A named frame fixed on a body: an end-effector, a grasp point, a sensor.
struct FrameDescription {
  std::string name;
  std::string body;
  Posed X_BE = Posed::identity();  // in the body's frame
};

}  // namespace grapnel
