#include "grapnel/report/base64.hpp"

#include <bit>
#include <string_view>

namespace grapnel {
namespace {

static_assert(std::endian::native == std::endian::little, "the bytes of numbers are copied unchanged");

std::string encoded(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t at = 0; at < bytes.size(); at += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - at);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < count ? static_cast<std::uint8_t>(bytes[at + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

template <class T>
std::string encoded_bytes(std::span<const T> values) {
  const std::span<const std::byte> bytes = std::as_bytes(values);
  return encoded({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

std::string base64_of(std::span<const double> values) { return encoded_bytes(values); }
std::string base64_of(std::span<const float> values) { return encoded_bytes(values); }
std::string base64_of(std::span<const std::uint8_t> values) { return encoded_bytes(values); }

}  // namespace grapnel
