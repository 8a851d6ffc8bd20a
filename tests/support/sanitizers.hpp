#pragma once

// Under sanitizers arithmetic takes four to eight times as long, and what they find they find in the first few of a
// loop's cases: repetitions() shortens loops over random cases, SKIP_UNDER_SANITIZERS leaves out long runs through code
// that shorter tests go through as well.

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

/// How many random cases a test takes of the n that it takes without sanitizers.
constexpr int repetitions(int n) { return kSanitized ? (n + 7) / 8 : n; }

}  // namespace grapnel::test

#define SKIP_UNDER_SANITIZERS() \
  if (grapnel::test::kSanitized) GTEST_SKIP() << "takes long under sanitizers, and runs no code that others do not"
