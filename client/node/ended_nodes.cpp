#include "client/node/ended_nodes.hpp"

#include <atomic>
#include <deque>
#include <exception>
#include <mutex>

#include "shm/descendants.hpp"

namespace arbiter::detail {
namespace {

constexpr std::size_t kMostEnded = 65536;

struct EndedNode {
  shm::SegmentIdentity board;
  std::uint64_t node = 0;
};

// A child has closed its parent's.
struct RingingBell {
  std::weak_ptr<const ServiceBell> bell;
  shm::ProcessMark process;
};

std::mutex ended_mutex;  // of the next two
std::deque<EndedNode> ended_nodes;
std::vector<RingingBell> ringing_bells;
std::atomic<std::size_t> ended_count{0};  // of them

}  // namespace

void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node) noexcept try {
  const std::lock_guard lock(ended_mutex);
  if (ended_nodes.size() == kMostEnded) ended_nodes.pop_front();
  ended_nodes.push_back({board, node});
  ended_count.store(ended_nodes.size(), std::memory_order_relaxed);
  for (const RingingBell& each : ringing_bells) {
    const auto bell = each.process.is_here() ? each.bell.lock() : nullptr;
    if (bell != nullptr) bell->ring();
  }
} catch (const std::exception&) {  // no memory: its name is kept until the process ends
}

bool has_any_ended() noexcept { return ended_count.load(std::memory_order_relaxed) != 0; }

std::vector<std::uint64_t> ended_in(const shm::SegmentIdentity& board) {
  std::vector<std::uint64_t> nodes;
  const std::lock_guard lock(ended_mutex);
  for (const EndedNode& each : ended_nodes) {
    if (each.board == board) nodes.push_back(each.node);
  }
  return nodes;
}

void forget_ended(const shm::SegmentIdentity& board,
                  const std::set<std::uint64_t>& nodes) noexcept {
  const std::lock_guard lock(ended_mutex);
  std::erase_if(ended_nodes, [&](const EndedNode& each) {
    return each.board == board && nodes.count(each.node) != 0;
  });
  ended_count.store(ended_nodes.size(), std::memory_order_relaxed);
}

void ring_for_ended(const std::shared_ptr<const ServiceBell>& bell) {
  const std::lock_guard lock(ended_mutex);
  std::erase_if(ringing_bells, [](const RingingBell& each) { return each.bell.expired(); });
  ringing_bells.push_back({bell, shm::ProcessMark::of_this_process()});
}

}  // namespace arbiter::detail
