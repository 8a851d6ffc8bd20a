#pragma once

/// @file
/// A capture as plain data (CaptureProblem), and the mechanical system of its servicer. Public, kept stable.

#include "grapnel/api/model.hpp"
#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// The servicer of a problem, with moving wheels and gyros, and its initial state.
struct Servicer {
  Model model;
  State state;
  int base;                        // body
  std::vector<int> joints;         // bodies of the driven joints, in the order of the problem's joint values
  std::vector<int> end_effectors;  // frames, in the robot's order
};

/// @throws std::invalid_argument if the problem contradicts itself; ModelError.
Servicer servicer_of(const CaptureProblem& problem);

}  // namespace grapnel
