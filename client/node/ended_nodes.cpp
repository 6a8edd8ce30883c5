#include "client/node/ended_nodes.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <mutex>
#include <utility>

namespace arbiter::detail {
namespace {

struct EndedNode {
  shm::SegmentIdentity board;
  std::uint64_t node = 0;  // 0: none
};

std::mutex ended_mutex;  // of the next two
std::array<EndedNode, 64> ended_nodes;
std::size_t oldest_ended = 0;

}  // namespace

void remember_ended(const shm::SegmentIdentity& board, std::uint64_t node) noexcept {
  const std::lock_guard lock(ended_mutex);
  ended_nodes[oldest_ended] = {board, node};
  oldest_ended = (oldest_ended + 1) % ended_nodes.size();
}

std::uint64_t take_ended(const shm::SegmentIdentity& board) noexcept {
  const std::lock_guard lock(ended_mutex);
  const auto found =
      std::find_if(ended_nodes.begin(), ended_nodes.end(),
                   [&](const EndedNode& each) { return each.node != 0 && each.board == board; });
  return found == ended_nodes.end() ? 0 : std::exchange(found->node, 0);
}

}  // namespace arbiter::detail
