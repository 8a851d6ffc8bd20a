#include "grapnel/linear/linearize.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "grapnel/dynamics/momentum.hpp"
#include "grapnel/linear/linear_variables.hpp"
#include "grapnel/linear/operating_point.hpp"
#include "grapnel/linear/plant.hpp"
#include "grapnel/linear/stability.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/spatial/decompositions.hpp"
#include "grapnel/text/error_text.hpp"

namespace grapnel {
namespace {

using Variable = LinearModel::Variable;
using Input = LinearInput;

// --- Conserved momenta ---

// The momentum of the trees connected with the base, in its axes, if it is conserved in every state, (27.6).
// `torque`: a law gives an external torque.
std::optional<ConservedRows> conserved_momentum(const OperatingPoint& point, MinimalCoordinates& coordinates,
                                                bool torque) {
  const PhaseSetup& setup = point.setup();
  if (!point.has_free_base() || setup.held_root >= 0 || setup.orbit || !setup.loads.empty()) return {};
  const Model& model = point.model();
  const auto m = static_cast<int>(coordinates.independent().size());
  std::vector<int> solved;
  for (int k = 0; k < 6; ++k) {
    const auto& independent = coordinates.independent();
    const auto at = std::find(independent.begin(), independent.end(), point.base_velocity() + k);
    if (at == independent.end()) return {};
    solved.push_back(m + static_cast<int>(at - independent.begin()));
  }
  std::vector<int> roots;
  for (std::size_t i = 0; i < model.bodies().size(); ++i) {
    const Body& body = model.bodies()[i];
    if (body.parent >= 0) continue;
    if (body.description.joint.type != JointType::free) return {};
    if (!point.elsewhere[static_cast<std::size_t>(body.v)]) roots.push_back(static_cast<int>(i));
  }
  const Rotationd R = root_pose(model, point.state, point.base).R;
  const Derivative momentum = derivative_of(coordinates, [&](const State& state) {
    const Kinematics kinematics = forward_kinematics(model, state);
    const Momentumd h = momentum_about(model, kinematics, center_of_mass(model, kinematics, roots), roots);
    const Vector3d k = transposed_times(R, h.angular), p = transposed_times(R, h.linear);
    return Eigen::VectorXd((Eigen::VectorXd(6) << k[0], k[1], k[2], p[0], p[1], p[2]).finished());
  });
  const double* w = point.state.v.data() + point.base_velocity();
  Eigen::Matrix3d turning;
  turning << 0, w[2], -w[1], -w[2], 0, w[0], w[1], -w[0], 0;
  if (torque) {
    return ConservedRows{
        momentum.value.bottomRows(3), turning, {solved.begin() + 3, solved.end()}, momentum.error.bottomRows(3)};
  }
  Eigen::MatrixXd both = Eigen::MatrixXd::Zero(6, 6);
  both.topLeftCorner(3, 3) = turning, both.bottomRightCorner(3, 3) = turning;
  return ConservedRows{momentum.value, both, solved, momentum.error};
}

// The rate at which a free base rotates [rad/s].
double base_rate(const OperatingPoint& point) {
  if (!point.has_free_base() || point.setup().held_root >= 0) return 0;
  const double* w = point.state.v.data() + point.base_velocity();
  return std::hypot(w[0], w[1], w[2]);
}

// Whether a joint is that of a reaction wheel or of the rotor of a gyro.
bool is_rotor(const OperatingPoint& point, int joint) {
  const std::string& name = point.model().joint_body(static_cast<std::size_t>(joint)).description.joint.name;
  const auto& wheels = point.problem.robot.wheels;
  return std::ranges::any_of(wheels, [&](const WheelSetup& wheel) { return name == wheel_body_name(wheel.name); }) ||
         std::ranges::any_of(point.setup().gyros, [&](const MomentGyro& gyro) { return gyro.rotor == joint; });
}

// The rate with which the linear model changes: the fastest rotation of the base, of a joint, or twice that of the
// orbit, whose tidal field turns as fast.
double motion_rate(const OperatingPoint& point) {
  double rate = base_rate(point);
  for (std::size_t j = 0; j < point.model().joints().size(); ++j) {
    const Body& body = point.model().joint_body(j);
    // A rotor is symmetric about its axis, so the model does not change with its angle.
    if (body.description.joint.type != JointType::revolute || is_rotor(point, static_cast<int>(j))) continue;
    rate = std::max(rate, std::abs(point.state.v[static_cast<std::size_t>(body.v)]));
  }
  if (point.setup().orbit) rate = std::max(rate, 2 * mean_motion(*point.setup().orbit));
  return rate;
}

// --- Closed loop ---

// Entries below the error of their column's differences count as zero.
Eigen::MatrixXd without_noise(const Derivative& derivative) {
  Eigen::MatrixXd K = derivative.value;
  const double largest = K.size() > 0 ? K.cwiseAbs().maxCoeff() : 0;
  for (Eigen::Index i = 0; i < K.rows(); ++i) {
    for (Eigen::Index j = 0; j < K.cols(); ++j) {
      if (std::abs(K(i, j)) <= std::max(10 * derivative.error(i, j), 1e-13 * largest)) K(i, j) = 0;
    }
  }
  return K;
}

// Channels of the loop: each joint with a law, and the base's axes, whose torque wheels may give; other wheels are
// channels themselves.
std::vector<LoopChannel> channels_of(const std::vector<Input>& inputs, const Eigen::MatrixXd& K,
                                     const Eigen::MatrixXd& torque) {
  const auto m = static_cast<Eigen::Index>(inputs.size());
  std::vector<Eigen::Index> wheels, others;
  for (Eigen::Index i = 0; i < m; ++i) {
    if (K.row(i).isZero(0)) continue;
    const bool is_wheel = inputs[static_cast<std::size_t>(i)].variable.name.starts_with("wheels/");
    (is_wheel ? wheels : others).push_back(i);
  }
  std::vector<LoopChannel> channels;
  for (const Eigen::Index i : others) {
    const Variable& input = inputs[static_cast<std::size_t>(i)].variable;
    channels.push_back({input.name, input.unit, Eigen::VectorXd::Unit(m, i), K.row(i)});
  }
  if (wheels.empty()) return channels;
  // The wheels' torques as shares of the torque on the base, if they are.
  const Eigen::MatrixXd of_wheels = K(wheels, Eigen::all);
  const Eigen::MatrixXd shares = of_wheels * pseudo_inverse(torque, 1e-10);
  const double residual = (of_wheels - shares * torque).norm();
  if (residual <= 1e-8 * of_wheels.norm()) {
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      if (torque.row(axis).isZero(0)) continue;
      Eigen::VectorXd direction = Eigen::VectorXd::Zero(m);
      for (std::size_t i = 0; i < wheels.size(); ++i) direction[wheels[i]] = shares(static_cast<Eigen::Index>(i), axis);
      channels.push_back({std::string("base/torque/") + "xyz"[axis], "N m", direction, torque.row(axis)});
    }
    return channels;
  }
  for (const Eigen::Index i : wheels) {
    const Variable& input = inputs[static_cast<std::size_t>(i)].variable;
    channels.push_back({input.name, input.unit, Eigen::VectorXd::Unit(m, i), K.row(i)});
  }
  return channels;
}

struct ClosedLoopParts {
  Plant plant;
  Eigen::MatrixXd K, torque, direct;  // direct: A of the closed loop by its own differences
  bool torque_is_external = false;
};

ClosedLoopParts parts_of(const OperatingPoint& point, const Eigen::VectorXd& commands, const std::vector<Input>& inputs,
                         EvaluatedPhase& phase, MinimalCoordinates& coordinates) {
  const Model& model = point.model();
  const Eigen::Index n = model.velocities();
  ClosedLoopParts parts;
  parts.plant = plant_of(point, coordinates, setup_of_plant(point, true), commands, inputs);
  const Derivative laws = derivative_of(coordinates, [&](const State& state) { return phase.commands(state); });
  const Eigen::MatrixXd K = without_noise(laws);
  parts.K = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(inputs.size()), coordinates.size());
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    for (std::size_t j = 0; j < model.joints().size(); ++j) {
      const int v = model.joint_body(j).v;
      if (inputs[i].force == Eigen::VectorXd::Unit(n, v) && !coordinates.fixed()[static_cast<std::size_t>(v)])
        parts.K.row(static_cast<Eigen::Index>(i)) = K.row(static_cast<Eigen::Index>(j));
    }
    for (int k = 0; k < 3 && point.has_free_base(); ++k) {
      if (inputs[i].force != Eigen::VectorXd::Unit(n, point.base_velocity() + k)) continue;
      parts.K.row(static_cast<Eigen::Index>(i)) = K.row(static_cast<Eigen::Index>(model.joints().size()) + k);
      parts.torque_is_external = parts.torque_is_external || !parts.K.row(static_cast<Eigen::Index>(i)).isZero(0);
    }
  }
  parts.torque = without_noise(
      derivative_of(coordinates, [&](const State& state) { return Eigen::VectorXd(phase.commanded_torque(state)); }));
  const Derivative direct = derivative_of(coordinates, [&](const State& state) {
    Eigen::VectorXd all(2 * n);
    all.head(n) = coordinates.position_rates(coordinates.deviation(state));
    all.tail(n) = phase.accelerations(state);
    return coordinates.independent_of(all);
  });
  parts.direct = direct.value;
  return parts;
}

void add_held_notes(const OperatingPoint& point, const std::vector<std::uint8_t>& fixed,
                    std::vector<std::string>& notes) {
  for (std::size_t j = 0; j < point.model().joints().size(); ++j) {
    const Body& body = point.model().joint_body(j);
    const bool is_gyro = std::ranges::any_of(point.setup().gyros, [&](const MomentGyro& gyro) {
      return gyro.gimbal == static_cast<int>(j) || gyro.rotor == static_cast<int>(j);
    });
    if (fixed[static_cast<std::size_t>(body.v)] && !is_gyro)
      notes.push_back(
          fmt::format("static friction or a stop holds joint '{}': it does not deviate", body.description.joint.name));
  }
  if (point.setup().held_root >= 0) notes.push_back("the base is held at its pose");
}

// Notes, which are doubts about the verdict as well.
void add_saturation_notes(const OperatingPoint& point, const Eigen::VectorXd& commands, std::vector<std::string>& notes,
                          std::vector<std::string>& doubts) {
  if (point.setup().actuators.thrusters) doubts.push_back("the limits of the thrusters are not contained");
  for (std::size_t j = 0; j < point.model().joints().size(); ++j) {
    const JointDescription& joint = point.model().joint_body(j).description.joint;
    if (std::abs(commands[static_cast<Eigen::Index>(j)]) < joint.limits.effort * (1 - 1e-9)) continue;
    notes.push_back(fmt::format("the effort of joint '{}' is at its limit of {:.6g}: its law has no gain there",
                                joint.name, joint.limits.effort));
    doubts.push_back(fmt::format("the effort of joint '{}' is at its limit", joint.name));
  }
}

// The loop of the laws at a state.
struct LoopAt {
  std::string obstacle;  // why there is none; empty: there is
  ClosedLoopParts parts = {};
  LinearLoop whole = {};
  ReducedLoop reduced = {};
};

// `commands`: constant efforts; without `is_checked` they may differ from those of the laws.
LoopAt loop_at(const OperatingPoint& point, const Eigen::VectorXd& commands, const std::vector<Input>& inputs,
               std::vector<std::string> doubts, bool is_checked = true) {
  constexpr double kDisagreement = 1e-5;
  EvaluatedPhase phase(point, setup_of_laws(point));
  std::vector<std::uint8_t> fixed = phase.prescribed();
  for (std::size_t v = 0; v < fixed.size(); ++v) fixed[v] = fixed[v] || point.elsewhere[v];
  MinimalCoordinates coordinates(point.model(), point.setup().closures, point.state, fixed);
  if (coordinates.size() == 0) return {"nothing moves freely under the laws at this time"};
  LoopAt at;
  at.parts = parts_of(point, commands, inputs, phase, coordinates);
  const Plant& plant = at.parts.plant;
  const Eigen::MatrixXd A = plant.A + plant.B * at.parts.K;
  const double error = (A - at.parts.direct).norm() / std::max(at.parts.direct.norm(), 1e-300);
  if (is_checked && !(error <= kDisagreement))
    return {
        fmt::format("the laws act by more than their efforts, or are not differentiable here: the closed loop and "
                    "its parts differ by {:.2g} of their size",
                    error)};
  at.whole = {plant.A, plant.B, at.parts.K, plant.error, names_of(states_of(point, coordinates))};
  at.whole.doubts = std::move(doubts);
  if (point.setup().clock) at.whole.timing = point.setup().clock->timing();
  constexpr double kMostPeriods = 200;  // in a delay: each is a state per input
  if (at.whole.timing && at.whole.timing->delay > kMostPeriods * at.whole.timing->period)
    return {fmt::format("the delay of the laws has more than {} periods", kMostPeriods)};
  if (!point.setup().attitude && !point.setup().controller) at.whole.free_rotation = base_rate(point);
  at.whole.motion_rate = motion_rate(point);
  const auto positions = static_cast<int>(coordinates.independent().size());
  at.reduced = reduced_loop(at.whole, conserved_momentum(point, coordinates, at.parts.torque_is_external), positions);
  return at;
}

// The growth rate of the fastest eigenvalue that grows [1/s]; 0 if none does.
double growth_of(const LinearModel::Modes& modes) {
  const auto grows = std::ranges::find(modes.eigenvalues, LinearModel::Kind::grows, &LinearModel::Eigenvalue::kind);
  return grows == modes.eigenvalues.end() ? 0 : grows->real;
}

// The loop at a state that follows the operating point; absent: there is none.
using FollowingLoop =
    std::function<std::optional<ReducedLoop>(const OperatingPoint&, const Eigen::VectorXd&, const std::vector<Input>&)>;

// How much a growth g [1/s] changes along the motion in its time constant, of its size (27.4b): over a tenth of that
// time, since a motion that begins at rest changes nothing at first. Infinite if it cannot be computed.
double change_of_growth(const OperatingPoint& point, double growth, const FollowingLoop& loop_of) {
  try {
    const double dt = 0.1 / growth;
    EvaluatedPhase phase(point, setup_of_laws(point));
    MinimalCoordinates coordinates(point.model(), point.setup().closures, point.state, phase.prescribed());
    const auto n = static_cast<Eigen::Index>(point.state.v.size());
    const Eigen::VectorXd velocities = Eigen::Map<const Eigen::VectorXd>(point.state.v.data(), n);
    OperatingPoint later = point;
    const Eigen::VectorXd accelerations = phase.accelerations(point.state);
    later.state = coordinates.moved_by(dt * velocities + 0.5 * dt * dt * accelerations, dt * accelerations);
    later.time = std::min(point.time + dt, point.interval_end);
    const Eigen::VectorXd commands = EvaluatedPhase(later, setup_of_laws(later)).commands(later.state);
    const std::optional<ReducedLoop> reduced = loop_of(later, commands, inputs_of(later, commands));
    if (!reduced) return std::numeric_limits<double>::infinity();
    const double change = std::abs(growth_of(modes_of(*reduced)) - growth) / (dt * growth * growth);
    return std::isfinite(change) ? change : std::numeric_limits<double>::infinity();
  } catch (const std::exception&) {  // the state that follows has no linear model
    return std::numeric_limits<double>::infinity();
  }
}

// The fastest growth of the loop at rest in the point's configuration, with rotors at their rates and without constant
// efforts: a steady motion. Absent: nothing grows, or it has no linear model.
std::optional<LinearModel::Eigenvalue> growth_at_rest(const OperatingPoint& point) {
  try {
    OperatingPoint rest = point;
    std::ranges::fill(rest.state.v, 0.0);
    for (std::size_t j = 0; j < point.model().joints().size(); ++j) {
      const auto v = static_cast<std::size_t>(point.model().joint_body(j).v);
      if (is_rotor(point, static_cast<int>(j))) rest.state.v[v] = point.state.v[v];
    }
    const auto joints = static_cast<Eigen::Index>(point.model().joints().size());
    const Eigen::VectorXd none = Eigen::VectorXd::Zero(joints + 3);
    const LoopAt at = loop_at(rest, none, inputs_of(rest, none), {}, false);
    if (!at.obstacle.empty()) return {};
    const LinearModel::Modes modes = modes_of(at.reduced);
    if (modes.verdict != LinearModel::Stability::unstable) return {};
    return *std::ranges::find(modes.eigenvalues, LinearModel::Kind::grows, &LinearModel::Eigenvalue::kind);
  } catch (const std::exception&) {
    return {};
  }
}

// Modes with the verdict on a growth: by its change along the motion, or, `with_laws`, by the loop at rest.
LinearModel::Modes modes_along(const OperatingPoint& point, ReducedLoop& reduced, bool with_laws,
                               const FollowingLoop& loop_of) {
  LinearModel::Modes modes = modes_of(reduced);
  const double growth = growth_of(modes);
  if (growth == 0) return modes;
  if (growth >= reduced.loop.motion_rate) reduced.loop.change = change_of_growth(point, growth, loop_of);
  modes = modes_of(reduced);
  if (modes.verdict == LinearModel::Stability::unstable || !with_laws) return modes;
  reduced.loop.growth_at_rest = growth_at_rest(point);
  return modes_of(reduced);
}

void close_loop(const OperatingPoint& point, const LawsOfPoint& laws, const Eigen::VectorXd& commands,
                const std::vector<Input>& inputs, LinearModel& model) {
  std::vector<std::string> doubts;
  add_saturation_notes(point, commands, model.notes, doubts);
  LoopAt at = loop_at(point, commands, inputs, std::move(doubts));
  if (!at.obstacle.empty()) {
    model.closed_loop_absent = at.obstacle;
    return;
  }
  const ClosedLoopParts& parts = at.parts;
  ReducedLoop& reduced = at.reduced;
  LinearModel::ClosedLoop loop;
  loop.laws = laws.names;
  loop.K = rows_of(parts.K);
  loop.states = at.whole.states;
  loop.sampled = at.whole.timing.has_value();
  loop.stability =
      modes_along(point, reduced, true,
                  [](const OperatingPoint& later, const Eigen::VectorXd& efforts, const std::vector<Input>& all) {
                    LoopAt following = loop_at(later, efforts, all, {});
                    return following.obstacle.empty() ? std::optional(std::move(following.reduced)) : std::nullopt;
                  });
  const auto has = [&](LinearModel::Kind kind) {
    return std::ranges::any_of(loop.stability.eigenvalues, [kind](const auto& e) { return e.kind == kind; });
  };
  if (loop.stability.verdict == LinearModel::Stability::unstable)
    model.warnings.push_back("the controlled system is unstable: " + loop.stability.reason);
  if (loop.stability.verdict == LinearModel::Stability::undecided)
    model.warnings.push_back("the stability of the controlled system is not decided: " + loop.stability.reason);
  if (has(LinearModel::Kind::grows)) {
    loop.margins_absent = "an eigenvalue of the closed loop grows";
  } else {
    if (has(LinearModel::Kind::tumbles))
      model.notes.push_back("margins are to growth faster than the free rotation of the base");
    std::vector<LoopChannel> channels = channels_of(inputs, parts.K, parts.torque);
    for (LoopChannel& channel : channels) channel.gain = channel.gain * reduced.map;
    loop.margins = margins_of(reduced.loop, channels);
    if (channels.empty()) loop.margins_absent = "no law has a gain";
  }
  model.closed_loop = std::move(loop);
}

}  // namespace

namespace {

// The system without laws. `coordinates` and `plant`: those of the point.
ReducedLoop open_loop(const OperatingPoint& point, MinimalCoordinates& coordinates, const Plant& plant) {
  LinearLoop open{plant.A,
                  plant.B,
                  Eigen::MatrixXd::Zero(plant.B.cols(), plant.A.rows()),
                  plant.error,
                  names_of(states_of(point, coordinates)),
                  {}};
  open.free_rotation = base_rate(point), open.motion_rate = motion_rate(point);
  const auto positions = static_cast<int>(coordinates.independent().size());
  return reduced_loop(open, conserved_momentum(point, coordinates, false), positions);
}

}  // namespace

LinearModel linearize(const CaptureProblem& problem, const LinearizeOptions& options) {
  if (options.sample_time && !(*options.sample_time > 0)) throw LinearizeError("the sample time must be above 0 s");
  if (!(options.delay >= 0)) throw LinearizeError("the delay must be at least 0 s");
  if (options.delay > 0 && !options.sample_time) throw LinearizeError("a delay needs a sample time");
  const CaptureProblem modelled = is_flexible(problem.robot) ? flexible_problem(problem) : problem;
  CaptureSteps steps(problem, CaptureDetail::columns);
  const OperatingPoint point(modelled, task_at(steps, options.time));
  if (shapes_touch(point))
    throw LinearizeError(fmt::format(
        "at t = {:.9g} s shapes touch: contacts have no linear model; choose a time without contact", point.time));
  LinearModel model;
  model.version = GRAPNEL_VERSION, model.scenario = problem.name, model.sha256 = problem.sha256;
  model.time = point.time, model.phase = point.phase();

  // Commands of the operating point, and the system without laws.
  const LawsOfPoint laws = laws_of(point);
  model.notes = laws.notes;
  const bool linear_laws = laws.obstacle.empty();
  const Eigen::VectorXd commands =
      linear_laws ? EvaluatedPhase(point, setup_of_laws(point)).commands(point.state) : commands_at(point);
  const std::vector<Input> inputs = inputs_of(point, commands);
  const PhaseSetup setup = setup_of_plant(point, false);
  std::vector<std::uint8_t> fixed = EvaluatedPhase(point, setup).prescribed();
  add_held_notes(point, fixed, model.notes);
  for (std::size_t v = 0; v < fixed.size(); ++v) fixed[v] = fixed[v] || point.elsewhere[v];
  MinimalCoordinates coordinates(point.model(), setup.closures, point.state, fixed);
  if (coordinates.size() == 0) throw LinearizeError("nothing moves freely at this time");
  const Plant plant = plant_of(point, coordinates, setup, commands, inputs);
  model.states = states_of(point, coordinates);
  for (const Input& input : inputs) model.inputs.push_back(input.variable);
  const LinearOutputs outputs = outputs_of(point, coordinates);
  const Derivative C = derivative_of(coordinates, outputs.at);
  model.outputs = outputs.variables;
  model.A = rows_of(plant.A), model.B = rows_of(plant.B), model.C = rows_of(without_noise(C));
  model.D = rows_of(Eigen::MatrixXd::Zero(C.value.rows(), plant.B.cols()));
  const double scale = std::max(plant.A.cwiseAbs().maxCoeff(), 1e-300);
  model.difference_error = plant.error.maxCoeff() / scale;
  constexpr double kDoubtful = 1e-5;
  if (model.difference_error > kDoubtful)
    model.warnings.push_back(
        fmt::format("the estimated error of A is {:.2g} of its largest entry: the motion is not smooth at this state",
                    model.difference_error));

  // The sampled model, and eigenvalues.
  std::optional<ControlTiming> timing;
  if (point.setup().clock) timing = point.setup().clock->timing();
  if (options.sample_time) timing = ControlTiming{*options.sample_time, options.delay};
  if (timing) {
    constexpr double kMostPeriods = 1000;
    if (timing->delay > kMostPeriods * timing->period)
      throw LinearizeError(fmt::format("the delay of {:.6g} s has more than {} periods of {:.6g} s", timing->delay,
                                       kMostPeriods, timing->period));
    const HeldInput held = hold_inputs(plant.A, plant.B, *timing);
    model.sampled = LinearModel::Sampled{timing->period,   timing->delay,     static_cast<std::size_t>(held.whole),
                                         rows_of(held.Ad), rows_of(held.now), rows_of(held.previous)};
  }
  ReducedLoop open = open_loop(point, coordinates, plant);
  const auto open_later = [&](const OperatingPoint& later, const Eigen::VectorXd& efforts,
                              const std::vector<Input>& all) {
    MinimalCoordinates moved(later.model(), setup.closures, later.state, fixed);
    const Plant its = plant_of(later, moved, setup_of_plant(later, false), efforts, all);
    return std::optional(open_loop(later, moved, its));
  };
  model.open_loop = linear_laws ? modes_along(point, open, false, open_later) : modes_of(open);

  // The scenario's own laws.
  if (!linear_laws)
    model.closed_loop_absent = laws.obstacle;
  else if (laws.names.empty())
    model.closed_loop_absent = "no law acts at this time";
  else
    close_loop(point, laws, commands, inputs, model);
  return model;
}

// --- The loops of a result ---

namespace {

// The laws of the segment; absent if none acts. `duration`: of the phase.
std::optional<ControlLoopReport> control_loop(const CaptureProblem& modelled, const MotionTask& task, double duration) {
  ControlLoopReport report;
  report.time = task.begin, report.phase = phase_of(modelled, task.phase);
  LinearModel model;
  try {
    const OperatingPoint point(modelled, task);
    const LawsOfPoint laws = laws_of(point);
    if (laws.names.empty()) return {};
    report.laws = laws.names;
    model.closed_loop_absent = shapes_touch(point) ? "shapes touch, and contacts have no linear model" : laws.obstacle;
    if (model.closed_loop_absent.empty()) {
      const Eigen::VectorXd commands = EvaluatedPhase(point, setup_of_laws(point)).commands(point.state);
      close_loop(point, laws, commands, inputs_of(point, commands), model);
    }
  } catch (const std::exception& error) {  // the result remains, with the reason
    model.closed_loop.reset();
    model.closed_loop_absent = error_text(error);
  }
  report.reason = report.margins_absent = model.closed_loop_absent;
  if (!model.closed_loop) return report;
  const LinearModel::ClosedLoop& loop = *model.closed_loop;
  report.verdict = loop.stability.verdict, report.reason = loop.stability.reason;
  if (report.verdict == LinearStability::unstable && growth_of(loop.stability) * duration < 1) {
    report.verdict = LinearStability::undecided;
    report.reason += fmt::format("; the phase of {:.4g} s is shorter than the time constant of this growth", duration);
  }
  report.sampled = loop.sampled;
  report.margins = loop.margins, report.margins_absent = loop.margins_absent;
  return report;
}

// The phases of a result: begins, ends.
std::vector<std::pair<double, double>> phases_of(const CaptureResult& result) {
  std::vector<std::pair<double, double>> phases;
  if (result.approach_end) phases.emplace_back(0, result.approach_end->time);
  for (const MotionPhaseReport& phase : result.phases) phases.emplace_back(phase.begin, phase.end);
  return phases;
}

}  // namespace

void add_control_loops(const CaptureProblem& problem, CaptureResult& result, const CaptureProgress& progress) {
  result.control_loops.clear();
  const auto& control = problem.control;
  if (control && (control->external || !control->plugin.empty() || !control->fmu.empty())) return;
  // Phases begin where the second simulation begins them; they end except for a last part, which a segment needs.
  constexpr double kLast = 1e-4;
  std::vector<double> ends;
  CaptureSteps steps(problem, CaptureDetail::columns, progress);
  for (const auto& [begin, end] : phases_of(result)) {
    if (end > begin) steps.pause_at(ends.emplace_back(end - kLast * (end - begin)));
  }
  const CaptureProblem modelled = is_flexible(problem.robot) ? flexible_problem(problem) : problem;
  std::string last;
  while (const MotionTask* task = steps.next()) {
    const std::string phase = phase_of(problem, task->phase);
    const bool begins = phase != std::exchange(last, phase);
    if (!begins && std::ranges::none_of(ends, [&](double end) { return is_same_time(task->begin, end); })) continue;
    if (progress) progress("margins of " + phase, task->begin, task->end);
    double duration = std::numeric_limits<double>::infinity();  // of a phase that failed
    for (const auto& [begin, end] : phases_of(result)) {
      if (task->begin < end && (task->begin >= begin || is_same_time(task->begin, begin))) duration = end - begin;
    }
    std::optional<ControlLoopReport> report = control_loop(modelled, *task, duration);
    if (!report) continue;
    if (report->verdict == LinearStability::unstable)
      result.warnings.push_back(fmt::format("the controlled system is unstable at t = {:.6g} s in {}: {}", report->time,
                                            report->phase, report->reason));
    result.control_loops.push_back(std::move(*report));
  }
  const CaptureResult again = steps.finish();
  if (again.status != result.status)
    throw LinearizeError("the simulation for margins ended before the run: " + again.failure);
}

}  // namespace grapnel
