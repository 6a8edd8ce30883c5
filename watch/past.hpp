// What a status remembers of a port that nobody has open: who died with it, and who was refused it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "wire/status.hpp"

namespace arbiter::watch {

// By which end of a port it is found what has become of it.
struct PortEnd {
  std::optional<std::string> wire::RefusalStatus::*refused;
  std::vector<std::string> wire::DeathStatus::*left_open;
};
inline constexpr PortEnd kOutputEnd{&wire::RefusalStatus::output, &wire::DeathStatus::outputs};
inline constexpr PortEnd kInputEnd{&wire::RefusalStatus::input, &wire::DeathStatus::inputs};

// The model mentions it, and nobody has it open, nor is it kept for somebody. Null: nobody knows
// it.
[[nodiscard]] bool is_vacant(const auto* port) {
  return port != nullptr && port->mentioned && !port->open && !port->away_pid;
}

// Who had the port open last and died; null: nobody, as far as the daemon remembers.
[[nodiscard]] const wire::DeathStatus* death_of(const wire::Status& status, const PortEnd& end,
                                                const std::string& port);

// "gaze-control (pid 4711) had it open, and died 3 s ago". `now`: on the clock of that status;
// nothing: it does not say it.
[[nodiscard]] std::string death_text(const wire::DeathStatus& death,
                                     std::optional<shm::Nanoseconds> now);

// Whether whoever kept the port from those who asked for it then has died since.
[[nodiscard]] bool has_died_since(const wire::Status& status, const PortEnd& end,
                                  const wire::RefusalStatus& refusal);

// Who has asked for the port in vain last; null: nobody, or only while another had it who has died.
[[nodiscard]] const wire::RefusalStatus* refusal_of(const wire::Status& status, const PortEnd& end,
                                                    const std::string& port);

}  // namespace arbiter::watch
