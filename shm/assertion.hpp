// What must be so whatever anybody does: accounts that balance, one owner of what has one.
//
// It holds in releases too: a process whose accounts are wrong would go on with them, and harm
// others. Never for what another process can bring about, which is judged and refused; and neither
// in publish() nor in take(), which are as short as they can be.
#pragma once

#include <cstdio>
#include <cstdlib>

namespace arbiter::shm {

[[noreturn, gnu::cold, gnu::noinline]] inline void fail_assertion(const char* what,
                                                                  const char* condition,
                                                                  const char* file, int line) {
  std::fprintf(stderr, "arbiter: a mistake in the program: %s (%s, %s:%d); please report it\n",
               what, condition, file, line);
  std::abort();
}

}  // namespace arbiter::shm

// `what`: what is wrong where the condition does not hold.
#define ARBITER_ASSERT(condition, what) \
  ((condition) ? static_cast<void>(0)   \
               : ::arbiter::shm::fail_assertion(what, #condition, __FILE__, __LINE__))
