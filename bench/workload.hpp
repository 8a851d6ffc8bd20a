#pragma once

/// @file
/// The robots and states that every benchmark, ours or a peer's, is given.

#include <string>
#include <vector>

#include "grapnel/dynamics/forward_dynamics.hpp"

namespace grapnel::bench {

/// A robot with a ring of states and generalized forces: each call takes the next, so that nothing is constant and
/// nothing drifts, however long a batch is.
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

/// States and forces for a model whose first body is free, or for that robot. The base turns and drifts, the joints
/// move; torques on all joints and a wrench on the base.
Workload make_workload(const std::string& name, Model model);
Workload make_workload(const std::string& name, int arms, int joints, bool alternate);

/// The two robots of the targets: (a) 2 arms x 3 joints about z, (b) 2 arms x 7 joints about z and y in turn.
std::vector<Workload> targets();
/// One arm of 7, 14, 28, ... 224 joints about z and y in turn.
std::vector<Workload> chains();

}  // namespace grapnel::bench
