#include "grapnel/scenario/plausibility.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/problem/problem_clearance.hpp"
#include "grapnel/problem/target_motion.hpp"
#include "grapnel/text/message_text.hpp"

namespace grapnel {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kFastest = 6;  // [rad/s], approximately one turn per second

// ---- Inertia ----

// Density of the densest metal [kg/m^3].
constexpr double kDensest = 22600;
// Without a shape: largest mean distance of the mass from its centre for a body of one tonne [m], scaled with size.
constexpr double kLargestGyration = 10, kMassOfLargest = 1000;
// With a shape: the mean distance is at most three times, and at least a twentieth, of the extent of the shape.
constexpr double kBeyondShape = 3, kWithinShape = 0.05;

double largest_principal_moment(const Symmetric3d& I) {
  // Eigenvalues of a symmetric matrix, by the trigonometric solution of its characteristic equation.
  const double q = (I.xx + I.yy + I.zz) / 3;
  const double off = I.xy * I.xy + I.xz * I.xz + I.yz * I.yz;
  const double dx = I.xx - q, dy = I.yy - q, dz = I.zz - q;
  const double p = std::sqrt((dx * dx + dy * dy + dz * dz + 2 * off) / 6);
  if (p == 0) return q;
  const double det = dx * (dy * dz - I.yz * I.yz) - I.xy * (I.xy * dz - I.yz * I.xz) + I.xz * (I.xy * I.yz - dy * I.xz);
  return q + 2 * p * std::cos(std::acos(std::clamp(det / (2 * p * p * p), -1.0, 1.0)) / 3);
}

// Second moments of the mass about the reference point of the tensor: S = (tr I / 2) 1 - I.
Symmetric3d second_moments(const Symmetric3d& I) {
  const double half = (I.xx + I.yy + I.zz) / 2;
  Symmetric3d S = Symmetric3d::zero();
  S.xx = half - I.xx, S.yy = half - I.yy, S.zz = half - I.zz;
  S.xy = -I.xy, S.xz = -I.xz, S.yz = -I.yz;
  return S;
}

double least_principal_moment(const Symmetric3d& S) {
  Symmetric3d negative = S;
  for (double* component : {&negative.xx, &negative.yy, &negative.zz, &negative.xy, &negative.xz, &negative.yz})
    *component = -*component;
  return -largest_principal_moment(negative);
}

// For a tensor about the frame's origin.
Symmetric3d about_centre_of_mass(Symmetric3d I, double mass, const Vector3d& com) {
  const double square = dot(com, com);
  I.xx -= mass * (square - com[0] * com[0]), I.yy -= mass * (square - com[1] * com[1]);
  I.zz -= mass * (square - com[2] * com[2]);
  I.xy += mass * com[0] * com[1], I.xz += mass * com[0] * com[2], I.yz += mass * com[1] * com[2];
  return I;
}

// Largest distance of a shape's points from a point of its body's frame, an upper bound for round shapes.
double farthest(const Geometry& shape, const Vector3d& from) {
  const auto at = [&](const Vector3d& p) { return norm(shape.X_BG * p - from); };
  double most = 0;
  switch (shape.shape) {
    case Geometry::Shape::none:
      break;
    case Geometry::Shape::sphere:
      most = at(Vector3d::zero()) + shape.size[0];
      break;
    case Geometry::Shape::cylinder:
    case Geometry::Shape::capsule:
      for (const double end : {-0.5, 0.5}) most = std::max(most, at({0, 0, end * shape.size[1]}) + shape.size[0]);
      break;
    case Geometry::Shape::box:
      for (int corner = 0; corner < 8; ++corner) {
        const auto half = [&](int k) { return ((corner >> k) & 1 ? 0.5 : -0.5) * shape.size[k]; };
        most = std::max(most, at({half(0), half(1), half(2)}));
      }
      break;
    case Geometry::Shape::mesh:
      if (!shape.mesh) break;  // its file is missing
      for (const Vector3d& p : shape.mesh->vertices)
        most = std::max(most, at({shape.size[0] * p[0], shape.size[1] * p[1], shape.size[2] * p[2]}));
      break;
  }
  return most;
}

bool is_shape(const Geometry& shape) { return shape.shape != Geometry::Shape::none; }

double farthest(const std::vector<Geometry>& shapes, const Vector3d& from) {
  double most = 0;
  for (const Geometry& shape : shapes) most = std::max(most, farthest(shape, from));
  return most;
}

// The smallest extent of the shapes with a positive extent; 0: no such shape.
double nearest_end(const std::vector<Geometry>& shapes, const Vector3d& from) {
  double least = 0;
  for (const Geometry& shape : shapes) {
    const double end = farthest(shape, from);
    if (end > 0 && (least == 0 || end < least)) least = end;
  }
  return least;
}

// The unit error that would explain a radius of gyration that is too large by a factor: tonnes give 31.6, square
// millimetres give 1000.
std::string unit_mistake(double too_large_by) {
  if (too_large_by > 300) return "; is the inertia in kg mm^2?";
  if (too_large_by > 10) return "; is the mass in t?";
  if (too_large_by < 0.1 && too_large_by > 0.003) return "; is the inertia in t m^2, or the mass in g?";
  return "";
}

// ---- Directions ----

// Cosine of the angle between two vectors; empty for a zero vector.
std::optional<double> cosine(const Vector3d& a, const Vector3d& b) {
  const double length = norm(a) * norm(b);
  if (!(length > 1e-9)) return {};
  return dot(a, b) / length;
}
constexpr double kOpposite = 0.5;  // of a cosine: 60 degrees

// The centre of the target's only shape; empty with several shapes.
Vector3d middle_of(const TargetSetup& target) {
  return target.geometry.size() == 1 && is_shape(target.geometry[0]) ? target.geometry[0].X_BG.p : target.com;
}

void doubt_directions(const Node& node, const std::string& path, const GraspPoint& point, const Vector3d& middle,
                      FaultList& faults) {
  const Vector3d outward = point.X_TG.p - middle;
  const auto along = [&](const std::optional<Vector3d>& direction) {
    return direction ? cosine(*direction, outward).value_or(0) : 0;
  };
  const auto reversed = [](const Vector3d& v) {
    return fmt::format("[{:g}, {:g}, {:g}]", 0 - v[0], 0 - v[1], 0 - v[2]);
  };
  if (along(point.approach_direction) > kOpposite) {
    faults.warn(part(node, "approach_direction").mark,
                fmt::format("{} points away from the target: it must be the direction of motion of the approaching "
                            "end-effector; did you mean {}?",
                            below(path, "approach_direction"), reversed(*point.approach_direction)));
  }
  if (along(point.normal) < -kOpposite) {
    faults.warn(part(node, "normal").mark,
                fmt::format("{} points into the target: it must be the outward normal of the surface; did you mean {}?",
                            below(path, "normal"), reversed(*point.normal)));
  }
}

// ---- The start ----

// The cost of the backward simulation from the capture to the start is proportional to the number of turns.
constexpr double kMostTurned = 1e5;         // [rad]
constexpr double kMostTurnedInOrbit = 1e2;  // if the whole motion must be integrated [rad]

bool start_is_cheap(const CaptureProblem& problem) {
  const double T = problem.approach ? problem.approach->duration : 0;
  return std::all_of(problem.targets.begin(), problem.targets.end(), [&](const TargetSetup& t) {
    const auto acts = [&](const LoadSetup& load) {
      return load.body == BodyName::of_target(target_index(problem, t.name));
    };
    if (t.given_at == TargetSetup::Instant::start) return true;
    return T * norm(t.V_WT.angular) < (problem.orbit ? kMostTurnedInOrbit : kMostTurned) &&
           std::none_of(problem.loads.begin(), problem.loads.end(), acts);
  });
}

// The location of a body's description: a target's position, else the robot.
const Mark& place_of_body(const Node& scenario, const CaptureSystem& system, int body) {
  const Node& list = part(scenario, "targets");
  const std::size_t target = system.addresses[static_cast<std::size_t>(body)].target;
  if (belongs_to_targets(system, body) && target < list.items.size())
    return part(part(list.items[target], "state"), "position").mark;
  return part(scenario, "robot").mark;
}

// Pairs of bodies that overlap at t = 0, each with the largest depth of its shapes.
class StartOverlaps {
 public:
  struct Overlap {
    int body_a, body_b;
    double depth;  // [m]
  };

  void add(const Overlap& found) {
    const auto [known, is_first] = places_.emplace(std::minmax(found.body_a, found.body_b), all_.size());
    if (is_first) all_.push_back(found);
    all_[known->second].depth = std::max(all_[known->second].depth, found.depth);
  }
  const std::vector<Overlap>& all() const { return all_; }

 private:
  std::vector<Overlap> all_;
  std::map<std::pair<int, int>, std::size_t> places_;
};

std::string shown_body(const CaptureSystem& system, int body) {
  const std::string name = in_quotes(shown_name(system, body));
  return system.addresses[static_cast<std::size_t>(body)].is_target_itself() ? "target " + name : name;
}

}  // namespace

void doubt_angle(double angle, const Mark& mark, const std::string& name, FaultList& faults) {
  if (!(std::abs(angle) > 2 * kPi * (1 + 1e-6)) || !std::isfinite(angle)) return;
  faults.warn(mark, fmt::format("{} is {} rad, more than a full turn; angles are in rad, {} degrees would be {:.9g}",
                                name, angle, angle, angle * kPi / 180));
}

void doubt_angular_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults) {
  if (!(std::abs(rate) > kFastest) || !std::isfinite(rate)) return;
  faults.warn(mark, fmt::format("{} is {} rad/s, {:.3g} turns per second; rates are in rad/s, {} deg/s would be {:.9g}",
                                name, rate, std::abs(rate) / (2 * kPi), rate, rate * kPi / 180));
}

void doubt_rotor_rate(double rate, const Mark& mark, const std::string& name, FaultList& faults) {
  constexpr double kPerMinute = 2 * kPi / 60;
  faults.warn(mark, fmt::format("{} is {} rad/s, {:.6g} turns per minute, faster than any wheel or rotor; rates are in "
                                "rad/s, {} rpm would be {:.9g}",
                                name, rate, std::abs(rate) / kPerMinute, rate, rate * kPerMinute));
}

void doubt_joint_limits(const Node& joint, const std::string& path, const JointDescription& read, FaultList& faults) {
  constexpr double kDegree = kPi / 180;
  constexpr double kMultiple = 10, kRounded = 0.01;  // [deg]: joints of many turns stop at multiples
  // Limits in degrees are in this range; larger numbers mean no limit.
  const auto is_suspect = [](double x) { return std::abs(x) > 4 * kPi * (1 + 1e-6) && std::abs(x) <= 720; };
  if (!turns_about_axis(read.type)) return;
  const Node& limits = part(joint, "limits");
  const auto is_plain = [](const Node& node) { return node.is_scalar() && node.unit == 0; };
  for (const auto& [key, value] : {std::pair{"lower", read.limits.lower}, std::pair{"upper", read.limits.upper}}) {
    const Node& node = part(limits, key);
    const double degrees = value / kDegree;
    if (!is_plain(node) || !is_suspect(value) || std::abs(std::remainder(degrees, kMultiple)) < kRounded) continue;
    faults.warn(node.mark, fmt::format("{} is {} rad, {:.3g} turns; limits are in rad, {} degrees would be {:.9g}",
                                       below(below(path, "limits"), key), value, std::abs(value) / (2 * kPi), value,
                                       value * kDegree));
  }
  const Node& rate = part(limits, "rate");
  const std::string source = rate.mark.source ? *rate.mark.source : "";
  const bool is_model = source.ends_with(".urdf") || source.ends_with(".xml");
  if (!is_plain(rate) || is_model || !is_suspect(read.limits.rate)) return;
  faults.warn(rate.mark, fmt::format("{} is {} rad/s, {:.3g} turns per second; rates are in rad/s, {} deg/s would be "
                                     "{:.9g}",
                                     below(below(path, "limits"), "rate"), read.limits.rate,
                                     read.limits.rate / (2 * kPi), read.limits.rate, read.limits.rate * kDegree));
}

bool is_doubtful_quaternion(std::span<const double, 4> q) {
  // A computed half turn has a scalar part of rounding error.
  constexpr double kRounding = 1e-12;
  // As w, x, y, z a rotation by more than 150 degrees, as x, y, z, w by less than 30.
  const bool is_half_turn = std::abs(q[0]) < std::cos(75 * kPi / 180) && std::abs(q[3]) > std::cos(15 * kPi / 180);
  return is_half_turn && (q[0] == 0 || std::abs(q[0]) > kRounding);
}

void doubt_quaternion(std::span<const double, 4> q, const Mark& mark, const std::string& name, FaultList& faults) {
  if (!is_doubtful_quaternion(q)) return;
  const double turn = 2 * std::acos(std::min(1.0, std::abs(q[0]))) * 180 / kPi;
  const double other = 2 * std::acos(std::min(1.0, std::abs(q[3]))) * 180 / kPi;
  faults.warn(mark, fmt::format("{} rotates by {:.4g} degrees; in the order x, y, z, w it would rotate by {:.4g}. The "
                                "order is w, x, y, z; use rpy for an intended half turn",
                                name, turn, other));
}

void doubt_inertia(const Node& body, const std::string& path, const MassProperties& read,
                   const std::vector<Geometry>& shapes, FaultList& faults) {
  const auto& [mass, com, inertia] = read;
  if (!body.find("mass") || !body.find("inertia") || !(mass > 0)) return;
  const double largest = largest_principal_moment(inertia);
  const double gyration = std::sqrt(largest / mass);
  // Mean square distance from the centre of mass: for a ball of the densest metal, and for this body.
  const double ball = 0.6 * std::pow(3 * mass / (4 * kPi * kDensest), 2.0 / 3);
  const double spread = (inertia.xx + inertia.yy + inertia.zz) / (2 * mass);
  // The smallest shape may have all the mass: others are panels or antennas.
  const double reach = farthest(shapes, com), core = nearest_end(shapes, com);
  const bool has_shape = reach > 0;
  const double most =
      has_shape ? kBeyondShape * reach : kLargestGyration * std::max(1.0, std::cbrt(mass / kMassOfLargest));
  std::string why;
  double off = 1;
  if (gyration > most) {
    off = gyration / (has_shape ? reach : 1);
    why = has_shape ? fmt::format("{} {:.3g} m from the centre of mass",
                                  shapes.size() > 1 ? "the shapes end" : "the shape ends", reach)
                    : fmt::format("more than {:.3g} m is implausible", most);
  } else if (spread < ball) {
    off = std::sqrt(spread / ball) * 0.1;
    why = "a ball of the densest metal has a larger one";
  } else if (has_shape && spread < std::pow(kWithinShape * core, 2)) {
    off = std::sqrt(spread) / core;
    why = fmt::format("{} {:.3g} m from the centre of mass",
                      shapes.size() > 1 ? "the nearest of the shapes ends" : "the shape ends", core);
  }
  if (why.empty()) return;
  faults.warn(part(body, "inertia").mark,
              fmt::format("{}: the moment of inertia {:.6g} kg m^2 and the mass {:.6g} kg make a radius of gyration of "
                          "{:.3g} m, and {}{}",
                          below(path, "inertia"), largest, mass, gyration, why, unit_mistake(off)));
}

void doubt_inertia_point(const Node& body, const std::string& path, const BodyDescription& read,
                         const std::vector<Vector3d>& points, const std::vector<Geometry>& shapes, FaultList& faults) {
  // Mass may extend slightly beyond joints, as motors do. The check requires a slender body: housings of other bodies
  // may be wider than the distance of their joints, and larger than their shapes.
  constexpr double kBeyond = 1.15, kSlender = 0.25, kRounding = 1e-6;
  const double offset = norm(read.com);
  const bool has_shape = farthest(shapes, read.com) > 0;
  if (!body.find("mass") || !body.find("inertia") || !(read.mass > 0) || !(offset > 0)) return;
  if (points.empty() && !has_shape) return;
  const Vector3d along = (1 / offset) * read.com;
  double reach = farthest(shapes, read.com);
  for (const Vector3d& point : points) reach = std::max(reach, std::abs(dot(along, point - read.com)));
  const Symmetric3d S = second_moments(read.inertia);
  const double spread = dot(along, S * along) / read.mass, across = (S.xx + S.yy + S.zz) / read.mass - spread;
  const double moved = spread - offset * offset;  // if it is about the origin
  if (!(spread > kBeyond * reach * reach) || !(moved >= 0) || !(moved <= reach * reach)) return;
  if (across > kSlender * offset * offset) return;
  const Symmetric3d about_com = about_centre_of_mass(read.inertia, read.mass, read.com);
  if (least_principal_moment(second_moments(about_com)) < -kRounding * read.mass * spread) return;
  const Symmetric3d& I = about_com;
  faults.warn(part(body, "inertia").mark,
              fmt::format("{}: with the mass {:.6g} kg and the centre of mass {:.4g} m from the frame's origin it "
                          "gives a mass distribution of {:.3g} m (root mean square) along the line between them, but "
                          "the body ends {:.3g} m from the centre of mass; is it about the origin? About the centre of "
                          "mass, as required, it would be [{:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}, {:.6g}]",
                          below(path, "inertia"), read.mass, offset, std::sqrt(spread), reach, I.xx, I.yy, I.zz,
                          I.xy + 0.0, I.xz + 0.0, I.yz + 0.0));
}

void doubt_target_inertia(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults) {
  doubt_inertia(target, path, {read.mass, read.com, read.inertia}, read.geometry, faults);
  BodyDescription body;
  body.mass = read.mass, body.com = read.com, body.inertia = read.inertia;
  doubt_inertia_point(target, path, body, {}, read.geometry, faults);
}

void doubt_approach_axis(const Node& end_effector, const std::string& path, const EndEffectorSetup& read,
                         FaultList& faults) {
  if (!read.approach_axis) return;
  const Vector3d axis = read.X_BE.R * *read.approach_axis;
  if (cosine(axis, read.X_BE.p).value_or(0) > -0.7) return;
  faults.warn(
      part(end_effector, "approach_axis").mark,
      fmt::format(
          "{} points from the end-effector back to the origin of its link {}: it must be the direction of approach",
          below(path, "approach_axis"), in_quotes(read.body)));
}

void doubt_grasp_points(const Node& target, const std::string& path, const TargetSetup& read, FaultList& faults) {
  const Node& list = part(target, "grasp_points");
  const double reach = farthest(read.geometry, Vector3d::zero());
  for (std::size_t i = 0; i < list.items.size() && i < read.grasp_points.size(); ++i) {
    const GraspPoint& point = read.grasp_points[i];
    const std::string here = item(below(path, "grasp_points"), i);
    const double distance = norm(point.X_TG.p);
    if (reach > 0 && distance > 1.25 * reach) {
      faults.warn(part(list.items[i], "position").mark,
                  fmt::format("{} is {:.4g} m from the target's origin, and its {} at {:.4g} m; positions of "
                              "grasp points are in the target's frame, in m",
                              below(here, "position"), distance, read.geometry.size() > 1 ? "shapes end" : "shape ends",
                              reach));
    }
    doubt_directions(list.items[i], here, point, middle_of(read), faults);
  }
}

void doubt_shared_points(const Node& list, const CaptureProblem& problem, FaultList& faults) {
  constexpr double kSame = 1e-3;  // [m]
  const bool releases = problem.post_impact.any([](const PostImpactSetup& phase) { return !phase.releases.empty(); });
  const auto position = [&](const GraspSetup& grasp) -> const Vector3d* {
    for (const TargetSetup& t : problem.targets) {
      if (t.name != grasp.target) continue;
      for (const GraspPoint& p : t.grasp_points) {
        if (p.name == grasp.grasp_point) return &p.X_TG.p;
      }
    }
    return nullptr;
  };
  for (std::size_t b = 1; b < problem.grasps.size() && b < list.items.size(); ++b) {
    const Vector3d* at_b = position(problem.grasps[b]);
    for (std::size_t a = 0; a < b && at_b; ++a) {
      const GraspSetup &first = problem.grasps[a], &second = problem.grasps[b];
      const Vector3d* at_a = first.target == second.target ? position(first) : nullptr;
      // One end-effector may follow another at the same grasp point.
      const bool in_turn = releases && (first.closes != second.closes || first.closes_at != second.closes_at);
      if (!at_a || in_turn || norm(*at_a - *at_b) > kSame) continue;
      faults.warn(part(list.items[b], "point").mark,
                  fmt::format("{}: end-effectors {} and {} have the same grasp point on target {} and would collide",
                              item("grasps", b), in_quotes(first.end_effector), in_quotes(second.end_effector),
                              in_quotes(second.target)));
      break;
    }
  }
}

void doubt_start(const CaptureProblem& problem, const Node& scenario, FaultList& faults) {
  const CaptureSystem system = make_capture_system(problem);
  State state = initial_servicer_state(problem, system);
  CaptureProblem watched = problem;
  watched.clearance.enabled = true;
  watched.contacts.clear();  // pairs that may touch are watched too
  const ClearanceModel clearance = make_clearance_model(watched, system);
  if (clearance.pairs().empty() || !start_is_cheap(problem)) return;
  const TargetPlan targets = plan_targets(problem);
  for (std::size_t t = 0; t < watched.targets.size(); ++t) {
    set_root_pose(system.model, system.model.frames()[system.target_frames[t]].body, targets.start[t].X_WT, state);
  }
  const auto is_target = [&](int body) { return belongs_to_targets(system, body); };
  const Kinematics kinematics = forward_kinematics(system.model, state);
  StartOverlaps overlaps;
  for (std::size_t p = 0; p < clearance.pairs().size(); ++p) {
    const int pair = static_cast<int>(p);
    constexpr double kTouching = 1e-6;  // [m]
    // Shapes of a robot's links are approximate in folded postures; the run checks their feasibility.
    const bool of_robot = !is_target(clearance.pairs()[p].body_a) && !is_target(clearance.pairs()[p].body_b);
    if (of_robot || clearance.lower_bound(pair, kinematics) > 0) continue;
    const double distance = clearance.distance(pair, kinematics).distance;
    if (!(distance < -kTouching)) continue;
    overlaps.add({clearance.pairs()[p].body_a, clearance.pairs()[p].body_b, -distance});
  }
  const std::vector<ContactPair> touching = contact_pairs(problem, system);
  const auto may_touch = [&](const StartOverlaps::Overlap& overlap) {
    return std::any_of(touching.begin(), touching.end(), [&](const ContactPair& pair) {
      const int a = body_named(system, pair.a), b = body_named(system, pair.b);
      return std::minmax(a, b) == std::minmax(overlap.body_a, overlap.body_b);
    });
  };
  for (const StartOverlaps::Overlap& overlap : overlaps.all()) {
    // A target follows the robot in the model: it is the more likely cause.
    faults.warn(place_of_body(scenario, system, overlap.body_b),
                fmt::format("{} and {} overlap by {:.3g} m at t = 0, by their shapes{}",
                            shown_body(system, overlap.body_a), shown_body(system, overlap.body_b), overlap.depth,
                            may_touch(overlap) ? "; 'contacts' lets them touch, so that the run will fail: move one of "
                                                 "them, or leave the pair out of 'contacts'"
                                               : ""));
  }
}

namespace {

// The angular frequency of two bodies on the spring of their contact; obstacles and held bases are immovable.
double contact_frequency(const CaptureSystem& system, const ContactPair& pair) {
  const auto inverse_mass = [&](const BodyName& name) {
    const int body = body_named(system, name);  // -1: an obstacle
    const double mass = body < 0 ? 0 : system.model.bodies()[static_cast<std::size_t>(body)].description.mass;
    return mass > 0 ? 1 / mass : 0;
  };
  return pair.law.hertz ? 0 : std::sqrt(pair.law.elastic * (inverse_mass(pair.a) + inverse_mass(pair.b)));
}

}  // namespace

void doubt_contact_stiffness(const CaptureProblem& problem, const Node& scenario, FaultList& faults) {
  if (problem.contacts.empty() || problem.integration.method != IntegrationSetup::Method::adaptive_8) return;
  constexpr double kStable = 6.1;          // largest step times angular frequency of adaptive_8, about
  constexpr double kStepsPerSecond = 1e4;  // of a run with contacts, about
  const CaptureSystem system = make_capture_system(problem);
  const double duration = problem.post_impact.total_duration() + (problem.approach ? problem.approach->duration : 0);
  const ContactPair* fastest = nullptr;
  double frequency = 0;
  const std::vector<ContactPair> pairs = contact_pairs(problem, system);
  for (const ContactPair& pair : pairs) {
    const double of_pair = contact_frequency(system, pair);
    if (of_pair > frequency) frequency = of_pair, fastest = &pair;
  }
  const double steps = frequency * duration / kStable, most = static_cast<double>(problem.integration.max_steps);
  if (!(steps > most)) return;
  faults.warn(part(scenario, "contacts").mark,
              fmt::format("contact of '{}' and '{}' with {:.3g} N/m vibrates with {:.3g} Hz; where it lasts for all of "
                          "the {:.3g} s, the integrator needs about {:.2g} steps and {:.2g} h, and "
                          "integration.max_steps is {:.2g}; use a stiffness of at most {:.2g} N/m",
                          contact_name(problem, fastest->a), contact_name(problem, fastest->b), fastest->law.elastic,
                          frequency / (2 * kPi), duration, steps, steps / kStepsPerSecond / 3600, most,
                          fastest->law.elastic * most * most / (steps * steps)));
}

}  // namespace grapnel
