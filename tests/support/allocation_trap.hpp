#pragma once

/// @file
/// Counts heap allocations between construction and `stop()`: malloc and related functions, and operator new (which
/// g++'s runtime may implement without them), so all allocations of Eigen and the standard library. Include it in
/// one source of a program only: it defines these functions. Sanitizers define their own; then nothing is counted and
/// kTrapWorks is false. Thread safety: one trap at a time.

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <new>
#include "support/sanitizers.hpp"

namespace grapnel::testing {

#if defined(GRAPNEL_SANITIZED)
inline constexpr bool kTrapWorks = false;
#else
inline constexpr bool kTrapWorks = true;
#endif

inline std::atomic<bool> g_trap_armed{false};
inline std::atomic<long> g_trapped{0};
inline void note_allocation() {
  if (g_trap_armed.load(std::memory_order_relaxed)) ++g_trapped;
}

class AllocationTrap {
 public:
  AllocationTrap() {
    g_trapped = 0;
    g_trap_armed = true;
  }
  ~AllocationTrap() { g_trap_armed = false; }
  AllocationTrap(const AllocationTrap&) = delete;
  AllocationTrap& operator=(const AllocationTrap&) = delete;
  /// Allocations since construction.
  long stop() {
    g_trap_armed = false;
    return g_trapped;
  }
};

}  // namespace grapnel::testing

#if !defined(GRAPNEL_SANITIZED)

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  return __libc_realloc(memory, size);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
  grapnel::testing::note_allocation();
  *memory = __libc_memalign(alignment, size);
  return *memory == nullptr ? ENOMEM : 0;
}
}

// Not inlined; otherwise g++ warns of a mismatched pair of new and free.
[[gnu::noinline]] void* operator new(std::size_t size) {
  grapnel::testing::note_allocation();
  if (void* memory = __libc_malloc(size == 0 ? 1 : size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, std::align_val_t alignment) {
  grapnel::testing::note_allocation();
  if (void* memory = __libc_memalign(static_cast<std::size_t>(alignment), size)) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::align_val_t) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { std::free(memory); }

#endif
