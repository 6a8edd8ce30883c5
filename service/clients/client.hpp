// One client's connection: whose it is, what it has been told, what waits to be sent.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "service/clients/in_flight.hpp"
#include "service/clients/put_aside.hpp"
#include "service/kept/process.hpp"
#include "service/kept/registry_entry.hpp"
#include "service/policy/shares.hpp"
#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"
#include "shm/ids.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {

using ClientId = std::uint64_t;

// A request that is tried again, at `deadline` for the last time.
struct Postponed {
  ClientId client = 0;
  PutAside request;
  shm::Nanoseconds deadline = 0;
};

// Ports that are kept for a component, each with what it counts; nothing since another daemon.
using KeptPorts = std::map<shm::PortInstance, Charge>;

class Client {
 public:
  static constexpr std::uint64_t kDescriptors = 2;  // the socket, and the process

  // Takes over an accepted socket. Throws std::system_error; LimitExceeded where its user has
  // enough.
  Client(ClientId id, shm::FileDescriptor socket, Shares& shares);
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;
  ~Client();

  // Sends, or queues where the client is slow to read. Descriptors are duplicated if need be.
  void send(const wire::Message& message,
            std::array<int, wire::kMaxDescriptors> descriptors = {-1, -1});
  // Sends what is queued, as far as it goes.
  void flush();
  // The next message that it has sent; those that were read ahead come first. Its descriptors are
  // memfds and anonymous pipes, whoever made them; where others came with it, `is_strange` is set.
  [[nodiscard]] wire::ReceiveResult receive(wire::Received& received);
  // Reads what it has sent by now, at most kMaxReadAhead messages, and sets it aside; less where
  // its user has no share left.
  void read_ahead();
  // Throws LimitExceeded, and then `received` is as it was.
  [[nodiscard]] PutAside put_aside(wire::Received& received) { return {received, user_, shares_}; }
  // Of what was read ahead: takes out the closing of a port, if it is there.
  [[nodiscard]] bool take_closing_of(shm::PortInstance port);
  // Whether it has said all that it ever will, and will not come back.
  [[nodiscard]] bool has_gone() const;
  // Whether anything was read ahead, be it that the client has hung up.
  [[nodiscard]] bool has_read_ahead() const { return !ahead_.empty() || ahead_ended_; }
  [[nodiscard]] bool has_queue() const { return !queue_.empty(); }
  // What is queued waits until descriptors are read that it, or others of its user, have been sent;
  // its socket may have room.
  [[nodiscard]] bool is_held_back() const { return held_back_ && !queue_.empty(); }
  // Whether its socket is worth watching for room.
  [[nodiscard]] bool can_be_sent_more() const { return has_queue() && !is_held_back() && !lost_; }
  // How many flushes in turn have sent nothing, since it was held back.
  [[nodiscard]] unsigned flushed_in_vain() const { return flushed_in_vain_; }
  // Looks whether it has read what it was sent.
  void look_in_flight() { in_flight_.look(socket_.get()); }
  // The end: what is to be kept for as long as it has not read all.
  [[nodiscard]] LeftUnread::Client release_unread();
  // Nothing more can be sent to it: it has gone, or does not read what it is sent.
  [[nodiscard]] bool is_lost() const { return lost_; }
  // It has closed its end: what it sent before is all that there is, and still counts.
  [[nodiscard]] bool has_hung_up() const { return hung_up_; }
  // Asks the kernel whether the process has ended, which may be known before its socket is closed.
  [[nodiscard]] bool has_died() const;
  // Or looks whether it is about to have: its socket closes a moment before its end is told.
  [[nodiscard]] bool is_dying() const;

  [[nodiscard]] ClientId id() const { return id_; }
  [[nodiscard]] int socket() const { return socket_.get(); }
  [[nodiscard]] int process() const { return process_.get(); }
  // The same, to outlive this.
  [[nodiscard]] shm::FileDescriptor release_process() { return std::move(process_); }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] uid_t user() const { return user_; }
  // Whether that is the process at the other end, by its number and its pidfd. Processes outside of
  // this one's PID namespace all have the number 0: such a one is known by its pidfd alone, and
  // where the kernel does not tell those apart (before Linux 6.9), by nothing.
  [[nodiscard]] bool is_process(pid_t pid, int process) const;
  // Asked of the kernel once, and not before somebody wants to know.
  [[nodiscard]] Process identity() const;
  // For messages to people: node "object-detector" (pid 4711).
  [[nodiscard]] std::string description() const;

  std::string name;  // of the node; empty until it has said hello
  NodeId node = 0;   // 0 until it has been welcomed
  std::uint64_t hello_request = 0;
  bool is_turned_away = false;  // what it says after that is not heard
  bool is_taken_anew = false;   // it came back from another daemon: what it hands back is not ours
  bool has_service_thread = false;
  bool is_component = false;          // has opened a port once
  bool comes_back = false;            // if the conversation is lost: then its ports are kept for it
  bool is_returning = false;          // and has not handed back all yet:
  KeptPorts to_hand_back;             // these are missing
  bool has_failed_to_return = false;  // one came, and we could not take it
  std::string why_not_returned;       // as the log has it; empty: nothing stood there
  shm::Nanoseconds late_told_at = 0;  // when the log had that it is late; 0: never
  bool has_turn = false;              // waits for its turn to be served
  bool is_last_turn = false;          // for its process has ended
  int last_turns = 0;                 // that it has had since
  Charge charge;                      // as one of so many clients
  std::uint32_t postponed = 0;        // requests that cannot be served yet
  std::deque<Postponed> to_retry;     // of these: in its next turns
  std::uint32_t waits_for_status = 0;              // how often it has asked for a document
  bool watches_queue = false;                      // the loop waits until it can be written
  std::map<shm::SourceId, shm::PageNumber> pages;  // the last that it has been sent, by number
  std::set<shm::PortInstance> ports;               // that it has open

 private:
  struct Queued {
    explicit Queued(uid_t reader) : user(reader) {}
    Queued(const Queued&) = delete;
    Queued& operator=(const Queued&) = delete;
    ~Queued();  // a bell among them may take any time to close

    const uid_t user;
    wire::Message message;
    std::array<shm::FileDescriptor, wire::kMaxDescriptors> descriptors;
    Charge bytes;
    Charge open;  // the descriptors
  };
  using Descriptors = std::array<int, wire::kMaxDescriptors>;

  [[nodiscard]] bool has_room_for(std::uint64_t descriptors) const;
  [[nodiscard]] wire::SendResult try_to_send(const wire::Message& message,
                                             const Descriptors& descriptors, std::uint64_t count);
  static constexpr std::size_t kMaxReadAhead = 256;
  static constexpr std::size_t kMaxQueue = 16384;
  static constexpr std::size_t kMaxQueuedDescriptors = 4096;  // so that others find some left

  [[nodiscard]] wire::ReceiveResult receive_from_socket(wire::Received& received);

  const ClientId id_;
  Shares& shares_;
  Charge descriptors_;
  shm::FileDescriptor socket_;
  shm::FileDescriptor process_;  // a pidfd
  pid_t pid_ = 0;
  uid_t user_ = 0;
  mutable std::optional<std::uint64_t> started_;
  InFlight in_flight_;
  bool held_back_ = false;
  unsigned flushed_in_vain_ = 0;
  bool lost_ = false;
  bool hung_up_ = false;
  std::deque<std::unique_ptr<Queued>> queue_;
  std::size_t queued_descriptors_ = 0;
  std::deque<PutAside> ahead_;
  std::optional<wire::ReceiveResult> ahead_ended_;  // how the conversation ends after `ahead_`
};

}  // namespace arbiter::service
