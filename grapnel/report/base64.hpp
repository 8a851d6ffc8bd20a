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

}  // namespace grapnel
