#pragma once

/// @file
/// Robots and states shared by all benchmarks of Grapnel and other engines.

#include <string>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::bench {

/// A robot with a cyclic list of states and generalized forces. Each call takes the next entry, so that the input
/// varies and does not drift, regardless of the batch size.
struct Workload {
  static constexpr int kCases = 16;
  std::string name;
  Model model;
  std::vector<State> states;
  std::vector<Forces> forces;
};

/// A free base with `arms` arms of `joints` revolute joints each, about z, or about z and y in turn. Masses and lengths
/// of the thesis's planar dual-arm robot (table 4.1's order of magnitude). Links are named "link<arm>.<joint>".
ModelBuilder describe_robot(int arms, int joints, bool alternate);

/// States and forces for a model whose first body is free, or for that robot: nonzero twist of the base and joint
/// rates, torques on all joints, and a wrench on the base.
Workload make_workload(const std::string& name, Model model);
Workload make_workload(const std::string& name, int arms, int joints, bool alternate);

/// The two target robots: (a) 2 arms x 3 joints about z, (b) 2 arms x 7 joints about z and y in turn.
std::vector<Workload> targets();
/// One arm of 7, 14, 28, ... 224 joints about z and y in turn.
std::vector<Workload> chains();

}  // namespace grapnel::bench
