#include "client/calls/foreign.hpp"

#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <exception>
#include <new>
#include <utility>

namespace arbiter::detail {

namespace {

// "/Object/pos:o belongs to process 17, and this is process 18, …: make a Node of its own …".
std::string is_foreign(const std::string& whose, const shm::ProcessMark& process) {
  return whose + " belongs to process " + std::to_string(process.process()) +
         ", and this is process " + std::to_string(::getpid()) +
         ", forked from it: make a Node of its own after fork()";
}

}  // namespace

void refuse_foreign(const std::string& whose, const shm::ProcessMark& process) {
  throw Error(is_foreign(whose, process));
}

// By one write: a lock of stdio may have been held by a thread that is not here.
void warn_once_that_foreign(const std::string& whose, const shm::ProcessMark& process,
                            pid_t& warned) noexcept {
  const pid_t self = ::getpid();
  if (std::exchange(warned, self) == self) return;
  try {
    const std::string line =
        "arbiter: " + is_foreign(whose, process) + "; its calls to the port are ignored\n";
    static_cast<void>(!::write(STDERR_FILENO, line.data(), line.size()));
  } catch (const std::exception&) {  // no memory for the line
  }
}

namespace {

struct Kept {
  std::shared_ptr<const void> core;
  Kept* next;
};
std::atomic<Kept*> all_kept{nullptr};  // reachable, so that nobody takes them for lost

}  // namespace

void keep_for_ever(std::shared_ptr<const void> core) noexcept {
  auto* const kept =
      new (std::nothrow) Kept{std::move(core), all_kept.load(std::memory_order_relaxed)};
  if (kept == nullptr) std::abort();  // the child ends: it must not destroy the core
  while (!all_kept.compare_exchange_weak(kept->next, kept, std::memory_order_relaxed)) {
  }
}

}  // namespace arbiter::detail
