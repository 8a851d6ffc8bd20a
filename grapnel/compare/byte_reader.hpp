#pragma once

/// @file
/// Little-endian numbers and parts of a log's bytes, with checked lengths. For the readers of MCAP and rosbag.

#include <cstdint>
#include <stdexcept>
#include <string_view>

namespace grapnel {

/// The bytes end within a number or a part: the log is truncated, or a length is wrong.
struct EndOfBytes : std::runtime_error {
  EndOfBytes() : std::runtime_error("a length exceeds the bytes that follow") {}
};

class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : bytes_(bytes) {}

  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }
  std::uint64_t number(std::size_t size) {
    const std::string_view part = take(size);
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value |= static_cast<std::uint64_t>(static_cast<unsigned char>(part[i])) << (8 * i);
    return value;
  }
  std::string_view take(std::uint64_t size) {
    if (size > left()) throw EndOfBytes();
    const std::string_view part = bytes_.substr(at_, static_cast<std::size_t>(size));
    at_ += part.size();
    return part;
  }
  /// A part behind its length of four or eight bytes.
  std::string_view part(std::size_t size_of_length = 4) { return take(number(size_of_length)); }

 private:
  std::string_view bytes_;
  std::size_t at_ = 0;
};

}  // namespace grapnel
