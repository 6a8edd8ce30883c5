#include "service/clients/in_flight.hpp"

#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <utility>

#include "shm/assertion.hpp"
#include "wire/hang_up.hpp"

namespace arbiter::service {
namespace {

void end(LeftUnread::Client& client) { wire::hang_up(std::move(client.socket), client.user); }

}  // namespace

void InFlight::add(Shares& shares, uid_t user, std::uint64_t descriptors) {
  if (descriptors == 0) return;
  const bool is_within_share = shares.allows(user, Share::kInFlight, descriptors);
  sent_.push_back(is_within_share ? shares.take(user, Share::kInFlight, descriptors)
                                  : shares.take_own(Share::kInFlight, descriptors));
  count_ += descriptors;
  ARBITER_ASSERT(count_ >= descriptors, "more descriptors are under way than can be counted");
}

void InFlight::look(int socket) {
  ARBITER_ASSERT(sent_.empty() == (count_ == 0), "descriptors are under way that were not sent");
  int unread = 0;
  if (sent_.empty() || ioctl(socket, SIOCOUTQ, &unread) != 0 || unread != 0) return;
  sent_.clear();
  count_ = 0;
}

LeftUnread::~LeftUnread() { std::for_each(clients_.begin(), clients_.end(), end); }

void LeftUnread::add(Client client) {
  client.in_flight.look(client.socket.get());
  if (client.in_flight.empty()) {
    end(client);
    return;
  }
  shutdown(client.socket.get(), SHUT_RDWR);
  clients_.push_back(std::move(client));
}

void LeftUnread::look() {
  for (Client& client : clients_) {
    client.in_flight.look(client.socket.get());
    if (client.in_flight.empty()) end(client);
  }
  std::erase_if(clients_, [](const Client& client) { return client.in_flight.empty(); });
}

}  // namespace arbiter::service
