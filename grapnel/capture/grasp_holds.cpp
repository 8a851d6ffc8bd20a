#include "grapnel/capture/grasp_holds.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "grapnel/capture/internal_loads.hpp"

namespace grapnel {
namespace {

// Shares of limits that differ by less are equal: several grasps reach their limits simultaneously.
constexpr double kEqual = 1e-9;
// A slip that has moved ends when its speed falls to the resolution; one that has not, when its wrench lies by this
// fraction inside the limit surface.
constexpr double kInside = 0.01;
constexpr double kMoved = 2;

}  // namespace

// Limits, magnitudes => share (8.15). Infinite limits contribute nothing.
double share_of_limits(const GraspLimits& limits, double force, double moment) {
  const double f = force / limits.force, m = moment / limits.moment;
  return limits.combined == GraspLimits::Combined::ellipsoid ? std::hypot(f, m) : std::max(f, m);
}

SlipParts parts_beyond(const GraspLimits& limits, const HoldLoad& load) {
  SlipParts all{std::isfinite(limits.force), std::isfinite(limits.moment)};
  if (limits.combined == GraspLimits::Combined::ellipsoid) return all;
  const double least = load.share - kEqual;
  return {all.force && load.force / limits.force >= least, all.moment && load.moment / limits.moment >= least};
}

SlipDisplacement displacement_of(const GraspSlip& slip, const Kinematics& k) {
  const Posed X_WC = k.X_WB[slip.body_a] * slip.X_AC, X_WD = k.X_WB[slip.body_b] * slip.X_BD;
  SlipDisplacement by{norm(X_WC.p - X_WD.p), 0};
  if (slip.model == GraspModel::hinge) {
    const Vector3d h_C = X_WC.R * slip.hinge_C, h_D = X_WD.R * slip.hinge_C;
    by.angle = std::atan2(norm(cross(h_C, h_D)), dot(h_C, h_D));
  } else if (slip.model == GraspModel::rigid) {
    by.angle = rotation_angle(transpose(X_WC.R) * X_WD.R);
  }
  return by;
}

HoldWatch::HoldWatch(const CaptureProblem& problem, const CaptureSystem& system, std::vector<SlipParts> moved)
    : problem_(problem), system_(system), moved_(std::move(moved)), kinematics_(system.model) {
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    if (problem.grasps[system.grasps[g].grasp].holds) watched_.push_back(g);
  }
  search_ = PeakSearch(watched_.size(), watched_.size());
}

// Sample => loads of the watched grasps, from the interface wrenches.
void HoldWatch::evaluate(const PhaseSample& sample) {
  forward_kinematics(system_.model, sample.state, kinematics_);
  const std::vector<GraspWrench> wrenches = wrenches_of_grasps(system_, kinematics_, sample);
  loads_.clear();
  for (const std::size_t g : watched_) {
    const std::size_t grasp = system_.grasps[g].grasp;
    const double force = norm(wrenches[g].F_WC.linear), moment = norm(wrenches[g].F_WC.angular);
    const Rotationd R_WC = (kinematics_.X_WB[system_.grasps[g].frames.body_a] * system_.grasps[g].frames.X_AC).R;
    loads_.push_back({grasp, force, moment, share_of_limits(*problem_.grasps[grasp].holds, force, moment), sample.time,
                      transposed_times(R_WC, wrenches[g].F_WC)});
  }
}

// Kinematics => margins of slips: zero when a part comes to rest, or the slip reaches its limits.
void HoldWatch::evaluate_slips() {
  slips_.clear();
  for (std::size_t i = 0; i < system_.slips.size(); ++i) {
    const SlippingGrasp& slip = system_.slips[i];
    const GraspLimits& limits = *problem_.grasps[slip.grasp].holds;
    const SlipState now = slip_state(slip.slip, kinematics_);
    const SlipDisplacement by = displacement_of(slip.slip, kinematics_);
    const auto from_rest = [](bool slips, bool moved, const SlipSpeed& speed) {
      if (!slips) return std::numeric_limits<double>::infinity();
      return moved ? speed.relative - 1 : speed.driven - (1 - kInside);
    };
    const SlipParts parts = slip.slip.parts();
    slips_.push_back({from_rest(parts.force, moved_[i].force, now.force),
                      from_rest(parts.moment, moved_[i].moment, now.moment),
                      1 - std::max(by.distance / limits.lost_distance, by.angle / limits.lost_angle)});
  }
}

// Sample => loads of the parts of slipping grasps that closures hold and that have a limit, added to the others.
void HoldWatch::add_held_parts(const PhaseSample& sample) {
  if (system_.slips.empty()) return;
  const std::vector<Wrenchd> wrenches = wrenches_of_slips(system_, kinematics_, sample);
  for (std::size_t i = 0; i < system_.slips.size(); ++i) {
    const SlippingGrasp& slip = system_.slips[i];
    if (slip.closure < 0) continue;
    const GraspLimits& limits = *problem_.grasps[slip.grasp].holds;
    const double force = norm(wrenches[i].linear), moment = norm(wrenches[i].angular);
    const double share = slip.slip.force > 0 ? moment / limits.moment : force / limits.force;
    const Rotationd R_WC = (kinematics_.X_WB[slip.frames.body_a] * slip.frames.X_AC).R;
    stop_.push_back({slip.grasp, force, moment, share, sample.time, transposed_times(R_WC, wrenches[i])});
  }
}

double HoldWatch::margin(const PhaseSample& sample) {
  evaluate(sample);
  evaluate_slips();
  stop_ = loads_;
  add_held_parts(sample);
  return last_margin();
}

double HoldWatch::last_margin() const {
  double least = 1;
  for (const HoldLoad& load : stop_) least = std::min(least, 1 - load.share);
  for (const SlipMargins& slip : slips_) least = std::min({least, slip.force, slip.moment, slip.out});
  return least;
}

// Margins up to this one have fallen to zero, within rounding.
double HoldWatch::reached() const { return std::max(last_margin(), 0.0) + kEqual; }

std::vector<RestingSlip> HoldWatch::at_rest() const {
  std::vector<RestingSlip> resting;
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const SlipParts parts{slips_[i].force <= reached(), slips_[i].moment <= reached()};
    if (parts.any()) resting.push_back({i, parts});
  }
  return resting;
}

std::vector<std::size_t> HoldWatch::slipped_out() const {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    if (slips_[i].out <= reached()) out.push_back(i);
  }
  return out;
}

std::vector<HoldLoad> HoldWatch::at_limit() const {
  std::vector<HoldLoad> loads;
  std::ranges::copy_if(stop_, std::back_inserter(loads),
                       [&](const HoldLoad& load) { return 1 - load.share <= reached(); });
  return loads;
}

void HoldWatch::step(const PhaseStep& step) {
  if (!moved_.empty()) {
    forward_kinematics(system_.model, step.state_at(step.end), kinematics_);
    for (std::size_t i = 0; i < moved_.size(); ++i) {
      const SlipState now = slip_state(system_.slips[i].slip, kinematics_);
      moved_[i] |= {now.force.relative > kMoved, now.moment.relative > kMoved};
    }
  }
  if (watched_.empty()) return;
  search_.step(step.begin, step.end, step.fresh, [&](double t, std::span<double> shares) {
    evaluate(step.at(t));
    for (std::size_t i = 0; i < loads_.size(); ++i) shares[i] = loads_[i].share;
  });
}

std::vector<HoldLoad> HoldWatch::largest() const {
  std::vector<HoldLoad> all;
  for (std::size_t i = 0; i < watched_.size(); ++i) {
    const Peak& peak = search_.peaks()[i];
    if (peak.magnitude >= 0) all.push_back({system_.grasps[watched_[i]].grasp, 0, 0, peak.magnitude, peak.time});
  }
  return all;
}

std::vector<HoldLoad> loads_in_impact(const CaptureProblem& problem, const ImpactReport& report) {
  std::vector<HoldLoad> loads;
  for (const GraspImpulse& g : report.grasps) {
    const auto grasp = std::ranges::find(problem.grasps, g.end_effector, &GraspSetup::end_effector);
    if (grasp == problem.grasps.end() || !grasp->holds) continue;
    HoldLoad load{static_cast<std::size_t>(grasp - problem.grasps.begin()), 0, 0, 0, 0};
    const double duration = problem.impact->duration;
    load.force = g.profile ? g.profile->peak_force : norm(g.impulse) / duration;
    load.moment = g.profile ? g.profile->peak_moment : norm(g.angular_impulse) / duration;
    load.share = share_of_limits(*grasp->holds, load.force, load.moment);
    loads.push_back(load);
  }
  return loads;
}

void raise_held_loads(const CaptureProblem& problem, const CaptureSystem& system, const CompliantSample& sample,
                      std::vector<HoldLoad>& largest) {
  const auto raise = [&](std::size_t grasp, const Wrenchd& F_WC) {
    if (!problem.grasps[grasp].holds) return;
    const double force = norm(F_WC.linear), moment = norm(F_WC.angular);
    const HoldLoad load{grasp, force, moment, share_of_limits(*problem.grasps[grasp].holds, force, moment), 0};
    const auto at = std::ranges::find(largest, grasp, &HoldLoad::grasp);
    if (at == largest.end())
      largest.push_back(load);
    else if (load.share > at->share)
      *at = load;
  };
  for (std::size_t g = 0; g < system.grasps.size(); ++g) raise(system.grasps[g].grasp, sample.held_wrenches[g]);
  for (std::size_t s = 0; s < system.slips.size(); ++s) raise(system.slips[s].grasp, sample.slip_wrenches[s]);
}

}  // namespace grapnel
