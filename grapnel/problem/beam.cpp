#include "grapnel/problem/beam.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace grapnel {
namespace {

constexpr double kEnds = 1e-6;  // tolerance of the first and last station at the beam's ends, relative to its length

// For uniform beams clamped at one end: first roots of 1 + cos b cosh b (bending) and of cos b (torsion).
constexpr double kFirstBending = 1.8751040687119611, kFirstTorsion = 0.5 * std::numbers::pi;

constexpr double BeamProperties::*kProperties[] = {
    &BeamProperties::mass_per_length,     &BeamProperties::rotary_inertia,      &BeamProperties::bending_stiffness_y,
    &BeamProperties::bending_stiffness_z, &BeamProperties::torsional_stiffness, &BeamProperties::axial_stiffness};
using Stated = std::optional<double>;
constexpr Stated BeamStation::*kStated[] = {&BeamStation::mass_per_length,     &BeamStation::rotary_inertia,
                                            &BeamStation::bending_stiffness_y, &BeamStation::bending_stiffness_z,
                                            &BeamStation::torsional_stiffness, &BeamStation::axial_stiffness};
constexpr const char* kKeys[] = {"mass_per_length",     "rotary_inertia",      "bending_stiffness_y",
                                 "bending_stiffness_z", "torsional_stiffness", "axial_stiffness"};
constexpr int kCount = 6;

// The value that the beam itself states for the k-th of the six properties.
Stated own(const BeamDescription& beam, int k) {
  switch (k) {
    case 0:
      return beam.mass_per_length;
    case 1:
      return beam.rotary_inertia != 0 ? Stated(beam.rotary_inertia) : Stated();
    case 2:
      return beam.bending_stiffness_y;
    case 3:
      return beam.bending_stiffness_z;
    case 4:
      return beam.torsional_stiffness;
    default:
      return beam.axial_stiffness;
  }
}

double blend(double a, double b, double share) { return a + share * (b - a); }

constexpr Stated BeamSection::*kSizes[] = {&BeamSection::diameter, &BeamSection::width, &BeamSection::height,
                                           &BeamSection::wall_thickness};

BeamSection blend(const BeamSection& a, const BeamSection& b, double share) {
  BeamSection between;
  for (const auto size : kSizes) {
    if (a.*size && b.*size) between.*size = blend(*(a.*size), *(b.*size), share);
  }
  return between;
}

bool has_same_sizes(const BeamSection& a, const BeamSection& b) {
  return std::all_of(std::begin(kSizes), std::end(kSizes),
                     [&](const auto size) { return (a.*size).has_value() == (b.*size).has_value(); });
}

std::string section_fault(const BeamSection& s) {
  const bool round = s.diameter.has_value(), flat = s.width || s.height;
  if (round == flat || (flat && !(s.width && s.height))) return "a section has a diameter, or a width and a height";
  for (const auto size : kSizes) {
    if (s.*size && !(*(s.*size) > 0)) return "a section's sizes must be above 0";
  }
  const double least = round ? *s.diameter : std::min(*s.width, *s.height);
  if (s.wall_thickness && !(2 * *s.wall_thickness < least))
    return fmt::format("wall_thickness of {:.6g} m fills the section of {:.6g} m; leave it out for a solid section",
                       *s.wall_thickness, least);
  return {};
}

// Torsion constant of a solid rectangle: (1/3) a b^3 (1 - (192 b / (pi^5 a)) sum over odd n of tanh(n pi a / (2 b)) /
// n^5), with a the longer side.
double torsion_constant(double a, double b) {
  if (a < b) std::swap(a, b);
  double sum = 0;
  for (int n = 1; n < 60; n += 2) sum += std::tanh(0.5 * n * std::numbers::pi * a / b) / std::pow(n, 5);
  return a * b * b * b / 3 * (1 - 192 * b / (std::pow(std::numbers::pi, 5) * a) * sum);
}

}  // namespace

BeamProperties section_properties(const BeamSection& s, const BeamMaterial& m) {
  const double t = s.wall_thickness.value_or(0);
  double A, I_y, I_z, J;
  if (s.diameter) {
    const double D = *s.diameter, d = s.wall_thickness ? D - 2 * t : 0;
    A = 0.25 * std::numbers::pi * (D * D - d * d);
    I_y = I_z = std::numbers::pi / 64 * (std::pow(D, 4) - std::pow(d, 4));
    J = I_y + I_z;
  } else {
    const double b = *s.width, h = *s.height;
    const double bi = s.wall_thickness ? b - 2 * t : 0, hi = s.wall_thickness ? h - 2 * t : 0;
    A = b * h - bi * hi;
    I_y = (b * h * h * h - bi * hi * hi * hi) / 12;
    I_z = (h * b * b * b - hi * bi * bi * bi) / 12;
    J = s.wall_thickness ? 2 * t * (b - t) * (b - t) * (h - t) * (h - t) / (b + h - 2 * t) : torsion_constant(b, h);
  }
  return {m.density * A,       m.density * (I_y + I_z), m.young_modulus * I_y, m.young_modulus * I_z,
          m.shear_modulus * J, m.density * I_y,         m.density * I_z,       m.young_modulus * A};
}

std::string description_fault(const BeamDescription& b) {
  const double length = norm(b.to - b.from);
  if (!(length > 0)) return "a beam's ends, from and to, must differ";
  if (b.section_y) {
    const Vector3d x = (1 / length) * (b.to - b.from), across = *b.section_y - dot(*b.section_y, x) * x;
    if (!(norm(across) > 1e-6 * norm(*b.section_y))) return "section_y must not be along the beam";
  }
  const bool stations_have_sections =
      std::any_of(b.stations.begin(), b.stations.end(), [](const BeamStation& s) { return s.section.has_value(); });
  const bool has_sections = b.section || stations_have_sections;
  if (has_sections != b.material.has_value())
    return has_sections ? "a section needs a material" : "a material needs a section, of the beam or of its stations";
  if (b.section && stations_have_sections) return "a section is stated by the beam or by its stations, not by both";
  if (b.section) {
    if (std::string fault = section_fault(*b.section); !fault.empty()) return fault;
  }
  const auto states = [&](int k) {
    return std::any_of(b.stations.begin(), b.stations.end(), [&](const BeamStation& s) { return s.*kStated[k]; });
  };
  for (int k = 0; k < kCount; ++k) {
    if (has_sections && (own(b, k) || states(k)))
      return fmt::format("{} follows from the section and the material; state either it or them", kKeys[k]);
    if (own(b, k) && states(k))
      return fmt::format("{} is stated by the beam or by its stations, not by both", kKeys[k]);
  }
  if (b.stretches && !has_sections)
    return "stretches needs a section and a material; without them state axial_stiffness";
  bool yields = has_sections;
  for (int k = 2; k < kCount; ++k) yields = yields || own(b, k) || states(k);
  if (!yields)
    return "a beam needs bending_stiffness_y, bending_stiffness_z, torsional_stiffness or axial_stiffness, or a "
           "section and a material";
  if (b.stations.empty()) return {};
  if (b.stations.size() < 2) return "a beam needs stations at both of its ends, or none";
  for (std::size_t i = 0; i < b.stations.size(); ++i) {
    const BeamStation &s = b.stations[i], &first = b.stations.front();
    const auto here = [&](const std::string& fault) {
      return fmt::format("station {}, at {:.6g} m: {}", i + 1, s.at, fault);
    };
    if (i > 0 && !(s.at > b.stations[i - 1].at)) return here("stations must be in order from the beam's beginning");
    for (int k = 0; k < kCount; ++k) {
      if ((s.*kStated[k]).has_value() != (first.*kStated[k]).has_value())
        return here(fmt::format("either every station states {} or none does", kKeys[k]));
    }
    if (s.section.has_value() != first.section.has_value())
      return here("either every station states a section or none does");
    if (!s.section) continue;
    if (const std::string fault = section_fault(*s.section); !fault.empty()) return here(fault);
    if (!has_same_sizes(*s.section, *first.section))
      return here(
          "sections of one beam must be of the same kind: a diameter, or width and height; all solid, or all hollow");
  }
  if (std::abs(b.stations.front().at) > kEnds * length || std::abs(b.stations.back().at - length) > kEnds * length)
    return fmt::format("the first station must be at 0 and the last at the beam's end, {:.6g} m", length);
  return {};
}

Beam::Beam(const BodyDescription& link) : setup_(*link.beam) {
  const Vector3d along = setup_.to - setup_.from;
  length_ = norm(along);
  x_ = (1 / length_) * along;
  const bool along_y = std::abs(x_[1]) > 0.9;
  const Vector3d side = setup_.section_y.value_or(along_y ? Vector3d{0, 0, 1} : Vector3d{0, 1, 0});
  const Vector3d across = side - dot(side, x_) * x_;
  y_ = (1 / norm(across)) * across;
  z_ = cross(x_, y_);
  mass_per_length_ = link.mass / length_;
  whole_ = rod(0, length_);
  if (std::abs(whole_.mass - link.mass) <= kSameMass * link.mass) {
    mass_scale_ = link.mass / whole_.mass;
    whole_ = rod(0, length_);
    whole_.mass = link.mass;
  }
  if (setup_.damping_ratio > 0) {
    rate_y_ = first_rate(&BeamProperties::bending_stiffness_y);
    rate_z_ = first_rate(&BeamProperties::bending_stiffness_z);
  }
}

double Beam::hinge_at(int i) const {
  static const double kGauss = 0.5 / std::sqrt(3.0);
  const double segment = length_ / setup_.segments;
  return (i / 2 + 0.5 + (i % 2 == 0 ? -kGauss : kGauss)) * segment;
}

int Beam::piece_of(const Vector3d& p) const {
  const double s = dot(x_, p - setup_.from);
  int piece = 0;
  while (piece < hinges() && s >= end(piece)) ++piece;
  return piece;
}

BeamProperties Beam::at_length(double s) const {
  BeamProperties here;
  std::size_t i = 1;  // index of the station behind s
  double share = 0;
  if (!setup_.stations.empty()) {
    while (i + 1 < setup_.stations.size() && s > setup_.stations[i].at) ++i;
    const double a = setup_.stations[i - 1].at, b = setup_.stations[i].at;
    share = std::clamp((s - a) / (b - a), 0.0, 1.0);
  }
  if (setup_.material) {
    const BeamSection section =
        setup_.section ? *setup_.section : blend(*setup_.stations[i - 1].section, *setup_.stations[i].section, share);
    here = section_properties(section, *setup_.material);
    if (!setup_.stretches) here.axial_stiffness = 0;
  } else {
    here.mass_per_length = mass_per_length_;
    for (int k = 0; k < kCount; ++k) {
      if (const Stated value = own(setup_, k)) here.*kProperties[k] = *value;
      if (setup_.stations.empty()) continue;
      const Stated &a = setup_.stations[i - 1].*kStated[k], &b = setup_.stations[i].*kStated[k];
      if (a && b) here.*kProperties[k] = blend(*a, *b, share);
    }
    here.rotary_inertia_y = here.rotary_inertia_z = 0.5 * here.rotary_inertia;
  }
  here.mass_per_length *= mass_scale_;
  return here;
}

// Mass, centre of mass and inertia of a part, by three-point Gauss quadrature between stations: mass per length is at
// most quadratic there, and is multiplied by squares.
Beam::Rod Beam::rod(double begin, double end) const {
  double mass = 0, first = 0, second = 0, along = 0, y = 0, z = 0;
  const auto add = [&](double a, double b) {
    if (!(b > a)) return;
    const double half = 0.5 * (b - a), middle = 0.5 * (a + b), r = std::sqrt(0.6);
    for (const auto& [x, weight] : {std::pair{-r, 5.0 / 9}, std::pair{0.0, 8.0 / 9}, std::pair{r, 5.0 / 9}}) {
      const double s = middle + half * x;
      const BeamProperties p = at_length(s);
      mass += half * weight * p.mass_per_length;
      first += half * weight * p.mass_per_length * (s - begin);
      second += half * weight * p.mass_per_length * (s - begin) * (s - begin);
      along += half * weight * p.rotary_inertia;
      y += half * weight * p.rotary_inertia_y, z += half * weight * p.rotary_inertia_z;
    }
  };
  double from = begin;
  for (const BeamStation& station : setup_.stations) {
    if (!(station.at > from && station.at < end)) continue;
    add(from, station.at);
    from = station.at;
  }
  add(from, end);
  const double c = first / mass, across = second - mass * c * c;
  return {mass, begin + c, along, across + y, across + z};
}

// Inertia in the link's axes.
Symmetric3d Beam::about_com(const Rod& part) const {
  Symmetric3d I = Symmetric3d::zero();
  for (const auto& [moment, a] : {std::pair{part.along, x_}, std::pair{part.y, y_}, std::pair{part.z, z_}})
    I += Symmetric3d{moment * a[0] * a[0], moment * a[1] * a[1], moment * a[2] * a[2],
                     moment * a[0] * a[1], moment * a[0] * a[2], moment * a[1] * a[2]};
  return I;
}

RigidBodyInertiad Beam::piece_inertia(int piece) const {
  const Rod r = rod(begin(piece), end(piece));
  Symmetric3d I = about_com(r);
  const double share = r.mass / whole_.mass;
  const Symmetric3d& e = spread_;
  I += Symmetric3d{share * e.xx, share * e.yy, share * e.zz, share * e.xy, share * e.xz, share * e.yz};
  return RigidBodyInertiad::about_com(r.mass, at(r.middle) - origin(piece), I);
}

RigidBodyInertiad Beam::inertia() const { return RigidBodyInertiad::about_com(whole_.mass, com(), about_com(whole_)); }

double Beam::spread_along() const { return dot(x_, spread_ * x_); }

bool Beam::has_rotary_inertia() const {
  if (spread_along() > 0) return true;
  for (int piece = 0; piece <= hinges(); ++piece) {
    if (!(rod(begin(piece), end(piece)).along > 0)) return false;
  }
  return true;
}

std::vector<Beam::Hinge> Beam::springs(int hinge) const {
  std::vector<Hinge> springs;
  const BeamProperties here = at_length(hinge_at(hinge));
  const auto add = [&](const char* name, const Vector3d& axis, double stiffness, double rate) {
    if (!(stiffness > 0)) return;
    const double k = stiffness / compliant_length();
    const JointType type = *name == 'a' ? JointType::prismatic : JointType::continuous;
    springs.push_back({name, type, axis, {k, rate > 0 ? 2 * setup_.damping_ratio / rate * k : 0, 0}});
  };
  add("y", y_, here.bending_stiffness_y, rate_y_);
  add("z", z_, here.bending_stiffness_z, rate_z_);
  add("a", x_, here.axial_stiffness, setup_.damping_ratio > 0 ? first_rate(&BeamProperties::axial_stiffness) : 0);
  if (here.torsional_stiffness > 0 && has_rotary_inertia())
    add("x", x_, here.torsional_stiffness,
        setup_.damping_ratio > 0 ? first_rate(&BeamProperties::torsional_stiffness) : 0);
  return springs;
}

// The first frequency of the beam alone, clamped at its beginning [rad/s]. If its properties vary, by Stodola's
// iteration on midpoints: the next shape is the deflection under the inertial load of the current shape.
double Beam::first_rate(double BeamProperties::*stiffness) const {
  const bool twists = stiffness == &BeamProperties::torsional_stiffness;
  const bool bends = !twists && stiffness != &BeamProperties::axial_stiffness;
  const double spread_per_mass = spread_along() / whole_.mass;
  const auto inertia = [&](const BeamProperties& p) {
    return twists ? p.rotary_inertia + spread_per_mass * p.mass_per_length : p.mass_per_length;
  };
  const BeamProperties root = at_length(0);
  if (!(root.*stiffness > 0)) return 0;
  if (setup_.stations.empty()) {
    const double wave = bends ? kFirstBending * kFirstBending / (length_ * length_) : kFirstTorsion / length_;
    return wave * std::sqrt(root.*stiffness / inertia(root));
  }
  constexpr std::size_t kCells = 400;
  const double h = length_ / kCells;
  std::vector<double> load(kCells), yields(kCells), shape(kCells), next(kCells);
  for (std::size_t i = 0; i < kCells; ++i) {
    const double s = (static_cast<double>(i) + 0.5) * h;
    const BeamProperties p = at_length(s);
    load[i] = inertia(p), yields[i] = 1 / (p.*stiffness);
    shape[i] = bends ? s * s : s;
  }
  const auto inward = [&](std::vector<double>& f) {  // integral from s to the end
    double sum = 0;
    for (std::size_t i = kCells; i-- > 0;) {
      const double value = f[i];
      f[i] = sum + 0.5 * h * value, sum += h * value;
    }
  };
  const auto outward = [&](std::vector<double>& f) {  // from the beginning to s
    double sum = 0;
    for (double& value : f) {
      const double old = value;
      value = sum + 0.5 * h * old, sum += h * old;
    }
  };
  double squared = 0;
  for (int iteration = 0; iteration < 12; ++iteration) {
    for (std::size_t i = 0; i < kCells; ++i) next[i] = load[i] * shape[i];
    inward(next);
    if (bends) inward(next);
    for (std::size_t i = 0; i < kCells; ++i) next[i] *= yields[i];
    outward(next);
    if (bends) outward(next);
    double mixed = 0, square = 0;  // Rayleigh's quotient
    for (std::size_t i = 0; i < kCells; ++i)
      mixed += load[i] * shape[i] * next[i], square += load[i] * next[i] * next[i];
    squared = mixed / square;
    const double size = next.back();
    for (std::size_t i = 0; i < kCells; ++i) shape[i] = next[i] / size;
  }
  return std::sqrt(squared);
}

}  // namespace grapnel
