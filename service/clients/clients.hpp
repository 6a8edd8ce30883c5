// Those who are connected.
#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <utility>

#include "service/clients/client.hpp"

namespace arbiter::service {

class Clients {
 public:
  // Null: it has gone.
  [[nodiscard]] Client* find(ClientId id) const {
    const auto found = by_id_.find(id);
    return found == by_id_.end() ? nullptr : found->second.get();
  }
  [[nodiscard]] std::size_t size() const { return by_id_.size(); }
  [[nodiscard]] bool empty() const { return by_id_.empty(); }
  // The oldest first.
  [[nodiscard]] auto begin() const { return by_id_.begin(); }
  [[nodiscard]] auto end() const { return by_id_.end(); }

  void add(std::unique_ptr<Client> client) {
    const ClientId id = client->id();
    by_id_.emplace(id, std::move(client));
  }
  // Null: it has gone before.
  [[nodiscard]] std::unique_ptr<Client> take_out(ClientId id) {
    auto node = by_id_.extract(id);
    return node ? std::move(node.mapped()) : nullptr;
  }

 private:
  std::map<ClientId, std::unique_ptr<Client>> by_id_;
};

}  // namespace arbiter::service
