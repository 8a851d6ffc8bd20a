#pragma once

/// @file
/// What random scenarios are drawn from, to be called inside a generator of RapidCheck. Each draw shrinks towards its
/// first argument, so that a failing case loses what does not matter.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "grapnel/spatial/vector3.hpp"

namespace grapnel::testing {

using Numbers = std::vector<double>;

/// From lower to upper, both included; at full size from the first case on.
int integer(int lower, int upper);
/// One of a thousand steps between the two.
double uniform(double lower, double upper);
/// Within +-size; shrinks to 0.
double around(double size);
/// Logarithmic, with three digits.
double decades(double lower, double upper);
/// True in so many cases of a hundred; shrinks to false.
bool percent(int chance);
/// Each component within +-size.
Vector3d vector(double size);

template <std::size_t N>
std::string any_of(const std::array<const char*, N>& choices) {
  return choices[static_cast<std::size_t>(integer(0, N - 1))];
}

/// "[1, 2.5]"; the format is fmt's, of one number.
std::string list(const Numbers& numbers, const char* format = "{:.12g}");
std::string list(const Vector3d& v, const char* format = "{:.12g}");
/// A vector of length 1: along a coordinate axis, or any. All digits: the length must be right to 1e-9.
std::string unit_vector();
/// "position: [...], rpy: [...]", or less.
std::string pose(double size);
/// Mass, centre of mass (within +-com) and inertia of a box with edges from least to most, its axes turned in the
/// body's frame.
std::string body(double mass, double least, double most, double com);
/// The members of body(), each on a separate line.
std::string in_lines(std::string members, const std::string& indent);

}  // namespace grapnel::testing
