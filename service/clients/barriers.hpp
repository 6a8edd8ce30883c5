// Waiting, for a bounded time, until clients have taken up what they were told.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "service/clients/client.hpp"
#include "shm/activity.hpp"
#include "shm/assertion.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {

// How long a component that does not run may hold up the opening of a port, or a new model.
constexpr shm::Nanoseconds kMaxWaitForClients = 200'000'000;

class Barriers {
 public:
  // Asks the clients to say when they are done, and calls `passed` once all have, or at `deadline`.
  // A client without a service thread is not waited for. Calls it at once if nobody is.
  void raise(const std::set<Client*>& clients, shm::Nanoseconds deadline,
             std::function<void()> passed) {
    const std::uint64_t number = ++last_;
    Barrier barrier{{}, deadline, shm::monotonic_now(), std::move(passed)};
    for (Client* client : clients) {
      if (!client->has_service_thread) continue;
      wire::Message sync;
      sync.kind = wire::MessageKind::kSync;
      sync.request = number;
      client->send(sync);
      barrier.waiting.insert(client->id());
    }
    const bool is_first = barriers_.emplace(number, std::move(barrier)).second;
    ARBITER_ASSERT(is_first, "a barrier is raised twice");
    pass(number);
  }

  void synced(ClientId client, std::uint64_t number) {
    const auto found = barriers_.find(number);
    if (found == barriers_.end()) return;
    found->second.waiting.erase(client);
    pass(number);
  }

  void forget(ClientId client) {
    std::set<std::uint64_t> numbers;
    for (auto& [number, barrier] : barriers_) {
      if (barrier.waiting.erase(client) != 0) numbers.insert(number);
    }
    for (const std::uint64_t number : numbers) pass(number);
  }

  // When the next one is given up; kForever: none waits.
  [[nodiscard]] shm::Nanoseconds next_deadline() const {
    shm::Nanoseconds next = shm::kForever;
    for (const auto& [number, barrier] : barriers_) next = std::min(next, barrier.deadline);
    return next;
  }

  // Returns who is not waited for any longer, and has had time to answer.
  std::set<ClientId> expire(shm::Nanoseconds now) {
    std::set<std::uint64_t> numbers;
    std::set<ClientId> late;
    for (auto& [number, barrier] : barriers_) {
      if (barrier.deadline > now) continue;
      // Who was asked when the time was nearly over has had none.
      if (now - barrier.asked >= kMaxWaitForClients / 2) late.merge(barrier.waiting);
      barrier.waiting.clear();
      numbers.insert(number);
    }
    for (const std::uint64_t number : numbers) pass(number);
    return late;
  }

 private:
  struct Barrier {
    std::set<ClientId> waiting;
    shm::Nanoseconds deadline;
    shm::Nanoseconds asked;
    std::function<void()> passed;
  };

  void pass(std::uint64_t number) {
    const auto found = barriers_.find(number);
    if (found == barriers_.end() || !found->second.waiting.empty()) return;
    const auto passed = std::move(found->second.passed);
    ARBITER_ASSERT(passed != nullptr, "a barrier is passed twice");
    barriers_.erase(found);
    passed();
  }

  std::uint64_t last_ = 0;
  std::map<std::uint64_t, Barrier> barriers_;
};

}  // namespace arbiter::service
