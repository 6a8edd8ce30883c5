#include "gateway/dds/warnings.hpp"

#include <cstddef>

namespace arbiter::gateway::dds {
namespace {

constexpr std::size_t kMaxOfPeer = 16;  // which may change for ever

}  // namespace

void Warnings::set(Sentences now, const PeerMap& peers) {
  std::erase_if(said_, [&](const auto& of) { return !peers.contains(of.first); });
  std::erase_if(now, [&](const auto& one) {
    const auto of = said_.find(one.first);
    return of != said_.end() &&
           (of->second.size() >= kMaxOfPeer || of->second.contains(one.second));
  });
  to_say_ = std::move(now);
}

std::vector<std::string> Warnings::take(Quota& quota, shm::Nanoseconds now) {
  std::vector<std::string> result;
  while (result.size() < to_say_.size() && quota.take_without_count(now)) {
    const auto& [guid, sentence] = to_say_[result.size()];
    said_[guid].insert(sentence);
    result.push_back(sentence);
  }
  to_say_.erase(to_say_.begin(), to_say_.begin() + static_cast<std::ptrdiff_t>(result.size()));
  return result;
}

}  // namespace arbiter::gateway::dds
