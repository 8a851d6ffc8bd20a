#pragma once

/// @file
/// Rows of numbers in packs of eight, of any processor: for derivatives with respect to all velocities of a tree. For
/// one source file, whose options hold for all of it.

#include <cstdint>
#include <cstring>
#include <vector>

#include "grapnel/spatial/scalar.hpp"

// Packs are only passed to functions that are inlined.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace grapnel::packed_rows {

// Numbers of eight neighbouring velocities. Rows are padded, so that the last pack of a range may exceed it.
using Pack = double __attribute__((vector_size(64)));
using Mask = std::int64_t __attribute__((vector_size(64), may_alias));
constexpr int kPack = 8;
// A pack at any double. Copies, since Clang takes the alignment of a vector type for granted behind a reference.
struct LoosePack {
  double numbers[kPack];

  GRAPNEL_INLINE operator Pack() const {
    Pack pack;
    std::memcpy(&pack, numbers, sizeof pack);
    return pack;
  }
  GRAPNEL_INLINE void operator=(const Pack& pack) { std::memcpy(numbers, &pack, sizeof pack); }
  GRAPNEL_INLINE void operator*=(double x) { *this = x * Pack(*this); }
  GRAPNEL_INLINE void operator-=(const Pack& pack) { *this = Pack(*this) - pack; }
  GRAPNEL_INLINE friend Pack operator*(double x, const LoosePack& pack) { return x * Pack(pack); }
};
constexpr int padded(int n) { return (n + kPack - 1) / kPack * kPack + kPack; }
// Zeros that begin at a cache line, so that a pack at a multiple of eight numbers lies in one.
class PackedNumbers {
 public:
  explicit PackedNumbers(int count) : lines_(static_cast<std::size_t>((count + kPack - 1) / kPack + 1)) {}
  double* data() { return lines_.data()->numbers; }
  const double* data() const { return lines_.data()->numbers; }

 private:
  struct alignas(64) Line {
    double numbers[kPack] = {};
  };
  std::vector<Line> lines_;
};
GRAPNEL_INLINE LoosePack& pack_at(double* x) { return *reinterpret_cast<LoosePack*>(x); }
GRAPNEL_INLINE const LoosePack& pack_at(const double* x) { return *reinterpret_cast<const LoosePack*>(x); }

// Zeros from `to` on, up to `end` or beyond. A loop over numbers would become a call of memset.
GRAPNEL_INLINE void clear(double* to, const double* end) {
  for (; to < end; to += kPack) pack_at(to) = Pack{};
}

}  // namespace grapnel::packed_rows
