#pragma once

/// @file
/// Numbers as text inside JSON: base64 (RFC 4648, padded) of their bytes, little endian.

#include <cstdint>
#include <span>
#include <string>

namespace grapnel {

std::string base64_of(std::span<const double> values);
std::string base64_of(std::span<const float> values);
std::string base64_of(std::span<const std::uint8_t> values);

/// Characters that base64 takes for so many bytes.
constexpr std::size_t base64_length(std::size_t bytes) { return (bytes + 2) / 3 * 4; }

}  // namespace grapnel
