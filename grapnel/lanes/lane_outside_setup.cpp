#include "grapnel/lanes/lane_outside_setup.hpp"

#include <algorithm>
#include <numbers>
#include <stdexcept>

namespace grapnel::lanes {
namespace {

LoadTable::Kind kind_of(const LoadProfile& profile) {
  switch (profile.shape) {
    case LoadProfile::Shape::half_sine:
    case LoadProfile::Shape::sine:
      return LoadTable::Kind::sine;
    case LoadProfile::Shape::table:
      return LoadTable::Kind::line;
    case LoadProfile::Shape::constant:
      break;
  }
  return LoadTable::Kind::constant;
}

const BodyPlacement& placement_of(const Model& model, int body) { return model.bodies().at(body).placement; }

// Rotation from a load's axes to the link's axes, which are fixed in the body.
Rotationd to_link(const Model& model, const ExternalLoad& load) {
  return load.frame == LoadFrame::body ? placement_of(model, load.body).X_LB.R : Rotationd::identity();
}

LoadTable load_table(const Model& model, const ExternalLoad& load) {
  LoadTable table{};
  table.link = placement_of(model, load.body).link;
  table.kind = kind_of(load.profile);
  table.frame = load.frame;
  table.has_stream = load.stream.has_value();
  table.both_sides = load.stream && load.stream->both_sides;
  return table;
}

// Setup => which external effects exist: gravity, orbit, loads, torque on the actuated root, wheels, thrusters, ground.
OutsideTable outside_table(const Model& model, const PhaseSetup& setup) {
  OutsideTable table{};
  table.has_gravity = dot(setup.gravity, setup.gravity) > 0;
  table.has_orbit = setup.orbit.has_value();
  table.is_circular = setup.orbit && setup.orbit->eccentricity == 0;
  const int root = setup.attitude ? setup.attitude->root : setup.commanded_root;
  table.attitude_link = root >= 0 ? placement_of(model, root).link : -1;
  table.load_count = static_cast<int>(setup.loads.size());
  table.wheel_count = static_cast<int>(setup.wheels.size());
  table.has_thrusters = setup.actuators.thrusters != nullptr;
  table.has_outer_torque = root >= 0 && setup.wheels.empty() && !table.has_thrusters && !setup.actuators.one_by_one;
  const std::vector<TreeLink<double>>& links = model.tree().links;
  table.has_ground = setup.held_root >= 0 || std::any_of(links.begin(), links.end(), [](const TreeLink<double>& link) {
                       return link.joint == JointType::fixed;
                     });
  return table;
}

void put(const Vector3d& v, double* out) { std::copy(v.e, v.e + 3, out); }
void put(const Wrenchd& F, double* out) { put(F.angular, out), put(F.linear, out + 3); }

// The table line that contains the time `inside`, its wrenches rotated by R; see wrench_at(). `out` is initially zero.
void write_line(const LoadProfile& p, const Rotationd& R, double inside, double* out) {
  if (inside < p.start || inside >= p.end || inside < p.times.front() || inside >= p.times.back()) return;
  const auto above = std::upper_bound(p.times.begin(), p.times.end(), inside);
  const std::size_t next = static_cast<std::size_t>(above - p.times.begin());
  out[kLoadLineStart] = p.times[next - 1];
  put(R * p.values[next - 1], out + kLoadLineWrench);
  put(R * ((1 / (p.times[next] - p.times[next - 1])) * (p.values[next] - p.values[next - 1])), out + kLoadLineRate);
}

// See factor_at(). `out` is initially zero.
void write_factor(const LoadProfile& p, double inside, double* out) {
  if (inside < p.start || inside >= p.end) return;
  out[kLoadActs] = 1;
  if (p.shape == LoadProfile::Shape::constant) return;
  const bool half = p.shape == LoadProfile::Shape::half_sine;
  out[kLoadStart] = p.start;
  out[kLoadFrequency] = half ? std::numbers::pi / (p.end - p.start) : 2 * std::numbers::pi * p.frequency;
  out[kLoadPhase] = half ? 0 : p.phase;
}

// In the order of OrbitConstants.
void write_orbit(const ReferenceOrbit& orbit, double* out) {
  const OrbitConstants<double> c = orbit_constants(orbit);
  const double numbers[] = {c.mu,          c.semi_major_axis, c.eccentricity, c.root,
                            c.mean_motion, c.mean_anomaly,    c.cosine,       c.sine};
  std::copy(std::begin(numbers), std::end(numbers), out);
  put(c.radial, out + 8), put(c.along_track, out + 11), put(c.position, out + 14), put(c.velocity, out + 17);
}

void write_attitude(const AttitudeControl& control, double* out) {
  const Quaterniond q = quaternion_from(control.R_WD);
  const double numbers[] = {q.w, q.x, q.y, q.z};
  std::copy(std::begin(numbers), std::end(numbers), out);
  put(control.kp, out + 4), put(control.kd, out + 7), put(control.limit, out + 10);
}

void write_wheels(const std::vector<ReactionWheel>& wheels, double* out) {
  const WheelArray array(wheels);
  for (std::size_t w = 0; w < wheels.size(); ++w, out += kWheelNumbers) {
    put(array.shares()[w], out + kWheelRow);
    out[kWheelTorque] = wheels[w].torque, out[kWheelRate] = wheels[w].rate;
  }
}

void write_load(const Model& model, const ExternalLoad& load, double* out) {
  const Posed& X_LB = placement_of(model, load.body).X_LB;
  put(X_LB * load.p_BP, out + kLoadPoint);
  put(to_link(model, load) * load.amplitude, out + kLoadAmplitude);
  if (!load.stream) return;
  put(load.stream->direction, out + kLoadDirection);
  put(X_LB.R * load.stream->normal, out + kLoadNormal);
  out[kLoadReach] = load.stream->pressure * load.stream->area;
  out[kLoadSpecular] = load.stream->specular, out[kLoadDiffuse] = load.stream->diffuse;
}

}  // namespace

// Setup => external effects and loads of `structure`, with the place of each load's numbers in a block. Throws
// std::invalid_argument for invalid loads, loads on no body or in the axes of a missing orbit.
void describe_outside(LaneStructure& structure, const Model& model, const PhaseSetup& setup) {
  structure.outside = outside_table(model, setup);
  structure.loads.clear();
  for (const ExternalLoad& load : setup.loads) {
    validate(load);
    if (load.body < 0 || load.body >= static_cast<int>(model.bodies().size()))
      throw std::invalid_argument("lane_structure: a load acts on no body of the model");
    if (load.frame == LoadFrame::orbit && !setup.orbit)
      throw std::invalid_argument("lane_structure: a load is in the axes of an orbit, but there is no orbit");
    LoadTable& table = structure.loads.emplace_back(load_table(model, load));
    table.block_offset = structure.block_size;
    structure.block_size += kLoadBlockNumbers[static_cast<int>(table.kind)];
  }
}

std::string outside_difference(const LaneStructure& structure, const Model& model, const PhaseSetup& setup) {
  OutsideTable own = outside_table(model, setup);
  own.is_circular =
      own.is_circular && structure.outside.is_circular;  // structures for elliptic orbits serve circular ones
  bool same = own == structure.outside;
  for (std::size_t i = 0; same && i < setup.loads.size(); ++i) {
    LoadTable table = load_table(model, setup.loads[i]);
    table.block_offset = structure.loads[i].block_offset;
    same = table == structure.loads[i];
  }
  return same ? "" : "the external loads have another structure";
}

void write_loads(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, double inside,
                 double* block) {
  for (std::size_t i = 0; i < setup.loads.size(); ++i) {
    const ExternalLoad& load = setup.loads[i];
    double* out = block + structure.loads[i].block_offset;
    if (load.profile.shape == LoadProfile::Shape::table) {
      write_line(load.profile, to_link(model, load), inside, out);
    } else {
      write_factor(load.profile, inside, out);
    }
  }
}

void write_thrust(const Model& model, const BaseActuation& base, double begin, double end, double* line) {
  const Posed& X_LB = placement_of(model, base.root()).X_LB;
  const auto on_link = [&](double t) -> Wrenchd {
    const Wrenchd F = base.thrust_at(t);
    const Vector3d force = X_LB.R * F.linear;
    return {X_LB.R * F.angular + cross(X_LB.p, force), force};
  };
  const Wrenchd first = on_link(begin);
  line[kLoadLineStart] = begin;
  put(first, line + kLoadLineWrench);
  put(end > begin ? (1 / (end - begin)) * (on_link(end) - first) : Wrenchd::zero(), line + kLoadLineRate);
}

// Setup => numbers of the external effects of one case: gravity, orbit (14.1), attitude control (6.13), loads, wheels
// (17.2); in the layout of the structure, zero where an effect is absent.
std::vector<double> outside_numbers(const LaneStructure& structure, const Model& model, const PhaseSetup& setup) {
  std::vector<double> numbers(static_cast<std::size_t>(structure.outside_numbers()), 0.0);
  if (numbers.empty()) return numbers;
  put(setup.gravity, numbers.data() + kGravity);
  if (setup.orbit) write_orbit(*setup.orbit, numbers.data() + kOrbit);
  if (setup.attitude) write_attitude(*setup.attitude, numbers.data() + kAttitude);
  double* out = numbers.data() + kLoads;
  for (const ExternalLoad& load : setup.loads) {
    write_load(model, load, out);
    out += kLoadNumbers;
  }
  write_wheels(setup.wheels, out);
  return numbers;
}

}  // namespace grapnel::lanes
