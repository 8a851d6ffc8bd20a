#pragma once

/// @file
/// Momentum and energy of a system at one instant, body by body from poses and twists.

#include <span>
#include <vector>

#include "grapnel/dynamics/group_scale.hpp"
#include "grapnel/dynamics/momentum.hpp"

namespace grapnel {

/// One group of bodies that touch, in W: a tree of the model, or several.
struct GroupQuantities {
  Vector3d com = Vector3d::zero();
  Momentumd h = Momentumd::zero();  // [angular about the group's centre of mass; linear]
  GroupSize<double> size = {};
};
/// Several groups as one.
GroupQuantities together(std::span<const GroupQuantities> groups);

struct ConservedQuantities {
  Vector3d com;                        // of everything
  Momentumd about_com;                 // total, about it
  double kinetic_energy = 0;           // [J]
  double linear_scale = 0;             // sum |m v|
  double angular_scale = 0;            // sum (|I w| + |r x m v|), r from the system's centre of mass
  std::vector<GroupQuantities> trees;  // in the order of their roots
};
ConservedQuantities conserved_quantities(const Model& model, const Kinematics& kinematics, const State& state);

/// Momentum of some bodies, angular about `p_W`, in W: a target that hangs on an arm still has its own.
Momentumd group_momentum(const Model& model, const Kinematics& kinematics, std::span<const int> bodies,
                         const Vector3d& p_W);

/// Per body, which tree it is in, counted in the order of the roots.
std::vector<int> trees_of_bodies(const Model& model);

}  // namespace grapnel
