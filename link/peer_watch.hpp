// Whether the names of hosts that multicast does not reach (--peer) lead where they led when the
// link joined its network.
//
// DDS looks a name up when it joins, and never again. Where a name server answers only later, or a
// host has got another address, hosts would stay apart until somebody starts a link again. So names
// are looked up now and then, on a thread: a name server may be silent for long.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "shm/activity.hpp"

namespace arbiter::link {

// What names lead to. Thread safety: one thread.
class PeerAddresses {
 public:
  // `addresses`: none, and the name cannot be looked up now, which changes nothing.
  void note(const std::string& name, std::set<std::string> addresses);
  // What they lead to now is what the link goes by from now on.
  void accept(shm::Nanoseconds now);
  // What has changed since, as a sentence; empty: nothing. Where a name has several addresses
  // nobody knows which one DDS uses: it has changed once it has none of those that it had. A minute
  // passes between two changes: a name may lead elsewhere each time that somebody asks.
  [[nodiscard]] std::string change(shm::Nanoseconds now) const;

 private:
  struct Place {
    std::set<std::string> joined;
    std::set<std::string> now;
  };
  [[nodiscard]] std::string change_of_any() const;

  std::map<std::string, Place> places_;  // by name
  shm::Nanoseconds quiet_until_ = 0;
};

struct LookedUp {
  int error = 0;                    // of getaddrinfo()
  std::set<std::string> addresses;  // of IPv4, as links use them
};
// Waits for a name server.
[[nodiscard]] LookedUp look_up(const std::string& host);

// Of ADDRESS, NAME, or either with :PORT: what stands before the port. An IPv6 address as it is.
[[nodiscard]] std::string host_of_peer(const std::string& peer);
// The same, if it is a name; empty: it is an address.
[[nodiscard]] std::string name_of_peer(const std::string& peer);

// As PeerAddresses has it, without waiting. Thread safety: any thread.
class PeerWatch {
 public:
  explicit PeerWatch(const std::vector<std::string>& peers);
  PeerWatch(const PeerWatch&) = delete;
  PeerWatch& operator=(const PeerWatch&) = delete;
  // Does not wait for a name server.
  ~PeerWatch();

  void accept();
  [[nodiscard]] std::string change() const;

 private:
  struct Shared;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace arbiter::link
