#include "grapnel/contact/contact_material.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace grapnel {

namespace {

void check(const ContactMaterial& m) {
  const auto valid = [](double x) { return std::isfinite(x) && x >= 0; };
  if (!valid(m.modulus) || !valid(m.stiffness) || !valid(m.damping) || !valid(m.dissipation) ||
      !valid(m.static_friction) || !valid(m.kinetic_friction) || !valid(m.rolling_length) ||
      !valid(m.torsional_length)) {
    throw std::invalid_argument("ContactMaterial: a value is negative or not finite");
  }
  const auto positive = [](double x) { return std::isfinite(x) && x > 0; };
  if (!positive(m.damping_depth) || !positive(m.stiction_speed) || !positive(m.stiction_displacement) ||
      !positive(m.stiction_rate) || !positive(m.rest_speed)) {
    throw std::invalid_argument(
        "ContactMaterial: damping_depth, stiction_speed, stiction_displacement, stiction_rate and rest_speed must be "
        "positive");
  }
  if (!(m.restitution >= 0 && m.restitution <= 1)) {
    throw std::invalid_argument("ContactMaterial: restitution must be within [0, 1]");
  }
  if (!(m.poisson_ratio > -1 && m.poisson_ratio <= 0.5)) {
    throw std::invalid_argument("ContactMaterial: poisson_ratio must be within (-1, 0.5]");
  }
  if ((m.modulus > 0) == (m.stiffness > 0)) {
    throw std::invalid_argument("ContactMaterial: exactly one of modulus and stiffness must be positive");
  }
}

double elasticity(const ContactMaterial& m) {
  return m.modulus > 0 ? m.modulus / (1 - m.poisson_ratio * m.poisson_ratio) : m.stiffness;
}

constexpr ContactMaterial published(double modulus, double poisson_ratio, double static_friction = 0,
                                    double kinetic_friction = 0) {
  ContactMaterial m;
  m.modulus = modulus, m.poisson_ratio = poisson_ratio;
  m.static_friction = static_friction, m.kinetic_friction = kinetic_friction;
  return m;
}

constexpr PublishedMaterial kPublished[] = {
    {"aluminium", published(68.9e9, 0.33, 1.05, 1.05), true,
     "6061-T6: https://www.glemco.com/capabilities/material-expertise/aluminum-6061-t6/ (Aluminum Association, "
     "typical). Friction, dry, static 1.05 to 1.35, the kinetic one set equal: Lawrence Berkeley National Laboratory, "
     "http://www-eng.lbl.gov/~ajdemell/coefficients_of_friction.html"},
    {"steel", published(200e9, 0.29, 0.74, 0.57), true,
     "ASTM A36, 29e6 psi: Multimedia Engineering Mechanics, appendix Material Properties, http://ecoursesbook.com. "
     "Friction, mild steel, dry and clean: https://mech.subwiki.org/wiki/Table_of_friction_coefficients"},
    {"titanium", published(113.8e9, 0.342), false,
     "Ti-6Al-4V ELI, annealed: ASM, https://asm.matweb.com/search/SpecificMaterial.asp?bassnum=MTP643"},
    {"kapton", published(2.5e9, 0.34, 0.63, 0.48), true,
     "HN film at 23 deg C, film on film: DuPont's table at "
     "http://mu2e.phy.duke.edu/cw/misc/0404_kapton_properties.cfm.htm"},
    {"rubber", published(1.5e6, 0.5), false,
     "natural rubber, vulcanized, shear modulus 0.5 MPa, incompressible (E = 3 G): MatWeb, "
     "https://www.matweb.com/search/DataSheet.aspx?matguid=6588439546ac4492965c894ddff3f5da"},
};

}  // namespace

ContactLaw combine(const ContactMaterial& a, const ContactMaterial& b) {
  check(a), check(b);
  if ((a.modulus > 0) != (b.modulus > 0)) {
    throw std::invalid_argument("combine: both materials need a modulus, or both a stiffness");
  }
  ContactLaw law;
  law.hertz = a.modulus > 0;
  law.elastic_a = elasticity(a), law.elastic_b = elasticity(b);
  const double sum = law.elastic_a + law.elastic_b;
  law.elastic = law.elastic_a * law.elastic_b / sum;
  const double part_a = law.elastic_b / sum, part_b = law.elastic_a / sum;  // of the deformation
  law.damping = a.damping * part_a * part_a + b.damping * part_b * part_b;
  law.damping_depth = std::max(a.damping_depth, b.damping_depth);
  law.dissipation = a.dissipation * part_a + b.dissipation * part_b;
  law.static_friction = std::sqrt(a.static_friction * b.static_friction);
  law.kinetic_friction = std::sqrt(a.kinetic_friction * b.kinetic_friction);
  law.stiction_speed = std::max(a.stiction_speed, b.stiction_speed);
  law.stiction_displacement = std::max(a.stiction_displacement, b.stiction_displacement);
  law.rolling_length = std::sqrt(a.rolling_length * b.rolling_length);
  law.torsional_length = std::sqrt(a.torsional_length * b.torsional_length);
  law.stiction_rate = std::max(a.stiction_rate, b.stiction_rate);
  law.hard = a.hard && b.hard;
  if (law.hard) law.restitution = a.restitution * part_a + b.restitution * part_b;
  law.rest_speed = std::max(a.rest_speed, b.rest_speed);
  return law;
}

// u (1 + e) = log((1 + u) / (1 - e u)) for u = a v in (0, 1/e), by bisection: the right-hand side minus the left-hand
// side is negative near zero and infinite at 1/e.
double dissipation_for(double restitution, double approach_speed) {
  const double e = restitution;
  if (!(e > 0 && e <= 1) || !(std::isfinite(approach_speed) && approach_speed > 0)) {
    throw std::invalid_argument("dissipation_for: restitution must be within (0, 1], approach_speed positive");
  }
  if (e == 1) return 0;
  double low = 0, high = 1 / e;
  for (int step = 0; step < 200; ++step) {
    const double u = 0.5 * (low + high);
    (std::log1p(u) - std::log1p(-e * u) > u * (1 + e) ? high : low) = u;
  }
  return 0.5 * (low + high) / approach_speed;
}

std::span<const PublishedMaterial> published_materials() { return kPublished; }

const PublishedMaterial* published_material(std::string_view name) {
  for (const PublishedMaterial& m : kPublished) {
    if (m.name == name) return &m;
  }
  return nullptr;
}

}  // namespace grapnel
