#pragma once

/// @file
/// SHA-256 (FIPS 180-4), to name an input.

#include <string>
#include <string_view>

namespace grapnel {

/// Digest of the bytes, as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

}  // namespace grapnel
