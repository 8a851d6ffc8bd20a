#pragma once

/// @file
/// Eight cases of one random tree structure with separate numbers, and lane kernel runs on them.

#include <array>
#include <memory>
#include <vector>

#include "grapnel/spatial/dispatch.hpp"
#include "lane_kernels/kernel_table.hpp"
#include "support/random_robot.hpp"

namespace grapnel::lanes::testing {

inline constexpr int kCases = 8;

/// One case: a tree, its state, and its loads.
struct LaneCase {
  Tree<double> tree;
  std::vector<double> q, v, force, acceleration;
  std::vector<Wrenchd> link_wrench;
  Vector3d gravity;
  double elapsed;
};

/// Kernel results of a case. Momenta have kRootNumbers entries per root; motion has eighteen per link, as in
/// KernelTable.
struct LaneResults {
  std::vector<double> vdot, force, inverse, momenta, q, v, motion;
};

/// Robot `index`: branched, spherical and prismatic joints, rotors, up to two targets. Each case has its own masses,
/// inertias, offsets and rotors, state and forces. About a third of the one-degree-of-freedom joints and spherical ones
/// are prescribed in the same way in all cases.
struct CaseSet {
  std::array<LaneCase, kCases> cases;
  std::vector<std::uint8_t> prescribed;
};
CaseSet random_cases(int index);

/// The double kernels on one case.
LaneResults double_results(const LaneCase& c, const std::vector<std::uint8_t>& prescribed);

/// Results of the set's kernels on all cases. `order[i]` is the case at position i of consecutively filled packs;
/// results are in the order of the cases.
std::array<LaneResults, kCases> lane_results(InstructionSet set, const CaseSet& cases,
                                             const std::array<int, kCases>& order = {0, 1, 2, 3, 4, 5, 6, 7});

}  // namespace grapnel::lanes::testing
