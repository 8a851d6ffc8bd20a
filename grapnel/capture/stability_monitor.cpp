#include "grapnel/capture/stability_monitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "grapnel/capture/conservation_monitor.hpp"
#include "grapnel/problem/flexible_bodies.hpp"
#include "grapnel/result/text_table.hpp"
#include "grapnel/result/verdicts.hpp"

namespace grapnel {
namespace {

constexpr std::size_t kMaxHalves = 3000;
constexpr std::size_t kBins = 96;

// ---- The criteria ----

// Minimum number of half-cycles in total, and in a third.
constexpr std::size_t kMinHalves = 9;
// Growth of the peaks from the first to the second third of the half-cycles, and from the second to the last.
constexpr double kGrowsEarly = 1.1, kGrowsLate = 1.2;
// Fast growth: number of half-cycles at the end, and growth of each peak relative to the previous one.
constexpr std::size_t kFastHalves = 4;
constexpr double kFastGrowth = 1.15;
// The same for forced oscillations: both growths, and that of each half-cycle.
constexpr double kGrowsForced = 4, kGrowsForcedEach = 1.3;
// If springs or free joints store energy, the total energy must grow, too: otherwise they only exchange it.
constexpr double kEnergyGrows = 1.05;
// Sustained oscillation: peaks of the last third over the second, and the share of time at the limit.
constexpr double kSustained = 0.8, kSaturated = 0.2;
// Forced oscillations between both limits: minimum number of half-cycles, reversals of the limit per half-cycle, and
// per step in which the excitation reverses.
constexpr long kMinAlternating = 15;
constexpr double kReversals = 0.5, kReversalsPerExcitation = 3;
// Peaks below this fraction of the phase's maximum have settled.
constexpr double kSettled = 0.02;
// A phase has decayed if the maximum of its last third is below this fraction of that of its first.
constexpr double kDecayed = 0.5;
// Divergence without oscillation: number of parts of equal duration, and minimum growth from each to the next. Powers
// of time up to the third, as of a rate under a constant or ramped torque, grow less in the last part.
constexpr int kParts = 8;
constexpr double kDiverges = 1.5;
// Rates at rounding level [rad/s or m/s], and the multiple of a sensor's deviation that counts as noise.
constexpr double kSettledRate = 1e-7, kNoiseDeviations = 5;

// Contacts between shapes that have begun so far, and impacts of hard ones.
long touches_in(const ContactSet* contacts) {
  long touches = 0;
  for (std::size_t g = 0; contacts && g < contacts->groups(); ++g)
    touches += contacts->history(g).touches + contacts->history(g).impacts;
  return touches;
}

}  // namespace

// ---- Oscillation ----

// Durations, counts and saturated times add up; peaks and energies are maxima.
void Oscillation::Content::append(const Content& later) {
  peak = std::max(peak, later.peak), energy = std::max(energy, later.energy);
  saturated += later.saturated, count += later.count;
  reversals += later.reversals, excited += later.excited;
}

// Step and the value at its end => extends the current half-cycle, or begins one at a change of sign; updates its peak,
// energy, saturated time and reversals, and the envelope. At kMaxHalves, half-cycles are merged.
void Oscillation::add(const Step& step) {
  const double size = std::abs(step.value), duration = step.end - step.begin;
  const int sign = step.value > 0 ? 1 : step.value < 0 ? -1 : sign_;
  if (halves_.empty() || sign != sign_) {
    if (halves_.size() >= kMaxHalves) merge_halves();
    Half& half = halves_.emplace_back();
    half.begin = step.begin, half.count = 1;
    sign_ = sign;
  }
  Half& half = halves_.back();
  half.end = step.end;
  half.peak = std::max(half.peak, size), half.energy = std::max(half.energy, step.energy);
  if (step.excited) ++half.excited;
  if (step.limit != 0) {
    half.saturated += duration;
    if (limit_ != 0 && step.limit != limit_) ++half.reversals;
    limit_ = step.limit;
  }
  if (std::isnan(start_)) start_ = step.begin, width_ = std::max(duration, 1e-9) / 4;
  bin(step.end, size);
}

// Half-cycles => every three in one.
void Oscillation::merge_halves() {
  std::vector<Half> merged;
  for (std::size_t i = 0; i < halves_.size(); ++i) {
    if (i % 3 == 0) {
      merged.push_back(halves_[i]);
      continue;
    }
    merged.back().append(halves_[i]);
    merged.back().end = halves_[i].end;
  }
  halves_ = std::move(merged);
}

void Oscillation::bin(double t, double value) {
  end_ = t;
  while (t - start_ >= width_ * static_cast<double>(kBins)) {
    for (std::size_t i = 0; 2 * i < bins_.size(); ++i)
      bins_[i] = std::max(bins_[2 * i], 2 * i + 1 < bins_.size() ? bins_[2 * i + 1] : 0.0);
    bins_.resize((bins_.size() + 1) / 2);
    width_ *= 2;
  }
  const auto at = static_cast<std::size_t>((t - start_) / width_);
  if (at >= bins_.size()) bins_.resize(at + 1, 0.0);
  bins_[at] = std::max(bins_[at], value);
}

double Oscillation::in_bins(double from, double to) const {
  const double duration = end_ - start_;
  double most = 0;
  for (std::size_t i = 0; i < bins_.size(); ++i) {
    const double middle = (static_cast<double>(i) + 0.5) * width_;
    if (middle >= from * duration && middle <= to * duration + width_) most = std::max(most, bins_[i]);
  }
  return most;
}

// Minimum number of half-cycles => peaks, energies, durations of the three equal parts of the half-cycles. Empty if
// there are fewer, or if the oscillation has ended: the last half-cycle lasts more than three usual ones.
std::vector<Oscillation::Third> Oscillation::thirds(std::size_t least) const {
  if (halves_.size() < least) return {};
  std::vector<Third> thirds(3);
  const std::size_t size = halves_.size() / 3, rest = halves_.size() % 3;
  const Half &last = halves_.back(), &before = halves_[halves_.size() - 2];
  for (std::size_t i = rest; i < halves_.size(); ++i) {
    Third& third = thirds[(i - rest) / size];
    Half half = halves_[i];
    if ((i - rest) % size == 0) third.begin = half.begin;
    if (i + 1 == halves_.size()) {  // it is incomplete
      half.end = half.begin;
      half.saturated = 0, half.count = half.reversals = half.excited = 0;
    }
    third.append(half);
    third.duration += half.end - half.begin;
  }
  const auto mean = [](const Half& half) { return (half.end - half.begin) / static_cast<double>(half.count); };
  const double usual = std::max(mean(before), thirds[2].duration / static_cast<double>(std::max(1L, thirds[2].count)));
  return mean(last) > 3 * usual ? std::vector<Third>() : thirds;
}

std::optional<Oscillation::Growth> Oscillation::growth(std::size_t count, double factor) const {
  if (halves_.size() < count + 1) return {};  // the last one is incomplete
  const std::size_t end = halves_.size() - 1, begin = end - count;
  for (std::size_t i = begin + 1; i < end; ++i) {
    if (!(halves_[i].peak > factor * halves_[i - 1].peak)) return {};
  }
  const Half &first = halves_[begin], &last = halves_[end - 1];
  const double period = 2 * (last.end - first.begin) / static_cast<double>(count);
  return Growth{first.peak, last.peak, last.energy / first.energy, period, first.begin};
}

double Oscillation::saturated_since() const {
  std::size_t first = halves_.size() - 1;  // incomplete
  while (first > 0 && !(halves_[first - 1].saturated > 0)) --first;
  while (first > 0 && halves_[first - 1].saturated > 0) --first;
  return halves_[first].begin;
}

bool Oscillation::diverges(int parts, double factor) const {
  if (bins_.size() < 4 * static_cast<std::size_t>(parts)) return false;
  double before = 0;
  for (int k = 0; k < parts; ++k) {
    const double largest = in_bins(static_cast<double>(k) / parts, static_cast<double>(k + 1) / parts);
    if (k > 0 && !(largest > factor * before)) return false;
    before = largest;
  }
  return before >= this->largest();
}

// ---- The verdict ----

namespace {

// Whether the actuators alternate between their limits in the second and the last third, by themselves.
bool alternates(const std::vector<Oscillation::Third>& thirds) {
  Oscillation::Content late = thirds[1];
  late.append(thirds[2]);
  const auto reverses = [](const Oscillation::Content& part) {
    return static_cast<double>(part.reversals) >= kReversals * static_cast<double>(part.count);
  };
  return thirds[0].count + late.count >= kMinAlternating && reverses(thirds[1]) && reverses(thirds[2]) &&
         static_cast<double>(late.reversals) > kReversalsPerExcitation * static_cast<double>(late.excited);
}

}  // namespace

// Oscillation, sensor noise, conditions => verdict with reason, period [s] and amplitudes. In this order: growth over
// the thirds or saturation, fast growth of the last half-cycles, exponential growth, decay.
StabilityReport evaluate_oscillation(const Oscillation& o, double noise, bool stores_energy, bool forced) {
  StabilityReport report;
  const double floor = std::max(kSettledRate, kNoiseDeviations * noise);
  const std::vector<Oscillation::Third> thirds = o.thirds(kMinHalves);
  if (!thirds.empty()) {
    const Oscillation::Third &first = thirds[0], &middle = thirds[1], &last = thirds[2];
    report.period = 2 * last.duration / static_cast<double>(std::max(1L, last.count));
    report.amplitude_before = first.peak, report.amplitude_after = last.peak;
    report.saturated_share = last.duration > 0 ? last.saturated / last.duration : 0;
    const bool is_large = last.peak > std::max(floor, kSettled * o.largest());
    const double early = forced ? kGrowsForced : kGrowsEarly, late = forced ? kGrowsForced : kGrowsLate;
    const bool grows = middle.peak > early * first.peak && last.peak > late * middle.peak &&
                       (!stores_energy || last.energy > kEnergyGrows * middle.energy);
    const bool is_sustained =
        last.peak > kSustained * middle.peak && report.saturated_share > kSaturated && (!forced || alternates(thirds));
    if (is_large && (grows || is_sustained)) {
      report.verdict = Stability::unstable;
      report.since = grows ? first.begin : o.saturated_since();
      report.reason = grows     ? "the oscillation grows"
                      : !forced ? "the oscillation does not decay and the actuator saturates"
                                : "the oscillation does not decay and the actuator alternates between its limits";
      return report;
    }
  }
  const std::optional<Oscillation::Growth> growth =
      o.growth(forced ? kMinHalves : kFastHalves, forced ? kGrowsForcedEach : kFastGrowth);
  if (growth && growth->last > std::max(floor, kSettled * o.largest()) &&
      (!stores_energy || growth->energy_factor > kEnergyGrows)) {
    report.period = growth->period, report.amplitude_before = growth->first, report.amplitude_after = growth->last;
    report.verdict = Stability::unstable, report.reason = "the oscillation grows", report.since = growth->begin;
    return report;
  }
  report.period = 0, report.saturated_share = 0;
  report.amplitude_before = o.first(), report.amplitude_after = o.last();
  if (!forced && o.last() > floor && o.diverges(kParts, kDiverges)) {
    report.verdict = Stability::unstable, report.reason = "the rate grows exponentially", report.since = o.start();
    return report;
  }
  if (forced) {
    report.reason = "joints follow a moving reference, or noise";
    return report;
  }
  if (o.last() <= std::max(floor, kDecayed * o.first()) || o.last() <= kSettled * o.largest()) {
    report.verdict = Stability::stable;
    report.reason = "the rate has decayed";
  } else {
    report.reason = "the rate neither decays nor grows in this phase";
  }
  return report;
}

// ---- Phases ----

// Problem => monitor without signals; begin_phase() selects them.
StabilityMonitor::StabilityMonitor(const CaptureProblem& problem) : problem_(problem) {}

// Phase => signals to observe, with limits and sensor noise: base rates under attitude control, rates of joints that
// control moves by efforts; also the criteria of rest after the impact.
void StabilityMonitor::begin_phase(const std::string& name, const CaptureSystem& system, const PhaseDynamics& dynamics,
                                   bool moved_by_law, bool after_impact) {
  name_ = name, system_ = &system, dynamics_ = &dynamics, moved_by_law_ = moved_by_law;
  touches_ = touches_in(dynamics.setup().contacts.get()), disturbed_ = false;
  signals_.clear();
  pulls_.assign(system.robot_joints.size(), 0.0), reference_reverses_ = false;
  const PhaseSetup& setup = dynamics.setup();
  const Model& model = system.model;
  const double period = problem_.control ? problem_.control->timing.period : 0;
  const SensorSetup sensors = problem_.sensors.value_or(SensorSetup{});
  const int root = setup.attitude ? setup.attitude->root : setup.commanded_root;
  for (int k = 0; root >= 0 && k < 3; ++k) {
    Signal signal;
    signal.of = std::string("base ") + "xyz"[k];
    signal.velocity = model.bodies()[root].v + k, signal.axis = k;
    signal.limit = setup.attitude ? setup.attitude->limit[k] : std::numeric_limits<double>::infinity();
    if (sensors.gyro) signal.noise = sensors.gyro->deviation(period) + sensors.gyro->quantum;
    signals_.push_back(signal);
  }
  stores_energy_ = false;
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const JointDescription& joint = model.joint_body(j).description.joint;
    const bool is_robots = std::count(system.robot_joints.begin(), system.robot_joints.end(), static_cast<int>(j)) > 0;
    const ControlOutput output = setup.drives.empty() ? ControlOutput::none : output_of(setup.drives[j].control);
    stores_energy_ = stores_energy_ || yields(joint) || (is_robots && output == ControlOutput::none);
    if (!is_robots || !works_by_effort(output)) continue;
    Signal signal;
    signal.of = joint.name, signal.joint = static_cast<int>(j);
    signal.of_law = output == ControlOutput::command && moved_by_law;
    signal.velocity = model.joint_body(j).v;
    signal.limit = joint.limits.effort;
    if (sensors.joints && period > 0)
      signal.noise = sensors.joints->rate_noise + sensors.joints->rate_quantum +
                     (sensors.joints->noise + sensors.joints->position_quantum()) / period;
    signals_.push_back(signal);
  }
  seeks_rest_ = after_impact && problem_.post_impact && problem_.post_impact->at_rest;
  if (!seeks_rest_ || rest_) return;
  rest_.emplace();
  rest_->angular_velocity_limit = problem_.post_impact->at_rest->angular_velocity;
  rest_->joint_rate_limit = problem_.post_impact->at_rest->joint_rate;
}

// Kinetic energy of all motion except that of wheels and rotors in the base, and elastic energy.
double StabilityMonitor::energy(const State& state) const {
  State still = state;
  const Model& model = system_->model;
  const auto stop = [&](int joint) { still.v[model.joint_body(joint).v] = 0; };
  for (const int wheel : system_->wheels) stop(wheel);
  for (const CaptureSystem::Gyro& gyro : system_->gyros) stop(gyro.rotor);
  const ConservedQuantities q = conserved_quantities(model, forward_kinematics(model, still), still);
  return q.kinetic_energy + q.elastic_energy;
}

// Whether a joint reference moves in a step, or a joint follows noise. Also sets whether an acceleration of a reference
// changes its sign in the step.
bool StabilityMonitor::is_forced(double begin, double end) {
  constexpr double kMoves = 1e-9;  // [rad/s or m/s]
  const PhaseSetup& setup = dynamics_->setup();
  reference_reverses_ = false;
  bool moves = false;
  for (std::size_t i = 0; i < system_->robot_joints.size() && !setup.drives.empty(); ++i) {
    const JointDrive& drive = setup.drives[static_cast<std::size_t>(system_->robot_joints[i])];
    if (drive.control == JointControl::free) continue;
    const JointPoint at = evaluate(drive.trajectory, end, 0.5 * (begin + end));
    if (std::abs(at.acceleration) > kMoves) {
      if (at.acceleration * pulls_[i] < 0) reference_reverses_ = true;
      pulls_[i] = at.acceleration;
    }
    if (drive.noise.amplitude() != 0) moves = reference_reverses_ = true;
    if (std::abs(at.rate) > kMoves || std::abs(at.acceleration) > kMoves) moves = true;
  }
  return moves;
}

// Step => deviation of each rate from its reference added to its oscillation, or to the forced one if references move
// or joints follow noise; at a limit if the effort is.
void StabilityMonitor::step(double begin, const PhaseSample& reached, bool base_is_saturated) {
  constexpr double kAtLimit = 1 - 1e-9;
  const PhaseSetup& setup = dynamics_->setup();
  if (const long touches = touches_in(setup.contacts.get()); touches != touches_) {
    touches_ = touches;
    forget_before_contact();
  }
  const double now = stores_energy_ ? energy(reached.state) : 0;
  const bool forced = is_forced(begin, reached.time) || moved_by_law_;
  bool law_reverses = false;
  for (Signal& signal : signals_) {
    const double rate = reached.state.v[signal.velocity];
    if (!signal.of_law || rate == 0) continue;
    law_reverses = law_reverses || rate * signal.last_rate < 0;
    signal.last_rate = rate;
  }
  for (Signal& signal : signals_) {
    double value = reached.state.v[signal.velocity], command = 0;
    if (signal.joint < 0) {
      command = reached.dynamics->base().commanded_torque()[signal.axis];
    } else {
      const auto j = static_cast<std::size_t>(signal.joint);
      const JointTrajectory& trajectory = setup.drives[j].trajectory;
      if (!signal.of_law) value -= evaluate(trajectory, reached.time, 0.5 * (begin + reached.time)).rate;
      command = reached.motor[j];
    }
    // Beside a reference an axis counts by its own limit, if it has one: the wheel of another axis may be saturated.
    const bool has_limit = std::isfinite(signal.limit);
    const bool saturated = (signal.joint < 0 && base_is_saturated && !(forced && has_limit)) ||
                           (has_limit && std::abs(command) >= kAtLimit * signal.limit);
    (forced ? signal.forced : signal.oscillation)
        .add({.begin = begin,
              .end = reached.time,
              .value = value,
              .limit = !saturated    ? 0
                       : command < 0 ? -1
                                     : 1,
              .energy = now,
              .excited = reference_reverses_ || (law_reverses && signal.joint < 0)});
  }
}

// State at the end of the step => angular velocity of the base [rad/s] and largest joint rate, whether both are within
// their limits, and the time since which they are; NaN if they are not.
void StabilityMonitor::step_to_rest(double begin, const PhaseSample& reached) {
  const Model& model = system_->model;
  const Body& base = model.bodies()[system_->base];
  RestReport& rest = *rest_;
  rest.angular_velocity = 0;
  if (base.description.joint.type == JointType::free) {
    const double* w = reached.state.v.data() + base.v;
    rest.angular_velocity = norm(Vector3d{w[0], w[1], w[2]});
  }
  rest.joint_rate = 0, rest.joint.clear();
  for (const int joint : system_->robot_joints) {
    if (!std::isfinite(rest.joint_rate_limit)) break;
    const Body& body = model.joint_body(joint);
    const double rate = std::abs(reached.state.v[body.v]);
    if (rest.joint.empty() || rate > rest.joint_rate) rest.joint = body.description.joint.name, rest.joint_rate = rate;
  }
  const bool within = rest.angular_velocity <= rest.angular_velocity_limit && rest.joint_rate <= rest.joint_rate_limit;
  if (within && !rest.at_rest) rest.time = begin < reached.time ? reached.time : begin;
  if (!within) rest.time = std::numeric_limits<double>::quiet_NaN();
  rest.at_rest = within;
}

// Forced oscillations decide only if they are unstable or the only ones.
StabilityReport StabilityMonitor::judge(const Signal& signal) const {
  const double noise = std::max(signal.noise, kSettled * signal.largest / kNoiseDeviations);
  StabilityReport report = evaluate_oscillation(signal.oscillation, noise, stores_energy_);
  const StabilityReport forced = evaluate_oscillation(signal.forced, noise, stores_energy_, true);
  if (report.verdict != Stability::unstable && (forced.verdict == Stability::unstable || signal.oscillation.empty()))
    report = forced;
  report.phase = name_, report.of = signal.of;
  if (report.verdict == Stability::unstable) return report;
  if (signal.unstable) return *signal.unstable;
  if (disturbed_ && report.verdict == Stability::not_evaluated)
    report.reason = signal.oscillation.empty() && signal.forced.empty()
                        ? "a contact began at the end of the phase"
                        : report.reason + ", since the last contact began";
  return report;
}

// A contact that begins excites vibrations, whose growth from those before is no instability. What was unstable before
// it is, and the largest rate remains the scale of what has settled.
void StabilityMonitor::forget_before_contact() {
  for (Signal& signal : signals_) {
    const StabilityReport report = judge(signal);
    if (report.verdict == Stability::unstable) signal.unstable = report;
    signal.largest = std::max({signal.largest, signal.oscillation.largest(), signal.forced.largest()});
    signal.oscillation = signal.forced = {};
  }
  disturbed_ = true;
}

// Signals => one report per phase, of the signal with the worst verdict and, among equals, the largest ratio of
// amplitudes.
void StabilityMonitor::end_phase() {
  if (signals_.empty()) return;
  StabilityReport decides;
  double ratio = -1;
  for (const Signal& signal : signals_) {
    const StabilityReport report = judge(signal);
    if (signal.of_law && report.verdict != Stability::unstable) continue;
    const double own = report.amplitude_before > 0 ? report.amplitude_after / report.amplitude_before : 0;
    if (ratio >= 0 && (report.verdict > decides.verdict || (report.verdict == decides.verdict && own <= ratio)))
      continue;
    decides = report, ratio = own;
  }
  signals_.clear();
  if (ratio >= 0) reports_.push_back(decides);
}

void StabilityMonitor::write(CaptureResult& result) const {
  result.stability = reports_;
  result.rest = rest_;
  for (const StabilityReport& report : reports_) {
    if (report.verdict == Stability::unstable) result.warnings.push_back(instability_text(report));
  }
  if (rest_ && !rest_->at_rest) result.warnings.push_back(rest_sentence(result));
}

}  // namespace grapnel
