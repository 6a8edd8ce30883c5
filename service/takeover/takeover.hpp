// How a daemon takes over from its predecessor: what was killed, or stopped, while its components
// went on.
//
// All that decides lives in memory that the components map: tables, activity, queues. The new
// daemon takes up that very memory and its numbers, so that for the components nothing changes;
// then it puts its own model in force by an ordinary swap. A component that is not back when it is
// time for that (it is stopped, or its user services the node late) comes back when it likes; until
// then its ports and names are kept for it, for as long as its process lives.
//
//   takeover.cpp    from finding a predecessor to serving others, and what is written down
//   returning.cpp   a component that comes back, or goes away
//
// Thread safety: none, it is the loop's.
#pragma once

#include <sys/types.h>

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "service/clients/clients.hpp"
#include "service/clients/gate.hpp"
#include "service/kept/descriptor_store.hpp"
#include "service/kept/registry.hpp"
#include "service/kept/state_file.hpp"
#include "service/models/board.hpp"
#include "service/policy/shares.hpp"
#include "service/ports/port_names.hpp"
#include "service/ports/switchboard.hpp"
#include "service/takeover/deaths.hpp"
#include "service/takeover/strangers.hpp"
#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {

class Takeover {
 public:
  // What it asks of the daemon around it.
  class Host {
   public:
    virtual ~Host() = default;
    // Calls forget_absentee(node) once the process of a pidfd has ended.
    virtual void watch_absentee(const shm::FileDescriptor& process, NodeId node) = 0;
    // Ends a conversation.
    virtual void drop(ClientId client) = 0;
    // The client has ended in good order: closes its ports, and keeps nothing for it.
    virtual void close_all(Client& client) = 0;
    // A client is known from now on, and is to hear so.
    virtual void welcome(Client& client) = 0;
    // Whether links have been made for a model that is not in force yet.
    [[nodiscard]] virtual bool has_links_ahead() const = 0;
    // Requests that could not be served may be served now.
    virtual void try_postponed() = 0;
    // All who came in time are back. `is_fresh`: there was nobody to come back.
    virtual void begin_to_serve(bool is_fresh) = 0;
  };
  // What it restores.
  struct Parts {
    const Gate& gate;
    Shares& shares;
    Registry& registry;
    PortNames& names;
    Board& board;
    Switchboard& switchboard;
    const Clients& clients;
  };

  // `stores`: whether the service manager keeps descriptors for the next daemon.
  Takeover(const Parts& parts, Host& host, StateFile state, bool stores);

  // Before the beginning: whether a predecessor seems to have left anything.
  [[nodiscard]] bool may_inherit();
  // The beginning: what is there of a predecessor. Without one it is over at once.
  void look_for_predecessor();
  // Only then is our own model put in force, and are others served.
  [[nodiscard]] bool is_over() const { return phase_ == Phase::kServing; }
  [[nodiscard]] shm::Nanoseconds deadline() const;
  void advance(shm::Nanoseconds now);
  // The end, where nobody will come back to a successor: then none must look for them.
  void leave_nothing_if_nobody_is_left();

  // A client that has said hello waits until it is over.
  void let_wait(const Client& client) { waiting_.push_back(client.id()); }
  void welcome_waiting();

  // Whether that is the board of this daemon or of its predecessor: other memory has other nodes of
  // the same numbers.
  [[nodiscard]] bool knows(const shm::FileDescriptor& board) const;
  // One that says it was here before. Throws std::runtime_error where it cannot be taken back;
  // RefusedAgain where the log has that already.
  void rejoin(Client& client, const wire::Received& hello);
  // What it hands back, each thing that it had. Throw std::runtime_error, LimitExceeded.
  void take_back_page(Client& client, const wire::Received& received);
  void take_back_output(Client& client, const wire::Received& received);
  void take_back_input(Client& client, const wire::Received& received);
  void take_back_link(const Client& client, const wire::Message& message);
  // Something that it has said was not taken. `is_ours`: for want of what we would need for it.
  // Whether the log is to have it: one who comes again all the time is refused for the same reason.
  [[nodiscard]] static bool note_refusal(Client& client, const wire::Message& message,
                                         const std::string& why, bool is_ours);
  void finish_return(Client& client);
  // One that is not taken back says what it has, all the same.
  void hear_stranger(const Client& client, const wire::Message& message) noexcept;
  [[nodiscard]] const Strangers& strangers() const { return strangers_; }
  [[nodiscard]] Deaths& deaths() { return deaths_; }
  // That component is no stranger from now on.
  void know(const Client& client) { strangers_.welcome(client); }

  // The conversation with a component is lost, and its process lives: its ports are kept for it.
  void set_away(Client& client);
  void forget_absentee(NodeId node);
  // A node of that client's process has ended and was not heard: nothing is kept for it.
  void forget_ended(const Client& client, NodeId ended);
  // What the absentee has taken of its user's share, for the process that was it. Throws
  // LimitExceeded where there is no room for another. `former`: who it says that it was; 0: nobody.
  [[nodiscard]] Charge make_room_for(const Client& newcomer, NodeId former);
  // That a name is kept for nobody who is away. Throws NotYet.
  void require_not_kept(const Client& asking, shm::PortInstance holder, const std::string& what);

  // For a successor: that client has opened a port.
  void remember_component(Client& client);

 private:
  // kExpecting: there was a predecessor, and nobody has handed back its realm yet. kTakingOver: its
  // components are coming back.
  enum class Phase : std::uint8_t { kExpecting, kTakingOver, kServing };
  struct Absentee {
    std::string name;  // of its node; empty where an earlier daemon knew it
    pid_t pid = 0;
    std::uint64_t started = 0;    // Process::started; 0 where its pidfd came with the component
    std::optional<uid_t> user;    // empty: it cannot be told
    shm::FileDescriptor process;  // none: it is to be opened yet
    KeptPorts ports;
    std::string why_not_returned;  // Client::why_not_returned
    Charge charge;
  };

  [[nodiscard]] bool inherit_stored();
  void take_stored_page(const StoredDescriptor& stored);
  void store_realm();
  void inherit(const shm::FileDescriptor& board, const shm::FileDescriptor& registry);
  void find_absentees();
  // `ended`: to those is added what need not be kept.
  void add_absentee(const Owner& owner, KeptPorts& ended);
  // Names that are taken up are the daemon's own at first. Then they count as their user's, and so
  // do ports that come back, but for what the components that are away need to come back by.
  void charge(uid_t user, Source& source);
  void charge(uid_t user, InputName& input);
  // `kept`: what it has counted all the time; empty where that was under another daemon.
  [[nodiscard]] Charge charge_of_port(uid_t user, Charge kept, std::uint64_t descriptors);
  [[nodiscard]] std::uint64_t left_for_absentees() const {
    return Client::kDescriptors * absentees_.size();
  }
  // False: it has ended.
  [[nodiscard]] bool open_and_watch(NodeId node, Absentee& absentee);
  void watch_unwatched();
  void take_back(Client& client, const wire::Received& hello);
  void log_end_of(const Absentee& absentee);
  void end_conversation_of(const Client& client, NodeId node);
  // Of the same process and user; null: there is none.
  [[nodiscard]] Client* former_client(const Client& client, NodeId node);
  [[nodiscard]] static bool is_that(const Client& client, const Absentee& absentee);
  void give_up(NodeId node);
  [[nodiscard]] shm::Nanoseconds deadline_of_return() const;
  void finish();
  void remember_components() noexcept;
  void log_unwritten(const std::string& why);
  void replace_lost_pages();

  const Gate& gate_;
  Shares& shares_;
  Registry& registry_;
  PortNames& names_;
  Board& board_;
  Switchboard& switchboard_;
  const Clients& clients_;
  Host& host_;
  StateFile state_;
  const bool stores_;
  Phase phase_ = Phase::kServing;
  std::optional<Predecessor> predecessor_;
  std::vector<std::string> stored_;  // what the service manager has kept, by name
  shm::Nanoseconds started_ = 0;
  std::map<NodeId, Absentee> absentees_;
  Strangers strangers_;
  Deaths deaths_;
  std::vector<ClientId> waiting_;  // have said hello, and are not welcomed yet
  // When that is tried again which has failed: to write the state file, to watch absentees.
  shm::Nanoseconds write_again_at_ = shm::kForever;
  shm::Nanoseconds watch_again_at_ = shm::kForever;
};

}  // namespace arbiter::service
