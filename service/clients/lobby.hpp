// Those who have connected and are not clients yet.
//
// The kernel keeps one queue of connections for all users, which one of them can fill as fast as he
// can connect. So the daemon takes them out in large numbers, at the price of two system calls
// each, and lets them wait here: what making a client of one costs, it pays for one of each user in
// turn.
#pragma once

#include <sys/types.h>

#include <deque>
#include <map>
#include <utility>
#include <vector>

#include "service/policy/shares.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

class Lobby {
 public:
  struct Waiting {
    uid_t user = 0;
    shm::FileDescriptor socket;
    Charge descriptor;
  };

  void add(Waiting waiting) { by_user_[waiting.user].push_back(std::move(waiting)); }
  [[nodiscard]] bool empty() const { return by_user_.empty(); }

  // Takes out the first of each user.
  std::vector<Waiting> next() {
    std::vector<Waiting> result;
    for (auto each = by_user_.begin(); each != by_user_.end();) {
      result.push_back(std::move(each->second.front()));
      each->second.pop_front();
      each = each->second.empty() ? by_user_.erase(each) : std::next(each);
    }
    return result;
  }

 private:
  std::map<uid_t, std::deque<Waiting>> by_user_;
};

}  // namespace arbiter::service
