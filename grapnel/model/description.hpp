#pragma once

/// @file
/// Plain data that describe bodies, joints and frames, as a file or a program gives them. ModelBuilder turns them into
/// an immutable Model. Public, kept stable.

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "grapnel/model/joint_type.hpp"
#include "grapnel/spatial/spatial_vector.hpp"

namespace grapnel {

/// What a joint meets at the ends of its range: a stop that throws it back with `restitution` times the rate at which
/// it came. Below the rate `rest_rate` it comes to rest there.
struct JointStop {
  double restitution = 0;   // from 0 to 1
  double rest_rate = 1e-4;  // [rad/s or m/s]
};

/// Position limits [rad or m], rate limit [rad/s or m/s], effort limit [N m or N]; infinite where none is given.
/// Without a stop nothing keeps the joint within its range.
struct JointLimits {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  double rate = std::numeric_limits<double>::infinity();
  double effort = std::numeric_limits<double>::infinity();
  std::optional<JointStop> stop = {};
};

/// Friction torque -(viscous rate + coulomb tanh(rate / transition_rate)). The smooth transition stands for the jump of
/// dry friction, so a joint creeps where a real one sticks; the rate at which it does is the user's to choose. With the
/// model `sticking` it is -(viscous rate + coulomb sign(rate)) while the joint moves, and at rest whatever holds the
/// joint, up to breakaway(): docs/theory, (19.1).
struct JointFriction {
  enum class Model { smooth, sticking };
  double viscous = 0;             // [N m s/rad or N s/m]
  double coulomb = 0;             // [N m or N]
  double transition_rate = 1e-3;  // of the model smooth [rad/s or m/s]
  Model model = Model::smooth;
  std::optional<double> static_effort = {};  // of the model sticking, at least coulomb [N m or N]; absent: coulomb

  /// The largest effort with which a sticking joint holds itself.
  double breakaway() const { return static_effort.value_or(coulomb); }
};

/// A motor's effort that swings with its angle: times 1 + amplitude sin(per_turn gear_ratio q + phase).
struct TorqueRipple {
  double amplitude = 0;  // from 0 to 1
  double per_turn = 1;   // periods in a turn of the motor
  double phase = 0;      // [rad]
};

/// What a motor can do, and what it takes, as seen at its joint.
struct JointMotor {
  /// Rate at which no effort is left in the sense of motion: the largest effort falls on a line from limits.effort at
  /// rest to nothing there [rad/s or m/s].
  double no_load_rate = std::numeric_limits<double>::infinity();
  std::optional<TorqueRipple> ripple = {};
  double torque_constant = 0;  // of the motor, effort over gear_ratio and current [N m/A]; 0: not known
  double resistance = 0;       // of its winding [Ohm]
};

/// A linear spring and damper at a joint of one axis, which pulls it back to `rest`: effort -stiffness (q - rest) -
/// damping rate, (22.1) of docs/theory; with backlash it begins to pull at half of that on either side. Joints with
/// a spring are not driven: hinges of panels, gears that yield, pieces of links that bend.
struct JointSpring {
  double stiffness = 0;  // [N m/rad or N/m]
  double damping = 0;    // [N m s/rad or N s/m]
  double rest = 0;       // [rad or m]
  double backlash = 0;   // within half of it on either side of `rest` the spring does nothing [rad or m]

  /// How far the spring is deflected.
  double deflection(double q) const {
    const double x = q - rest, half = 0.5 * backlash;
    return x > half ? x - half : x < -half ? x + half : backlash > 0 ? 0 : x;
  }
  double effort(double q) const { return -stiffness * deflection(q); }                       // of the spring alone
  double energy(double q) const { return 0.5 * stiffness * deflection(q) * deflection(q); }  // [J]
};

/// How the gear of a driven joint yields between its motor and its body (flexible_robot() makes a joint with a spring
/// of it; a Model takes it for rigid).
struct JointElasticity {
  double stiffness = 0;  // seen at the joint [N m/rad or N/m]
  double damping = 0;    // likewise [N m s/rad or N s/m]
  double backlash = 0;   // how far the link can be moved, seen at the joint, before the gear resists [rad or m]
};

/// A joint of one axis that does not move by itself: together with the other joints of its chain it moves by a few
/// modes, rate = modes . eta', with the same eta for all of them. The joints of a chain follow each other, one on the
/// body of the one before it; a link that bends by its own modes is one.
struct ModalJoint {
  std::string chain;
  std::vector<double> rates;  // of the joint, per rate of every mode; as many for all joints of a chain
};

/// A joint between a body and its parent.
struct JointDescription {
  std::string name;
  JointType type = JointType::fixed;
  Vector3d axis{0, 0, 1};  // unit vector in the joint's frame
  JointLimits limits;
  JointFriction friction;
  double rotor_inertia = 0;  // of the motor about its own axis [kg m^2]
  double gear_ratio = 1;     // motor turns per joint turn [1, or rad/m for a prismatic joint]
  /// The rotor's axis, unit, in the joint's frame, which is the parent's but for its mount: about it the rotor, which
  /// the parent carries, turns gear_ratio times as fast as the joint. Absent: the rotor adds to the joint's inertia
  /// alone. Present: its spin counts in the momentum, (19.6) of docs/theory.
  std::optional<Vector3d> rotor_axis = {};
  std::optional<JointMotor> motor = {};
  std::optional<JointSpring> spring = {};
  std::optional<JointElasticity> elasticity = {};
  std::optional<ModalJoint> modal = {};

  /// What the rotor adds to the joint's diagonal of the mass matrix [kg m^2 or kg].
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

/// Shape of a beam's section: a circle, or a rectangle along its principal axes; solid, or hollow with walls of one
/// thickness.
struct BeamSection {
  std::optional<double> diameter = {};        // outer, of a circle [m]
  std::optional<double> width = {};           // outer, of a rectangle along y [m]
  std::optional<double> height = {};          // likewise along z [m]
  std::optional<double> wall_thickness = {};  // absent: solid [m]
};

/// A beam at one place of its length. What a station does not state is the beam's own all along it.
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

/// A straight beam within a body, along which the body bends and twists (flexible_robot() makes pieces on springs of
/// it; a Model takes it for rigid). x: along the beam; y and z: principal axes of its section. What of the body is
/// before its beginning moves with that, what is beyond its end with the end.
struct BeamDescription {
  Vector3d from = Vector3d::zero(), to = Vector3d::zero();  // its ends, in the body's frame [m]
  /// Direction of y, of which what is across the beam counts; absent: the body's y axis, of a beam along that its z
  /// axis.
  std::optional<Vector3d> section_y = {};
  std::optional<double> mass_per_length = {};      // absent: it has the whole mass of the body [kg/m]
  double rotary_inertia = 0;                       // of the section about the beam, per length [kg m]
  std::optional<double> bending_stiffness_y = {};  // E I about y; absent: rigid [N m^2]
  std::optional<double> bending_stiffness_z = {};  // E I about z; absent: rigid [N m^2]
  std::optional<double> torsional_stiffness = {};  // G J; absent: rigid [N m^2]
  std::optional<double> axial_stiffness = {};      // E A; absent: it does not stretch [N]
  std::optional<BeamMaterial> material = {};       // with sections, in place of the six above
  bool stretches = false;                          // with sections: whether E A counts
  std::optional<BeamSection> section = {};         // all along it
  std::vector<BeamStation> stations = {};  // from end to end: numbers, or sizes of sections, are linear between them
  double damping_ratio = 0;                // of its first mode of each kind, clamped at `from`, by itself
  int segments = 4;                        // equal lengths, each of which yields at its two Gauss points
  /// It yields only by so many of its slowest modes of each kind, bending about y, about z, stretching, twisting, that
  /// it has when it is clamped where it begins and carries what hangs on its link; absent: by all that segments allow.
  std::optional<int> modes = {};
  double fastest_mode = 100;  // none of these may be faster [Hz]
};

/// A mode of vibration of what is clamped at a body's frame, as makers of solar panels and finite-element programs
/// state it: with the mode's coordinate in the norm of unit modal mass, a rate of one has these momenta about the
/// frame's origin (flexible_robot() makes a mass and a rotor on a spring of it; a Model takes it for rigid).
struct VibrationMode {
  double frequency = 0;  // [Hz]
  double damping_ratio = 0;
  Vector3d translation = Vector3d::zero();  // participation [kg^(1/2)]
  Vector3d rotation = Vector3d::zero();     // [kg^(1/2) m]
};

/// A rigid body and the joint that carries it. Its frame sits at the joint: X_PB(q) = X_PF * joint motion(q).
struct BodyDescription {
  std::string name;
  std::string parent;              // name of the parent body; empty: the world
  Posed X_PF = Posed::identity();  // joint frame in the parent's frame
  JointDescription joint;
  double mass = 0;                            // [kg]
  Vector3d com = Vector3d::zero();            // in the body's frame [m]
  Symmetric3d inertia = Symmetric3d::zero();  // about the centre of mass, in the body's axes [kg m^2]
  std::optional<BeamDescription> beam = {};
  std::vector<VibrationMode> modes = {};  // in place of a beam
  /// A part of a flexible body, or what lies between two of its joints. It may lack mass, or inertia about some axis,
  /// which the parts that hang on it have, and may have less than none, which the part that carries it has.
  bool is_part = false;
};

/// A named frame fixed on a body: an end-effector, a grasp point, a sensor.
struct FrameDescription {
  std::string name;
  std::string body;
  Posed X_BE = Posed::identity();  // in the body's frame
};

}  // namespace grapnel
