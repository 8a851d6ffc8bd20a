#include "grapnel/impact/contact_force.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

double exponent(const CompliantContact& contact) {
  switch (contact.model) {
    case ContactForceModel::kelvin_voigt:
      return 1;
    case ContactForceModel::hertz:
      return 1.5;
    default:
      return contact.exponent;
  }
}

}  // namespace

NormalForce normal_force(const CompliantContact& contact, double deformation, double rate) {
  const double k = contact.stiffness;
  NormalForce f;
  if (contact.model == ContactForceModel::kelvin_voigt) {
    f.elastic = k * deformation;
    f.total = f.elastic + contact.damping * rate;  // (12.4)
    f.energy = 0.5 * f.elastic * deformation;
    return f;
  }
  const double d = std::max(deformation, 0.0), n = exponent(contact);
  f.elastic = k * (n == 1.5 ? d * std::sqrt(d) : std::pow(d, n));  // (12.5)
  f.energy = f.elastic * d / (n + 1);
  f.total = contact.model == ContactForceModel::hertz ? f.elastic : f.elastic * (1 + contact.damping * rate);  // (12.6)
  return f;
}

double largest_deformation(const CompliantContact& contact, double mass, double speed) {
  // k d^(n+1) / (n + 1) = m v^2 / 2
  const double n = exponent(contact);
  return std::pow((n + 1) / 2 * mass * speed * speed / contact.stiffness, 1 / (n + 1));
}

}  // namespace grapnel
