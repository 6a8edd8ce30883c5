#include "client/tap/takes.hpp"

#include <algorithm>

namespace arbiter::detail {
namespace {

// Relaxed is enough for all counters: nothing is read by them, and each sum is told once it is
// seen.
std::uint64_t read(const shm::Atomic<std::uint64_t>& counter) noexcept {
  return counter.load(std::memory_order_relaxed);
}

std::array<std::uint64_t, 2> counts_of(const shm::Lane& lane) noexcept {
  return {read(lane.dropped), read(lane.overtaken)};
}

}  // namespace

TakeWatch::TakeWatch(const shm::InputSegment& segment) noexcept : segment_(&segment) {
  last_ = totals();
  for (std::size_t kind = 0; kind < accounts_.size(); ++kind) accounts_[kind].begin = last_[kind];
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    const shm::Lane& lane = segment_->lanes[i];
    lanes_[i] = {lane.publisher.load(std::memory_order_relaxed), read(lane.link), counts_of(lane)};
  }
}

TakeWatch::Totals TakeWatch::totals() const noexcept {
  const shm::InputCounters& counters = segment_->header.counters;
  return {read(counters.dropped), read(counters.overtaken)};
}

// What a lane has counted is told as far as the port's own counter has it too, which the port
// raises afterwards: so the sum of what is told is never more than that.
void TakeWatch::look_at(const shm::Lane& lane, Lane& known, const Totals& totals,
                        std::vector<News>& news) {
  const shm::PortInstance publisher = lane.publisher.load(std::memory_order_relaxed);
  const std::uint64_t link = read(lane.link);
  if (publisher != known.publisher || link != known.link) known = {publisher, link, {}};
  if (publisher == 0) return;
  const std::array<std::uint64_t, 2> counted = counts_of(lane);
  for (std::size_t kind = 0; kind < counted.size(); ++kind) {
    Account& account = accounts_[kind];
    const std::uint64_t left = totals[kind] - account.begin - account.told;
    // One that runs backwards is another's by now, or a lie.
    if (counted[kind] < known.told[kind]) known.told[kind] = counted[kind];
    const std::uint64_t count = std::min(counted[kind] - known.told[kind], left);
    if (count == 0) continue;
    known.told[kind] += count;
    account.told += count;
    news.push_back(
        {kind == 1, count, lane.source.load(std::memory_order_relaxed), read(lane.consumed)});
  }
}

// What no lane accounts for, a lane may still be about to: so it is told where it has been so
// twice.
void TakeWatch::look(bool is_last, std::vector<News>& news) {
  const Totals now = totals();
  const bool is_settled = accounts_[0].of_none == 0 && accounts_[1].of_none == 0;
  if (now == last_ && is_settled) return;
  for (std::size_t kind = 0; kind < accounts_.size(); ++kind) {
    // Backwards goes no honest one: what it says is taken for a new beginning.
    if (now[kind] < last_[kind]) accounts_[kind] = {now[kind], 0, 0};
  }
  last_ = now;
  for (std::size_t i = 0; i < lanes_.size(); ++i) {
    look_at(segment_->lanes[i], lanes_[i], now, news);
  }
  for (std::size_t kind = 0; kind < accounts_.size(); ++kind) {
    Account& account = accounts_[kind];
    const std::uint64_t rest = now[kind] - account.begin - account.told;
    const std::uint64_t sure = is_last ? rest : std::min(rest, account.of_none);
    account.told += sure;
    account.of_none = rest - sure;
    if (sure != 0) news.push_back({kind == 1, sure, shm::kNone, 0});
  }
}

}  // namespace arbiter::detail
