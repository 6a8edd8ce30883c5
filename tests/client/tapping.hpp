// Reading a tap until something has come.
#pragma once

#include <chrono>
#include <optional>
#include <utility>

#include <arbiter/arbiter.hpp>

namespace arbiter::test {

inline constexpr auto kForever = std::chrono::hours::max();

// The next event that is about an arrival or a deactivation.
template <class T>
std::optional<TapEvent<T>> next_of(Tap<T>& tap) {
  while (auto event = tap.take()) {
    if (event->kind() == TapEventKind::sample || event->kind() == TapEventKind::signal ||
        event->kind() == TapEventKind::deactivation) {
      return event;
    }
  }
  return std::nullopt;
}

// Passes over events until one of that kind.
template <class T>
TapEvent<T> wait_for_kind(Tap<T>& tap, TapEventKind kind) {
  for (;;) {
    auto event = tap.wait_for(kForever);
    if (event && event->kind() == kind) return std::move(*event);
  }
}

// Publishes signals until the tap sees its source. A component has 0.2 s to take a tap in, and may
// need more for large samples on a machine that is busy.
template <class Port, class T>
void wait_until_watched(Port& out, Tap<T>& tap) {
  do {
    out.signal();
  } while (!tap.take());
  while (tap.take()) {
  }
}

}  // namespace arbiter::test
