// A running instance, watched: its board and activity pages, the names of its ports, its status,
// its model. For tools, recorders, pages and gateways.
//
// A watcher is no component: it has no ports, the daemon keeps no name for it, and neither reloads
// nor components ever wait for it. What decides is read where the decisions read it, in memory that
// is mapped read-only; the daemon is only asked for what it alone knows.
//
// Daemons come and go. While there is none, what was decided last goes on, and can be watched. A
// daemon that takes over has the same memory. Where one comes with memory of its own, memory() is
// another from then on; whoever still holds the old one sees what the old one's components do.
//
// Threads: none is started, and one thread at a time may use an Instance. Whatever the daemon says
// waits until update() is called; ask() calls it too. Pictures of memory() may be taken by any
// thread meanwhile.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "shm/decision_memory.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/ids.hpp"
#include "wire/call.hpp"
#include "wire/messages.hpp"
#include "wire/status.hpp"

namespace arbiter::watch {

class Instance {
 public:
  // Joins the caller's instance; returns when all pages and names that there are have come. Throws
  // wire::CallError where there is no daemon or it does not let us observe; std::system_error where
  // memory or descriptors are short.
  explicit Instance(wire::Caller caller);
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;

  [[nodiscard]] const std::string& name() const noexcept { return caller_.instance; }
  // Readable when update() has something to do, and when another model has come into force.
  [[nodiscard]] int descriptor() const noexcept { return epoll_.get(); }
  // Takes up what the daemon has said, and looks for another where it has gone, twenty times a
  // second. Does not wait; a daemon that is stopped may hold it up for a second, once.
  void update();

  // False: the last one has gone, and no other has let us in yet.
  [[nodiscard]] bool has_daemon() const noexcept { return standing_ == Standing::kIn; }
  // Counts the daemons that have let us in.
  [[nodiscard]] std::uint64_t daemons() const noexcept { return daemons_; }

  [[nodiscard]] const std::shared_ptr<const shm::DecisionMemory>& memory() const noexcept {
    return shared_;
  }
  // Of all input ports that anybody has named; of those of one name the last.
  [[nodiscard]] const std::map<shm::PortId, std::string>& port_names() const noexcept {
    return port_names_;
  }
  // Nothing: nobody has named it. What was closed and opened again may have another id since.
  [[nodiscard]] std::optional<shm::PortId> find_port(std::string_view name) const;
  [[nodiscard]] std::optional<shm::SourceId> find_source(std::string_view name) const;

  // The answer to a question that changes nothing; where the daemon goes meanwhile, that of the
  // next. Throws wire::CallError where it refuses, or none answers within the caller's answer_time.
  wire::Received ask(const wire::Message& question);
  // Returns when all pages and names have come that the daemon had when it was asked: those of the
  // model in force among them. Throws as ask().
  void catch_up();
  // Throws wire::CallError, wire::DocumentError.
  wire::Status status();

 private:
  using Clock = std::chrono::steady_clock;
  enum class Standing : std::uint8_t { kIn, kGreeting, kAlone };

  void take_up_memory(wire::Received& welcome);
  void handle(wire::Received& received);
  void add_page(wire::Received& received);
  void add_port_name(shm::PortId id, std::string name);
  void look_for_daemon();
  void be_greeted(wire::Received& welcome);
  void lose_daemon(Clock::duration look_again_in);
  [[nodiscard]] bool watch_socket() const;
  void ring_timer_every(Clock::duration time) const;
  // False: the conversation is over.
  [[nodiscard]] bool say(const wire::Message& message) const;

  const wire::Caller caller_;
  shm::FileDescriptor epoll_;
  shm::FileDescriptor timer_;  // rings while there is no daemon, to look for one
  shm::FileDescriptor socket_;
  Standing standing_ = Standing::kAlone;
  std::uint64_t daemons_ = 0;
  shm::Nanoseconds greeted_ = 0;  // when another daemon was
  std::shared_ptr<shm::DecisionMemory> memory_;
  std::shared_ptr<const shm::DecisionMemory> shared_;  // the same
  std::map<shm::PortId, std::string> port_names_;
  std::map<std::string, shm::PortId, std::less<>> port_ids_;
  std::map<std::string, shm::SourceId, std::less<>> source_ids_;
  std::uint64_t last_request_ = 0;
  std::uint64_t asked_ = 0;               // the question that is to be answered
  std::optional<wire::Received> answer_;  // to it
};

}  // namespace arbiter::watch
