#pragma once

/// @file
/// A beam within a link, as flexible_robot() divides it: sections along its length, hinges with springs, rigid pieces
/// between them; (22.2) to (22.5a) of docs/theory. Internal to this module.

#include <string>
#include <vector>

#include "grapnel/model/description.hpp"

namespace grapnel {

/// Properties of a beam at one position. A stiffness of zero means that the beam is rigid in this direction.
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

/// Properties of a section and a material: exact for bending, and for torsion of circles and solid rectangles; Bredt's
/// formula for hollow rectangles with thin walls (Timoshenko & Goodier 1970, sections 109 and 115).
BeamProperties section_properties(const BeamSection& section, const BeamMaterial& material);

/// The error in a beam's description alone, without its link; empty: none.
std::string description_fault(const BeamDescription& beam);

class Beam {
 public:
  /// The beam of a link for which description_fault() is empty. If its mass equals the link's to within kSameMass, it
  /// is set to the link's exactly.
  explicit Beam(const BodyDescription& link);

  /// Relative difference up to which two masses, stated or computed from sections, count as equal.
  static constexpr double kSameMass = 1e-4;

  /// Number of hinges: the two Gauss points of each segment, with half of its compliance each. For any smooth weight
  /// function, kinetic energy and work of loads are then of fourth order in the segments' length; hinges at the
  /// midpoints would give second order (22.2).
  int hinges() const { return 2 * setup_.segments; }
  double length() const { return length_; }
  double mass() const { return whole_.mass; }
  const Vector3d& x() const { return x_; }

  /// Pieces 0 to hinges(): begin and end, from the beam's beginning [m].
  double begin(int piece) const { return piece == 0 ? 0 : hinge_at(piece - 1); }
  double end(int piece) const { return piece == hinges() ? length_ : hinge_at(piece); }
  Vector3d at(double s) const { return setup_.from + s * x_; }
  /// The piece that contains a point of the link.
  int piece_of(const Vector3d& p) const;
  /// The piece's origin in the link's frame, undeformed: the link's origin, or the hinge.
  Vector3d origin(int piece) const { return piece == 0 ? Vector3d::zero() : at(begin(piece)); }
  /// Inertia of a slender rod with the piece's mass, plus the piece's part of spread(), about the piece's origin.
  RigidBodyInertiad piece_inertia(int piece) const;
  /// Inertia of the whole beam, about the link's origin, without the part of spread().
  RigidBodyInertiad inertia() const;
  Vector3d com() const { return at(whole_.middle); }
  /// Of the whole beam, about its centre of mass [kg m^2]: about the beam's axis, and about the section's axes y and z.
  double inertia_along() const { return whole_.along; }
  double inertia_y() const { return whole_.y; }
  double inertia_z() const { return whole_.z; }

  struct Hinge {
    const char* name;
    JointType type;
    Vector3d axis;
    JointSpring spring;
  };
  /// The springs at a hinge, from the inside out (22.2), (22.3).
  std::vector<Hinge> springs(int hinge) const;

  /// Distributes the inertia that a link has beyond its beam as a slender rod over the pieces, by mass. For links
  /// without other mass.
  void spread(const Symmetric3d& rest) { spread_ = rest; }
  /// Whether every part has inertia about the beam's axis, so that it can twist.
  bool has_rotary_inertia() const;
  bool twists() const { return at_length(0).torsional_stiffness > 0; }

 private:
  // Mass properties of a part of the beam.
  struct Rod {
    double mass = 0, middle = 0;     // [kg]; its centre of mass, from the beam's beginning [m]
    double along = 0, y = 0, z = 0;  // about the centre of mass, about x, y and z of the beam [kg m^2]
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
  double mass_per_length_ = 0;  // if neither the beam nor its stations state it
  Vector3d x_, y_, z_;
  Rod whole_;
  Symmetric3d spread_ = Symmetric3d::zero();
  double rate_y_ = 0, rate_z_ = 0;  // first frequencies of the clamped beam alone [rad/s]
};

}  // namespace grapnel
