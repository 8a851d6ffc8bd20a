#pragma once

/// @file
/// Impacts of hard contacts between shapes (docs/theory, section 23, Hard contacts): alone, and in the instant of an
/// impact of grasps, contacts or brakes.

#include <span>
#include <vector>

#include "grapnel/contact/contact_set.hpp"
#include "grapnel/impact/contact_impact.hpp"

namespace grapnel {

struct ImpactInput;
struct ImpactLaw;

/// Steps of a path of impulses beyond which hard contacts do not part, since held rates press them together.
inline constexpr int kMaxHardSteps = 10'000;

/// Bodies in the instant of an impact of hard contacts.
struct HardImpactBodies {
  const Model& model;
  const State& state;
  std::span<const Grasp> closed = {};   // they hold
  std::span<const HeldRate> held = {};  // with the rows of couplings
  bool keep_rates = false;              // as ContactImpactOptions::keep_rates
  int max_steps = kMaxHardSteps;
};

/// Impulses by (11.1) to (11.8) with Stronge's hypothesis, under which no impact creates energy, on the second bodies
/// of all points. If held rates press bodies together, so that no finite impulse separates them, points of lasting
/// contact, whose forces are finite, are removed from `points`. Failed: there is no solution.
ImpactSolution solve_hard_impact(const HardImpactBodies& bodies, std::vector<HardPoint>& points);
/// Whether normal impulses alone can end the impact: they cannot if held rates press bodies together.
bool can_separate(const HardImpactBodies& bodies, std::vector<HardPoint> points);

/// The impact of any law, in which the hard contacts of the input take part. Grasps and held rates hold from the first
/// instant on, (11.2); the contacts of laws with contacts follow one path with the hard ones. Hard contacts take no
/// part if the law leaves none of them an approach speed above its rest speed.
ImpactSolution solve_impact(const ImpactLaw& law, const ImpactInput& input);

}  // namespace grapnel
