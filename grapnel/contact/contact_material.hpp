#pragma once

/// @file
/// Materials of surfaces in contact, the rule that combines two of them, and ready-made materials with their sources.
/// Thread safety: plain values and pure functions. Public, kept stable.

#include <span>
#include <string>
#include <string_view>

namespace grapnel {

/// The surface of one body. Either `modulus` with `poisson_ratio` (Hertz and pressure fields), or `stiffness` (linear).
struct ContactMaterial {
  double modulus = 0;           // Young's modulus E [Pa]; 0: linear stiffness instead
  double poisson_ratio = 0;     // nu
  double stiffness = 0;         // of a contact [N/m]; of polyhedra and cylinders: see contact_shape.hpp
  double damping = 0;           // of a contact [N s/m], in full from the depth damping_depth on
  double damping_depth = 1e-4;  // [m]
  double dissipation = 0;       // a of Hunt and Crossley [s/m]: the elastic force times (1 + a * approach speed)
  double static_friction = 0;   // coefficients
  double kinetic_friction = 0;
  double stiction_speed = 1e-2;  // slip speed around which friction falls from static to kinetic [m/s]
  /// Elastic tangential displacement up to the static friction [m]: bodies stick up to it (23.7a).
  double stiction_displacement = 1e-4;
  double rolling_length = 0;    // couple against rolling per normal force [m]
  double torsional_length = 0;  // couple against spinning about the normal per normal force [m]
  double stiction_rate = 1e-3;  // of the maximum of the couple against rolling [rad/s]
  /// Hard: contact begins with an impact in an instant, unless it is slower than rest_speed (ContactSet). Two hard
  /// surfaces are needed; with a compliant one, the contact is compliant.
  bool hard = false;
  double restitution = 0;    // of these impacts, 0 to 1
  double rest_speed = 1e-3;  // largest approach speed at which persistent contact begins [m/s]
};

/// Two materials in contact.
struct ContactLaw {
  bool hertz = false;
  double elastic_a = 0, elastic_b = 0;  // hertz: E / (1 - nu^2) of each [Pa]; otherwise its stiffness [N/m]
  double elastic = 0;                   // both in series: E* or k
  double damping = 0;
  double damping_depth = 0;
  double dissipation = 0;
  double static_friction = 0;
  double kinetic_friction = 0;
  double stiction_speed = 0;
  double stiction_displacement = 0;
  double rolling_length = 0;
  double torsional_length = 0;
  double stiction_rate = 0;
  bool hard = false;
  double restitution = 0;  // of impacts; hard only
  double rest_speed = 0;
};

/// The law of two materials (23.3): elasticities in series; damping, dissipation and restitution weighted by each one's
/// part of the deformation; geometric means of friction coefficients and of lengths; the larger speed, rate,
/// displacement and depth; hard if both are. Independent of the order, except elastic_a and elastic_b. @throws
/// std::invalid_argument if a value is negative or not finite, if a Poisson's ratio is not within (-1, 0.5], if a
/// restitution is not within [0, 1], if a stiction speed, rate or displacement, a damping depth or a rest speed is not
/// positive, or if not both materials state a modulus, or both a stiffness.
ContactLaw combine(const ContactMaterial& a, const ContactMaterial& b);

/// The dissipation a [s/m] with which a collision of `approach_speed` [m/s] has the coefficient of restitution e: a
/// solution of (23.6), for all masses and elastic laws. @throws std::invalid_argument if e is not within (0, 1] or the
/// speed is not positive.
double dissipation_for(double restitution, double approach_speed);

/// A published material. Values that its sources do not state are zero.
struct PublishedMaterial {
  std::string_view name;
  ContactMaterial material;
  bool states_friction;     // on a surface of the same material, dry, in air
  std::string_view source;  // of elasticity; then of friction
};
std::span<const PublishedMaterial> published_materials();
/// The published material of this name; null if there is none.
const PublishedMaterial* published_material(std::string_view name);

}  // namespace grapnel
