// Changes of the model that were asked for: they are made one after the other, in this order.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "service/clients/client.hpp"
#include "shm/limits.hpp"

namespace arbiter::service {

struct Change {
  enum class Kind : std::uint8_t {
    kReload,
    kCompare,  // the files, or a model of the past, with what is in force; changes nothing
    kSwitch,
    kRollback,
  };
  struct Asking {
    ClientId client = 0;
    std::uint64_t request = 0;
    bool wants_report = false;
  };

  Kind kind = Kind::kReload;
  std::string name;              // kSwitch: the model
  std::uint64_t generation = 0;  // of a rollback: which one; 0: the one before
  std::string by;                // who asked first, for people
  std::vector<Asking> asking;    // are answered when it is over
  bool of_past = false;          // kCompare: what a rollback would do, and not a reload
};

class ChangeQueue {
 public:
  static constexpr std::size_t kMaxWaiting = 64;

  // Joins the last one that waits, if that would do the same: who asks is told of files that were
  // read after that. Throws std::length_error where too many wait.
  void add(Change change) {
    for (const Change::Asking& each : change.asking) require_room_for(each.client);
    if (!waiting_.empty() && are_one(waiting_.back(), change)) {
      auto& asking = waiting_.back().asking;
      asking.insert(asking.end(), change.asking.begin(), change.asking.end());
      return;
    }
    // A signal comes from nobody who could be refused. It adds one to each that waits at most.
    if (!change.asking.empty() && waiting_.size() >= kMaxWaiting) {
      throw std::length_error("limit-exceeded: " + std::to_string(kMaxWaiting) +
                              " changes of the model wait already");
    }
    waiting_.push_back(std::move(change));
  }

  [[nodiscard]] bool empty() const { return waiting_.empty(); }
  Change take_next() {
    Change next = std::move(waiting_.front());
    waiting_.pop_front();
    return next;
  }

 private:
  // Each rollback counts for itself: two of them go back two steps.
  static bool are_one(const Change& last, const Change& next) {
    return last.kind == next.kind && last.name == next.name && last.of_past == next.of_past &&
           last.generation == next.generation && next.kind != Change::Kind::kRollback;
  }

  void require_room_for(ClientId client) const {
    std::size_t count = 0;
    for (const Change& each : waiting_) {
      count += static_cast<std::size_t>(
          std::count_if(each.asking.begin(), each.asking.end(),
                        [&](const Change::Asking& asking) { return asking.client == client; }));
    }
    if (count >= shm::kMaxPostponed) {
      throw std::length_error("limit-exceeded: " + std::to_string(shm::kMaxPostponed) +
                              " requests of this client wait already (kMaxPostponed)");
    }
  }

  std::deque<Change> waiting_;
};

}  // namespace arbiter::service
