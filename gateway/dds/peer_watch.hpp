// Whether the names of hosts that multicast does not reach (--peer of a link, peers= of a gateway)
// lead where they led when a domain of DDS was joined.
//
// DDS looks a name up when it joins, and never again. Where a name server answers only later, or a
// host has got another address, hosts would stay apart until somebody starts a program again. So
// names are looked up now and then, on a thread: a name server may be silent for long.
#pragma once

#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "shm/activity.hpp"

namespace arbiter::gateway::dds {

// What names lead to. Thread safety: one thread.
class PeerAddresses {
 public:
  // A name that has several addresses may lead to one of them at a time. Once it leads back to one,
  // all that it has led to within so long are its own. Not for ever, nor without that: some day
  // they are somebody else's, and to look for a host at each costs datagrams.
  static constexpr shm::Nanoseconds kRemembered = 600'000'000'000;

  // `addresses`: none, and the name cannot be looked up now, which changes nothing.
  void note(const std::string& name, std::set<std::string> addresses, shm::Nanoseconds now);
  // DDS is about to join: what is known() now is what it goes by from now on.
  void accept(shm::Nanoseconds now);
  // Of a name; empty: none is known.
  [[nodiscard]] std::set<std::string> known(const std::string& name) const;
  // It has joined, and has found no address of this one.
  void note_unknown(const std::string& name);
  // What has changed since: "base has the address 10.0.0.3 now"; empty: nothing. Where a name has
  // several addresses nobody knows which one DDS uses: it has changed once it has none of those
  // that it had. A minute passes between two changes: a name may lead elsewhere each time that
  // somebody asks.
  [[nodiscard]] std::string change(shm::Nanoseconds now) const;

 private:
  struct Place {
    std::set<std::string> joined{};
    std::set<std::string> now{};                       // at the last answer
    std::map<std::string, shm::Nanoseconds> lately{};  // when each was in an answer last
    bool alternates = false;                           // it has led back to one of them
  };
  [[nodiscard]] std::string change_of_any() const;

  std::map<std::string, Place> places_;  // by name
  shm::Nanoseconds quiet_until_ = 0;
};

struct LookedUp {
  int error = 0;                    // of getaddrinfo()
  std::set<std::string> addresses;  // of IPv4, as links and Cyclone use them
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

  // As PeerAddresses has it. What DDS is to be given: `peers`, with addresses in place of the names
  // of which some are known. So to join again needs no name server, which may be silent by then.
  [[nodiscard]] std::vector<std::string> accept(const std::vector<std::string>& peers);
  // `peers`: as DDS was given them.
  void note_unknown(const std::vector<std::string>& peers);
  [[nodiscard]] std::string change() const;

 private:
  struct Shared;
  const std::shared_ptr<Shared> shared_;
};

}  // namespace arbiter::gateway::dds
