#include "grapnel/simulate/joint_modes.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Rates below this are zero: events are found to rounding [rad/s or m/s].
constexpr double kAtRest = 1e-11;
// Tolerances beyond the zero of an event, so that a motion that begins at an event does not end there: of rates [rad/s
// or m/s], of positions relative to the stop's, or to 1 rad or m.
constexpr double kRateSlack = 1e-13, kPlaceSlack = 1e-14;
// A joint closer than this is at its stop [rad or m].
constexpr double kAtStop = 4e-12;
// Tolerance of holding efforts, relative to their current size, and at stops without friction [N m or N].
constexpr double kEffortSlack = 1e-11, kMinStopSlack = 1e-12;
// Rounding error in comparisons of accelerations.
constexpr double kAccelerationRounding = 1e-13;
// Fractions of the holding slack up to which a joint at its limit is held if it need not slip.
constexpr double kLimitShare = 0.25;
// Threshold of a unit change of undetermined efforts; smaller values are rounding errors.
constexpr double kOpen = 1e-9;
// Maximum number of iterations if motors respond to the choice of modes.
constexpr int kMaxRounds = 20;
// Tolerance of pulling impulses, relative to the largest.
constexpr double kPulls = 1e-12;
constexpr std::size_t kMaxStopImpacts = 100;  // maximum number of recorded impacts
// Fraction of the slack above which a joint's excess frees it; events occur at the whole slack.
constexpr double kFreed = 0.5;

double sense_of(double x) { return x < 0 ? -1 : 1; }

JointModes::End end_at(const JointModes::Joint& joint, double q) {
  if (q <= joint.lower + kAtStop) return JointModes::End::lower;
  if (q >= joint.upper - kAtStop) return JointModes::End::upper;
  return JointModes::End::none;
}

struct HoldingRange {
  double lower, upper;
};
// The range of efforts that friction up to `breakaway` and a stop provide together.
HoldingRange holding_range(const JointModes::Joint& joint, double breakaway) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  return {joint.end == JointModes::End::upper ? -kNone : -breakaway,
          joint.end == JointModes::End::lower ? kNone : breakaway};
}

// Rate of a joint at a stop => rate into the stop, positive if it moves into it.
double into_stop(const JointModes::Joint& joint, double rate) { return rate * static_cast<double>(joint.end); }

}  // namespace

// Model and prescribed velocities => one entry per joint with sticking friction or a stop; others have no modes.
JointModes::JointModes(const Model& model, std::span<const std::uint8_t> prescribed) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.joint_body(j);
    const JointDescription& d = body.description.joint;
    at_.push_back(-1);
    // Friction without breakaway effort has no modes.
    const bool sticks = d.friction.model == JointFriction::Model::sticking && d.friction.breakaway() > 0;
    if (prescribed[body.v] || !(sticks || d.limits.stop)) continue;
    at_.back() = static_cast<int>(joints_.size());
    Joint joint{j, body.q, body.v, sticks, 0, 0, 0, -kNone, kNone, 0, 0};
    if (sticks)
      joint.viscous = d.friction.viscous, joint.coulomb = d.friction.coulomb, joint.breakaway = d.friction.breakaway();
    if (d.limits.stop) {
      joint.lower = d.limits.lower, joint.upper = d.limits.upper;
      joint.restitution = d.limits.stop->restitution, joint.rest_rate = d.limits.stop->rest_rate;
    }
    joints_.push_back(joint);
  }
}

bool JointModes::any_held() const {
  return std::any_of(joints_.begin(), joints_.end(), [](const Joint& j) { return j.mode == Mode::held; });
}

void JointModes::begin(std::span<const double> q, std::span<const double> v) {
  for (Joint& j : joints_) {
    j.lower = std::min(j.lower, q[j.q]), j.upper = std::max(j.upper, q[j.q]);
    j.sticks_count = j.breakaways = j.stop_impacts = 0;
    j.stop_energy_lost = j.largest_share = 0;
    j.undetermined = false;
  }
  stop_impacts_.clear();
  stop_impact_count_ = 0;
  chosen_ = false;
  take_modes(q, v);
}

void JointModes::take_modes(std::span<const double> q, std::span<const double> v) {
  for (Joint& j : joints_) {
    const double rate = v[j.v];
    j.end = end_at(j, q[j.q]);
    const bool rests = std::abs(rate) <= kAtRest && (j.sticks || j.end != End::none);
    j.mode = rests ? Mode::held : Mode::moving;
    j.sense = sense_of(rate);
  }
}

void JointModes::choose(std::span<const double> q, std::span<const double> v, const Dynamics& dynamics) {
  std::vector<Mode> before;
  for (const Joint& j : joints_) before.push_back(j.mode);
  take_modes(q, v);
  settle(dynamics);
  for (std::size_t i = 0; i < joints_.size() && chosen_; ++i) {
    if (before[i] == Mode::moving && joints_[i].mode == Mode::held) ++joints_[i].sticks_count;
    if (before[i] == Mode::held && joints_[i].mode == Mode::moving) ++joints_[i].breakaways;
  }
  chosen_ = true;
}

// Settles joints at rest, initially all held.
void JointModes::settle(const Dynamics& dynamics) {
  std::vector<Joint*> resting;
  std::vector<int> velocities;
  for (Joint& j : joints_) {
    if (j.mode == Mode::held) resting.push_back(&j), velocities.push_back(j.v);
  }
  if (resting.empty()) return;
  Response response = dynamics.respond();
  take_slacks(response);
  if (response.possible && held_excess(response.holding, response.open) <= kFreed) return;
  const Mobility mobility = dynamics.mobility(velocities);
  Eigen::VectorXd released;
  for (int round = 0; round < kMaxRounds; ++round) {
    const Eigen::VectorXd now = dynamics.released(velocities);
    // Model-based laws may respond with other efforts to held joints; otherwise one iteration suffices.
    const bool same = round > 0 && (now - released).norm() <= kAccelerationRounding * now.norm();
    released = now;
    if (!same) slip(resting, mobility, released, response, kLimitShare);
    response = dynamics.respond();
    if (same) break;
  }
  take_slacks(response);
  if (fits(response, resting)) return;
  slip(resting, mobility, released, response, 0);
  response = dynamics.respond();
  take_slacks(response);
  if (fits(response, resting)) return;
  // No choice is consistent to within rounding: held joints stay held until their limits are exceeded by twice the
  // excess.
  const double excess = held_excess(response.holding, response.open);
  if (!(excess > 1 - kLimitShare)) return;
  for (Joint& j : joints_) j.relief = 2 * excess;
}

// Units and slacks of held joints. A stop provides any effort.
void JointModes::take_slacks(const Response& response) {
  for (Joint& j : joints_) {
    j.relief = 1;
    if (j.mode != Mode::held) continue;
    const double h = response.possible ? std::abs(response.holding[j.joint]) : 0;
    j.unit = j.breakaway + (j.end != End::none ? h : 0);
    j.slack = kEffortSlack * j.unit + (response.possible ? response.rounding[j.joint] : 0);
    if (j.breakaway == 0) j.slack += kMinStopSlack, j.unit += kMinStopSlack / kEffortSlack;
  }
}

// Holding efforts and self-stresses => the family h0 + N zeta (19.19) of the held joints, in units of each joint, with
// bounds (19.1) or, at stops, (19.5).
EffortFamily JointModes::held_family(std::span<const double> holding, const OpenEfforts& open) const {
  std::vector<const Joint*> held;
  for (const Joint& j : joints_) {
    if (j.mode == Mode::held) held.push_back(&j);
  }
  const auto count = static_cast<Eigen::Index>(held.size());
  EffortFamily family;
  family.x0 = family.lower = family.upper = family.weight = Eigen::VectorXd(count);
  Eigen::MatrixXd directions(count, open.effort.cols()), terms(directions);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Joint& j = *held[i];
    const HoldingRange range = holding_range(j, j.breakaway);
    family.x0[i] = holding[j.joint] / j.unit;
    family.lower[i] = range.lower / j.unit, family.upper[i] = range.upper / j.unit;
    family.weight[i] = j.relief * j.slack / (kEffortSlack * j.unit);
    if (directions.cols() == 0) continue;
    directions.row(i) = open.effort.row(j.v) / j.unit, terms.row(i) = open.terms.row(j.v) / j.unit;
  }
  family.N = basis_of(directions, terms);
  return family;
}

// The excess of holding efforts over the range of friction and stops, in slacks; negative inside.
double JointModes::held_excess(std::span<const double> holding, const OpenEfforts& open) const {
  if (open.effort.cols() == 0) {
    double largest = -1 / kEffortSlack;
    for (const Joint& j : joints_) {
      if (j.mode != Mode::held) continue;
      const HoldingRange range = holding_range(j, j.breakaway);
      const double beyond = std::max(range.lower - holding[j.joint], holding[j.joint] - range.upper);
      largest = std::max(largest, beyond / (j.relief * j.slack));
    }
    return largest;
  }
  const EffortFamily family = held_family(holding, open);
  if (family.x0.size() == 0) return -1 / kEffortSlack;
  if (family.N.cols() > 0) {
    // Far from the limits the minimum-norm efforts suffice, at lower cost.
    constexpr double kFar = -1e-3;
    EffortFamily one = family;
    one.x0 -= family.N * (family.N.transpose() * family.x0);
    one.N.resize(one.x0.size(), 0);
    if (const double excess = min_excess(one).excess; excess < kFar) return excess / kEffortSlack;
  }
  return min_excess(family).excess / kEffortSlack;
}

// The program (19.17), scaled to unit mobility of each joint alone, repeated until (19.18) frees no more joints.
void JointModes::slip(const std::vector<Joint*>& resting, const Mobility& mobility, const Eigen::VectorXd& released,
                      const Response& response, double slack_share) {
  const auto count = static_cast<Eigen::Index>(resting.size());
  const Eigen::VectorXd root = mobility.without_loops.cwiseSqrt();
  BoxProgram program;
  program.A = root.cwiseInverse().asDiagonal() * mobility.with_loops * root.cwiseInverse().asDiagonal();
  program.b = released.cwiseQuotient(root);
  program.lower = program.upper = program.tolerance = Eigen::VectorXd(count);
  Eigen::VectorXd slack(count);
  for (Eigen::Index i = 0; i < count; ++i) slack[i] = resting[i]->slack * root[i];
  for (Eigen::Index i = 0; i < count; ++i) {
    const double rounding = response.rounding[resting[i]->joint];
    program.tolerance[i] =
        (std::isfinite(rounding) ? rounding : 0) * root[i] + kAccelerationRounding * program.b.cwiseAbs().maxCoeff();
    resting[i]->rate_noise = program.tolerance[i] * root[i];
    program.tolerance[i] += slack_share * program.A.row(i).cwiseAbs().dot(slack);
  }
  std::vector<bool> broken(resting.size(), false);
  for (bool again = true; again;) {
    for (Eigen::Index i = 0; i < count; ++i) {
      const Joint& j = *resting[i];
      const HoldingRange range = holding_range(j, broken[i] ? j.coulomb : j.breakaway);
      program.lower[i] = range.lower * root[i], program.upper[i] = range.upper * root[i];
    }
    const BoxSolution solution = minimize_in_box(program);
    again = false;
    for (Eigen::Index i = 0; i < count; ++i) {
      Joint& j = *resting[i];
      const bool slips = -solution.bound[i] * solution.gradient[i] > program.tolerance[i];
      j.mode = slips ? Mode::moving : Mode::held;
      j.sense = sense_of(solution.gradient[i]);
      if (!slips || broken[i]) continue;
      broken[i] = true;
      again = again || j.coulomb < j.breakaway;
    }
  }
}

// Whether slipping joints move against their friction, and held joints can be held.
bool JointModes::fits(const Response& response, const std::vector<Joint*>& resting) const {
  for (const Joint* j : resting) {
    if (j->mode == Mode::moving && !(response.acceleration[j->v] * j->sense > -j->rate_noise)) return false;
  }
  return response.possible && held_excess(response.holding, response.open) <= 1 - kLimitShare;
}

double JointModes::moving_margin(std::span<const double> q, std::span<const double> v) const {
  double least = 1;
  for (const Joint& j : joints_) {
    if (j.mode == Mode::held) continue;
    if (j.sticks) least = std::min(least, j.sense * v[j.v] + kRateSlack);
    const auto left = [](double distance, double stop) { return distance + kPlaceSlack * (1 + std::abs(stop)); };
    if (std::isfinite(j.lower)) least = std::min(least, left(q[j.q] - j.lower, j.lower));
    if (std::isfinite(j.upper)) least = std::min(least, left(j.upper - q[j.q], j.upper));
  }
  return least;
}

double JointModes::holding_margin(std::span<const double> holding, const OpenEfforts& open) const {
  return std::min(1.0, 1 - held_excess(holding, open));
}

// Self-stresses and `holding` => `holding` with the minimum-norm admissible efforts (19.21) at undetermined joints, and
// the velocities of these joints. If no set is admissible, the one with the smallest excess (19.20).
std::vector<int> JointModes::share_out(const OpenEfforts& open, std::span<double> holding) {
  std::vector<int> changed;
  if (open.effort.cols() == 0) return changed;
  const EffortFamily family = held_family(holding, open);
  if (family.N.cols() == 0) return changed;
  const MinExcess least = min_excess(family);
  const Eigen::VectorXd x = least.excess < 0 ? min_norm_within(family, least.x) : least.x;
  Eigen::Index i = 0;
  for (Joint& j : joints_) {
    if (j.mode != Mode::held) continue;
    const bool is_open = family.N.row(i).cwiseAbs().maxCoeff() > kOpen;
    if (is_open) holding[j.joint] = j.unit * x[i], changed.push_back(j.v);
    j.undetermined = j.undetermined || is_open;
    ++i;
  }
  return changed;
}

void JointModes::note_holding(std::span<const double> holding) {
  for (Joint& j : joints_) {
    if (j.mode != Mode::held || j.breakaway == 0) continue;
    const HoldingRange range = holding_range(j, 0);
    double beyond = std::max(range.lower - holding[j.joint], holding[j.joint] - range.upper);
    if (beyond > j.breakaway && beyond <= j.breakaway + j.slack) beyond = j.breakaway;  // rounding error
    if (!(beyond / j.breakaway <= j.largest_share)) j.largest_share = beyond / j.breakaway;
  }
}

std::vector<JointModes::RateChange> JointModes::overshoots(std::span<const double> v) const {
  std::vector<RateChange> changes;
  for (const Joint& j : joints_) {
    if (chosen_ && j.sticks && j.mode == Mode::moving && j.sense * v[j.v] < 0) changes.push_back({j.v, -v[j.v]});
  }
  return changes;
}

// q and v with joints at stops => v after the impact (19.2), q at the exact ends, and records of each impact. `respond`
// solves the system for given rate changes; the smallest restitution applies to all joints that arrive.
bool JointModes::apply_stop_impacts(double time, std::span<double> q, std::span<double> v,
                                    const std::function<ImpulseResponse(std::span<const RateChange>)>& respond) {
  std::vector<std::size_t> candidates;  // at stops
  std::vector<std::uint8_t> pushes;     // whether the stop is taken to act
  bool any = false;
  double e = 1;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    Joint& j = joints_[i];
    j.end = end_at(j, q[j.q]);
    if (j.end == End::none) continue;
    const double rate = into_stop(j, v[j.v]);
    if (rate > kAtRest) {
      any = true;
      e = std::min(e, rate < j.rest_rate ? 0.0 : j.restitution);
    }
    candidates.push_back(i);
    pushes.push_back(rate >= -kAtRest);
  }
  if (!any) return false;
  // Determines the acting stops: initially all that are reached or rested on; then without those that would pull, and
  // with those into which joints would be driven, each at most once.
  std::vector<std::uint8_t> dropped(candidates.size(), 0), added(candidates.size(), 0);
  std::vector<RateChange> changes;
  std::vector<double> after;  // of these
  ImpulseResponse response;
  for (bool again = true; again;) {
    again = false;
    changes.clear(), after.clear();
    for (std::size_t c = 0; c < candidates.size(); ++c) {
      const Joint& j = joints_[candidates[c]];
      const double rate = v[j.v];
      if (!pushes[c]) continue;
      after.push_back(into_stop(j, rate) > kAtRest ? -e * rate : 0.0);
      changes.push_back({j.v, after.back() - rate});
    }
    response = respond(changes);
    double largest = 0;
    for (const RateChange& r : changes) largest = std::max(largest, std::abs(response.impulse[r.v]));
    for (std::size_t c = 0; c < candidates.size() && !again; ++c) {
      const Joint& j = joints_[candidates[c]];
      if (pushes[c] && !dropped[c] && into_stop(j, response.impulse[j.v]) > kPulls * largest)
        pushes[c] = 0, dropped[c] = 1, again = true;
      else if (!pushes[c] && !added[c] && into_stop(j, v[j.v] + response.change[j.v]) > kAtRest)
        pushes[c] = 1, added[c] = 1, again = true;
    }
  }
  last_energy_lost_ = 0;
  for (std::size_t c = 0; c < candidates.size(); ++c) {
    Joint& j = joints_[candidates[c]];
    if (!pushes[c]) continue;
    const double before = v[j.v];
    const bool arrives = into_stop(j, before) > kAtRest;
    const double rebound = arrives ? -e * before : 0.0, impulse = response.impulse[j.v];
    const double lost = -0.5 * impulse * (before + rebound);  // (19.4)
    last_energy_lost_ += lost;
    q[j.q] = j.end == End::lower ? j.lower : j.upper;
    if (!arrives) continue;
    ++j.stop_impacts, ++stop_impact_count_;
    j.stop_energy_lost += lost;
    if (stop_impacts_.size() < kMaxStopImpacts)
      stop_impacts_.push_back({time, j.joint, j.end, before, rebound, impulse, lost});
  }
  for (std::size_t i = 0; i < v.size(); ++i) v[i] += response.change[i];
  for (std::size_t k = 0; k < changes.size(); ++k) v[changes[k].v] = after[k];  // exactly
  for (Joint& j : joints_) j.sense = sense_of(v[j.v]);
  return true;
}

}  // namespace grapnel
