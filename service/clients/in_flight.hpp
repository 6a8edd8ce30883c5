// Descriptors that a client has been sent and may not have received yet.
//
// The kernel counts what a user has under way in messages to anybody, and refuses to send more than
// RLIMIT_NOFILE of them (ETOOMANYREFS). All that this daemon sends counts together, unless it may
// do as it likes (CAP_SYS_RESOURCE): clients that ask and do not read would use it up for
// everybody. So what waits at the other end is charged to the user who lets it wait, and is given
// back once the kernel says that all has been read there.
//
// A client that has gone is not gone for the kernel, while another process still has its end.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <vector>

#include "service/policy/shares.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// Of one client.
class InFlight {
 public:
  // Whether so many more may be under way: as much as its user's share has, and a client can have.
  // One that has read everything is sent the next message in any case, lest those of the same user
  // that do not read keep it waiting.
  [[nodiscard]] bool allows(const Shares& shares, uid_t user, std::uint64_t descriptors) const {
    if (descriptors == 0 || sent_.empty()) return true;
    return count_ + descriptors <= kMostOfAClient &&
           shares.allows(user, Share::kInFlight, descriptors);
  }
  // They have been sent.
  void add(Shares& shares, uid_t user, std::uint64_t descriptors);
  // Looks whether all has been read that was sent through this socket.
  void look(int socket);
  [[nodiscard]] bool empty() const { return sent_.empty(); }

 private:
  static constexpr std::uint64_t kMostOfAClient = 128;

  std::vector<Charge> sent_;  // since all had been read the last time
  std::uint64_t count_ = 0;   // of descriptors
};

// What clients left unread that have gone.
class LeftUnread {
 public:
  struct Client {
    uid_t user = 0;
    shm::FileDescriptor socket;
    InFlight in_flight;
    Charge descriptors;
  };

  LeftUnread() = default;
  LeftUnread(const LeftUnread&) = delete;
  LeftUnread& operator=(const LeftUnread&) = delete;
  ~LeftUnread();

  // Ends the conversation. Its socket is kept for as long as something waits at the other end.
  void add(Client client);
  // Closes the sockets of those who have read, or closed, since.
  void look();
  [[nodiscard]] bool empty() const { return clients_.empty(); }

 private:
  std::vector<Client> clients_;
};

}  // namespace arbiter::service
