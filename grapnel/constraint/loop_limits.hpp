#pragma once

/// @file
/// Tolerances for redundancy, closure and contradiction of closed loops, shared by single captures
/// (constrained_dynamics.hpp, simulate/) and SIMD lanes (grapnel/lanes/).

namespace grapnel::loop_limits {

/// Smaller pivots of the scaled W indicate redundant rows. Pivots are squares: directions with a millionth of a free
/// target's mobility are kept, while rounding errors of about 1e-15 are not.
inline constexpr double kRankTolerance = 1e-12;
/// Redundant rows contradict each other if they differ by more than this share of the accelerations, or velocities, of
/// the closure's two sides; rounding error is about 1e-13.
inline constexpr double kContradiction = 1e-6;
/// Negligible accelerations of the closures' bodies [rad/s^2, m/s^2].
inline constexpr double kUnnoticed = 1e-6;
/// Prevents 0/0.
inline constexpr double kSmallest = 1e-300;
/// A projection refactors in each iteration while defects exceed this value.
inline constexpr double kRefactorBeyond = 1e-8;
/// Iteration limit of a projection.
inline constexpr int kMostIterations = 20;
/// A projection fails if a larger defect remains [m, rad].
inline constexpr double kClosed = 1e-12;
/// Smaller defects of a step are not corrected: they are rounding errors of alternating sign, and correcting each would
/// accumulate them. [m, rad, and these per second]
inline constexpr double kNegligible = 3e-14;
/// Rounding error of a step in the norm of corrections: with light links that close heavy loops, projection amplifies
/// rounding errors to corrections of this size.
inline constexpr double kRoundingOfStep = 1e-12;

}  // namespace grapnel::loop_limits
