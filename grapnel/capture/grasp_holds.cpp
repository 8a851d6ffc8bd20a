#include "grapnel/capture/grasp_holds.hpp"

#include <algorithm>
#include <cmath>

#include "grapnel/capture/internal_loads.hpp"

namespace grapnel {
namespace {

// Shares of limits that differ by less are equal: several grasps reach their limits simultaneously.
constexpr double kEqual = 1e-9;

}  // namespace

// Limits, magnitudes => share (8.15). Infinite limits contribute nothing.
double share_of_limits(const GraspLimits& limits, double force, double moment) {
  const double f = force / limits.force, m = moment / limits.moment;
  return limits.combined == GraspLimits::Combined::ellipsoid ? std::hypot(f, m) : std::max(f, m);
}

HoldWatch::HoldWatch(const CaptureProblem& problem, const CaptureSystem& system)
    : problem_(problem), system_(system), kinematics_(system.model) {
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
    loads_.push_back(
        {grasp, force, moment, share_of_limits(*problem_.grasps[grasp].holds, force, moment), sample.time});
  }
}

double HoldWatch::margin(const PhaseSample& sample) {
  evaluate(sample);
  stop_ = loads_;
  return last_margin();
}

double HoldWatch::last_margin() const {
  double least = 1;
  for (const HoldLoad& load : stop_) least = std::min(least, 1 - load.share);
  return least;
}

std::vector<HoldLoad> HoldWatch::at_limit() const {
  const double least = last_margin();
  std::vector<HoldLoad> reached;
  for (const HoldLoad& load : stop_) {
    if (1 - load.share <= std::max(least, 0.0) + kEqual) reached.push_back(load);
  }
  return reached;
}

void HoldWatch::step(const PhaseStep& step) {
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
  for (std::size_t g = 0; g < system.grasps.size(); ++g) {
    const std::size_t grasp = system.grasps[g].grasp;
    if (!problem.grasps[grasp].holds) continue;
    const double force = norm(sample.held_wrenches[g].linear), moment = norm(sample.held_wrenches[g].angular);
    const HoldLoad load{grasp, force, moment, share_of_limits(*problem.grasps[grasp].holds, force, moment), 0};
    const auto at = std::ranges::find(largest, grasp, &HoldLoad::grasp);
    if (at == largest.end())
      largest.push_back(load);
    else if (load.share > at->share)
      *at = load;
  }
}

}  // namespace grapnel
