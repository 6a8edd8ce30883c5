#include "client/node/ended_nodes.hpp"

#include <pthread.h>

#include <atomic>
#include <deque>
#include <exception>
#include <mutex>
#include <vector>

namespace arbiter::detail {
namespace {

constexpr std::size_t kMostEnded = 65536;

struct EndedNode {
  shm::SegmentIdentity board;
  std::uint64_t node = 0;
  std::weak_ptr<const ServiceBell> teller;  // whose node says it
};

struct RingingBell {
  std::weak_ptr<const ServiceBell> bell;
  shm::SegmentIdentity board;
  bool has_thread = false;
};

// Of this process. It outlives all static objects, which may be nodes. The first node makes it.
struct EndedNodes {
  static EndedNodes& all() {
    static auto* const instance = new EndedNodes;
    return *instance;
  }

  std::mutex mutex;  // of the next two
  std::deque<EndedNode> nodes;
  std::vector<RingingBell> bells;
};

// Of those nodes: whoever holds the mutex writes it. Relaxed, with no partner: it spares others the
// mutex where there is none, and they read the list itself under the mutex.
std::atomic<std::size_t> ended_count{0};

// Another thread may hold the mutex at a fork, and the bells are the parent's.
void begin_anew_in_children() {
  static const int error = pthread_atfork([] { EndedNodes::all().mutex.lock(); },
                                          [] { EndedNodes::all().mutex.unlock(); },
                                          [] {
                                            EndedNodes& ended = EndedNodes::all();
                                            ended.nodes.clear();
                                            ended.bells.clear();
                                            ended_count.store(0, std::memory_order_relaxed);
                                            ended.mutex.unlock();
                                          });
  static_cast<void>(error);  // no memory: as without it
}

// Under the mutex. Null: no other node has that memory.
std::shared_ptr<const ServiceBell> teller_for(const shm::SegmentIdentity& board,
                                              const ServiceBell* own) {
  std::shared_ptr<const ServiceBell> found;
  for (const RingingBell& each : EndedNodes::all().bells) {
    if (!(each.board == board)) continue;
    auto bell = each.bell.lock();
    if (bell == nullptr || bell.get() == own) continue;
    if (each.has_thread) return bell;
    if (found == nullptr) found = std::move(bell);
  }
  return found;
}

}  // namespace

void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node,
                    const ServiceBell* own) noexcept try {
  std::shared_ptr<const ServiceBell> teller;
  {
    EndedNodes& ended = EndedNodes::all();
    const std::lock_guard lock(ended.mutex);
    teller = teller_for(board, own);
    if (ended.nodes.size() == kMostEnded) ended.nodes.pop_front();
    ended.nodes.push_back({board, node, teller});
    ended_count.store(ended.nodes.size(), std::memory_order_relaxed);
  }
  if (teller != nullptr) teller->ring();
} catch (const std::exception&) {  // no memory: its name is kept until the process ends
}

bool has_any_ended() noexcept { return ended_count.load(std::memory_order_relaxed) != 0; }

std::vector<std::uint64_t> ended_in(const shm::SegmentIdentity& board) {
  return ended_to_tell(board, nullptr);
}

std::vector<std::uint64_t> ended_to_tell(const shm::SegmentIdentity& board,
                                         const std::shared_ptr<const ServiceBell>& bell) {
  std::vector<std::uint64_t> nodes;
  EndedNodes& ended = EndedNodes::all();
  const std::lock_guard lock(ended.mutex);
  for (EndedNode& each : ended.nodes) {
    if (!(each.board == board)) continue;
    if (bell != nullptr && each.teller.expired()) each.teller = bell;
    if (bell == nullptr || each.teller.lock() == bell) nodes.push_back(each.node);
  }
  return nodes;
}

void forget_ended(const shm::SegmentIdentity& board,
                  const std::set<std::uint64_t>& nodes) noexcept {
  EndedNodes& ended = EndedNodes::all();
  const std::lock_guard lock(ended.mutex);
  std::erase_if(ended.nodes, [&](const EndedNode& each) {
    return each.board == board && nodes.count(each.node) != 0;
  });
  ended_count.store(ended.nodes.size(), std::memory_order_relaxed);
}

void ring_for_ended(const std::shared_ptr<const ServiceBell>& bell,
                    const shm::SegmentIdentity& board, bool has_thread) {
  begin_anew_in_children();
  {
    EndedNodes& ended = EndedNodes::all();
    const std::lock_guard lock(ended.mutex);
    std::erase_if(ended.bells, [&](const RingingBell& each) {
      const auto known = each.bell.lock();
      return known == nullptr || known == bell;
    });
    ended.bells.push_back({bell, board, has_thread});
  }
  if (has_any_ended()) bell->ring();  // perhaps one that ended when no other node was there
}

}  // namespace arbiter::detail
