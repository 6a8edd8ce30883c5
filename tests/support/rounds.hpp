// How often a test of random inputs is repeated.
#pragma once

namespace arbiter::test {

#if defined(__SANITIZE_ADDRESS__)  // gcc
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)  // clang
inline constexpr bool kSanitized = __has_feature(address_sanitizer);
#else
inline constexpr bool kSanitized = false;
#endif

// A tenth under a sanitizer: each round takes ten times as long there, and the sanitizer looks for
// errors that any round shows.
template <class Count>
constexpr Count rounds(Count all) {
  return kSanitized ? all / 10 : all;
}

}  // namespace arbiter::test
