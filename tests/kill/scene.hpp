// What surrounds a component that kills itself: survivors with ports to and from it, and what must
// still be so when it is dead.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/kill/number.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/segments.hpp"

namespace arbiter::test {

// The victim, in a process of its own (victim_main.cpp).
class Victim {
 public:
  Victim(const std::string& phase, std::uint64_t fatal);

  // Returns when it is about to begin.
  void prepare();
  void go();
  // Returns when it has done so, true, or has ended.
  bool has_opened() { return read_line() == "open"; }
  // True if it has come through unharmed; then it lives still.
  bool is_unharmed();
  // It has ended, one way or the other, or sleeps in wait_for().
  void wait_until_it_polls_or_ends();
  void kill() { process_.kill(); }
  [[nodiscard]] pid_t pid() const { return process_.pid(); }

 private:
  std::string read_line();

  shm::FileDescriptor say_;
  shm::FileDescriptor hear_;
  ChildProcess process_;
};

class Scene {
 public:
  Scene();

  // Ports anew, with not one slot more than they need. `kept`: the victim comes with its two ports.
  void open_survivors();
  void close_survivors();

  // Taps the victim's output port: from here on what it does is seen, to its end.
  void watch() { tap_.emplace(node_->tap<Number>("/victim:o")); }

  // The victim is dead: everything that must be so.
  void require_all_is_well(const OwnSegments& dead, const shm::Activity& before);
  // It had a tap of /first:o: as many as there may be at all can be opened, for its place, and what
  // it held, are free again.
  void require_taps_fit();

  [[nodiscard]] shm::Activity& page() { return page_.as<shm::ActivityPage>()->of(source_id_); }
  OutputPort<Number>& first() { return *first_; }
  OutputPort<Number>& second() { return *second_; }
  InputPort<Number>& in() { return *in_; }
  // The longest time from a death until a successor had both names.
  [[nodiscard]] std::chrono::microseconds slowest_succession() const { return slowest_; }

 private:
  struct Successor {
    Node node{"successor"};
    std::optional<OutputPort<Number>> out;
    std::optional<InputPort<Number>> in;
  };
  void meet_daemon();
  void require_survivors_go_on();
  void require_tap_was_told();
  void require_page_is_sane(const shm::Activity& before);
  void succeed(Successor& successor);
  void require_successor_works(Successor& successor);
  void require_no_slot_is_lost(Successor& successor);
  void require_accounts_balance(const OwnSegments& dead);
  std::string imbalance(std::uint64_t accepted_from_dead);
  void drain();

  Daemon daemon_;
  RawClient observer_;
  shm::Mapping page_;  // of the victim's source
  std::uint32_t port_id_ = shm::kNone;
  shm::SourceId source_id_ = shm::kNone;
  std::optional<Node> node_;
  std::optional<OutputPort<Number>> first_;
  std::optional<OutputPort<Number>> second_;
  std::optional<InputPort<Number>> in_;
  std::optional<Tap<Number>> tap_;
  std::chrono::steady_clock::time_point died_at_;
  std::chrono::microseconds slowest_{0};
};

}  // namespace arbiter::test
