// The daemon: hosts the shared memory's directory, loads models, introduces components to each
// other.
//
// One thread, one epoll. It is off the data path: what it does slowly makes nobody publish slowly.
//
//   daemon.cpp           the loop, and clients that come and go
//   daemon_requests.cpp  what they ask
//   daemon_pages.cpp     sources that pass from one user to another
//   daemon_reload.cpp    another model, or policy: reload, switch, rollback
//   daemon_takeover.cpp  what a predecessor has left
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <stop_token>
#include <string>
#include <vector>

#include "service/barriers.hpp"
#include "service/changes.hpp"
#include "service/client.hpp"
#include "service/compiler.hpp"
#include "service/continuity.hpp"
#include "service/directory.hpp"
#include "service/gate.hpp"
#include "service/history.hpp"
#include "service/in_flight.hpp"
#include "service/inheritance.hpp"
#include "service/library.hpp"
#include "service/lobby.hpp"
#include "service/model_copy.hpp"
#include "service/models.hpp"
#include "service/observers.hpp"
#include "service/preparation.hpp"
#include "service/registry.hpp"
#include "service/shares.hpp"
#include "service/status_requests.hpp"
#include "service/strangers.hpp"
#include "service/switchboard.hpp"
#include "service/turns.hpp"
#include "service/watchdog.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::service {

// How long a component that does not run may hold up the opening of a port, or a new model.
constexpr shm::Nanoseconds kMaxWaitForClients = 200'000'000;
// How long after a connection was made the publisher's other receivers are told that it uses more
// memory: so long that they are told once of many.
constexpr shm::Nanoseconds kShowGrowthAfter = 250'000'000;

struct DaemonOptions {
  std::vector<NamedFiles> models;     // the first is put in force at the start
  std::string instance;               // checked
  std::string directory;              // where to listen
  std::optional<std::string> policy;  // a file; without one the default policy holds
  bool is_strict = false;             // takes warnings for errors, in all that it reads
  // How much of what all share one user may have, in percent of what is left (service/shares.hpp).
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

// A request that cannot be served yet, and why; it is tried again, at `deadline` for the last time.
class NotYet : public std::runtime_error {
 public:
  NotYet(const std::string& why, shm::Nanoseconds until)
      : std::runtime_error(why), deadline(until) {}
  const shm::Nanoseconds deadline;
};

// A refusal that the log has already.
class RefusedAgain : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Daemon {
 public:
  // Loads the model and listens. Throws BadModel, std::runtime_error, rules::Stopped.
  explicit Daemon(const DaemonOptions& options);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon();

  // Serves until stop_descriptor is readable. SIGHUP and SIGTERM come by signalfd, see main.cpp.
  void run(int signal_descriptor);

  [[nodiscard]] const std::string& path() const { return listener_.path; }

  // A change of the model, from when it is prepared until those who asked are answered.
  struct Swap {
    Change change;
    Findings findings;
    LoadedModel to;
    std::string how;               // as in the history
    std::uint64_t content = 0;     // likewise
    std::string changes = "null";  // of what was in force before: as Reading::changes
    // Of a rollback: to where.
    std::optional<PastModel> back_to{};
    // Of a reload: what else changes with it.
    std::optional<Library> library{};
    std::optional<Policy> policy{};
  };

 private:
  enum class Tag : std::uint32_t { kListener, kSignals, kClient, kProcess, kAbsentee, kCompiler };

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
  void accept_clients();
  void admit_clients();
  void turn_away_client();
  // What is owed to strangers' descriptors and to the service manager, once in each round.
  void look_after_the_loop(shm::Nanoseconds now);
  void look_in_flight(shm::Nanoseconds now);
  void plan_to_look_in_flight();
  // Throws std::length_error where there is no room for another.
  Charge make_room_for(const Client& newcomer, NodeId returning);
  void drop_oldest_silent_client();
  // Handles what it has sent, a bounded part of it: others wait too. True: there may be more.
  bool serve(Client& client);
  void drop(ClientId id);
  void settle();

  void retry(Client& client);
  void handle_or_refuse(Client& client, shm::Received& received, shm::Nanoseconds deadline);
  void handle(Client& client, shm::Received& received);
  void hello(Client& client, const shm::Received& received);
  void open_output(Client& client, shm::Received& received);
  void finish_opening(Client& client, std::uint64_t request, std::unique_ptr<OutputPort> port,
                      Source& source);
  void open_input(Client& client, shm::Received& received);
  void connect(Client& client, std::uint64_t request, shm::PortInstance port);
  void introduce(const Switchboard::Told& told, std::function<void()> passed);
  void close_port(Client& client, shm::PortInstance port);
  void answer_status(shm::Nanoseconds now);
  static shm::FileDescriptor make_document(const std::string& document);
  void send_model(Client& client, std::uint64_t request);
  void deactivate(Client& client, const shm::Message& message);
  void refuse(Client& client, std::uint64_t request, const std::string& why);
  // Throws std::runtime_error if a live component has the name. One that has closed its port, or
  // has ended, before `asking` asked, has not.
  void require_free(const Client& asking, shm::PortInstance holder, const std::string& what);
  // The same of one that is away. Throws NotYet.
  void require_not_kept(shm::PortInstance holder, const std::string& what);

  // Pages that are replaced (daemon_pages.cpp).

  // Throws NotYet.
  void require_not_changing(const Source& source) const;
  // Calls `changed` once another page is in force, which `user` may be given, or nobody; not if the
  // client has gone by then. Where it throws, the request is refused.
  void change_page(Source& source, const Client& client, std::uint64_t request, PageUser user,
                   std::function<void(Source&, Client&)> changed);
  // Whether somebody else can write the page, whom an operator may have to hold it against.
  [[nodiscard]] bool may_undo(const Source& source) const;
  bool end_activity(const Source& source);

  // Changes of the model (daemon_reload.cpp): each is answered when it is over.
  void ask_for(Change change, const Client& client, const shm::Message& message);
  void reload_for_signal(const std::string& by);
  void advance_changes();
  // Calls `step`; where it throws, the change is refused.
  void attempt(Swap& swap, const std::function<void()>& step);
  // In the compiler's thread; `after_reading` may add to what was read.
  [[nodiscard]] Compiler::Job reading_job(
      std::function<void(Reading&, const std::stop_token&)> after_reading) const;
  void read_first_models(int stop_descriptor);
  // What comes of a change is prepared by the compiler, and then finished here.
  void prepare(Swap& swap, Compiler::Job job);
  void finish_preparing();
  void stop_preparing_for_nobody();
  void prepare_reload(Swap& swap);
  void finish_reload(Swap& swap, Reading reading);
  void prepare_switch(Swap& swap);
  void prepare_rollback(Swap& swap);
  void prepare_comparison(Swap& swap);
  void finish_comparison(const Swap& swap, const Reading& reading);
  [[nodiscard]] std::uint64_t content_of(const LoadedModel& next) const;
  void reserve_tables(const Library& library);
  void begin_swap(Swap& swap);
  void put_in_force();
  void answer_done(const Swap& swap, nlohmann::json changes);
  void answer_refused(const Swap& swap, const std::string& why);
  void answer(const Swap& swap, const std::string& report, const std::string& why_not = {});
  void send_document(Client& client, std::uint64_t request, shm::MessageKind kind,
                     const std::string& document);

  // Taking over from a predecessor (daemon_takeover.cpp).

  // kExpecting: there was a predecessor, and nobody has handed back its realm yet. kTakingOver: its
  // components are coming back. Only then is our own model put in force and are others served.
  enum class Phase : std::uint8_t { kExpecting, kTakingOver, kServing };
  struct Absentee {
    pid_t pid = 0;
    uid_t user = 0;
    shm::FileDescriptor process;
    std::set<shm::PortInstance> ports;
    Charge charge;
  };

  void look_for_predecessor();
  void inherit(const shm::FileDescriptor& board, const shm::FileDescriptor& registry);
  void find_absentees();
  void add_absentee(const Owner& owner);
  void rejoin(Client& client, const shm::Received& hello);
  // One that is not taken back says what it has, all the same.
  void hear_stranger(const Client& client, const shm::Message& message) noexcept;
  void take_back_page(Client& client, const shm::Received& received);
  void take_back_output(Client& client, const shm::Received& received);
  void take_back_input(Client& client, const shm::Received& received);
  void take_back_link(const Client& client, const shm::Message& message);
  void finish_return(Client& client);
  void set_away(Client& client);
  void forget_absentee(NodeId node);
  void finish_takeover();
  [[nodiscard]] Swap first_swap();
  void remember_components();
  void remember_component(Client& client);
  void welcome(Client& client);
  void welcome_waiting();
  [[nodiscard]] shm::Nanoseconds takeover_deadline() const;
  void advance_takeover(shm::Nanoseconds now);
  // Those that are to be tried again are in the next turns of who asked.
  void retry_postponed(shm::Nanoseconds now);

  const std::string instance_;
  const bool stores_;
  Gate gate_;
  Shares shares_;
  Registry registry_;
  Directory directory_{registry_, shares_, stores_};
  Models models_{directory_, registry_};
  const std::vector<NamedFiles> files_;
  const bool is_strict_;
  std::vector<ModelPointer> read_at_start_;  // until they are put into the library
  Library library_;
  LoadedModel in_force_;  // null: none, or a predecessor's
  History history_;
  Continuity continuity_;
  ModelCopy model_copy_;
  Switchboard switchboard_{directory_, registry_};
  Barriers barriers_;
  shm::Nanoseconds show_growth_at_ = shm::kForever;
  shm::Listener listener_;
  StateFile state_;
  Phase phase_ = Phase::kServing;
  std::optional<Predecessor> predecessor_;
  shm::Nanoseconds started_ = 0;
  std::map<NodeId, Absentee> absentees_;
  Strangers strangers_;
  std::vector<ClientId> waiting_;  // have said hello, and are not welcomed yet
  std::vector<Postponed> postponed_;
  bool try_postponed_ = false;  // something has changed that they wait for
  shm::FileDescriptor epoll_;
  // Not before: there was no descriptor even to turn a client away.
  shm::Nanoseconds listen_again_at_ = shm::kForever;
  Lobby lobby_;
  LeftUnread left_unread_;
  // When to look again who has read: somebody is to be sent something, or has left something
  // unread.
  shm::Nanoseconds look_in_flight_at_ = shm::kForever;
  Watchdog watchdog_;
  std::map<ClientId, std::unique_ptr<Client>> clients_;  // the oldest first
  ClientId last_client_ = 0;
  Turns turns_;
  Observers observers_;
  bool is_more_to_tell_ = false;  // to observers
  StatusRequests status_requests_;
  shm::Nanoseconds give_back_at_ = shm::kForever;
  Changes changes_;
  std::optional<Swap> swap_;       // the one that waits for its barrier
  std::optional<Swap> preparing_;  // the one that waits for the compiler
  std::uint64_t reloads_refused_ = 0;
  bool stop_wanted_ = false;
  const std::uint64_t steps_;  // that the proof of a model may take
  const std::function<void(std::stop_token)> before_reading_;
  Compiler compiler_;  // last: its job ends before anything else does
};

}  // namespace arbiter::service
