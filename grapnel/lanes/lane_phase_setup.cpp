#include "grapnel/lanes/lane_phase_setup.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "grapnel/lanes/lane_loops_setup.hpp"
#include "grapnel/lanes/lane_outside_setup.hpp"

namespace grapnel::lanes {
namespace {

const JointDrive kFree = {};

constexpr const char* kStandsWithRate =
    "a prescribed joint has a rate at constant position, beyond its trajectory's end";
// Minimum number of coefficients per segment: that of any polynomial profile, so that cases with moving and resting
// joints share one structure.
constexpr int kLeastSeries = 6;
// Rounding error of a zero rate [rad/s or m/s].
constexpr double kRest = 1e-10;

const JointDrive& drive_of(const PhaseSetup& setup, std::size_t joint) {
  return setup.drives.empty() ? kFree : setup.drives.at(joint);
}

int coefficients(const JointSegment& segment) {
  const auto* series = std::get_if<ChebyshevSegment>(&segment.shape);
  return series != nullptr ? static_cast<int>(series->coefficients.size()) : 6;
}

bool is_cycloidal(const JointTrajectory& trajectory) {
  for (const JointSegment& segment : trajectory.segments) {
    const auto* path = std::get_if<JointPath>(&segment.shape);
    if (path != nullptr && path->profile == JointProfile::cycloidal) return true;
  }
  return false;
}

// Joints' positions in the order of sampled control's channels.
std::vector<int> channels_of(const Model& model, const PhaseSetup& setup) {
  if (setup.channels) return *setup.channels;
  std::vector<int> channels(model.joints().size());
  std::iota(channels.begin(), channels.end(), 0);
  return channels;
}

// Whether each case's own dynamics computes its commands under a clock (take_turn): for features that lanes lack. These
// are noisy sensors, laws with their own model, controllers, and base actuators other than a single torque.
bool is_computed_by_case(const PhaseSetup& setup) {
  if (!setup.clock) return false;
  const BaseActuators& actuators = setup.actuators;
  return setup.sensors || setup.law_model || setup.controller || actuators.thrusters || actuators.feedforward ||
         actuators.wheel_speed_rate != 0 || actuators.one_by_one;
}

LinkTable& table_of_joint(const Model& model, std::size_t joint, std::vector<LinkTable>& tables) {
  const Body& body = model.joint_body(joint);
  return tables[body.placement.link];
}

// Assigns joints to the efforts of a command.
void assign_channels(const Model& model, const PhaseSetup& setup, std::vector<LinkTable>& tables) {
  if (!setup.clock) return;
  if (!is_computed_by_case(setup)) {
    const std::vector<int> channels = channels_of(model, setup);
    for (std::size_t c = 0; c < channels.size(); ++c)
      table_of_joint(model, static_cast<std::size_t>(channels[c]), tables).channel = static_cast<int>(c);
    return;
  }
  int next = 0;
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    LinkTable& t = table_of_joint(model, j, tables);
    if (t.wheel < 0 && !works_by_effort(t.output)) continue;
    // The command contains its effort; the rest of its law is not evaluated.
    t.output = ControlOutput::none, t.reads_acceleration = t.is_cycloidal = false;
    t.series = 0, t.tones = -1;
    t.channel = next++;
  }
}

// The fields of a link's entry that follow from model and setup; offsets of segments and tones are set later.
std::vector<LinkTable> link_tables(const Model& model, const PhaseSetup& setup) {
  std::vector<LinkTable> tables;
  for (const TreeLink<double>& link : model.tree().links) {
    LinkTable t{};
    t.parent = link.parent, t.joint = link.joint, t.axis = link.axis, t.rotated = link.rotated;
    t.has_armature = link.armature != 0;
    t.is_massless = link.inertia.mass == 0;
    t.is_grounded = link.joint == JointType::fixed;
    t.q = link.q, t.v = link.v, t.sign = link.sign;
    t.block_offset = t.tones = t.channel = t.wheel = -1;
    tables.push_back(t);
  }
  if (setup.held_root >= 0) {
    const Body& held = model.bodies().at(setup.held_root);
    tables[held.placement.link].is_grounded = true;
  }
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const JointDrive& drive = drive_of(setup, j);
    const JointFriction& friction = body.description.joint.friction;
    LinkTable& t = tables[body.placement.link];
    const JointControlLaw& law = law_of(drive.control);
    t.control = drive.control, t.output = law.output, t.reads_acceleration = law.reads_acceleration;
    t.is_viscous = friction.viscous != 0;
    t.has_coulomb = friction.coulomb != 0;
    if (const auto& spring = body.description.joint.spring) t.has_spring = true, t.has_damper = spring->damping > 0;
    if (t.output == ControlOutput::none) continue;
    t.is_cycloidal = is_cycloidal(drive.trajectory);
    t.series = 1;
    for (const JointSegment& segment : drive.trajectory.segments) t.series = std::max(t.series, coefficients(segment));
    if (!drive.noise.tones().empty()) t.tones = 0;
  }
  for (std::size_t w = 0; w < setup.wheels.size(); ++w) {
    const int joint = model.joints()[setup.wheels[w].joint];
    const Body& body = model.bodies()[joint];
    tables[body.placement.link].wheel = static_cast<int>(w);
  }
  assign_channels(model, setup, tables);
  return tables;
}

// --- Trajectories ---------------------------------------------------------------------------------------------------

// Ends of the intervals from t0 to t1 in which trajectories and loads are smooth; ticks are not included.
std::vector<double> block_ends(const PhaseSetup& setup, double t0, double t1) {
  PhaseSetup unsampled = setup;
  unsampled.clock.reset();
  std::vector<double> times = phase_breaks(unsampled, t0, t1);
  times.push_back(t1);
  return times;
}

// Setup => channels, wheels and maximum number of delayed commands (6.14), and whether cases evaluate their control
// themselves.
ControlTable control_table(const PhaseSetup& setup, const std::vector<LinkTable>& links) {
  if (!setup.clock) return {false, 0, 0, false, false, 0};
  if (is_computed_by_case(setup)) {
    const auto channels = std::count_if(links.begin(), links.end(), [](const LinkTable& l) { return l.channel >= 0; });
    return {true, static_cast<int>(channels), 0, true, setup.actuators.thrusters != nullptr, 0};
  }
  const ControlTiming& timing = setup.clock->timing();
  // Commands delayed at a tick, including that of the tick, plus one for rounding of times.
  const int most = static_cast<int>(std::ceil(timing.delay / timing.period)) + 2;
  return {true,
          static_cast<int>(setup.clock->channels()),
          std::max(most, static_cast<int>(setup.clock->delayed_count()) + 1),
          false,
          false,
          static_cast<int>(setup.wheels.size())};
}

std::vector<double> command_numbers(const ControlClock::Command& command, const ControlTable& table) {
  std::vector<double> numbers = command.effort;
  numbers.insert(numbers.end(), command.base_torque.e, command.base_torque.e + 3);
  numbers.insert(numbers.end(), command.wheel_rates.begin(), command.wheel_rates.end());
  numbers.resize(table.command_numbers(), NAN);
  return numbers;
}

// The polynomial part of a profile as a series.
std::vector<double> path_series(const JointPath& path) {
  JointPath polynomial = path;
  if (path.profile == JointProfile::cycloidal) {  // its travel is stored separately
    polynomial.profile = JointProfile::quintic;
    polynomial.end = polynomial.start;
  }
  std::vector<double> values;
  for (int k = 0; k <= 5; ++k) values.push_back(evaluate(polynomial, chebyshev_point(0, path.duration, k, 5)).position);
  return chebyshev_interpolant(values).coefficients;
}

void write_hold(double position, double rate, double* out) {
  out[kSegmentInverseHalf] = 0;
  out[kSegmentRate] = rate;
  out[kSegmentSeries] = position;
}

// Segment of a trajectory => its numbers in a block: Chebyshev series, travel of a cycloidal profile, middle and
// inverse half length. Throws std::invalid_argument if the structure has fewer coefficients.
void write_segment(const JointSegment& segment, const LinkTable& table, double* out) {
  if (coefficients(segment) > table.series) {
    throw std::invalid_argument("lane_motion: a trajectory has more coefficients than the structure provides");
  }
  double begin = segment.begin, length = segment.end - segment.begin;
  if (const auto* path = std::get_if<JointPath>(&segment.shape)) {
    const std::vector<double> series = path_series(*path);
    std::copy(series.begin(), series.end(), out + kSegmentSeries);
    length = path->duration;
    if (path->profile == JointProfile::cycloidal) out[kSegmentTravel] = path->end - path->start;
  } else {
    const std::vector<double>& series = std::get<ChebyshevSegment>(segment.shape).coefficients;
    std::copy(series.begin(), series.end(), out + kSegmentSeries);
  }
  out[kSegmentMiddle] = begin + 0.5 * length;
  out[kSegmentInverseHalf] = 2 / length;
}

// Segment at the time `inside`, see evaluate(JointTrajectory, t, inside). `out` is initially zero.
void write_trajectory(const JointTrajectory& trajectory, double inside, const LinkTable& table, double* out) {
  const std::vector<JointSegment>& segments = trajectory.segments;
  if (segments.empty()) return;
  if (inside < segments.front().begin || inside >= segments.back().end) {
    const JointPoint held = evaluate(trajectory, inside, inside);
    if (table.output == ControlOutput::motion && std::abs(held.rate) > kRest) {
      throw std::invalid_argument(kStandsWithRate);
    }
    return write_hold(held.position, held.rate, out);
  }
  const auto next = std::upper_bound(segments.begin(), segments.end(), inside,
                                     [](double x, const JointSegment& p) { return x < p.begin; });
  write_segment(*(next - 1), table, out);
}

// --- Numbers of links -----------------------------------------------------------------------------------------------

void write_link(const TreeLink<double>& link, double* out) {
  out[kLinkMass] = link.inertia.mass;
  const Symmetric3d& J = link.inertia.rotational;
  const double rotational[6] = {J.xx, J.yy, J.zz, J.xy, J.xz, J.yz};
  std::copy(rotational, rotational + 6, out + kLinkRotational);
  for (int k = 0; k < 3; ++k) {
    out[kLinkFirstMoment + k] = link.inertia.first_moment[k];
    out[kLinkPosition + k] = link.X_PF.p[k];
    for (int c = 0; c < 3; ++c) out[kLinkRotation + 3 * k + c] = link.X_PF.R(k, c);
  }
  out[kLinkArmature] = link.armature;
}

bool matches(const LinkTable& own, const LinkTable& shared) {
  const bool same_tree = own.parent == shared.parent && own.joint == shared.joint && own.axis == shared.axis &&
                         own.q == shared.q && own.v == shared.v && own.sign == shared.sign &&
                         own.control == shared.control && own.channel == shared.channel && own.wheel == shared.wheel &&
                         own.is_grounded == shared.is_grounded;
  const auto allowed = [](bool needed, bool provided) { return provided || !needed; };
  return same_tree && allowed(own.rotated, shared.rotated) && allowed(own.has_armature, shared.has_armature) &&
         allowed(own.is_viscous, shared.is_viscous) && allowed(own.has_coulomb, shared.has_coulomb) &&
         own.has_spring == shared.has_spring && own.has_damper == shared.has_damper &&
         own.is_massless == shared.is_massless && allowed(own.tones >= 0, shared.tones >= 0);
}

}  // namespace

// Model, setup and method => first feature that lanes do not integrate; empty if there is none.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration) {
  // A structured binding: a new member of these structures fails to compile here until lanes handle it.
  const auto& [drives, held_root, gravity, loads, orbit, attitude, controller, commanded_root, wheels, gyros, actuators,
               effectors, clock, channels, sensors, law_model, recover_roots, driven_in_impacts, braked_in_impacts,
               contacts, tendons, closures, project_loops, loop_feedback, slips] = setup;
  if (attitude) {
    [[maybe_unused]] const auto& [root, R_WD, kp, kd, limit] = *attitude;
  }
  using Method = IntegrationSetup::Method;
  if (integration.method != Method::automatic && integration.method != Method::adaptive_8)
    return "the method is neither automatic nor adaptive_8";
  if (contacts) return "contacts between shapes";
  if (!slips.empty()) return "grasps slip";
  if (!tendons.empty()) return "tendons pull joints";
  // Under a clock each case computes its laws and actuators itself.
  const bool is_sampled = clock != nullptr;
  if (sensors && !is_sampled) return "sensors without a clock";
  if (law_model && !is_sampled) return "continuous laws with a separate model";
  if (controller && !is_sampled) return "a custom controller without a clock";
  [[maybe_unused]] const auto& [thrusters, modulation, dumping, feedforward, wheel_speed_rate, wheel_speeds, steering,
                                one_by_one] = actuators;
  if (thrusters && !is_sampled) return "thrusters switch depending on the state";
  if (feedforward && !is_sampled) return "continuous feedforward of the base torque";
  if (!wheels.empty() && !attitude && commanded_root < 0) return "reaction wheels without attitude control";
  if (!wheels.empty() && wheel_speed_rate != 0 && !is_sampled) return "continuous control of reaction wheel speeds";
  if (!gyros.empty() || steering) return "control moment gyros";
  for (const auto& effector : effectors) {
    if (const std::string obstacle = effector->lane_obstacle(); !obstacle.empty()) return obstacle;
  }
  if (!model.rotors().empty()) return "rotors store momentum";
  if (!model.couplings().empty()) return "joints are coupled";
  // Works are integrated for one tree.
  const int driven_root = model.joints().empty() ? -1 : model.bodies()[model.joints().front()].root;
  for (const int body : model.joints()) {
    // Likewise for the members of a joint.
    const auto& [name, type, axis, limits, joint_friction, rotor_inertia, gear_ratio, rotor_axis, motor, spring,
                 elasticity, modal, mimic] = model.bodies()[body].description.joint;
    const auto& [viscous, coulomb, transition_rate, friction_model, static_effort] = joint_friction;
    const auto& [lower, upper, rate, effort, stop] = limits;
    if (friction_model == JointFriction::Model::sticking) return "joints stick";
    if (stop) return "joints have stops";
    if (motor) return "joints have motors";
    if (modal) return "links have mode shapes";
    if (spring && spring->backlash > 0) return "gears have backlash";
    if (spring && spring->damping > 0 && model.bodies()[body].root != driven_root) return "dampers outside the robot";
  }
  if (held_root >= 0) {
    const Body& held = model.bodies().at(held_root);
    if (held.parent >= 0 || held.description.joint.type != JointType::free || (attitude && attitude->root == held_root))
      return "the held root is not free, or is under attitude control";
  }
  if (!drives.empty() && drives.size() != model.joints().size()) return "drives do not match the joints";
  return loop_obstacle(model, setup);
}

// The same for the interval t0 to t1: also rejects prescribed joints with a rate beyond the ends of their trajectories.
std::string lane_obstacle(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration, double t0,
                          double t1) {
  const std::string obstacle = lane_obstacle(model, setup, integration);
  if (!obstacle.empty()) return obstacle;
  double begin = t0;
  for (double end : block_ends(setup, t0, t1)) {
    const double inside = 0.5 * (begin + end);
    for (const JointDrive& drive : setup.drives) {
      const std::vector<JointSegment>& segments = drive.trajectory.segments;
      if (output_of(drive.control) != ControlOutput::motion || segments.empty()) continue;
      const bool beyond = inside < segments.front().begin || inside >= segments.back().end;
      if (beyond && std::abs(evaluate(drive.trajectory, inside, inside).rate) > kRest) return kStandsWithRate;
    }
    begin = end;
  }
  return {};
}

// Model, setup and method => structure of all cases: links, layout of segments and noise, control, external effects,
// loops. Throws std::invalid_argument with the obstacle if lanes cannot integrate the phase.
LaneStructure lane_structure(const Model& model, const PhaseSetup& setup, const IntegrationSetup& integration) {
  const std::string obstacle = lane_obstacle(model, setup, integration);
  if (!obstacle.empty()) throw std::invalid_argument("lane_structure: " + obstacle);
  LaneStructure s;
  s.links = link_tables(model, setup);
  s.coordinates = model.coordinates();
  s.velocities = model.velocities();
  s.quaternions = model.quaternions();
  s.recover_roots = setup.recover_roots;
  s.control = control_table(setup, s.links);
  s.integration = integration;
  for (LinkTable& link : s.links) {
    if (link.output == ControlOutput::none) continue;
    link.series = std::max(link.series, kLeastSeries);
    link.block_offset = s.block_size;
    s.block_size += kSegmentSeries + link.series;
    if (link.tones < 0) continue;
    link.tones = s.noise_numbers;
    s.noise_numbers += kNoiseNumbers;
  }
  describe_outside(s, model, setup);
  s.loops = loop_tables(model, setup);
  return s;
}

namespace {

// The block of the smooth interval around `inside`.
void write_block(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, double inside,
                 double* out) {
  write_loads(structure, model, setup, inside, out);
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const JointDrive& drive = drive_of(setup, j);
    const Body& body = model.joint_body(j);
    const LinkTable& table = structure.links.at(body.placement.link);
    if (table.output == ControlOutput::none && table.control == drive.control) continue;
    if (table.block_offset < 0 || (is_cycloidal(drive.trajectory) && !table.is_cycloidal)) {
      throw std::invalid_argument("lane_motion: a joint's drive does not match the structure");
    }
    write_trajectory(drive.trajectory, inside, table, out + table.block_offset);
  }
}

// The clock's actions at `t`, as in ControlClock::tick() and command().
void advance(ControlClock& clock, double t, double same, LaneInterval& interval) {
  std::size_t waiting = clock.delayed_count();
  interval.samples = clock.tick(t, same);
  interval.due = static_cast<std::uint8_t>(waiting - clock.delayed_count());
  if (!interval.samples) return;
  waiting = clock.delayed_count() + 1;
  clock.command({std::vector<double>(clock.channels())}, t, same);
  interval.acts_at_once = clock.delayed_count() < waiting;
}

}  // namespace

// Setup and interval => blocks of trajectory and load numbers, one per smooth interval, and the intervals between all
// breaks with the actions of the clock in each. A copy of the clock is advanced.
std::shared_ptr<const LaneMotion> lane_motion(const LaneStructure& structure, const Model& model,
                                              const PhaseSetup& setup, double t0, double t1) {
  if (!(t1 >= t0)) throw std::invalid_argument("lane_motion: the end lies before the start");
  if (const std::string difference = outside_difference(structure, model, setup); !difference.empty())
    throw std::invalid_argument("lane_motion: " + difference);
  auto motion = std::make_shared<LaneMotion>();
  motion->start_time = t0;
  motion->end_time = t1;
  const double same = break_resolution(t0, t1);
  std::optional<ControlClock> clock;
  if (setup.clock && !structure.control.by_case)
    clock = *setup.clock;  // a copy: the run's own clock advances when the lane's case has ended
  std::vector<double> ends = phase_breaks(setup, t0, t1);
  ends.push_back(t1);
  const std::vector<double> smooth = block_ends(setup, t0, t1);
  std::size_t next = 0;  // of them
  const auto numbers = static_cast<std::size_t>(structure.block_size);
  double begin = t0, block_begin = t0;
  int block = -1;
  for (const double end : ends) {
    bool breaks = block < 0;
    while (next + 1 < smooth.size() && smooth[next] <= begin + same) breaks = true, ++next, block_begin = begin;
    if (breaks) {
      ++block;
      motion->blocks.resize(motion->blocks.size() + numbers);
      write_block(structure, model, setup, 0.5 * (block_begin + smooth[next]),
                  motion->blocks.data() + motion->blocks.size() - numbers);
    }
    LaneInterval& interval = motion->intervals.emplace_back(LaneInterval{end, block, 0, false, false});
    if (clock) advance(*clock, begin, same, interval);
    begin = end;
  }
  return motion;
}

// Scalar dynamics of a case and its state => command until the returned time: motor efforts per channel, external
// torque on the base and, with thrusters, their wrench and its rate.
double take_turn(const LaneStructure& structure, PhaseDynamics& dynamics, const LaneTurn& turn,
                 std::span<double> command) {
  const Model& model = dynamics.model();
  std::vector<double> y;
  if (turn.is_first) {
    y = dynamics.initial({turn.q, turn.v}, turn.time);
    dynamics.begin_control(turn.time, turn.phase_end);
  } else {
    y.assign(dynamics.size(), 0.0);
    const auto integrals = std::copy(turn.v.begin(), turn.v.end(), std::copy(turn.q.begin(), turn.q.end(), y.begin()));
    std::copy(turn.integrals.begin(), turn.integrals.end(), integrals);
  }
  const double until = dynamics.begin_smooth_interval(turn.time, turn.end, y);
  const PhaseDynamics::HeldDrive held = dynamics.held_drive(turn.time);
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const int channel = structure.links[body.placement.link].channel;
    if (channel >= 0) command[channel] = held.motor[j];
  }
  double* rest = command.data() + structure.control.channels;
  std::copy(held.outer_torque.e, held.outer_torque.e + 3, rest);
  if (structure.control.has_thrusters) write_thrust(model, dynamics.base(), turn.time, until, rest + 3);
  return until;
}

// Outcome of a case => clock with the samples up to its end and with the commands that the lane has computed.
void end_control(const LaneMotion& motion, const LaneOutcome& outcome, ControlClock& clock) {
  const double same = break_resolution(motion.start_time, motion.end_time);
  double begin = motion.start_time;
  for (const LaneInterval& interval : motion.intervals) {
    if (begin > outcome.time) break;
    LaneInterval same_again{};
    advance(clock, begin, same, same_again);
    begin = interval.end;
  }
  const std::size_t channels = clock.channels();
  std::vector<ControlClock::Command> commands;
  const std::size_t wheels = outcome.command_wheels, size = channels + 3 + wheels;
  for (std::size_t at = 0; at + size <= outcome.commands.size(); at += size) {
    const double* numbers = outcome.commands.data() + at;
    ControlClock::Command& command = commands.emplace_back();
    command.effort.assign(numbers, numbers + channels);
    std::copy(numbers + channels, numbers + channels + 3, command.base_torque.e);
    const double* rates = numbers + channels + 3;
    if (wheels > 0 && !std::isnan(rates[0])) command.wheel_rates.assign(rates, rates + wheels);
  }
  clock.put(std::move(commands));
}

// Model, setup and state => numbers of one case: links, gains, friction, springs, noise, loops, external effects and
// delayed commands. Throws std::invalid_argument if the structure differs.
void lane_case(const LaneStructure& structure, const Model& model, const PhaseSetup& setup, const State& state,
               std::shared_ptr<const LaneMotion> motion, LaneCase& result) {
  const std::vector<LinkTable> own = link_tables(model, setup);
  bool same = own.size() == structure.links.size() && structure.coordinates == model.coordinates();
  for (std::size_t n = 0; same && n < own.size(); ++n) same = matches(own[n], structure.links[n]);
  if (!same || control_table(setup, own) != structure.control)
    throw std::invalid_argument("lane_case: the model or its drives have another structure");
  if (const std::string difference = outside_difference(structure, model, setup); !difference.empty())
    throw std::invalid_argument("lane_case: " + difference);
  const auto numbers_of = [&](int link) { return result.links.data() + static_cast<long>(link) * kLinkNumbers; };
  result.links.assign(own.size() * kLinkNumbers, 0.0);
  for (std::size_t n = 0; n < own.size(); ++n) write_link(model.tree().links[n], numbers_of(static_cast<int>(n)));
  result.noise.assign(structure.noise_numbers, 0.0);
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const JointDrive& drive = drive_of(setup, j);
    const JointDescription& joint = body.description.joint;
    double* out = numbers_of(body.placement.link);
    out[kLinkKp] = drive.kp, out[kLinkKd] = drive.kd;
    out[kLinkEffort] = joint.limits.effort;
    out[kLinkViscous] = joint.friction.viscous, out[kLinkCoulomb] = joint.friction.coulomb;
    out[kLinkInverseTransition] = 1 / joint.friction.transition_rate;
    if (joint.spring) {
      out[kLinkStiffness] = joint.spring->stiffness, out[kLinkDamping] = joint.spring->damping;
      out[kLinkRest] = joint.spring->rest;
    }
    const std::vector<NoiseSignal::Tone>& tones = drive.noise.tones();
    const LinkTable& table = structure.links[body.placement.link];
    if (table.output == ControlOutput::none || tones.empty()) continue;
    double* noise = result.noise.data() + table.tones;
    noise[0] = drive.noise.amplitude();
    for (int k = 0; k < kTones; ++k) {
      noise[1 + 2 * k] = tones[k].angular_frequency;
      noise[2 + 2 * k] = tones[k].phase;
    }
  }
  if (loop_tables(model, setup) != structure.loops)
    throw std::invalid_argument("lane_case: the loop closures do not match the structure");
  result.outside = outside_numbers(structure, model, setup);
  result.loops = loop_numbers(model, setup);
  result.q = state.q;
  result.v = state.v;
  result.commands.clear();
  if (setup.clock && !structure.control.by_case) {
    for (const ControlClock::Command& command : setup.clock->commands()) {
      const std::vector<double> numbers = command_numbers(command, structure.control);
      result.commands.insert(result.commands.end(), numbers.begin(), numbers.end());
    }
  }
  result.motion = std::move(motion);
}

}  // namespace grapnel::lanes
