#include "grapnel/contact/pair_contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <stdexcept>
#include <utility>

#include "grapnel/contact/contact_law.hpp"

namespace grapnel {

namespace {

using Kind = ContactShape::Kind;

ContactLaw ordered(ContactLaw law, bool exchanged) {
  if (exchanged) std::swap(law.elastic_a, law.elastic_b);
  return law;
}

double effective_radius(const ContactShape& sphere, const ContactShape& other) {
  const double r = sphere.core().rounding;
  switch (other.kind()) {
    case Kind::sphere:
      return r * other.core().rounding / (r + other.core().rounding);
    case Kind::capsule:
      return r * std::sqrt(other.core().rounding / (r + other.core().rounding));
    case Kind::cylinder:
      return r * std::sqrt(other.core().half[0] / (r + other.core().half[0]));
    default:
      return r;
  }
}

}  // namespace

ContactShapes::ContactShapes(ContactShape first, ContactShape second, const ContactLaw& pair_law)
    : a(std::move(first)), b(std::move(second)), law(pair_law) {
  radius = a.kind() == Kind::sphere ? effective_radius(a, b) : a.core().rounding;
  if (a.kind() == Kind::capsule && b.kind() == Kind::capsule) {
    radius = a.core().rounding * b.core().rounding / (a.core().rounding + b.core().rounding);
  }
  // A half-space deforms as if it were as thick as the other shape.
  const double thickness_a = a.thickness(), thickness_b = b.kind() == Kind::half_space ? thickness_a : b.thickness();
  const double smaller = std::min(thickness_a, thickness_b);
  reference_area = std::numbers::pi * smaller * smaller;
  const auto slope = [&](double elastic, double thickness) {
    return law.hertz ? elastic / thickness : elastic / (std::numbers::pi * thickness * thickness);
  };
  pressure_a = slope(law.elastic_a, thickness_a), pressure_b = slope(law.elastic_b, thickness_b);
  pressure = pressure_a * pressure_b / (pressure_a + pressure_b);
}

PairContact::PairContact(ContactShape a, ContactShape b, ContactLaw law)
    : exchanged_(b.kind() < a.kind()),
      shapes_(exchanged_ ? b : a, exchanged_ ? a : b, ordered(law, exchanged_)),
      pressure_(shapes_) {
  if (shapes_.a.kind() == Kind::half_space) throw std::invalid_argument("PairContact: two half-spaces");
  const bool is_polyhedral = shapes_.a.kind() >= Kind::cylinder;
  elements_.reserve(is_polyhedral ? PressureContact::kMaxElements : 1024);
}

namespace {

// The pose of a shape's core. A sphere's frame has the axes of W.
Posed core_pose_of(const ContactShape& shape, const Posed& X_WB) {
  const Vector3d p = X_WB * shape.X_BC().p;
  if (shape.kind() == Kind::sphere) return {Rotationd::identity(), p};
  return {shape.is_aligned() ? X_WB.R : X_WB.R * shape.X_BC().R, p};
}

// Farthest distance along a unit vector in W of the box around the shape from its core's origin.
double extent_along(const ContactShape& shape, const Posed& X_WC, const Vector3d& n_W) {
  if (shape.kind() == Kind::sphere) return shape.core().rounding;
  const Vector3d n = transposed_times(X_WC.R, n_W);
  const Vector3d& half = shape.half_extents();
  return shape.core().rounding + std::abs(n[0]) * half[0] + std::abs(n[1]) * half[1] + std::abs(n[2]) * half[2];
}

Posed pose_between(const Posed& X_WA, const Posed& X_WB) {
  return {transpose(X_WA.R) * X_WB.R, transposed_times(X_WA.R, X_WB.p - X_WA.p)};
}

}  // namespace

// Of the first and the second shape.
PairContact::CorePoses PairContact::core_poses(const Posed& X_WA, const Posed& X_WB) const {
  return {core_pose_of(shapes_.a, exchanged_ ? X_WB : X_WA), core_pose_of(shapes_.b, exchanged_ ? X_WA : X_WB)};
}

// The bound by spheres alone needs no orientations.
double PairContact::gap_bound(const Posed& X_WA, const Posed& X_WB) const {
  if (shapes_.b.kind() != Kind::half_space) {
    const double by_spheres = norm(between_centers(X_WA, X_WB)) - shapes_.a.reach() - shapes_.b.reach();
    if (by_spheres > 0) return by_spheres;
  }
  return gap_bound_from(core_poses(X_WA, X_WB));
}

double PairContact::gap_bound_from(const CorePoses& cores) const {
  constexpr double kRounding = 1 + 1e-12;
  const Vector3d between = cores.X_WA.p - cores.X_WB.p;
  if (shapes_.b.kind() == Kind::half_space) {
    const Vector3d outward = cores.X_WB.R.column(2);
    const double height = dot(outward, between), by_sphere = height - shapes_.a.reach();
    return by_sphere > 0 ? by_sphere : height - kRounding * extent_along(shapes_.a, cores.X_WA, outward);
  }
  const double distance = norm(between), by_spheres = distance - shapes_.a.reach() - shapes_.b.reach();
  if (by_spheres > 0 || !(distance > 0)) return by_spheres;
  const Vector3d n = (1 / distance) * between;
  return distance - kRounding * (extent_along(shapes_.a, cores.X_WA, n) + extent_along(shapes_.b, cores.X_WB, n));
}

// The elements of the same relative pose, bit by bit, are kept.
void PairContact::gather(const Posed& X_AB) {
  if (is_gathered_ && std::memcmp(&X_AB, &gathered_, sizeof gathered_) == 0) return;
  gathered_ = X_AB, is_gathered_ = true;
  elements_.clear();
  switch (shapes_.a.kind()) {
    case Kind::sphere:
      return add_sphere_contact(shapes_, X_AB, elements_);
    case Kind::capsule:
      return add_capsule_contact(shapes_, X_AB, elements_);
    case Kind::cylinder:
      if (shapes_.b.kind() == Kind::half_space) return add_cylinder_on_plane(shapes_, X_AB, elements_);
      [[fallthrough]];
    default:
      pressure_.add(shapes_, X_AB, elements_);
  }
}

namespace {

using Block = ContactElements::Block;
constexpr std::size_t kLanes = ContactElements::kLanes;

// One partial sum per lane.
struct LaneSum {
  double lane[kLanes] = {};
  double total() const {
    return ((lane[0] + lane[4]) + (lane[2] + lane[6])) + ((lane[1] + lane[5]) + (lane[3] + lane[7]));
  }
};
struct LaneVectorSum {
  LaneSum x, y, z;
  Vector3d total() const { return {x.total(), y.total(), z.total()}; }
};

// The approach speed of both shapes along the contact's normal n, as a function of the position in A.
struct Approach {
  Vector3d n;
  double parting;  // at A's origin
  Vector3d gradient;
  double at(const Vector3d& p) const { return -(parting + dot(gradient, p)); }
};

// Of the normal forces on B; the moment about A's origin.
struct NormalSums {
  LaneVectorSum force, moment;
  LaneSum normal, power, area;
};

// The part of an element's force along n that is not elastic.
template <bool kDamper>
GRAPNEL_INLINE double dissipative_force(double elastic, double share, double depth, const ContactLaw& law,
                                        double approach) {
  const double damping = kDamper ? share * law.damping * contact_law::smooth_step(depth / law.damping_depth) : 0.0;
  const double force = elastic * (1 + law.dissipation * approach) + damping * approach;
  return (force > 0 ? force : 0.0) - elastic;
}

template <bool kDamper>
void add_block(const Block& e, const ContactLaw& law, const Approach& approach, NormalSums& sums) {
  const Vector3d &n = approach.n, &g = approach.gradient;
  for (std::size_t l = 0; l < kLanes; ++l) {
    const double x = e.point.x[l], y = e.point.y[l], z = e.point.z[l], elastic = e.elastic[l];
    const double speed = -(approach.parting + (g[0] * x + g[1] * y + g[2] * z));
    const double lost = dissipative_force<kDamper>(elastic, e.share[l], e.depth[l], law, speed);
    const double f_x = elastic * e.normal.x[l] + lost * n[0], f_y = elastic * e.normal.y[l] + lost * n[1];
    const double f_z = elastic * e.normal.z[l] + lost * n[2];
    const double along = f_x * n[0] + f_y * n[1] + f_z * n[2];
    sums.force.x.lane[l] += f_x, sums.force.y.lane[l] += f_y, sums.force.z.lane[l] += f_z;
    sums.moment.x.lane[l] += y * f_z - z * f_y;
    sums.moment.y.lane[l] += z * f_x - x * f_z;
    sums.moment.z.lane[l] += x * f_y - y * f_x;
    sums.normal.lane[l] += along > 0 ? along : 0.0;
    sums.power.lane[l] += lost * speed;
    sums.area.lane[l] += e.area[l];
  }
}

}  // namespace

// The only element => as find_center().
Vector3d PairContact::find_point() {
  const Block& e = elements_.blocks().front();
  force_.depth = e.depth[0], force_.p_WC = e.point[0], lever_ = 0;
  return e.elastic[0] > 0 ? e.normal[0] : Vector3d::zero();
}

// Elements => the centre of their elastic forces, in force_, and the direction of the sum; zero if these cancel (beyond
// the model). Both are continuous where damping ends the normal force before the overlap ends.
Vector3d PairContact::find_center() {
  if (elements_.size() == 1) return find_point();
  LaneVectorSum normals, points;
  LaneSum forces;
  double deepest[kLanes] = {};
  for (const Block& e : elements_.blocks()) {
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double f = e.elastic[l];
      forces.lane[l] += f;
      normals.x.lane[l] += f * e.normal.x[l], normals.y.lane[l] += f * e.normal.y[l];
      normals.z.lane[l] += f * e.normal.z[l];
      points.x.lane[l] += f * e.point.x[l], points.y.lane[l] += f * e.point.y[l], points.z.lane[l] += f * e.point.z[l];
      deepest[l] = e.depth[l] > deepest[l] ? e.depth[l] : deepest[l];
    }
  }
  const double total = forces.total();
  force_.depth = *std::max_element(deepest, deepest + kLanes);
  force_.p_WC = elements_.blocks().front().point[0], lever_ = 0;
  if (!(total > 0)) return Vector3d::zero();
  const Vector3d center = (1 / total) * points.total();
  force_.p_WC = center;
  if (shapes_.law.static_friction > 0) {
    LaneSum levers;
    for (const Block& e : elements_.blocks()) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        const double x = e.point.x[l] - center[0], y = e.point.y[l] - center[1], z = e.point.z[l] - center[2];
        levers.lane[l] += e.elastic[l] * std::sqrt(x * x + y * y + z * z);
      }
    }
    lever_ = levers.total() / total;
  }
  const Vector3d sum = normals.total();
  const double resultant = norm(sum);
  return resultant > 1e-9 * total ? (1 / resultant) * sum : Vector3d::zero();
}

// The elements, the contact's normal n, and the relative twist of B at A's origin, in A => elastic forces along the
// elements' normals and dissipative forces along n, on B, added to the wrench about A's origin, and to the power. At
// edges, elements' normals differ from n; damping along them would resist sliding.
void PairContact::add_normal_forces(const Vector3d& n, const Twistd& V_AB, Wrenchd& on_b) {
  const Approach approach{n, dot(V_AB.linear, n), cross(n, V_AB.angular)};
  const ContactLaw& law = shapes_.law;
  if (elements_.size() == 1) {
    const Block& e = elements_.blocks().front();
    const Vector3d p = e.point[0];
    const double speed = approach.at(p), elastic = e.elastic[0];
    const double lost = dissipative_force<true>(elastic, e.share[0], e.depth[0], law, speed);
    const Vector3d force = elastic * e.normal[0] + lost * n;
    on_b.linear += force, on_b.angular += cross(p, force);
    force_.normal_force = std::max(0.0, dot(force, n)), force_.damping_power = lost * speed;
    return;
  }
  NormalSums sums;
  if (law.damping > 0) {
    for (const Block& e : elements_.blocks()) add_block<true>(e, law, approach, sums);
  } else {
    for (const Block& e : elements_.blocks()) add_block<false>(e, law, approach, sums);
  }
  on_b.linear += sums.force.total(), on_b.angular += sums.moment.total();
  force_.normal_force = sums.normal.total(), force_.damping_power = sums.power.total();
  force_.area = sums.area.total();
}

namespace {

// Whether the rates of slip and deformation are continuous at a distance too (PairContact::graze).
bool grazes(const ContactShapes& shapes) { return shapes.a.kind() == Kind::sphere; }

// Factor of these rates: otherwise they begin at zero with the depth, so that the derivative of the state is
// continuous. Where bodies slip fast, they rise over ten times the depth, so that rounding errors of the depth change
// them less. `speed2`: square of the slip speed.
double onset_at(double depth, double speed2, const ContactShapes& shapes) {
  constexpr double kOnset = 1e-3;  // depth per stiction displacement up to which they rise, without slip
  if (grazes(shapes)) return 1;
  const double relative = speed2 / (shapes.law.stiction_speed * shapes.law.stiction_speed);
  return contact_law::smooth_step(depth /
                                  (kOnset * shapes.law.stiction_displacement * (1 + 9 * relative / (1 + relative))));
}

}  // namespace

// Normal forces, the contact's normal, relative twist at A's origin and deformation, in A => friction on B at the
// centre of the elastic forces, added to the wrench about A's origin, and the rate of the deformation. Force and couple
// about the normal share one ellipsoid (23.7a): chi = [slip; spin], of size 1 when it slips, with the rates [u; lever *
// w_n] / displacement.
void PairContact::add_friction(const Vector3d& n, const Twistd& V_AB, const StickState& stick, Wrenchd& on_b) {
  const ContactLaw& law = shapes_.law;
  const Vector3d& center = force_.p_WC;
  const auto tangential = [&](const Vector3d& x) { return x - dot(x, n) * n; };
  const Vector3d u = tangential(V_AB.linear + cross(V_AB.angular, center));
  const double u2 = dot(u, u);
  onset_ = onset_at(force_.depth, u2, shapes_);
  force_.slip_speed = onset_ * std::sqrt(u2);
  add_rolling(n, V_AB.angular, on_b);
  if (!(law.static_friction > 0)) return;

  // Rates of chi with elastic deformation, and less the outward part where it slips.
  constexpr double kElastic = 0.8;  // size up to which the deformation is elastic
  const double spin_lever = lever_ + law.torsional_length / law.static_friction;
  const double spin_speed = spin_lever * dot(V_AB.angular, n), per_length = onset_ / law.stiction_displacement;
  const Vector3d slip = tangential(stick.slip);
  const double size2 = dot(slip, slip) + stick.spin * stick.spin, size = std::sqrt(size2);
  const double slipping = std::clamp((size - kElastic) / (1 - kElastic), 0.0, 1.0);  // alpha
  const double outward = std::max(0.0, dot(slip, u) + stick.spin * spin_speed);      // times size
  const double relief = slipping > 0 ? slipping * outward / size2 : 0.0;
  const Vector3d slip_rate = per_length * (u - relief * slip);
  const double spin_rate = per_length * (spin_speed - relief * stick.spin);

  // Force and couple, with damping, within the ellipsoid. Where it slips, the delay of chi's turning is the time in
  // which chi follows the direction of slip, so that friction is opposite to the slip also where this direction
  // changes.
  const double speed2 = u2 + spin_speed * spin_speed, speed = std::sqrt(speed2);
  const double delay = law.stiction_displacement / law.stiction_speed;
  const double lead = law.stiction_displacement / std::sqrt(speed2 + law.stiction_speed * law.stiction_speed);
  const double turning = delay + slipping * (lead - delay);
  const double growth = dot(slip, slip_rate) + stick.spin * spin_rate;  // of |chi|^2 / 2
  const double along = slipping > 0 ? (delay - turning) * growth / size2 : 0.0;
  const Vector3d toward = slip + turning * slip_rate + along * slip;
  const double spin_toward = stick.spin + turning * spin_rate + along * stick.spin;
  const double length = std::sqrt(dot(toward, toward) + spin_toward * spin_toward);
  const double coefficient =
      contact_law::friction_coefficient(law.static_friction, law.kinetic_friction, law.stiction_speed, speed);
  force_.friction_use = std::min(1.0, length);
  const double scale = coefficient * force_.normal_force / std::max(1.0, length);
  const Vector3d force = -scale * toward, couple = (-scale * spin_lever * spin_toward) * n;
  on_b.linear += force;
  on_b.angular += cross(center, force) + couple;
  force_.friction_power -= dot(force, u) + dot(couple, V_AB.angular);
  // The normal part, from the rolling of the contact over both bodies, decays.
  force_.stick_rate = {slip_rate - (onset_ * dot(stick.slip, n) / delay) * n, spin_rate};
}

// A couple against rolling.
void PairContact::add_rolling(const Vector3d& normal, const Vector3d& w, Wrenchd& on_b) {
  const ContactLaw& law = shapes_.law;
  if (!(law.rolling_length > 0)) return;
  const Vector3d roll = w - dot(w, normal) * normal;
  const double factor =
      force_.normal_force * law.rolling_length * contact_law::rolling_ratio(law.stiction_rate, norm(roll));
  on_b.angular -= factor * roll;
  force_.friction_power += factor * dot(roll, roll);
}

// Sums in A's core frame, with the sense from the first core to the second => results in W, from the first shape to the
// second. `mean_rate`: of both bodies' angular velocities, in W, with which the deformation turns.
void PairContact::finish(const Posed& X_WA, const Vector3d& mean_rate, const StickState& stick, const Wrenchd& on_b) {
  const Vector3d center = force_.p_WC;
  const double sign = exchanged_ ? -1 : 1;
  force_.p_WC = X_WA * center;
  force_.on_b = sign * (X_WA.R * shift(on_b, center));
  force_.on_a = -force_.on_b;
  force_.stick_rate.slip = X_WA.R * force_.stick_rate.slip + onset_ * cross(mean_rate, stick.slip);
}

void PairContact::clear_force() {
  force_.touches = force_.beyond_model = false;
  force_.on_a = force_.on_b = Wrenchd::zero();
  force_.p_WC = Vector3d::zero();
  force_.normal_force = force_.area = force_.depth = force_.slip_speed = 0;
  force_.damping_power = force_.friction_power = force_.friction_use = 0;
  force_.stick_rate = {};
}

// Poses, twists and deformation => forces. The deformation is that of the second core relative to the first.
const ContactForce& PairContact::evaluate(const MovingBody& a, const MovingBody& b, const StickState& stick) {
  clear_force();
  const CorePoses cores = core_poses(a.X_WB, b.X_WB);
  if (gap_bound_from(cores) > 0) return force_;

  // Relative pose and twist of the cores, the twist at A's origin in A.
  const MovingBody &first = exchanged_ ? b : a, &second = exchanged_ ? a : b;
  const Posed& X_WA = cores.X_WA;
  gather(pose_between(cores.X_WA, cores.X_WB));
  force_.beyond_model = elements_.beyond_model;
  if (elements_.empty()) return force_;
  const Twistd V_W = shift(second.V_WB, X_WA.p - second.X_WB.p) - shift(first.V_WB, X_WA.p - first.X_WB.p);
  const Twistd V_AB = transposed_times(X_WA.R, V_W);

  // Normal forces and their centre, then friction there.
  force_.touches = true;
  Wrenchd on_b = Wrenchd::zero();
  const Vector3d n = find_center();
  add_normal_forces(n, V_AB, on_b);
  add_friction(n, V_AB, {transposed_times(X_WA.R, stick.slip), stick.spin}, on_b);
  finish(X_WA, 0.5 * (first.V_WB.angular + second.V_WB.angular), stick, on_b);
  return force_;
}

// Poses, twists and deformation => rates of a sphere in the limit of a small overlap: those of the second shape moved
// along the normal. Of other shapes the nearest points, and with them the rates, may jump.
const ContactForce& PairContact::graze(const MovingBody& a, const MovingBody& b, const StickState& stick) {
  clear_force();
  if (!grazes(shapes_)) return force_;
  const double overlap = 1e-9 * std::min(shapes_.a.reach(), shapes_.b.reach());
  const ShapeSeparation s = separation(a.X_WB, b.X_WB);
  MovingBody moved = b;
  moved.X_WB.p -= (s.distance + overlap) * s.normal;
  evaluate(a, moved, stick);
  const double slip_speed = force_.slip_speed;
  const StickState rate = force_.stick_rate;
  clear_force();
  force_.slip_speed = slip_speed, force_.stick_rate = rate;
  return force_;
}

double PairContact::elastic_energy(const Posed& X_WA, const Posed& X_WB) {
  if (gap_bound(X_WA, X_WB) > 0) return 0;
  const Posed X_AB = relative_pose(X_WA, X_WB);
  if (shapes_.a.kind() == Kind::polyhedron ||
      (shapes_.a.kind() == Kind::cylinder && shapes_.b.kind() != Kind::half_space)) {
    return pressure_.energy(shapes_, X_AB);
  }
  gather(X_AB);
  return elements_.energy;
}

namespace {

// Of the first core and a half-space.
ShapeSeparation to_half_space(const ConvexCore& a, const Posed& X_AB) {
  const Vector3d outward = X_AB.R.column(2);
  const Vector3d lowest = support(a, -outward) - a.rounding * outward;
  const double distance = dot(outward, lowest - X_AB.p);
  return {distance, -outward, lowest, lowest - distance * outward};
}

// Of two cores with their roundings.
ShapeSeparation of_cores(const ConvexCore& a, const ConvexCore& b, const Posed& X_AB) {
  const double rounding_a = a.rounding, rounding_b = b.rounding;
  const CorePair cores{a, b, X_AB};
  const ConvexDistance apart = convex_distance(cores);
  if (apart.separated) {
    const double distance = norm(apart.difference);
    const Vector3d n = (-1 / distance) * apart.difference;
    return {distance - rounding_a - rounding_b, n, apart.point_a + rounding_a * n, apart.point_b - rounding_b * n};
  }
  const Penetration inside = penetration(cores);
  const Vector3d& n = inside.normal;
  return {-inside.depth - rounding_a - rounding_b, n, inside.point_a + rounding_a * n, inside.point_b - rounding_b * n};
}

}  // namespace

ShapeSeparation PairContact::separation(const Posed& X_WA, const Posed& X_WB) const {
  const Posed X_WFirst = (exchanged_ ? X_WB : X_WA) * shapes_.a.X_BC();
  const Posed X_AB = inverse(X_WFirst) * ((exchanged_ ? X_WA : X_WB) * shapes_.b.X_BC());
  ShapeSeparation s = shapes_.b.kind() == Kind::half_space ? to_half_space(shapes_.a.core(), X_AB)
                                                           : of_cores(shapes_.a.core(), shapes_.b.core(), X_AB);
  s.normal = X_WFirst.R * s.normal, s.point_a = X_WFirst * s.point_a, s.point_b = X_WFirst * s.point_b;
  if (exchanged_) s.normal = -s.normal, std::swap(s.point_a, s.point_b);
  return s;
}

double PairContact::gap(const Posed& X_WA, const Posed& X_WB) const {
  const Posed X_AB = relative_pose(X_WA, X_WB);
  if (shapes_.b.kind() == Kind::half_space) return to_half_space(shapes_.a.core(), X_AB).distance;
  const CorePair pair = cores(X_AB);
  return of_cores(pair.a, pair.b, X_AB).distance;
}

TouchPoints PairContact::touch(const Posed& X_WA, const Posed& X_WB) const {
  const Posed X_WFirst = (exchanged_ ? X_WB : X_WA) * shapes_.a.X_BC();
  const Posed X_AB = inverse(X_WFirst) * ((exchanged_ ? X_WA : X_WB) * shapes_.b.X_BC());
  TouchPoints found =
      shapes_.b.kind() == Kind::half_space ? touch_points_on_plane(shapes_.a.core(), X_AB) : touch_points(cores(X_AB));
  found.normal = (exchanged_ ? -1.0 : 1.0) * (X_WFirst.R * found.normal);
  for (Vector3d& p : found.points) p = X_WFirst * p;
  return found;
}

// The cores between which forces begin.
CorePair PairContact::cores(const Posed& X_AB) const {
  const bool prisms = shapes_.a.kind() >= Kind::cylinder;
  return {prisms ? shapes_.a.bounding_core() : shapes_.a.core(), prisms ? shapes_.b.bounding_core() : shapes_.b.core(),
          X_AB};
}

// Of the second core relative to the first.
Posed PairContact::relative_pose(const Posed& X_WA, const Posed& X_WB) const {
  const CorePoses cores = core_poses(X_WA, X_WB);
  return pose_between(cores.X_WA, cores.X_WB);
}

double PairContact::overlap(const Posed& X_WA, const Posed& X_WB) {
  const CorePoses cores = core_poses(X_WA, X_WB);
  const double bound = gap_bound_from(cores);
  if (bound > 0) return -bound;
  const Posed X_AB = pose_between(cores.X_WA, cores.X_WB);
  if (PressureContact::has_overlap(shapes_)) return pressure_.overlap(shapes_, X_AB);
  gather(X_AB);
  const double deepest = elements_.largest_depth();
  return deepest > 0 ? deepest : -gap(X_WA, X_WB);
}

Vector3d PairContact::between_centers(const Posed& X_WA, const Posed& X_WB) const {
  return (exchanged_ ? X_WB : X_WA) * shapes_.a.X_BC().p - (exchanged_ ? X_WA : X_WB) * shapes_.b.X_BC().p;
}

// The gap changes by the relative velocity of the nearest points, along their line. One of them is on the second shape,
// or on the first one if the second is a half-space.
double PairContact::speed_bound(const MovingBody& a, const MovingBody& b) const {
  const MovingBody &first = exchanged_ ? b : a, &second = exchanged_ ? a : b;
  const bool plane = shapes_.b.kind() == Kind::half_space;
  const ContactShape& shape = plane ? shapes_.a : shapes_.b;
  const Vector3d center = (plane ? first : second).X_WB * shape.X_BC().p;
  const Twistd V = shift(second.V_WB, center - second.X_WB.p) - shift(first.V_WB, center - first.X_WB.p);
  return norm(V.linear) + norm(V.angular) * shape.reach();
}

double PairContact::depth(const Posed& X_WA, const Posed& X_WB) {
  if (gap_bound(X_WA, X_WB) > 0) return 0;
  gather(relative_pose(X_WA, X_WB));
  return elements_.largest_depth();
}

// Overlaps change by the relative velocity of points in contact. Of polyhedra they are along other directions than the
// forces.
double PairContact::overlap_speed(const MovingBody& a, const MovingBody& b) {
  const CorePoses cores = core_poses(a.X_WB, b.X_WB);
  gather(pose_between(cores.X_WA, cores.X_WB));
  const MovingBody &first = exchanged_ ? b : a, &second = exchanged_ ? a : b;
  const Posed& X_WA = cores.X_WA;
  const Twistd V_W = shift(second.V_WB, X_WA.p - second.X_WB.p) - shift(first.V_WB, X_WA.p - first.X_WB.p);
  const Twistd V_AB = transposed_times(X_WA.R, V_W);
  const bool by_pressure = shapes_.a.kind() >= Kind::cylinder &&
                           (shapes_.a.kind() != Kind::cylinder || shapes_.b.kind() != Kind::half_space);
  double largest = 0;
  for (std::size_t i = 0; i < elements_.size(); ++i) {
    const Block& e = elements_.blocks()[i / kLanes];
    const Vector3d v = V_AB.linear + cross(V_AB.angular, e.point[i % kLanes]);
    largest = std::max(largest, by_pressure ? norm(v) : std::abs(dot(v, e.normal[i % kLanes])));
  }
  return largest;
}

PairContact::SphereGap PairContact::sphere_gap(const MovingBody& a, const MovingBody& b) const {
  const MovingBody &first = exchanged_ ? b : a, &second = exchanged_ ? a : b;
  const Vector3d center = first.X_WB * shapes_.a.X_BC().p;
  const Posed X_WC = core_pose_of(shapes_.b, second.X_WB);
  const CoreDistance to = shapes_.b.distance(transposed_times(X_WC.R, center - X_WC.p));
  const Twistd V = shift(first.V_WB, center - first.X_WB.p) - shift(second.V_WB, center - second.X_WB.p);
  return {to.distance - shapes_.a.core().rounding - shapes_.b.core().rounding, dot(V.linear, X_WC.R * to.normal)};
}

}  // namespace grapnel
