#pragma once

/// @file
/// The instruction sets for which lane kernels exist. Each is a tag that every template of the lanes carries, so that
/// the mangled name of whatever a translation unit emits says for which set it was compiled: a linker can then never
/// hand portable code a function that needs AVX-512 (tests/lanes/symbols_test).

namespace grapnel::lanes {

/// Eight doubles, fused products.
struct Avx512 {
  static constexpr int kWidth = 8;
  static constexpr bool kFused = true;
};
/// Four doubles, fused products.
struct Avx2 {
  static constexpr int kWidth = 4;
  static constexpr bool kFused = true;
};
/// Two doubles; a fused product is two roundings here, so its results differ in the last bits.
struct Sse2 {
  static constexpr int kWidth = 2;
  static constexpr bool kFused = false;
};
/// One double on any machine, the reference for the others: the same bits as Avx512 and Avx2. Slow where std::fma is
/// not one instruction.
struct OneLane {
  static constexpr int kWidth = 1;
  static constexpr bool kFused = true;
};

}  // namespace grapnel::lanes
