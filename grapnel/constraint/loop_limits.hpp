#pragma once

/// @file
/// What counts as redundant, closed and contradictory where loops are kept closed: numbers that a capture alone
/// (constrained_dynamics.hpp, simulate/) and many in SIMD lanes (grapnel/lanes/) must agree on.

namespace grapnel::loop_limits {

/// Pivots of the scaled W below this are redundant rows: squares, so directions a millionth as mobile as a free target
/// still count, and rounding, some 1e-15, does not.
inline constexpr double kRankTolerance = 1e-12;
/// Redundant rows that disagree by more than this share of the accelerations, or velocities, of the closure's two sides
/// contradict each other; rounding leaves some 1e-13.
inline constexpr double kContradiction = 1e-6;
/// What nobody would notice of the accelerations of the closures' bodies [rad/s^2, m/s^2].
inline constexpr double kUnnoticed = 1e-6;
/// Keeps 0/0 away.
inline constexpr double kSmallest = 1e-300;
/// Defects above this are too large for one factorization to serve all iterations of a projection.
inline constexpr double kRefactorBeyond = 1e-8;
/// Of a projection.
inline constexpr int kMostIterations = 20;
/// A projection that ends above it has failed [m, rad].
inline constexpr double kClosed = 1e-12;
/// Defects of a step that are left to the next ones: rounding goes to and fro, and correcting it each time would add it
/// up. [m, rad, and these per second]
inline constexpr double kNegligible = 3e-14;
/// What rounding in a step is worth in the measure of corrections: where light links close heavy loops, projection
/// answers rounding with corrections of that size.
inline constexpr double kRoundingOfStep = 1e-12;

}  // namespace grapnel::loop_limits
