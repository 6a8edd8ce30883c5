// Where the fuzz target stands between the daemon and the kernel, so that both run in one thread
// and an input always does the same: time passes only where the target says so, the daemon's loop
// returns once it has nothing left to do, and clients are whom the target says.
//
// The linker puts the __wrap_ functions of loop.cpp in the place of the kernel's (CMakeLists.txt).
#pragma once

#include <sys/epoll.h>
#include <sys/types.h>

#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::fuzz {

// Whom the daemon's kernel reports at the other end of the next connection.
struct Identity {
  pid_t pid = 0;
  uid_t user = 0;
  int process = -1;  // readable once the process has ended
};

class Loop {
 public:
  Loop();

  // What the daemon is to take for its signals: readable when it shall return.
  [[nodiscard]] int signals() const { return read_end_.get(); }

  static inline Identity connecting;
  // What a descriptor leads to was made by that user, where nobody has said so before.
  static void declare_maker(int fd, uid_t user);
  // Whoever sends a descriptor has made it, whatever was said before. Unless that is left out.
  static inline bool senders_are_makers = true;
  static void forget_maker(int fd);
  static inline shm::Nanoseconds now = 0;
  static inline shm::Nanoseconds may_pass = 0;  // how much time, in this run
  static inline int rounds = 0;                 // in this run
  static inline int heard = 0;                  // events, since somebody has set it
  static inline bool was_told_to_return = false;

 private:
  friend int wait_for_events(int epoll, epoll_event* events, int most, int timeout_ms);
  static inline Loop* current = nullptr;
  void tell_to_return() const;

  shm::FileDescriptor read_end_;
  shm::FileDescriptor write_end_;
};

int wait_for_events(int epoll, epoll_event* events, int most, int timeout_ms);
uid_t maker_of(int fd);

}  // namespace arbiter::fuzz
