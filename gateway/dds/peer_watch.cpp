#include "gateway/dds/peer_watch.hpp"

#include <arpa/inet.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "shm/clock.hpp"

namespace arbiter::gateway::dds {
namespace {

constexpr std::chrono::seconds kBetweenLooks{5};
constexpr shm::Nanoseconds kBetweenChanges = 60'000'000'000;

}  // namespace

LookedUp look_up(const std::string& host) {
  addrinfo hints{};
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_DGRAM;
  addrinfo* list = nullptr;
  LookedUp found;
  found.error = ::getaddrinfo(host.c_str(), nullptr, &hints, &list);
  if (found.error != 0) return found;
  const std::unique_ptr<addrinfo, void (*)(addrinfo*)> owned(list, ::freeaddrinfo);
  for (const addrinfo* each = list; each != nullptr; each = each->ai_next) {
    std::array<char, INET_ADDRSTRLEN> text{};
    const auto* const to = reinterpret_cast<const sockaddr_in*>(each->ai_addr);
    ::inet_ntop(AF_INET, &to->sin_addr, text.data(), text.size());
    found.addresses.insert(text.data());
  }
  return found;
}

// The first answer is taken for what DDS has had.
void PeerAddresses::note(const std::string& name, std::set<std::string> addresses,
                         shm::Nanoseconds now) {
  Place& place = places_.try_emplace(name, Place{addresses}).first->second;
  if (addresses.empty()) return;
  std::erase_if(place.lately, [&](const auto& each) { return now - each.second > kRemembered; });
  for (const std::string& address : addresses) {
    const bool is_new = place.lately.insert_or_assign(address, now).second;
    place.alternates = place.alternates || (!is_new && !place.now.contains(address));
  }
  place.now = std::move(addresses);
  if (place.lately.size() == place.now.size()) place.alternates = false;
}

void PeerAddresses::accept(shm::Nanoseconds now) {
  if (!change_of_any().empty()) quiet_until_ = now + kBetweenChanges;
  for (auto& [name, place] : places_) place.joined = known(name);
}

std::set<std::string> PeerAddresses::known(const std::string& name) const {
  const auto at = places_.find(name);
  if (at == places_.end()) return {};
  const Place& place = at->second;
  std::set<std::string> result = place.now;
  if (!place.alternates) return result;
  for (const auto& [address, seen] : place.lately) result.insert(address);
  return result;
}

// Even if somebody has found one meanwhile, or finds the same as before.
void PeerAddresses::note_unknown(const std::string& name) { places_[name].joined.clear(); }

std::string PeerAddresses::change(shm::Nanoseconds now) const {
  return now < quiet_until_ ? std::string() : change_of_any();
}

std::string PeerAddresses::change_of_any() const {
  for (const auto& each : places_) {
    const Place& place = each.second;
    const bool is_any_left =
        std::any_of(place.now.begin(), place.now.end(),
                    [&](const std::string& address) { return place.joined.contains(address); });
    if (is_any_left || place.now.empty()) continue;
    return each.first + " has the address " + *place.now.begin() + " now";
  }
  return {};
}

std::string host_of_peer(const std::string& peer) {
  const std::size_t colon = peer.find(':');
  return colon == peer.rfind(':') ? peer.substr(0, colon) : peer;
}

std::string name_of_peer(const std::string& peer) {
  const std::string host = host_of_peer(peer);
  in_addr ignored{};
  return ::inet_aton(host.c_str(), &ignored) != 0 ? "" : host;
}

struct PeerWatch::Shared {
  std::mutex mutex;
  std::condition_variable news;
  bool ends = false;
  PeerAddresses addresses;

  void look_for_ever(const std::vector<std::string>& names) {
    for (;;) {
      for (const std::string& name : names) {
        auto found = look_up(name).addresses;
        const std::lock_guard lock(mutex);
        if (ends) return;
        addresses.note(name, std::move(found), shm::monotonic_now());
      }
      std::unique_lock lock(mutex);
      if (news.wait_for(lock, kBetweenLooks, [this] { return ends; })) return;
    }
  }
};

PeerWatch::PeerWatch(const std::vector<std::string>& peers) : shared_(std::make_shared<Shared>()) {
  std::vector<std::string> names;
  for (const std::string& peer : peers) {
    if (std::string name = name_of_peer(peer); !name.empty()) names.push_back(std::move(name));
  }
  if (names.empty()) return;
  try {
    std::thread([shared = shared_, names] { shared->look_for_ever(names); }).detach();
  } catch (const std::system_error&) {  // there is no thread left: nothing is looked up again
  }
}

PeerWatch::~PeerWatch() {
  const std::lock_guard lock(shared_->mutex);
  shared_->ends = true;
  shared_->news.notify_one();
}

std::vector<std::string> PeerWatch::accept(const std::vector<std::string>& peers) {
  const std::lock_guard lock(shared_->mutex);
  shared_->addresses.accept(shm::monotonic_now());
  std::vector<std::string> result;
  for (const std::string& peer : peers) {
    const std::string name = name_of_peer(peer);
    const std::set<std::string> known = shared_->addresses.known(name);
    for (const std::string& each : known) result.push_back(each + peer.substr(name.size()));
    if (known.empty()) result.push_back(peer);
  }
  return result;
}

void PeerWatch::note_unknown(const std::vector<std::string>& peers) {
  const std::lock_guard lock(shared_->mutex);
  for (const std::string& peer : peers) {
    if (const std::string name = name_of_peer(peer); !name.empty()) {
      shared_->addresses.note_unknown(name);
    }
  }
}

std::string PeerWatch::change() const {
  const std::lock_guard lock(shared_->mutex);
  return shared_->addresses.change(shm::monotonic_now());
}

}  // namespace arbiter::gateway::dds
