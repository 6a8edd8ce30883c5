// A node: the conversation with the daemon, and the registry of the ports that it concerns.
//
//   node_core.cpp     connecting; questions and answers
//   openings.cpp      opening and closing ports and taps
//   notices.cpp       what the component should know
//   service.cpp       what the daemon says, and the thread that hears it
//   links.cpp         what it says of the ports at the other end
//   say.cpp           what the node says
//   ends.cpp          that it has ended, and others of its process (ended_nodes.hpp)
//   rejoin.cpp        losing the daemon, and coming back to another
//   hand_back.cpp     what that one is handed back
//   descriptions.cpp  what components say of their ports
//   pages.cpp         what it sees of the activity of sources
//   taps.cpp          taps that this node opens, and taps of its output ports
//
// Thread safety: opening and closing ports may come from any thread; what the daemon says is
// handled by one thread at a time, the service thread, or whoever calls service() where there is
// none. `mutex_` guards the registry, the replies and the socket; nothing on the data path takes
// it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/detail/cores.hpp>

#include "client/input/input_core.hpp"
#include "client/memory.hpp"
#include "client/node/outbox.hpp"
#include "client/output/output_core.hpp"
#include "client/tap/tap_core.hpp"
#include "shm/descendants.hpp"
#include "wire/call.hpp"
#include "wire/messages.hpp"

namespace arbiter::detail {

class NodeCore : public std::enable_shared_from_this<NodeCore> {
 public:
  // Connects. Throws Error.
  NodeCore(std::string_view name, const NodeOptions& options);
  NodeCore(const NodeCore&) = delete;
  NodeCore& operator=(const NodeCore&) = delete;
  ~NodeCore();

  std::shared_ptr<OutputCore> open_output(std::string_view name, const Type& type,
                                          const OutputPortOptions& options);
  std::shared_ptr<InputCore> open_input(std::string_view name, const Type& type,
                                        const InputPortOptions& options);
  std::shared_ptr<TapCore> open_tap(std::string_view name, const Type& type,
                                    const TapOptions& options);
  // Not by its number, for a tap gets another from each daemon.
  template <class Core>
  void close(const Core& core) noexcept;
  // What stands behind a port, for the status.
  void describe(shm::PortInstance port, std::string_view text, bool is_trouble) noexcept;

  // Without a service thread: takes up what the daemon has said so far, without blocking.
  void service();
  // Readable when there is something to take up.
  [[nodiscard]] int service_fd() const noexcept { return epoll_.get(); }

  // The process that made it, and that alone may use it.
  [[nodiscard]] const shm::ProcessMark& process() const noexcept { return process_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }

  // Asks the daemon and waits for the answer; a daemon that takes over is asked again. Throws Error
  // where it refuses, or none answers in time.
  wire::Received ask(const wire::Message& question,
                     std::array<int, wire::kMaxDescriptors> descriptors);

  [[nodiscard]] std::shared_ptr<SharedMemory> memory();

 private:
  using Clock = std::chrono::steady_clock;
  using Socket = std::shared_ptr<const shm::FileDescriptor>;

  struct Reply {
    shm::PortInstance opened = 0;  // kOpened came
    bool finished = false;
    std::uint64_t asked_in = 0;  // the conversation in which the question was asked last
    std::string opens;           // "output /name": it asks for that port; empty: for none
    bool is_behind_given_up = false;
    bool has_asked_again = false;  // for that
    std::string refusal;
    wire::Received received;
    std::function<void(wire::Received&)> on_opened;
  };
  // The daemon is one that has other memory: what was made for the old has to be made anew.
  struct MemoryIsNew {};
  // What a user's callback has thrown, on its way through calls that would take it for an error of
  // their own. The call that the user has made throws it on as it was.
  struct ThrownByCallback {
    std::exception_ptr thrown;
  };
  struct MissedPage {
    std::string source;
    shm::FileDescriptor page;
  };
  // kRejoining: a daemon is handed back everything, or has been and has not answered yet.
  enum class Standing : std::uint8_t { kMember, kRejoining, kAlone };

  void connect();
  // May throw what a callback throws, as ThrownByCallback.
  void say_that_we_wait(const std::string& whom, std::chrono::milliseconds most) const;
  // The same, without the lock meanwhile. If it throws, the request is given up.
  void say_that_we_wait(std::unique_lock<std::mutex>& lock, std::uint64_t request,
                        std::chrono::milliseconds most);
  void give_up_on(std::uint64_t request);
  void note_second_daemons(const std::string& met_in);
  [[nodiscard]] wire::Message hello() const;
  [[nodiscard]] wire::Caller caller() const;

  void start_service_thread();
  void run_service_thread();
  void stop_service_thread();
  // Waits up to `timeout_ms` for something to do and does it.
  void pump(int timeout_ms);
  void tidy();
  void tidy_ports(
      std::vector<std::pair<shm::PortInstance, std::shared_ptr<const OutputPeer>>>& copied_from);
  void tidy_taps(
      std::vector<std::pair<shm::PortInstance, std::shared_ptr<const OutputPeer>>>& copied_from);
  // Under mutex_: when to look for what nobody will ring for, in milliseconds from now; -1: never.
  [[nodiscard]] int look_again_in() const noexcept;
  void ring_when_to_look_again() const;
  // Descriptions (descriptions.cpp). Under mutex_: those that are due; when the next one is.
  void say_descriptions() noexcept;
  [[nodiscard]] shm::Nanoseconds next_description() const noexcept;
  void describe_again() noexcept;
  void handle(wire::Received& received);
  void handle_without_descriptors(const wire::Message& message);
  void handle_reply(wire::Received& received);
  void wake_inputs();
  void add_receiver(const wire::Received& received);
  void add_publisher(const wire::Received& received);
  // Taps (taps.cpp).
  void handle_about_tap(wire::Received& received);
  void set_measured(const wire::Message& message);
  void add_tap(const wire::Received& received);
  void add_tap_source(const wire::Received& received);
  void add_tap_input(const wire::Received& received);
  void refuse_tap(const wire::Message& announced, const std::string& why);
  [[nodiscard]] bool note_tap_refusal(const wire::Message& refusal);
  void forget_numbers_of_taps();
  void reopen_taps();
  bool handle_tap_reopened(const wire::Message& message);
  void end_peer(const wire::Message& message);
  [[nodiscard]] std::optional<shm::TypeInfo> type_of_port(shm::PortInstance port);
  void refuse_peer(const wire::Message& announced, const std::string& why);
  void handle_refusal(const wire::Message& refusal);
  void handle_unmentioned(const wire::Message& message);
  void handle_yield(const wire::Message& message);
  // Activity pages, and tables (pages.cpp).
  void add_page(wire::Received& received);
  void note_missed(const std::string& source, const std::string& why);
  void forget_missed(shm::SourceId source, shm::PageNumber number);
  void try_missed_pages();
  void make_tables_resident();
  void hear_of_growth(const wire::Message& message);
  void look_at_growth(shm::PortInstance port, const OutputPeer& peer);
  void say_not_locked(shm::PortInstance port, const std::string& why);
  void say_refused(shm::PortInstance port, shm::PortInstance peer, const std::string& why);

  // Notices (notices.cpp). Under mutex_:
  void note(NoticeKind kind, shm::PortInstance port, const std::string& peer,
            const std::string& text);
  void note_refusal(const wire::Message& about, const std::string& why);
  void refuse_waiting(shm::PortInstance port, const InputPeer& peer, const std::string& why);
  void say_blind(shm::PortInstance port, const char* what_it_does);
  // Empty where it is not open.
  [[nodiscard]] const std::string& name_of_port(shm::PortInstance port) const;
  // Under no lock. False: there was none.
  bool give_notices();
  void give(const Notice& notice) const noexcept;
  // Under mutex_.
  [[nodiscard]] bool has_notices() const noexcept { return !notices_.empty() && !is_giving_; }

  [[nodiscard]] bool watch_socket();
  void hang_up() const noexcept;
  // Under mutex_: the conversation is over.
  void lose_daemon() noexcept;
  void be_alone(Clock::duration look_again_in) noexcept;
  void ring_timer_every(Clock::duration time) const;
  void rejoin();
  // Why this daemon is left alone for a second.
  void put_off(const std::string& why);
  // What is handed back, and taps (hand_back.cpp). Under mutex_.
  struct Due {
    wire::MessageKind kind;
    shm::PortInstance port = 0;  // or the tap
    std::uint64_t about = 0;     // of a link: the peer; of a page: the source
    std::uint64_t number = 0;    // of the link, of the page; of a tap: the request
    int descriptor = -1;         // of the page, which the memory owns
  };
  void begin_to_hand_back();
  // False: it is not there any more.
  [[nodiscard]] bool put_into_words(const Due& due, wire::Message& message,
                                    Outbox::Descriptors& descriptors) const noexcept;
  void say_what_is_due() noexcept;
  void be_welcomed(wire::Received& welcome);
  void be_turned_away(const wire::Message& refusal);
  // Whether the daemon is there, and has read all that we have said.
  [[nodiscard]] bool is_heard() const noexcept;
  // Under mutex_: which nodes of this process have ended.
  enum class Whom : std::uint8_t { kOwn, kAll };  // kOwn: those that it is to tell of
  void say_who_has_ended(Whom whom) noexcept;
  void say_ended(std::uint64_t node) noexcept;

  // Under mutex_. Never waits for the daemon. What is lost with the conversation, rejoining makes
  // good; it is over after this where that is the only way on.
  void say(const wire::Message& message, Outbox::Descriptors descriptors = {-1, -1}) noexcept;
  void say_what_waits() noexcept;
  // The last that it says, under no lock: there is no other thread.
  void say_the_end() noexcept;
  [[nodiscard]] bool has_said_all() const noexcept { return due_.empty() && outbox_.empty(); }
  // Until the user's descriptors that are under way have been read: there is room for no more.
  [[nodiscard]] bool has_too_many() const noexcept {
    return due_has_too_many_ || outbox_.has_too_many();
  }
  [[nodiscard]] bool hands_back() const noexcept {
    return standing_ == Standing::kRejoining && !due_.empty();
  }
  // Whether it is time for what the daemon says.
  [[nodiscard]] bool hears() const noexcept;
  // Has the loop hear of what it is time for: news of the daemon, room in the socket.
  void heed() noexcept;
  void say_closed(shm::PortInstance port) noexcept;
  void forget_port(shm::PortInstance port);
  // `memory`: that which the question is about, if any. Throws Error, MemoryIsNew.
  wire::Received converse(const wire::Message& question,
                          std::array<int, wire::kMaxDescriptors> descriptors,
                          const SharedMemory* memory = nullptr,
                          std::function<void(wire::Received&)> on_opened = nullptr);
  // Opens a port: calls make(memory) again where the memory is replaced meanwhile.
  template <class Make>
  auto open(std::string_view name, Make make);
  [[nodiscard]] shm::Residence residence() const noexcept;
  // Until something may have changed; false: it is time to give up.
  bool wait_for_news(std::unique_lock<std::mutex>& lock, Clock::time_point give_up);

  const shm::ProcessMark process_ = shm::ProcessMark::of_this_process();
  const std::string name_;
  const NodeOptions options_;
  std::string instance_;
  shm::FileDescriptor epoll_;
  // Rings while there is no daemon, to look for one; else, without a service thread, when to look
  // again.
  shm::FileDescriptor timer_;
  std::shared_ptr<const ServiceBell> service_bell_;

  std::mutex mutex_;
  std::shared_ptr<SharedMemory>
      memory_;                    // the service thread, which alone replaces it, needs no lock
  std::condition_variable news_;  // an answer, or a change of standing
  std::mutex pump_mutex_;         // without a service thread: one caller at a time
  Socket socket_;                 // null while alone
  std::uint32_t heeded_ = 0;      // what the loop hears of it
  std::deque<Due> due_;           // said before all in the outbox
  bool due_has_too_many_ = false;
  Outbox outbox_;                       // of the conversation
  std::set<std::uint64_t> ended_said_;  // nodes of this process, and perhaps not heard yet
  std::uint64_t ended_said_in_ = 0;     // the conversation
  bool has_ended_to_tell_ = false;
  Standing standing_ = Standing::kMember;
  std::uint64_t conversation_ = 1;  // counts the daemons that have welcomed us
  std::uint64_t node_ = 0;          // our number among all nodes
  std::string turned_away_;         // why the last daemon did not take us back
  // Of the thread that pumps: they could not be mapped, and are tried again. By source and number.
  std::map<std::pair<shm::SourceId, shm::PageNumber>, MissedPage> missed_pages_;
  shm::Nanoseconds try_pages_at_ = 0;
  bool has_no_ports_ = false;       // rejoining without any: other memory will do as well
  shm::Nanoseconds asked_ = 0;      // when we asked to rejoin
  bool has_told_of_clock_ = false;  // that the daemon's is another
  int refusals_ = 0;                // in a row, of daemons that did not take us back
  bool stopping_ = false;
  std::uint64_t next_request_ = 1;
  std::map<std::uint64_t, Reply> replies_;
  // What the daemon will answer first, and nobody waits for.
  std::map<std::uint64_t, std::string> given_up_;  // openings, by request: Reply::opens
  std::map<shm::PortInstance, std::shared_ptr<OutputCore>> outputs_;
  std::map<shm::PortInstance, std::shared_ptr<InputCore>> inputs_;
  std::map<shm::PortInstance, std::shared_ptr<TapCore>> taps_;
  std::map<std::uint64_t, std::weak_ptr<TapCore>> reopened_;  // by request
  std::vector<Notice> notices_;                               // to be given
  bool is_giving_ = false;
  struct Description {
    std::string text;
    bool is_trouble = false;
    bool is_said = true;
    shm::Nanoseconds said_at = 0;
  };
  std::map<shm::PortInstance, Description> descriptions_;
  std::map<shm::PortInstance, std::set<std::string>> given_;  // texts, by port

  std::thread service_thread_;  // last: it uses all of the above
};

}  // namespace arbiter::detail
