#include "gateway/dds/payload.hpp"

#include <algorithm>
#include <bit>
#include <new>

namespace arbiter::gateway::dds {
namespace {

constexpr std::align_val_t kAlignment{64};

}  // namespace

PayloadPool& PayloadPool::of_process() {
  static PayloadPool& pool = *new PayloadPool;
  return pool;
}

std::size_t PayloadPool::shelf_for(std::size_t bytes) noexcept {
  const std::size_t wanted = std::bit_ceil(std::max(bytes, kSmallest));
  return static_cast<std::size_t>(std::countr_zero(wanted) - std::countr_zero(kSmallest));
}

Payload* PayloadPool::take(std::size_t bytes) noexcept {
  if (bytes > (kSmallest << (kShelves - 1))) return nullptr;
  const std::size_t index = shelf_for(bytes);
  Shelf& shelf = shelves_.at(index);
  {
    const std::lock_guard lock(shelf.mutex);
    if (Payload* const payload = shelf.first; payload != nullptr) {
      shelf.first = payload->next;
      --shelf.kept;
      return payload;
    }
  }
  void* const memory =
      ::operator new(sizeof(Payload) + (kSmallest << index), kAlignment, std::nothrow);
  if (memory == nullptr) return nullptr;
  auto* const payload = ::new (memory) Payload;
  payload->shelf = static_cast<std::uint8_t>(index);
  return payload;
}

void PayloadPool::give_back(Payload* payload) noexcept {
  Shelf& shelf = shelves_.at(payload->shelf);
  const std::size_t size = kSmallest << payload->shelf;
  const std::size_t most = std::max<std::size_t>(kKeptBytes / size, size < kHuge ? 2 : 0);
  {
    const std::lock_guard lock(shelf.mutex);
    if (shelf.kept < most) {
      payload->next = shelf.first;
      shelf.first = payload;
      ++shelf.kept;
      return;
    }
  }
  payload->~Payload();
  ::operator delete(static_cast<void*>(payload), kAlignment);
}

}  // namespace arbiter::gateway::dds
