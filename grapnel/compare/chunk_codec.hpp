#pragma once

/// @file
/// Compressed parts of logs of messages (MCAP, rosbag).

#include <cstdint>
#include <string>
#include <string_view>

namespace grapnel {

/// The decompressed bytes. `compression` is "", "none", "lz4" (frames), "zstd" or "bz2". Memory grows with the produced
/// bytes, not with the declared `size`. @throws std::runtime_error for damaged bytes, a wrong or implausible size, and
/// an unknown compression
std::string decompressed(std::string_view compression, std::string_view bytes, std::uint64_t size);

/// CRC-32 as in Ethernet and ZIP files.
std::uint32_t crc32_of(std::string_view bytes);

}  // namespace grapnel
