// The daemon: hosts the memory that all share, loads models, introduces components to each
// other.
//
// One thread, one epoll. It is off the data path: what it does slowly makes nobody publish slowly.
//
//   daemon.cpp           the loop
//   daemon_clients.cpp   who connects and who leaves
//   daemon_requests.cpp  what they ask
//   daemon_ports.cpp     ports that open and close
//   daemon_pages.cpp     sources that pass from one user to another
// What a predecessor has left is Takeover's, another model in force ModelChanges's.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "service/clients/barriers.hpp"
#include "service/clients/clients.hpp"
#include "service/clients/gate.hpp"
#include "service/clients/in_flight.hpp"
#include "service/clients/lobby.hpp"
#include "service/clients/status_requests.hpp"
#include "service/clients/turns.hpp"
#include "service/kept/registry.hpp"
#include "service/models/board.hpp"
#include "service/models/model_changes.hpp"
#include "service/policy/shares.hpp"
#include "service/ports/introductions.hpp"
#include "service/ports/observers.hpp"
#include "service/ports/port_names.hpp"
#include "service/ports/refusals.hpp"
#include "service/ports/switchboard.hpp"
#include "service/takeover/takeover.hpp"
#include "service/watchdog.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::service {

struct DaemonOptions {
  std::vector<NamedFiles> models;     // the first is put in force at the start
  std::string instance;               // checked
  std::string directory;              // where to listen
  std::optional<std::string> policy;  // a file; without one the default policy holds
  bool is_strict = false;             // takes warnings for errors, in all that it reads
  // How much of what all share one user may have, in percent of what is left
  // (service/policy/shares.hpp).
  unsigned user_share = Shares::kDefaultPercent;
  // Whether the service manager keeps descriptors for the next daemon.
  bool uses_descriptor_store = false;
  std::uint64_t steps = rules::Budget::kSteps;  // that the proof of a model may take
  // Where it becomes readable while the first models are proved, this stops; -1: nowhere.
  int stop_descriptor = -1;
  Compiler::Thread compiles_in = Compiler::Thread::kOfItsOwn;
  // For tests: is called in the compiler's thread before files are read.
  std::function<void(std::stop_token)> before_reading{};
};

class Daemon final : private Takeover::Host {
 public:
  // Loads the model and listens. Throws BadModel, std::runtime_error, rules::Stopped.
  explicit Daemon(const DaemonOptions& options);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon() override;

  // Serves until stop_descriptor is readable. SIGHUP and SIGTERM come by signalfd, see main.cpp.
  void run(int signal_descriptor);

  [[nodiscard]] const std::string& path() const { return listener_.path; }

 private:
  enum class Tag : std::uint32_t { kListener, kSignals, kClient, kProcess, kAbsentee, kCompiler };

  // The loop (daemon.cpp).
  void watch(int fd, Tag tag, ClientId client, std::uint32_t events);
  // One that is closed later, or by somebody else.
  void unwatch(int fd) const noexcept;
  [[nodiscard]] int timeout_ms() const;
  // True: stop.
  bool handle_signal(int signal_descriptor);
  [[nodiscard]] bool hear(int signal_descriptor);
  void hear_client(ClientId id, std::uint32_t events);
  void hear_death(ClientId id);
  void give_turns();
  void watch_client(Client& client);
  // After an event of its, which ends the watching.
  void watch_heard(Client& client);
  // What is owed to strangers' descriptors and to the service manager, once in each round.
  void look_after_the_loop(shm::Nanoseconds now);
  // Handles what it has sent, a bounded part of it: others wait too. True: there may be more.
  bool serve(Client& client);
  void retry(Client& client);
  void handle_or_refuse(Client& client, wire::Received& received, shm::Nanoseconds deadline);
  // Once for a component that asks again and again.
  void log_refusal(const Client& client, const wire::Message& request, const std::string& why);
  // Those that are to be tried again are in the next turns of who asked.
  void retry_postponed(shm::Nanoseconds now);
  void settle();

  // Who connects and who leaves (daemon_clients.cpp).
  void accept_clients();
  void admit_clients();
  void turn_away_client();
  void leave_listener_alone();
  void drop(ClientId id) override;
  void close_all(Client& client) override;
  void log_end_of(const Client& client, bool is_away);
  void drop_oldest_silent_client();
  // That it is waited for no longer, for the log.
  void note_late(ClientId id, shm::Nanoseconds now);
  void look_in_flight(shm::Nanoseconds now);
  void plan_to_look_in_flight();

  // What clients ask (daemon_requests.cpp).
  void handle(Client& client, wire::Received& received);
  // False: it is not for the takeover.
  bool hand_back(Client& client, wire::Received& received);
  // False: it is about no change of the model.
  bool change_model(Client& client, const wire::Message& message);
  void ask_for_reload(Client& client, const wire::Message& message);
  void ask_for_switch(Client& client, const wire::Message& message);
  void hello(Client& client, const wire::Received& received);
  void welcome(Client& client) override;
  void say_whether_may(Client& client, const wire::Message& message);
  void answer_status(shm::Nanoseconds now);
  void send_model(Client& client, std::uint64_t request);

  // Ports and sources (daemon_ports.cpp, daemon_pages.cpp).
  void open_output(Client& client, wire::Received& received);
  void finish_opening(Client& client, std::uint64_t request, std::unique_ptr<OutputPort> port,
                      Source& source);
  void open_input(Client& client, wire::Received& received);
  void close_port(const Client& client, shm::PortInstance port);
  void open_tap(Client& client, wire::Received& received);
  void connect(Client& client, std::uint64_t request, shm::PortInstance port);
  void deactivate(Client& client, const wire::Message& message);
  // The live component that has the name; null: nobody. One that has closed its port, or has ended,
  // before `asking` asked, has not.
  Client* find_holder(const Client& asking, shm::PortInstance holder);
  // Throws std::runtime_error if there is one.
  void require_free(const Client& asking, shm::PortInstance holder, const std::string& what);
  // The same where an output port is to be opened; a holder that yields to it is asked to go, and
  // NotYet is thrown.
  void require_yielded(const Client& asking, Source& source, bool yields);
  void remove_port(shm::PortInstance port);
  // Throws NotYet.
  void require_not_changing(const Source& source) const;
  // Calls `changed` once another page is in force, which `user` may be given, or nobody; not if the
  // client has gone by then. Where it throws, the request is refused.
  void change_page(Source& source, const Client& client, std::uint64_t request, PageUser user,
                   std::function<void(Source&, Client&)> changed);
  // Whether somebody else can write the page, whom an operator may have to hold it against.
  [[nodiscard]] bool may_undo(const Source& source) const;
  bool end_activity(const Source& source);

  // What a takeover asks.
  void watch_absentee(const shm::FileDescriptor& process, NodeId node) override;
  void try_postponed() override { try_postponed_ = true; }
  // Whether newcomers and questions are served: not before it is decided which model is in force,
  // or a port that opens meanwhile would be told that no model mentions it.
  [[nodiscard]] bool serves() const { return takeover_.is_over() && changes_.has_settled(); }
  [[nodiscard]] bool has_links_ahead() const override { return changes_.has_links_ahead(); }
  void begin_to_serve(bool is_fresh) override { changes_.start(is_fresh); }

  const std::string instance_;
  Gate gate_;
  Shares shares_;
  Registry registry_;
  PortNames names_;
  Board board_{names_, registry_};
  Switchboard switchboard_{names_, registry_};
  Barriers barriers_;
  Introductions introductions_{switchboard_, barriers_};
  Refusals refusals_;
  wire::Listener listener_;
  shm::FileDescriptor epoll_;
  // Not before: there was no descriptor even to turn a client away, or no memory to accept one.
  shm::Nanoseconds listen_again_at_ = shm::kForever;
  bool cannot_accept_ = false;  // the log has why
  Lobby lobby_;
  std::vector<Postponed> postponed_;
  bool try_postponed_ = false;  // something has changed that they wait for
  LeftUnread left_unread_;
  // When to look again who has read: somebody is to be sent something, or has left something
  // unread.
  shm::Nanoseconds look_in_flight_at_ = shm::kForever;
  Watchdog watchdog_;
  Clients clients_;
  ClientId last_client_ = 0;
  Turns turns_;
  Observers observers_;
  bool is_more_to_tell_ = false;  // to observers
  StatusRequests status_requests_;
  shm::Nanoseconds give_back_at_ = shm::kForever;
  bool stop_wanted_ = false;
  Takeover takeover_;
  ModelChanges changes_;  // last: the compiler's job ends before anything else does
};

}  // namespace arbiter::service
