#include "grapnel/capture/run_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/contact/point_velocity.hpp"
#include "grapnel/problem/contact_surfaces.hpp"
#include "grapnel/problem/problem_clearance.hpp"

namespace grapnel {
namespace {

// Greatest depth at which shapes count as touching at the start: of rounding errors in positions [m].
constexpr double kTouching = 1e-9;

}  // namespace

RunContacts::RunContacts(const CaptureProblem& problem, const CaptureSystem& free)
    : problem_(problem), pairs_(contact_pairs(problem, free)) {}

std::shared_ptr<ContactSet> RunContacts::in(const CaptureSystem& system) {
  if (!any()) return nullptr;
  std::shared_ptr<ContactSet> set = make_contact_set(problem_, system, pairs_);
  if (last_) set->take(*last_);
  return last_ = std::move(set);
}

std::string RunContacts::overlaps(const CaptureSystem& system, const State& state) {
  if (!any()) return {};
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  std::vector<double> depth(pairs_.size(), 0);
  for (std::size_t p = 0; p < set->size(); ++p) {
    if (set->mode(p) != ContactSet::Mode::passing)
      depth[set->group_of(p)] = std::max(depth[set->group_of(p)], -set->separation(p, kinematics).distance);
  }
  std::string text;
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    if (depth[g] <= kTouching) continue;
    text += fmt::format("{}{} and {} overlap by {:.4g} m", text.empty() ? "" : "; ",
                        contact_name(problem_, pairs_[g].a), contact_name(problem_, pairs_[g].b), depth[g]);
  }
  return text;
}

// Grasp => per pair of bodies, whether it is that of the target and a body of the gripper.
std::vector<bool> RunContacts::pairs_of_grasp(std::size_t grasp, const CaptureSystem& system) const {
  const GraspSetup& setup = problem_.grasps[grasp];
  const std::vector<int> gripper = gripper_bodies(system, setup);
  const BodyName target = BodyName::of_target(target_index(problem_, setup.target));
  const auto is_gripper = [&](const BodyName& name) {
    return std::ranges::any_of(bodies_named(problem_, system, name),
                               [&](int body) { return std::ranges::find(gripper, body) != gripper.end(); });
  };
  std::vector<bool> pairs;
  for (const ContactPair& pair : pairs_)
    pairs.push_back((pair.a == target && is_gripper(pair.b)) || (pair.b == target && is_gripper(pair.a)));
  return pairs;
}

void RunContacts::close(std::size_t grasp, const CaptureSystem& system, const State& state, double time,
                        bool but_touching) {
  if (!any()) return;
  const std::vector<bool> passing = pairs_of_grasp(grasp, system);
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    if (passing[g]) set->let_pass(static_cast<int>(g), kinematics, time, but_touching);
  }
}

std::vector<HardPoint> RunContacts::hard_points(std::span<const std::size_t> closing, const CaptureSystem& system,
                                                const State& state, double time) {
  if (!std::ranges::any_of(pairs_, [](const ContactPair& pair) { return pair.law.hard; })) return {};
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  set->begin(time, kinematics);
  std::vector<HardPoint> points = set->touching_points(time, kinematics);
  for (const std::size_t grasp : closing) {
    const std::vector<bool> passing = pairs_of_grasp(grasp, system);
    std::erase_if(points, [&](const HardPoint& p) { return passing[static_cast<std::size_t>(set->group_of(p.pair))]; });
  }
  return points;
}

std::vector<HardContactImpulse> RunContacts::note_impact(std::span<const HardPoint> points,
                                                         std::span<const ContactPointImpulse> impulses,
                                                         const CaptureSystem& system, const State& after, double time) {
  const Kinematics k = forward_kinematics(system.model, after);
  std::vector<HardPointImpact> impacts;
  std::vector<HardContactImpulse> reports(pairs_.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const HardPoint& at = points[i];
    const ContactPointImpulse& law = impulses[i];
    const double separates = dot(relative_velocity(at, k), at.normal);
    impacts.push_back({law.normal, law.work, -law.normal_work, -law.friction_work, separates});
    HardContactImpulse& report = reports[static_cast<std::size_t>(last_->group_of(at.pair))];
    report.approach_speed = report.points > 0 ? std::max(report.approach_speed, at.approach_speed) : at.approach_speed;
    ++report.points;
    report.normal_impulse += law.normal;
    report.impulse += law.normal * at.normal + law.tangential;
    report.restitution_loss -= law.normal_work, report.friction_loss -= law.friction_work;
  }
  last_->note_impact(time, points, impacts, k);
  std::vector<HardContactImpulse> touching;
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    if (reports[g].points == 0) continue;
    reports[g].body_a = contact_name(problem_, pairs_[g].a), reports[g].body_b = contact_name(problem_, pairs_[g].b);
    touching.push_back(std::move(reports[g]));
  }
  return touching;
}

std::vector<std::size_t> RunContacts::targets_of(const std::vector<bool>& pairs) const {
  std::vector<std::size_t> targets;
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    for (const BodyName& name : {pairs_[g].a, pairs_[g].b}) {
      if (pairs[g] && name.target && std::ranges::find(targets, *name.target) == targets.end())
        targets.push_back(*name.target);
    }
  }
  return targets;
}

}  // namespace grapnel
