#include "client/input/predecessors.hpp"

#include <algorithm>

namespace arbiter::detail {

// Relaxed is enough: of one that is gone these are the last values, for the kernel has passed on
// the news of its end; of one that lives an older value only keeps a predecessor for longer.
std::uint64_t accepted_on(const OutputPeer& peer) noexcept {
  for (std::uint32_t index = 0; index < shm::kMaxDestinations; ++index) {
    const shm::Channel& channel = peer.segment.channel(index);
    if (channel.receiver.load(std::memory_order_relaxed) != peer.link) continue;
    const std::uint64_t first = channel.first.load(std::memory_order_relaxed);
    const std::uint64_t accepted = channel.accepted.load(std::memory_order_relaxed);
    const std::uint64_t counted = accepted + 1 > first ? accepted + 1 - first : 0;
    const std::uint32_t depth = channel.depth.load(std::memory_order_relaxed);
    if (depth == 0 || depth > shm::kMaxDepth) return counted;
    // It may have died between storing an entry and counting it.
    const shm::Entry entry =
        peer.segment.ring(index, peer.link)[counted % depth].load(std::memory_order_relaxed);
    const bool is_stored = shm::sequence_of(entry) == ((first + counted) & shm::kSequenceMask);
    return counted + (is_stored ? 1 : 0);
  }
  return 0;
}

std::vector<shm::PortInstance> spent_predecessors(
    const std::map<shm::PortInstance, OutputLink>& links, std::uint32_t depth) {
  std::map<shm::SourceId, std::uint64_t> later;  // samples, of sources that have a predecessor
  for (const auto& [instance, link] : links) {
    if (link.gone) later[link.peer->source] = 0;
  }
  std::vector<shm::PortInstance> spent;
  if (later.empty()) return spent;
  std::size_t kept = 0;
  const auto look_at = [&](const auto& each) {
    const auto& [instance, link] = each;
    const auto behind = later.find(link.peer->source);
    if (behind == later.end()) return;
    // A publisher that lies harms its own connection: the sum is bounded.
    const std::uint64_t own = std::min<std::uint64_t>(accepted_on(*link.peer), depth);
    if (link.gone && (own == 0 || behind->second >= depth || kept == kMaxPredecessors)) {
      spent.push_back(instance);
    } else if (link.gone) {
      ++kept;
    }
    behind->second += own;
  };
  std::for_each(links.rbegin(), links.rend(), look_at);  // the latest first
  return spent;
}

}  // namespace arbiter::detail
