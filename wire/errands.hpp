// What may wait for a stranger, done by threads that may be lost.
//
// To close a descriptor that another user's process has sent can take as long as he likes: a TCP
// socket with SO_LINGER waits for its peer, a file of FUSE for its server; a socket may hold either
// in messages that were never read. A write to a pipe waits for its lock, which a process that
// writes to it from memory that it does not provide holds for ever. Neither the daemon's loop nor a
// link's listener does any of it, but leaves it to a thread of that user's errands: one that waits
// for ever holds up nobody but the user whose descriptor it was.
//
// A user has one thread while there is something to do. Once an errand has taken kOverdue its
// thread is taken for lost, and another goes on with the rest, up to kMaxLostOfAUser: then the rest
// waits until one comes back. From kMaxWaiting on, or kMostWaiting where errands are slow and not
// all of these threads are lost, the user is stuck, and whoever collects errands takes nothing more
// from that user: what waits keeps descriptors that all share. A process that exits does not wait
// for them: the kernel makes no socket linger there; only a server of FUSE that does not answer
// keeps the process from ending, until it is killed itself.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::wire {

class Errands {
 public:
  static constexpr shm::Nanoseconds kOverdue = 1'000'000'000;
  static constexpr std::size_t kMaxLostOfAUser = 4;
  static constexpr std::size_t kMaxThreads = 64;
  static constexpr std::size_t kMaxWaiting = 512;  // while all threads of their user are lost
  static constexpr std::size_t kMostWaiting = 4096;

  // The process's. What it is given is done even when nobody is left who gave it.
  static Errands& of_the_process();

  Errands();
  Errands(const Errands&) = delete;
  Errands& operator=(const Errands&) = delete;
  // Leaves alone what is under way.
  ~Errands();

  // None of these blocks for longer than a mutex that is never held while anything waits.
  void run(uid_t user, std::function<void()> errand);
  void close(uid_t user, shm::FileDescriptor descriptor);

  // Starts threads in the place of lost ones. Returns a sentence for the log for each that is newly
  // lost, empty if there is none. To be called again by deadline().
  [[nodiscard]] std::string look_after(shm::Nanoseconds now);
  [[nodiscard]] shm::Nanoseconds deadline() const;
  // Whether as many errands of the user wait as may.
  [[nodiscard]] bool is_stuck(uid_t user) const;
  // How many threads are lost now.
  [[nodiscard]] std::size_t lost() const;

  // Waits until all is done, or `limit` has passed. True: all is done.
  [[nodiscard]] bool wait_until_done(shm::Nanoseconds limit) const;

 private:
  struct State;
  // Shared with the threads, which may outlive this.
  const std::shared_ptr<State> state_;
};

}  // namespace arbiter::wire
