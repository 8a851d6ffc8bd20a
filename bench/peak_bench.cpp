// Peak performance of this machine, by instruction set: multiplications and additions in registers, and stores to the
// first-level cache. The shares of the lane kernels show their bottleneck.
#include <benchmark/benchmark.h>

#include <string>

#include "bench/dynamics_bench.hpp"
#include "grapnel/spatial/dispatch.hpp"

namespace grapnel::bench {
namespace {

#if defined(__x86_64__) && defined(__GNUC__)

constexpr int kChains =
    12;  // independent of each other: enough for latency times throughput, and 16 registers hold them
constexpr int kRounds = 256;
constexpr int kStored = 16384;  // bytes, of a first-level cache of 32 kB or more

using Two = double __attribute__((vector_size(16)));
using Four = double __attribute__((vector_size(32)));
using Eight = double __attribute__((vector_size(64)));

// Inlined into functions compiled for one instruction set each; this file itself is compiled for the lowest one. SSE2
// has no fused operation: it uses a multiplication and an addition.
template <class V>
[[gnu::always_inline]] inline double multiply_add(double factor) {
  V x[kChains];
  const V a = V{} + factor, b = V{} + 1e-9;
  for (int c = 0; c < kChains; ++c) x[c] = V{} + c;
  for (int round = 0; round < kRounds; ++round) {
#pragma GCC unroll 12
    for (int c = 0; c < kChains; ++c) x[c] = x[c] * a + b;
  }
  V sum{};
  for (int c = 0; c < kChains; ++c) sum += x[c];
  return sum[0];
}

template <class V>
[[gnu::always_inline]] inline void store(V* memory, double value) {
  const V x = V{} + value;
  for (int i = 0; i < kStored / int{sizeof(V)}; i += 8) {
#pragma GCC unroll 8
    for (int k = 0; k < 8; ++k) memory[i + k] = x;
    asm volatile("" ::: "memory");
  }
}

[[gnu::target("sse2")]] double multiply_add_sse2(double f) { return multiply_add<Two>(f); }
[[gnu::target("avx2,fma")]] double multiply_add_avx2(double f) { return multiply_add<Four>(f); }
[[gnu::target("avx512f")]] double multiply_add_avx512(double f) { return multiply_add<Eight>(f); }
[[gnu::target("sse2")]] void store_sse2(void* m, double f) { store(static_cast<Two*>(m), f); }
[[gnu::target("avx2,fma")]] void store_avx2(void* m, double f) { store(static_cast<Four*>(m), f); }
[[gnu::target("avx512f")]] void store_avx512(void* m, double f) { store(static_cast<Eight*>(m), f); }

void register_set(lanes::InstructionSet set, double (*compute)(double), void (*write)(void*, double)) {
  if (!lanes::is_supported(set)) return;
  const std::string name = std::string(lanes::name(set));
  benchmark::RegisterBenchmark(("peak@" + name + "/multiply_add").c_str(), [=](benchmark::State& state) {
    double factor = 0.999;
    for (auto _ : state) {
      benchmark::DoNotOptimize(factor);
      benchmark::DoNotOptimize(compute(factor));
    }
    state.counters["flops"] = 2.0 * kChains * kRounds * lanes::lane_count(set);
  });
  benchmark::RegisterBenchmark(("peak@" + name + "/store").c_str(), [=](benchmark::State& state) {
    alignas(64) static unsigned char memory[kStored];
    double value = 1;
    for (auto _ : state) {
      benchmark::DoNotOptimize(value);
      write(memory, value);
    }
    state.counters["bytes"] = kStored;
  });
}

#endif

}  // namespace

void register_peak() {
#if defined(__x86_64__) && defined(__GNUC__)
  register_set(lanes::InstructionSet::sse2, multiply_add_sse2, store_sse2);
  register_set(lanes::InstructionSet::avx2, multiply_add_avx2, store_avx2);
  register_set(lanes::InstructionSet::avx512, multiply_add_avx512, store_avx512);
#endif
}

}  // namespace grapnel::bench
