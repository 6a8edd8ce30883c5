// Whose turn it is: clients that have sent something, served in turn by user.
//
// However many connections a user has, and whatever he asks, the others wait for one of his turns
// at most, not for all that he has asked.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <set>

#include "shm/assertion.hpp"

namespace arbiter::service {

class Turns {
 public:
  using ClientId = std::uint64_t;

  // Once for each client, until it has its turn.
  void add(uid_t user, ClientId client) {
    if (!waiting_.insert(client).second) return;
    auto& queue = by_user_[user];
    if (queue.empty()) users_.push_back(user);
    queue.push_back(client);
  }

  // The next, which does not wait any more. It may have gone meanwhile.
  std::optional<ClientId> next() {
    if (users_.empty()) return {};
    const uid_t user = users_.front();
    users_.pop_front();
    const auto queue = by_user_.find(user);
    const ClientId client = queue->second.front();
    queue->second.pop_front();
    const bool has_waited = waiting_.erase(client) == 1;
    ARBITER_ASSERT(has_waited, "a client that does not wait has its turn");
    if (queue->second.empty()) {
      by_user_.erase(queue);
    } else {
      users_.push_back(user);
    }
    return client;
  }

  [[nodiscard]] bool empty() const { return users_.empty(); }
  // How many users wait.
  [[nodiscard]] std::size_t users() const { return users_.size(); }

 private:
  std::deque<uid_t> users_;
  std::map<uid_t, std::deque<ClientId>> by_user_;
  std::set<ClientId> waiting_;
};

}  // namespace arbiter::service
