#include "top/arrivals.hpp"

#include <algorithm>
#include <cstdint>

#include "shm/limits.hpp"

namespace arbiter::top {

void Arrivals::add(std::vector<Accepted> accepted, shm::Nanoseconds now) {
  for (Accepted& each : accepted) {
    if (each.at < 0 || each.at > now) continue;  // no reading of this machine's clock
    if (each.is_sample) note_sample(each);
    fresh_.push_back(std::move(each));
  }
  if (fresh_.size() > kMostNew) {
    fresh_.erase(fresh_.begin(), fresh_.end() - static_cast<std::ptrdiff_t>(kMostNew));
  }
}

void Arrivals::drop_until(shm::Nanoseconds time) {
  std::erase_if(fresh_, [time](const Accepted& each) { return each.at <= time; });
}

void Arrivals::note_sample(const Accepted& accepted) {
  auto& times = samples_[{accepted.port, accepted.source}];
  if (!times.empty() && accepted.at < times.back()) return;
  times.push_back(accepted.at);
  // Twice, for some come between the question and the answer of a census.
  if (times.size() > std::size_t{2} * shm::kMaxDepth) times.pop_front();
}

// Of what waits, a queue has the latest that it accepted. The daemon looked at it after it was
// asked: the oldest one had arrived no earlier than what would have been the oldest one then. Where
// a tap has lost events, or was closed for a while, the bound is not as good, but it is one.
std::optional<shm::Nanoseconds> Arrivals::oldest_at(const PortFact& port,
                                                    const Census& census) const {
  shm::Nanoseconds oldest = 0;
  for (const auto& [source, waiting] : port.queues) {
    const auto found = samples_.find({port.name, source});
    if (found == samples_.end()) return std::nullopt;
    const auto& times = found->second;
    const auto by_then = std::upper_bound(times.begin(), times.end(), census.asked);
    if (static_cast<std::uint64_t>(by_then - times.begin()) < waiting) return std::nullopt;
    oldest = std::max(oldest, census.at - *(by_then - static_cast<std::ptrdiff_t>(waiting)));
  }
  return oldest;
}

}  // namespace arbiter::top
