// How often a test of random inputs is repeated.
#pragma once

namespace arbiter::test {

// A tenth under a sanitizer: each round takes ten times as long there, and the sanitizer looks for
// errors that any round shows.
template <class Count>
constexpr Count rounds(Count all) {
#ifdef __SANITIZE_ADDRESS__
  return all / 10;
#else
  return all;
#endif
}

}  // namespace arbiter::test
