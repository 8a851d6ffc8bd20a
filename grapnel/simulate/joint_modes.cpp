#include "grapnel/simulate/joint_modes.hpp"

#include <algorithm>
#include <cmath>

namespace grapnel {
namespace {

// Slower than this is at rest: events are found to rounding [rad/s or m/s].
constexpr double kAtRest = 1e-11;
// Events count a little beyond the zero that they are about, so that a motion that begins there does not end there:
// of rates [rad/s or m/s], of positions relative to the stop's, or to 1 rad or m.
constexpr double kRateSlack = 1e-13, kPlaceSlack = 1e-14;
// Nearer than this a joint is at its stop [rad or m].
constexpr double kAtStop = 4e-12;
// Of holding efforts, relative to those at hand, and [N m or N].
constexpr double kEffortSlack = 1e-11, kLeastEffortSlack = 1e-12;
// Impulses that pull by less, relative to the largest, are rounding.
constexpr double kPulls = 1e-12;
constexpr std::size_t kKept = 100;  // impacts
// A joint is freed where its excess is more than this part of the slack; events come at the whole of it.
constexpr double kFreed = 0.5;

double sense_of(double x) { return x < 0 ? -1 : 1; }

JointModes::End end_at(const JointModes::Joint& joint, double q) {
  if (q <= joint.lower + kAtStop) return JointModes::End::lower;
  if (q >= joint.upper - kAtStop) return JointModes::End::upper;
  return JointModes::End::none;
}

double into_stop(const JointModes::Joint& joint, double rate) { return rate * static_cast<double>(joint.end); }

}  // namespace

JointModes::JointModes(const Model& model, std::span<const std::uint8_t> prescribed) {
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (std::size_t j = 0; j < model.joints().size(); ++j) {
    const Body& body = model.bodies()[model.joints()[j]];
    const JointDescription& d = body.description.joint;
    at_.push_back(-1);
    const bool sticks = d.friction.model == JointFriction::Model::sticking;
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
    j.stop_energy_lost = 0;
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
    j.stays = false;
  }
}

// How far a holding effort is outside what friction and stop can give; negative inside [N m or N].
double JointModes::excess(const Joint& j, double h) const {
  double beyond = -std::numeric_limits<double>::infinity();
  if (j.end != End::upper) beyond = std::max(beyond, -j.breakaway - h);
  if (j.end != End::lower) beyond = std::max(beyond, h - j.breakaway);
  return beyond;
}

void JointModes::choose(std::span<const double> q, std::span<const double> v,
                        const std::function<Response()>& respond) {
  std::vector<Mode> before;
  for (const Joint& j : joints_) before.push_back(j.mode);
  take_modes(q, v);
  // Joints whose modes do not fit what follows from them: of those at rest.
  std::vector<std::uint8_t> rests, freed(joints_.size(), 0);
  for (const Joint& j : joints_) rests.push_back(j.mode == Mode::held);
  const std::size_t most_by_size = 2 * joints_.size(), most = 10 * joints_.size();
  for (std::size_t changes = 0; std::find(rests.begin(), rests.end(), 1) != rests.end(); ++changes) {
    const Response response = respond();
    Joint* misfit = nullptr;
    double worst = 0;
    for (std::size_t i = 0; i < joints_.size(); ++i) {
      Joint& j = joints_[i];
      if (!rests[i] || j.stays) continue;
      double misfits = 0;  // more than zero: it does; one that is to be freed comes before one that does not go
      if (j.mode == Mode::held) {
        const double h = response.holding[j.joint];
        j.slack = kEffortSlack * (j.breakaway + std::abs(h)) + kLeastEffortSlack;
        const double beyond = excess(j, h) / j.slack;
        if (beyond > (freed[i] ? 1.0 : kFreed)) misfits = 1 + beyond;
      } else if (!(response.acceleration[j.v] * j.sense > 0)) {
        misfits = 1;
      }
      if (misfits > worst) worst = misfits, misfit = &j;
      if (misfit && changes >= most_by_size) break;  // the first one
    }
    if (!misfit) break;
    if (misfit->mode == Mode::moving) {
      misfit->mode = Mode::held;
      misfit->stays = changes >= most;
    } else {
      misfit->mode = Mode::moving;
      misfit->sense = -sense_of(response.holding[misfit->joint]);
      freed[static_cast<std::size_t>(misfit - joints_.data())] = 1;
    }
  }
  for (std::size_t i = 0; i < joints_.size() && chosen_; ++i) {
    if (before[i] == Mode::moving && joints_[i].mode == Mode::held) ++joints_[i].sticks_count;
    if (before[i] == Mode::held && joints_[i].mode == Mode::moving) ++joints_[i].breakaways;
  }
  chosen_ = true;
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

double JointModes::holding_margin(std::span<const double> holding) const {
  double least = 1;
  for (const Joint& j : joints_) {
    if (j.mode != Mode::held || j.stays) continue;
    least = std::min(least, 1 - excess(j, holding[j.joint]) / j.slack);
  }
  return least;
}

std::vector<JointModes::RateChange> JointModes::overshoots(std::span<const double> v) const {
  std::vector<RateChange> changes;
  for (const Joint& j : joints_) {
    if (chosen_ && j.sticks && j.mode == Mode::moving && j.sense * v[j.v] < 0) changes.push_back({j.v, -v[j.v]});
  }
  return changes;
}

bool JointModes::meet_stops(double time, std::span<double> q, std::span<double> v,
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
  // Which stops act: first all that are met or rested on; then not those that would pull, and again those into which
  // joints would be driven, each at most once.
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
    const bool meets = into_stop(j, before) > kAtRest;
    const double rebound = meets ? -e * before : 0.0, impulse = response.impulse[j.v];
    const double lost = -0.5 * impulse * (before + rebound);  // (19.4)
    last_energy_lost_ += lost;
    q[j.q] = j.end == End::lower ? j.lower : j.upper;
    if (!meets) continue;
    ++j.stop_impacts, ++stop_impact_count_;
    j.stop_energy_lost += lost;
    if (stop_impacts_.size() < kKept) stop_impacts_.push_back({time, j.joint, j.end, before, rebound, impulse, lost});
  }
  for (std::size_t i = 0; i < v.size(); ++i) v[i] += response.change[i];
  for (std::size_t k = 0; k < changes.size(); ++k) v[changes[k].v] = after[k];  // exactly
  for (Joint& j : joints_) j.sense = sense_of(v[j.v]);
  return true;
}

}  // namespace grapnel
