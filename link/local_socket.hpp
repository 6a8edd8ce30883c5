// Where programs of this host ask the link: `arbiter hosts`, `arbiter status --all`
// (wire/link_call.hpp has their side).
//
// Any local user may connect, and may be hostile: say nothing, send too much, not read, or send
// descriptors that take long to close. So each program is served by a thread of its own, and a user
// may have kMostOfUser at a time; whatever one of them does holds up nobody but its user. Who is
// not let in may have sent something, too: that is closed as an errand (wire/errands.hpp). If a
// user has as many as may wait, nobody is let in until some are done, and the link keeps its
// descriptors.
//
// Thread safety: `serve` is called on many threads at once.
#pragma once

#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "link/own_daemon.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/hosts.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::link {

class LocalSocket {
 public:
  static constexpr unsigned kMostOfUser = 8;
  // Of all; root and the link's own user find a place besides.
  static constexpr unsigned kMost = 64;

  // The document that answers; what it throws (std::exception) is the reason why there is none.
  using Serve = std::function<std::string(const LocalUser&, const wire::LinkQuestion&)>;

  // Throws std::runtime_error where it cannot listen, or another link of the instance does.
  LocalSocket(const std::string& instance, Serve serve);
  LocalSocket(const LocalSocket&) = delete;
  LocalSocket& operator=(const LocalSocket&) = delete;
  // As close(); and waits for calls of `serve` that have begun.
  ~LocalSocket();

  // Nobody is let in or heard any more, and another link may listen. Does not wait.
  void close();

  [[nodiscard]] const std::string& path() const noexcept { return listener_.path; }

 private:
  struct Shared;

  void run();
  void let_in();
  void turn_away(shm::FileDescriptor socket, uid_t user);
  static void serve_program(Shared& shared, const LocalUser& who, shm::FileDescriptor& socket);
  static void converse(Shared& shared, const LocalUser& who, const shm::FileDescriptor& socket);

  wire::Listener listener_;
  shm::FileDescriptor end_;  // readable: it is over
  std::shared_ptr<Shared> shared_;
  std::set<uid_t> stuck_;  // as many errands of theirs wait as may; of the thread
  std::thread thread_;
};

}  // namespace arbiter::link
