// What the verbs that talk to a running daemon have in common.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "shm/activity.hpp"
#include "shm/decision_memory.hpp"
#include "shm/file_descriptor.hpp"
#include "watch/daemon_presence.hpp"
#include "watch/instance.hpp"
#include "wire/call.hpp"
#include "wire/status.hpp"

namespace CLI {
class App;
}

namespace arbiter::cli {

// --instance.
void add_instance_option(CLI::App& verb, std::string& instance);

// How long a verb looks for a daemon before it says that there is none.
inline constexpr std::chrono::milliseconds kConnectTimeout{300};

// Of a component. Notices go to standard error. Throws std::invalid_argument where that is no name
// for an instance, as caller() does.
NodeOptions live_options(const std::string& instance);

// Says hello as "arbiter-VERB", and on standard error whom it waits for.
wire::Caller caller(const std::string& verb, const std::string& instance);

// The instance, watched. Throws wire::CallError.
std::shared_ptr<watch::Instance> watch_instance(const std::string& verb,
                                                const std::string& instance);
// The same for a verb that goes on until it is interrupted: a question holds it up for a second at
// most, or for less, for meanwhile it does not hear Ctrl-C.
inline constexpr std::chrono::milliseconds kMostHeldUp{1000};
std::shared_ptr<watch::Instance> follow_instance(
    const std::string& verb, const std::string& instance,
    std::chrono::milliseconds most = kMostHeldUp,
    std::chrono::milliseconds patience = kConnectTimeout);

// Says on standard error that the daemon has gone, and that one is there again.
class DaemonNews {
 public:
  // `goes_on`: what the verb does with the last decisions meanwhile, as in "following".
  explicit DaemonNews(std::string goes_on) : goes_on_(std::move(goes_on)) {}
  void tell(const watch::Instance& instance);

 private:
  const std::string goes_on_;
  watch::DaemonPresence presence_;
};

// How often a verb that follows decisions looks, beside the times at which it knows that an
// activity ends: publishers do not ring for those who merely observe.
inline constexpr shm::Nanoseconds kLookEvery = 2'000'000;

// For verbs that ask the daemon once for each model that comes into force.
class ModelNews {
 public:
  struct Model {
    std::shared_ptr<const shm::DecisionMemory> memory;
    std::uint64_t generation = 0;
    friend bool operator==(const Model&, const Model&) = default;
  };
  // The one in force; nothing: it is the one that was noted, no daemon is there, or none has
  // answered lately.
  [[nodiscard]] std::optional<Model> unknown(const watch::Instance& instance) const;
  [[nodiscard]] static Model in_force(const watch::Instance& instance);
  void note(Model model) { noted_ = std::move(model); }
  // The daemon has not answered, and nothing else was done meanwhile: it is asked again later.
  void put_off();

 private:
  Model noted_;
  shm::Nanoseconds ask_again_ = 0;
};

// The daemon's status document, as text. Throws wire::CallError, wire::DocumentError.
std::string fetch_status_text(const std::string& verb, const std::string& instance);
wire::Status fetch_status(const std::string& verb, const std::string& instance);
wire::Status fetch_status(wire::Caller caller, std::chrono::milliseconds answer_time);

// SIGINT, SIGTERM and, unless it is ignored, SIGHUP as a descriptor, so that a stream ends with its
// summary, also where the terminal has gone. Call before threads start.
shm::FileDescriptor catch_interrupts();

// For a verb that was stopped before it was done: 128 plus the signal's number, which is what a
// shell reports for a program that the signal has ended. `interrupts` is readable.
[[nodiscard]] int interrupted_exit_code(const shm::FileDescriptor& interrupts);

// Spans may be longer than time is.
[[nodiscard]] constexpr shm::Nanoseconds time_after(shm::Nanoseconds start, shm::Nanoseconds span) {
  return span >= shm::kForever - start ? shm::kForever : start + span;
}

// Sleeps until `time` on CLOCK_MONOTONIC, or until `interrupts` is readable; true: it is.
bool sleep_until(shm::Nanoseconds time, const shm::FileDescriptor& interrupts);

// 1 500 000 000 -> "1.500 s".
std::string seconds_text(shm::Nanoseconds span);

}  // namespace arbiter::cli
