#pragma once

/// @file
/// A beam within a link, as flexible_robot() cuts it: sections along its length, places that yield, pieces between
/// them; (22.2) to (22.5a) of docs/theory. Internal to this module.

#include <string>
#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

/// What a beam is at one place. A stiffness of zero stands for a beam that does not yield so.
struct BeamProperties {
  double mass_per_length = 0;      // [kg/m]
  double rotary_inertia = 0;       // of the section about the beam, per length [kg m]
  double bending_stiffness_y = 0;  // E I about y [N m^2]
  double bending_stiffness_z = 0;  // E I about z [N m^2]
  double torsional_stiffness = 0;  // G J [N m^2]
  double rotary_inertia_y = 0;     // of the section about its principal axes, per length, whose sum is rotary_inertia
  double rotary_inertia_z = 0;     // [kg m]
  double axial_stiffness = 0;      // E A [N]
};

/// Of a section and a material: bending exact, torsion exact for circles and solid rectangles, Bredt's for hollow
/// rectangles with thin walls (Timoshenko & Goodier 1970, sections 109 and 115).
BeamProperties section_properties(const BeamSection& section, const BeamMaterial& material);

/// What is wrong with a beam's description by itself, without the link that it is in; empty: nothing.
std::string description_fault(const BeamDescription& beam);

class Beam {
 public:
  /// Of a link's beam in which description_fault() finds nothing. Where its mass is the link's but for what rounding
  /// of the numbers in a file may be (kSameMass), it is made the link's exactly.
  explicit Beam(const BodyDescription& link);

  /// Relative difference of two masses that are stated, or follow from sections, and are meant to be one.
  static constexpr double kSameMass = 1e-4;

  /// Places that yield: the two Gauss points of every segment, with half of its compliance each. Whatever smooth
  /// function a beam's deflection is weighed with, its kinetic energy and what loads do to it, is then right to the
  /// fourth order in the segments' length; in their middles it would be to the second (22.2).
  int hinges() const { return 2 * setup_.segments; }
  double length() const { return length_; }
  double mass() const { return whole_.mass; }
  const Vector3d& x() const { return x_; }

  /// Pieces 0 to hinges(): where they begin and end, from the beam's beginning [m].
  double begin(int piece) const { return piece == 0 ? 0 : hinge_at(piece - 1); }
  double end(int piece) const { return piece == hinges() ? length_ : hinge_at(piece); }
  Vector3d at(double s) const { return setup_.from + s * x_; }
  /// On which piece a point of the link is.
  int piece_of(const Vector3d& p) const;
  /// The piece's origin in the link's frame, undeformed: the link's own, or where it is hinged.
  Vector3d origin(int piece) const { return piece == 0 ? Vector3d::zero() : at(begin(piece)); }
  /// A slender rod of the beam's mass, with what spread() has added, about the piece's origin.
  RigidBodyInertiad piece_inertia(int piece) const;
  /// The whole beam, about the link's origin, without what spread() has added.
  RigidBodyInertiad inertia() const;
  Vector3d com() const { return at(whole_.middle); }
  /// Of the whole, about its centre of mass [kg m^2]: about the beam itself, and about the section's axes y and z.
  double inertia_along() const { return whole_.along; }
  double inertia_y() const { return whole_.y; }
  double inertia_z() const { return whole_.z; }

  struct Hinge {
    const char* name;
    JointType type;
    Vector3d axis;
    JointSpring spring;
  };
  /// At a place that yields, from the inside out (22.2), (22.3).
  std::vector<Hinge> springs(int hinge) const;

  /// What a link that is nothing but its beam has beyond a slender rod is spread over the pieces, by their mass.
  void spread(const Symmetric3d& rest) { spread_ = rest; }
  /// Whether all of it has inertia about the beam, so that it can twist.
  bool has_rotary_inertia() const;
  bool twists() const { return at_length(0).torsional_stiffness > 0; }

 private:
  // Of a part of it.
  struct Rod {
    double mass = 0, middle = 0;     // [kg]; its centre of mass, from the beam's beginning [m]
    double along = 0, y = 0, z = 0;  // about that, about x, y and z of the beam [kg m^2]
  };
  BeamProperties at_length(double s) const;
  Rod rod(double begin, double end) const;
  double hinge_at(int i) const;
  double compliant_length() const { return length_ / hinges(); }
  Symmetric3d about_com(const Rod& part) const;
  double spread_along() const;
  double first_rate(double BeamProperties::*stiffness) const;

  BeamDescription setup_;
  double length_ = 0, mass_scale_ = 1;
  double mass_per_length_ = 0;  // where neither the beam nor its stations state it
  Vector3d x_, y_, z_;
  Rod whole_;
  Symmetric3d spread_ = Symmetric3d::zero();
  double rate_y_ = 0, rate_z_ = 0;  // first frequencies, clamped, by itself [rad/s]
};

}  // namespace grapnel
