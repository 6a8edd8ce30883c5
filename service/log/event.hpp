// What a line of the log is about, for those who filter it: one of a few kinds, and whom and what
// it names. Only the journal keeps this (journal.hpp); elsewhere a line is its text.
//
// docs/log.md lists the kinds and the fields.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "service/log/log.hpp"

namespace arbiter::service {

enum class EventKind : std::uint8_t {
  kReady,
  kStopping,
  kOpened,
  kClosed,
  kLeft,
  kDied,
  kAway,
  kBack,
  kRefused,
  kTurnedAway,
  kGivenUp,
  kMismatch,
  kUnmentioned,
  kBlind,
  kDeactivated,
  kTakeover,
  kStarted,
  kReloaded,
  kSwitched,
  kRolledBack,
  kChangeRefused,
};

struct EventName {
  EventKind kind;
  const char* name;        // ARBITER_EVENT
  const char* message_id;  // MESSAGE_ID: 128 bits, chosen at random once and never changed
};
inline constexpr std::size_t kEventKinds = 21;
extern const std::array<EventName, kEventKinds> event_names;  // in the order of the kinds

// The names are the caller's, and must live until the line is written.
struct Event {
  EventKind kind;
  std::vector<std::string_view> components{};  // nodes
  std::vector<std::string_view> sources{};     // output ports
  std::vector<std::string_view> ports{};       // input ports
  std::uint64_t generation = 0;                // of a model; 0: it is about none
};

// For the text of a line: its one port, or how many ports it names: "/Arm/pos:i", "3 ports".
[[nodiscard]] std::string ports_text(const Event& event);

// While it lives, what this thread logs is about that event.
class EventScope {
 public:
  explicit EventScope(const Event& event) noexcept;
  EventScope(const EventScope&) = delete;
  EventScope& operator=(const EventScope&) = delete;
  ~EventScope();

  // Null: about none.
  [[nodiscard]] static const Event* current() noexcept;

 private:
  const Event* outer_;
};

template <class... Args>
void log_event(const Event& event, log::level::level_enum level,
               log::format_string_t<Args...> format, Args&&... args) {
  const EventScope scope(event);
  log::log(level, format, std::forward<Args>(args)...);
}

}  // namespace arbiter::service
