#pragma once

/// @file
/// The shapes of flexible links that flexible_robot() divides among their pieces. Internal to this module.

#include <string>
#include <utility>
#include <vector>

#include "grapnel/problem/capture_problem.hpp"

namespace grapnel {

/// A shape that extends along the beam of a link over several pieces.
struct CutShape {
  struct Piece {
    std::string body;   // in flexible_robot()
    Vector3d origin;    // of the body, in the link's frame, undeformed
    double begin, end;  // of the piece of the beam [m]
    Geometry part;      // of the shape, on the body
  };
  Geometry whole;        // in the link's frame
  Vector3d point, axis;  // the beginning of the beam and its direction, in the link's frame
  std::vector<Piece> pieces;
};

/// Of a robot that flexible_robot() has not changed, and of a target's panels. The links' beams have no error.
std::vector<CutShape> cut_shapes(const RobotSetup& robot);
std::vector<CutShape> cut_shapes(const TargetSetup& target);

}  // namespace grapnel
