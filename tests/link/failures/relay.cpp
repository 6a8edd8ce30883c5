#include "tests/link/failures/relay.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>

#include "tests/link/failures/network.hpp"

namespace arbiter::failures {
namespace {

constexpr int kMostAtOnce = 64;  // frames of one host before the next one's
constexpr std::size_t kSmallestFrame = 14;

}  // namespace

Relay::Relay(std::uint64_t seed)
    : random_(seed), wake_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)), thread_([this] { run(); }) {}

Relay::~Relay() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.get(), &one, sizeof one));
  thread_.join();
}

void Relay::connect(unsigned host, int cable) {
  {
    const std::lock_guard lock(mutex_);
    cables_[host] = cable;
  }
  const std::uint64_t one = 1;
  static_cast<void>(!::write(wake_.get(), &one, sizeof one));
}

void Relay::set(unsigned from, unsigned to, const Fault& fault) {
  const std::lock_guard lock(mutex_);
  faults_[{from, to}] = fault;
}

Passed Relay::passed() const {
  const std::lock_guard lock(mutex_);
  return passed_;
}

void Relay::run() {
  int patience = -1;
  for (std::vector<pollfd> ends;;) {
    {
      const std::lock_guard lock(mutex_);
      ends.assign(1, {wake_.get(), POLLIN, 0});
      for (const auto& [host, cable] : cables_) ends.push_back({cable, POLLIN, 0});
    }
    static_cast<void>(::poll(ends.data(), ends.size(), patience));
    std::uint64_t rings = 0;
    static_cast<void>(!::read(wake_.get(), &rings, sizeof rings));
    const std::lock_guard lock(mutex_);
    if (ends_) return;
    for (const auto& [host, cable] : cables_) take_from(host, cable);
    patience = pass_late_ones();
  }
}

void Relay::take_from(unsigned host, int cable) {
  std::array<unsigned char, 2048> frame;
  for (int i = 0; i < kMostAtOnce; ++i) {
    const ssize_t size = ::read(cable, frame.data(), frame.size());
    if (size < static_cast<ssize_t>(kSmallestFrame)) return;  // there is none, or it is down
    const unsigned receiver = receiver_of(frame.data());
    for (const auto& [other, its_cable] : cables_) {
      if (other == host || (receiver != 0 && receiver != other)) continue;
      send(host, other, frame.data(), static_cast<std::size_t>(size));
    }
  }
}

void Relay::send(unsigned from, unsigned to, const unsigned char* frame, std::size_t size) {
  const Fault fault = faults_[{from, to}];
  ++passed_.frames;
  if (happens(fault.lost)) {
    ++passed_.lost;
    return;
  }
  const std::uint64_t order = ++order_;
  const bool is_double = happens(fault.doubled);
  passed_.doubled += is_double ? 1 : 0;
  for (int copies = is_double ? 2 : 1; copies > 0; --copies) {
    if (!happens(fault.delayed)) {
      deliver(from, to, order, frame, size);
      continue;
    }
    ++passed_.delayed;
    const auto most = static_cast<std::uint32_t>(std::max<Nanoseconds>(fault.delay / 1000, 1));
    const Nanoseconds delay = fault.is_even ? fault.delay : Nanoseconds{random_.below(most)} * 1000;
    late_.push({now() + delay, order, from, to, {frame, frame + size}});
  }
}

void Relay::deliver(unsigned from, unsigned to, std::uint64_t order, const unsigned char* frame,
                    std::size_t size) {
  if (faults_[{from, to}].is_cut) {
    ++passed_.cut;
    return;
  }
  std::uint64_t& newest = newest_[{from, to}];
  passed_.overtaken += order < newest ? 1 : 0;
  newest = std::max(newest, order);
  const auto cable = cables_.find(to);
  // A host that does not take its frames loses them, as at any switch.
  if (cable != cables_.end()) static_cast<void>(!::write(cable->second, frame, size));
}

int Relay::pass_late_ones() {
  while (!late_.empty()) {
    const Nanoseconds left = late_.top().due - now();
    if (left > 0) return static_cast<int>(left / 1'000'000) + 1;
    const Late& first = late_.top();
    deliver(first.from, first.to, first.order, first.frame.data(), first.frame.size());
    late_.pop();
  }
  return -1;
}

}  // namespace arbiter::failures
