// Those who have asked to be told of every page and port name, and which model is in force.
//
// What is to be told stands once, in PortNames, in the order of its last change; an observer is
// a place in it. So an open costs the same however many observe, and one that does not read is not
// told anything more until it has read: it costs a place.
#pragma once

#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "service/clients/clients.hpp"
#include "service/clients/replies.hpp"
#include "service/ports/switchboard.hpp"

namespace arbiter::service {

class Observers {
 public:
  // `news`: the last; once it has been told, the request is answered. Throws LimitExceeded.
  void add(const Client& client, std::uint64_t request, std::uint64_t news) {
    Observer& observer = observers_[client.id()];
    if (observer.waiting.size() == kMaxRequests) {
      throw LimitExceeded("limit-exceeded: " + std::to_string(kMaxRequests) +
                          " requests to observe are not answered yet: read what they bring");
    }
    observer.waiting.push_back({request, news});
  }
  void forget(ClientId client) { observers_.erase(client); }

  // Tells some of them something. `generation`: of the model in force. True: there is more that
  // could be told at once.
  bool tell(const Clients& clients, Switchboard& switchboard, std::uint64_t generation) {
    int left = kMostAtOnce;
    bool is_more = false;
    for (std::size_t i = 0; i < observers_.size() && left > 0; ++i) {
      auto next = observers_.upper_bound(last_told_);
      if (next == observers_.end()) next = observers_.begin();
      last_told_ = next->first;
      Client& client = *clients.find(last_told_);
      Observer& observer = next->second;
      if (!client.has_queue()) {
        const bool has_more = switchboard.show_news(client, observer.told, left);
        is_more = has_more || is_more;
        // Behind the names that it speaks of. Who has a queue is told once that is sent.
        if (!has_more && !client.has_queue()) tell_model(client, observer, generation);
      }
      while (!observer.waiting.empty() && observer.waiting.front().news <= observer.told) {
        client.send(reply_to(observer.waiting.front().request, wire::MessageKind::kDone));
        observer.waiting.erase(observer.waiting.begin());
      }
    }
    return is_more || left == 0;
  }

 private:
  static constexpr int kMostAtOnce = 1024;
  static constexpr std::size_t kMaxRequests = 64;

  struct Request {
    std::uint64_t request = 0;
    std::uint64_t news = 0;
  };
  struct Observer {
    std::uint64_t told = 0;
    std::uint64_t generation = 0;  // that it was told
    std::vector<Request> waiting;
  };

  static void tell_model(Client& client, Observer& observer, std::uint64_t generation) {
    if (client.is_lost() || std::exchange(observer.generation, generation) == generation) return;
    wire::Message message = message_to(wire::MessageKind::kModelInForce, 0, 0, 0);
    message.link = generation;
    client.send(message);
  }

  std::map<ClientId, Observer> observers_;
  ClientId last_told_ = 0;
};

}  // namespace arbiter::service
