#pragma once

/// @file
/// Random numbers that are functions of where they are used: Philox 4x32-10 (Salmon, Moraes, Dror and Shaw 2011). No
/// number depends on which were asked for before it.

#include <array>
#include <cstdint>

namespace grapnel {

/// What random numbers are for: those of different uses are independent.
enum class RandomUse : std::uint32_t { uniform, permutation, jitter, scramble };

/// Four words of 32 random bits, the function of a seed, an index and a dimension.
std::array<std::uint32_t, 4> random_words(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension,
                                          RandomUse use);

/// A number in the open interval (0, 1) with 52 random bits, symmetric about 1/2.
double unit_number(std::uint32_t high, std::uint32_t low);

/// The same from seed, index and dimension.
double unit_number(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension);

}  // namespace grapnel
