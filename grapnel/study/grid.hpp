#pragma once

/// @file
/// The points of a grid and their order.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace grapnel {

/// Number of combinations; empty if it does not fit. No axes: one point.
std::optional<std::size_t> grid_size(std::span<const std::size_t> sizes);

/// Position on each axis of a point, counted from 0: the first axis varies slowest.
std::vector<std::size_t> grid_position(std::span<const std::size_t> sizes, std::size_t point);

/// `count` values from `from` to `to`, both ends exact; with `logarithmic` equal ratios (both ends of one sign).
std::vector<double> spaced_values(double from, double to, std::size_t count, bool logarithmic);

}  // namespace grapnel
