#pragma once

/// @file
/// Momentum and kinetic energy of measured motion over time.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "grapnel/compare/measured_motion.hpp"

namespace grapnel {

/// The components of one body's momentum and energy, in this order: linear (3), angular about the centre of mass (3),
/// angular about the world's origin (3), kinetic energy.
inline constexpr std::size_t kMomentumComponents = 10;
extern const std::array<const char*, kMomentumComponents> kMomentumNames;
extern const std::array<const char*, kMomentumComponents> kMomentumUnits;

/// Of the robot or a target. NaN where a component is not determined by the measured rates.
struct MomentumCurve {
  std::string body;  // "robot", or the target's name
  std::vector<double> time;
  std::vector<std::array<double, kMomentumComponents>> value, deviation;
  std::vector<std::string> missing;  // what would determine further components
};

inline constexpr std::size_t kMostMomenta = 2000;  // times

/// At the times of the measured rates, at most about `most` of them. `contacts`: no interpolation across them.
std::vector<MomentumCurve> measured_momentum(const RunModel& run, const MeasuredQuantities& measured, double offset,
                                             std::span<const ContactTime> contacts, std::size_t most);

/// momentum.csv
std::string momentum_csv(std::span<const MomentumCurve> curves);

}  // namespace grapnel
