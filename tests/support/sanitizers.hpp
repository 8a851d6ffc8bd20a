#pragma once

// Sanitizers slow arithmetic by a factor of four to eight, and usually report errors in the first cases of a loop.
// repetitions() shortens loops over random cases; SKIP_UNDER_SANITIZERS omits long runs of code that shorter tests
// cover as well.

#include <gtest/gtest.h>

namespace grapnel::test {

#if defined(__has_feature)  // clang
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define GRAPNEL_SANITIZED
#endif
#elif defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)  // g++
#define GRAPNEL_SANITIZED
#endif

#if defined(GRAPNEL_SANITIZED)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif

/// The number of random cases with sanitizers, for a test with n cases without them.
constexpr int repetitions(int n) { return kSanitized ? (n + 7) / 8 : n; }

}  // namespace grapnel::test

#define SKIP_UNDER_SANITIZERS() \
  if (grapnel::test::kSanitized) GTEST_SKIP() << "takes long under sanitizers, and runs no code that others do not"
