// What an import does with each event that arrives, on Cyclone's threads.
#include <time.h>

#include <algorithm>
#include <array>
#include <utility>

#include "gateway/dds/arrived_sample.hpp"
#include "link/import.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {

shm::Nanoseconds time_with_sleep() noexcept {
  timespec time{};
  clock_gettime(CLOCK_BOOTTIME, &time);
  return shm::Nanoseconds{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

void Import::take(const gateway::dds::Payload& payload,  // NOLINT(bugprone-exception-escape)
                  const gateway::dds::SampleWriter& writer) noexcept {
  const std::size_t before = encapsulation().size();
  const std::lock_guard lock(mutex_);
  std::array<std::byte, kMaxHeaderBytes> bytes;
  const std::size_t size = payload.size < before ? 0 : payload.size - before;
  const WritableBytes beginning(bytes.data(), std::min(size, bytes.size()));
  const gateway::dds::ArrivedSample sample(payload);
  if (!sample.copy(std::min<std::size_t>(before, payload.size), beginning) ||
      !read_header(beginning, size, header_)) {
    ++counts_.unreadable;
    return;
  }
  const StreamEvent event{header_.number,
                          header_.sequence,
                          has_sample(header_.kind),
                          header_.is_deactivated,
                          header_.kind == EventKind::kWithheld,
                          header_.token_of(me_) == 0};
  if (writer.handle != writer_) {  // one speaker: others are not heard
    remember(writer.handle, event);
    return;
  }
  if (header_.exporter != obeyed_) {
    ++counts_.unreadable;  // its own card says otherwise
    return;
  }
  const std::size_t header_and_before = before + header_bytes(header_);
  if (header_.kind == EventKind::kAgain && stream_.completes(header_.exporter, header_.number)) {
    complete(payload, header_and_before);
    return;
  }
  if (stream_.note(header_.exporter, event)) arrive(payload, header_and_before);
}

void Import::remember(std::uint64_t writer, const StreamEvent& event) noexcept {
  const auto found = std::find_if(unheard_.begin(), unheard_.end(),
                                  [&](const Unheard& each) { return each.writer == writer; });
  if (found != unheard_.end()) {
    *found = {writer, header_.exporter, event};
  } else if (unheard_.size() < kMaxUnheard) {
    unheard_.push_back({writer, header_.exporter, event});
  }
}

shm::Nanoseconds Import::time_left() const {
  return tokens_.time_left(header_.token_of(me_), max_age_.load(std::memory_order_relaxed),
                           time_with_sleep());
}

void Import::arrive(const gateway::dds::Payload& payload, std::size_t before) {
  if (header_.kind == EventKind::kWithheld) ++counts_.withheld;
  if (!port_) {
    if (has_sample(header_.kind)) ++counts_.too_soon;
    return;
  }
  if (header_.is_deactivated) {
    awaits_sample_ = false;
    // A state that says it once more would end what another one has begun since.
    const bool is_due = stream_.take_end();
    if (is_due || header_.kind == EventKind::kDeactivation) port_->deactivate();  // never too late
    return;
  }
  if (header_.kind == EventKind::kState) return;
  // Read first: if this thread is held up before the other clock is read, less is left, not more.
  const shm::Nanoseconds now = shm::monotonic_now();
  const bool is_alone = header_.kind == EventKind::kWithheld;
  if (is_alone && !demand_.believes_header(max_age_.load(std::memory_order_relaxed), now)) {
    ++counts_.unbelieved;
    return;
  }
  const shm::Nanoseconds left = time_left();
  // A deadline that has passed, where nothing is left: the port counts it, too.
  const Time deadline(std::chrono::nanoseconds(left < 0 ? -1 : now + left));
  const std::optional<Outcome> outcome = brings_sample(header_.kind) && left >= 0
                                             ? publish(payload, before, deadline)
                                             : port_->signal(deadline, origin());
  if (!outcome) return;
  if (outcome->late) {
    ++counts_.late;
    return;
  }
  if (header_.kind == EventKind::kUnsent) ++counts_.without_sample;
  if (has_sample(header_.kind)) awaits_sample_ = is_alone;
  demand_.note_arrival(port_->wants_samples(), now);
  say_demand();
}

Origin Import::origin() const noexcept { return {header_.exporter, header_.sequence}; }

std::optional<Outcome> Import::publish(const gateway::dds::Payload& payload, std::size_t before,
                                       Time deadline) {
  const std::uint64_t no_memory = counts_.no_memory;
  if (auto sample = sample_in(payload, before))
    return port_->publish(std::move(*sample), deadline, origin());
  // The source goes on, though nobody can have the sample.
  if (counts_.no_memory != no_memory) return port_->signal(deadline, origin());
  return std::nullopt;
}

void Import::say_demand() {
  if (demanding_ == 0 || demand_.demand() == said_demand_) return;
  if (demands_.tell(demanding_, {me_, demand_.demand()})) said_demand_ = demand_.demand();
}

void Import::complete(const gateway::dds::Payload& payload, std::size_t before) {
  const bool is_awaited = std::exchange(awaits_sample_, false);
  // Another host has asked for it.
  if (!is_awaited || !port_ || demand_.demand() != Demand::kSamples) return;
  const shm::Nanoseconds now = shm::monotonic_now();  // first, as in arrive()
  const shm::Nanoseconds left = time_left();
  const Time deadline(std::chrono::nanoseconds(left < 0 ? -1 : now + left));
  auto sample = sample_in(payload, before);
  if (sample && port_->publish_signalled(std::move(*sample), deadline, origin()).late)
    ++counts_.late;
}

std::optional<Loan<void>> Import::sample_in(const gateway::dds::Payload& payload,
                                            std::size_t before) {
  if (header_.type_revision != revision_) {
    ++counts_.too_soon;  // the port is opened again for it
    return std::nullopt;
  }
  auto loan = port_->loan(header_.length);
  if (!loan) {
    const bool fits = header_.length == port_->max_size() ||
                      (header_.length < port_->max_size() && !port_->type().has_one_size());
    ++(fits ? counts_.no_memory : counts_.unreadable);
    return std::nullopt;
  }
  if (gateway::dds::ArrivedSample(payload).copy(before, **loan)) return loan;
  ++counts_.unreadable;
  return std::nullopt;
}

}  // namespace arbiter::link
