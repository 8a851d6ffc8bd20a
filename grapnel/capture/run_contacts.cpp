#include "grapnel/capture/run_contacts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "grapnel/dynamics/kinematics.hpp"
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

void RunContacts::close(std::size_t grasp, const CaptureSystem& system, const State& state, double time,
                        bool but_touching) {
  if (!any()) return;
  const GraspSetup& setup = problem_.grasps[grasp];
  const std::vector<int> gripper = gripper_bodies(system, setup);
  const BodyName target = BodyName::of_target(target_index(problem_, setup.target));
  const auto is_gripper = [&](const BodyName& name) {
    return std::ranges::any_of(bodies_named(problem_, system, name),
                               [&](int body) { return std::ranges::find(gripper, body) != gripper.end(); });
  };
  const std::shared_ptr<ContactSet> set = in(system);
  const Kinematics kinematics = forward_kinematics(system.model, state);
  for (std::size_t g = 0; g < pairs_.size(); ++g) {
    const ContactPair& pair = pairs_[g];
    if ((pair.a == target && is_gripper(pair.b)) || (pair.b == target && is_gripper(pair.a)))
      set->let_pass(static_cast<int>(g), kinematics, time, but_touching);
  }
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
