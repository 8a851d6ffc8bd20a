#include "grapnel/campaign/random_number.hpp"

#include <Random123/philox.h>

namespace grapnel {

std::array<std::uint32_t, 4> random_words(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension,
                                          RandomUse use) {
  const r123::Philox4x32::key_type key = {{static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)}};
  const r123::Philox4x32::ctr_type counter = {{static_cast<std::uint32_t>(index),
                                               static_cast<std::uint32_t>(index >> 32), dimension,
                                               static_cast<std::uint32_t>(use)}};
  const r123::Philox4x32::ctr_type words = r123::Philox4x32()(counter, key);
  return {words[0], words[1], words[2], words[3]};
}

double unit_number(std::uint32_t high, std::uint32_t low) {
  const std::uint64_t bits = (std::uint64_t{high} << 32 | low) >> 12;
  return (static_cast<double>(bits) + 0.5) * 0x1p-52;  // exact: 53 bits
}

double unit_number(std::uint64_t seed, std::uint64_t index, std::uint32_t dimension) {
  const auto words = random_words(seed, index, dimension, RandomUse::uniform);
  return unit_number(words[0], words[1]);
}

}  // namespace grapnel
