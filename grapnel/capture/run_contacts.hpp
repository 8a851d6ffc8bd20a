#pragma once

/// @file
/// The contacts between shapes in a run: the surfaces of the current system, and the modes of all pairs from one motion
/// segment to the next. Thread safety: one thread at a time.

#include <memory>
#include <string>
#include <vector>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/impact/impact_solution.hpp"
#include "grapnel/problem/capture_system.hpp"
#include "grapnel/problem/contact_pairs.hpp"
#include "grapnel/result/impact_result.hpp"

namespace grapnel {

class RunContacts {
 public:
  /// `free`: the system with free targets.
  RunContacts(const CaptureProblem& problem, const CaptureSystem& free);

  bool any() const { return !pairs_.empty(); }
  /// The contacts of a system of the problem, one group per pair of bodies (contact_pairs()), with the modes of the
  /// last one; null without pairs.
  std::shared_ptr<ContactSet> in(const CaptureSystem& system);
  /// Checks the initial state. Returns a description of all overlaps with their depths, except of shapes that pass
  /// through each other; empty: none.
  std::string overlaps(const CaptureSystem& system, const State& state);
  /// A grasp closes: shapes of its gripper that overlap its target pass through it until they are apart. With
  /// `but_touching`, those in contact remain in contact.
  void close(std::size_t grasp, const CaptureSystem& system, const State& state, double time,
             bool but_touching = false);
  /// The points of hard contacts that touch in this state, without those between grippers and targets of `closing`
  /// grasps, which pass through each other from now on.
  std::vector<HardPoint> hard_points(std::span<const std::size_t> closing, const CaptureSystem& system,
                                     const State& state, double time);
  /// Records the impact of the last hard_points(), one entry each, whose velocities afterwards are those of `after`.
  /// Returns the impulses, pair by pair.
  std::vector<HardContactImpulse> note_impact(std::span<const HardPoint> points,
                                              std::span<const ContactPointImpulse> impulses,
                                              const CaptureSystem& system, const State& after, double time);
  /// The contacts that in() and note_impact() have changed last; null: none.
  const ContactSet* last() const { return last_.get(); }
  /// The targets of pairs that exchanged an impulse in an impact; per pair of bodies whether it did.
  std::vector<std::size_t> targets_of(const std::vector<bool>& pairs) const;

 private:
  std::vector<bool> pairs_of_grasp(std::size_t grasp, const CaptureSystem& system) const;

  const CaptureProblem& problem_;
  const std::vector<ContactPair> pairs_;
  std::shared_ptr<ContactSet> last_;
};

}  // namespace grapnel
