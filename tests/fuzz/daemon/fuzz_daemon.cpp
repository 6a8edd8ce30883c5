// Clients of the daemon that say what they like, with whatever descriptors, and hang up as they
// like.
//
// The input is a script: what the hostile ones do, step by step. The daemon is the real one, on
// real sockets (loop.hpp says what is not). Required, whatever the script:
//   - no crash, no undefined behaviour; the daemon's loop rests when there is nothing to do
//   - those who keep to the protocol are served in time, and keep their ports and each other
//   - once the hostile ones are gone, no client, port or descriptor of theirs is left
#include <sys/socket.h>

#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tests/fuzz/daemon/descriptors.hpp"
#include "tests/fuzz/daemon/stage.hpp"
#include "tests/fuzz/fuzz.hpp"
#include "tests/fuzz/script.hpp"

namespace arbiter::fuzz {
namespace {

using wire::MessageKind;

// They bound what an input costs, not what the daemon must bear.
constexpr std::size_t kMostHostile = 6;
constexpr int kMostSteps = 300;
constexpr std::size_t kMostRemembered = 16;

// Beyond any process that there is.
constexpr pid_t kHostilePid = 1 << 23;
constexpr uid_t kHostileUser = 4'000'000;

constexpr const char* kNames[] = {"/high", "/stop", "/third", "/other", "/low",     "/in",
                                  "/a",    "/b",    "x",      "",       "/with it", "/new\nline"};

constexpr MessageKind kKinds[] = {
    MessageKind::kHello,          MessageKind::kOpenOutput,    MessageKind::kOpenInput,
    MessageKind::kClosePort,      MessageKind::kSynced,        MessageKind::kStatus,
    MessageKind::kDeactivate,     MessageKind::kObserve,       MessageKind::kPeerRefused,
    MessageKind::kReload,         MessageKind::kStop,          MessageKind::kHandBackPage,
    MessageKind::kHandBackOutput, MessageKind::kHandBackInput, MessageKind::kHandBackLink,
    MessageKind::kHandedBack,     MessageKind::kConnect,       MessageKind::kWelcome,
    MessageKind::kSync,           MessageKind::kOpened,        MessageKind::kModel};

// Those that came later have bytes of their own, so that the corpus still means what it did.
constexpr MessageKind kLaterKinds[] = {MessageKind::kSwitch, MessageKind::kRollback,
                                       MessageKind::kReport, MessageKind::kDescribe};

// What a hostile process has been sent and said.
struct Hostile {
  Hostile(const std::string& path, std::size_t who)
      : process(kHostilePid + static_cast<pid_t>(who), kHostileUser + static_cast<uid_t>(who / 2)),
        connection(std::make_unique<Connection>(path, process)) {}

  Process process;
  std::unique_ptr<Connection> connection;
  std::vector<std::pair<wire::Message, std::vector<int>>> said;
  std::vector<shm::PortInstance> ports;
  std::vector<std::uint64_t> numbers;  // of nodes, links and barriers

  [[nodiscard]] Descriptors::Owner own() const {
    return {process.identity().process, connection->socket()};
  }
};

class Run {
 public:
  explicit Run(Script& script) : script_(script) { Loop::senders_are_makers = false; }

  void go() {
    for (int step = 0; step < kMostSteps && !script_.is_at_end(); ++step) act();
    for (Hostile& each : hostile_) leave(each);
    hostile_.clear();
    descriptors_.close();
    stage_.run(1'000'000'000);
    stage_.require_as_before();
  }

 private:
  void act() {
    switch (script_.byte() % 16) {
      case 0:
        return connect();
      case 1:
        return say_hello();
      case 2:
        return open(MessageKind::kOpenOutput);
      case 3:
        return open(MessageKind::kOpenInput);
      case 4:
      case 5:
      case 6:
        return say_anything();
      case 7:
        return say_noise();
      case 8:
        return say_again();
      case 9:
        return half_close();
      case 10:
        return hang_up();
      case 11:
      case 12:
        return read(script_.byte() % 4 != 0);
      case 13:
        return stage_.run();
      case 14:
        return stage_.run(script_.byte() * shm::Nanoseconds{2'000'000});
      default:
        return act_as_owner();
    }
  }

  void act_as_owner() {
    const std::uint8_t what = script_.byte();
    if (what % 4 == 0) return stage_.reload();
    if (what % 16 == 1) return stage_.switch_model();
    if (what % 16 == 2) return stage_.roll_back();
    stage_.serve_newcomer();
  }

  void connect() {
    if (hostile_.size() >= kMostHostile) return;
    hostile_.emplace_back(stage_.path(), script_.byte() % 4);
    stage_.run();
  }

  Hostile* who() {
    if (hostile_.empty()) connect();
    Hostile& each = hostile_[script_.byte() % hostile_.size()];
    return each.connection ? &each : nullptr;
  }

  void say(Hostile& who, const wire::Message& message, std::vector<int> descriptors) {
    declare_makers(who, descriptors);
    if (who.said.size() < kMostRemembered) who.said.emplace_back(message, descriptors);
    who.connection->send(message, std::move(descriptors));
  }

  // What they have made themselves is of the user who sends it first.
  void declare_makers(const Hostile& who, const std::vector<int>& descriptors) {
    for (const int fd : descriptors) {
      if (descriptors_.is_made(fd)) Loop::declare_maker(fd, who.process.identity().user);
    }
  }

  void say_hello() {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    wire::Message message;
    message.kind = MessageKind::kHello;
    message.value = wire::kWireVersion;
    message.flags = script_.byte() % 16;
    message.set_name("hostile");
    std::vector<int> descriptors;
    if ((message.flags & wire::kRejoins) != 0) {
      message.link = one_of(hostile->numbers);
      descriptors = {descriptors_.given(0), descriptors_.given(1)};
    } else if (script_.byte() % 2 == 0) {  // it has nothing left of what it was
      message.link = one_of(hostile->numbers);
      descriptors = {descriptors_.given(0)};
    }
    say(*hostile, message, descriptors);
    stage_.run();
  }

  void open(MessageKind kind) {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    wire::Message message;
    message.kind = kind;
    message.set_name(kNames[script_.byte() % std::size(kNames)]);
    const std::uint8_t how = script_.byte();
    message.type.size = how % 16;
    message.flags = how >= 240 ? wire::kYields : 0u;
    std::vector<int> descriptors;
    if (kind == MessageKind::kOpenOutput) {
      descriptors = {descriptors_.make(make_output_segment(message.type, 1 + script_.byte() % 8u))};
    } else {
      descriptors = {descriptors_.make(make_input_segment(1 + script_.byte() % 8u)),
                     descriptors_.bell()};
    }
    say(*hostile, message, descriptors);
  }

  wire::Message anything(const Hostile& hostile) {
    wire::Message message;
    message.kind = static_cast<MessageKind>(script_.byte());
    if (static_cast<std::size_t>(message.kind) >= 240 &&
        static_cast<std::size_t>(message.kind) < 250) {
      message.kind = kLaterKinds[static_cast<std::size_t>(message.kind) % std::size(kLaterKinds)];
    } else if (static_cast<std::size_t>(message.kind) < 250) {
      message.kind = kKinds[static_cast<std::size_t>(message.kind) % std::size(kKinds)];
    }
    message.flags = static_cast<std::uint32_t>(script_.number());
    message.request = script_.number();
    message.port = port(hostile);
    message.peer = port(hostile);
    message.link = script_.byte() % 2 == 0 ? one_of(hostile.numbers) : script_.number();
    message.id = static_cast<std::uint32_t>(script_.number());
    message.value =
        script_.byte() % 2 == 0 ? wire::kWireVersion : static_cast<std::uint32_t>(script_.number());
    message.set_name(kNames[script_.byte() % std::size(kNames)]);
    if (script_.byte() % 4 == 0) {
      message.set_name(std::string(script_.byte(), static_cast<char>(script_.byte())));
      message.set_text(std::string(script_.byte() * 4u, static_cast<char>(script_.byte())));
    }
    if (script_.byte() % 4 == 0) {
      message.type.size = script_.number();
      message.type.alignment = script_.number();
      message.type.set_name(std::string(script_.byte(), static_cast<char>(script_.byte())));
    }
    return message;
  }

  void say_anything() {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    const wire::Message message = anything(*hostile);
    say(*hostile, message, descriptors_.some(hostile->own()));
  }

  // A message cut off, too long, or altered at some place.
  void say_noise() {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    const wire::Message message = anything(*hostile);
    std::vector<std::uint8_t> bytes(4096);
    std::memcpy(bytes.data(), &message, sizeof message);
    for (int i = script_.byte() % 8; i > 0; --i) {
      bytes[script_.word() % bytes.size()] = script_.byte();
    }
    const std::size_t size = script_.word() % bytes.size();
    const std::vector<int> with = descriptors_.some(hostile->own());
    declare_makers(*hostile, with);
    hostile->connection->send_bytes(bytes.data(), size, with);
  }

  void say_again() {
    Hostile* const hostile = who();
    if (hostile == nullptr || hostile->said.empty()) return;
    const auto& [message, descriptors] = hostile->said[script_.byte() % hostile->said.size()];
    for (int times = script_.byte(); times >= 0; --times) {
      if (hostile->connection->send(message, descriptors) != wire::SendResult::kSent) break;
    }
  }

  void half_close() {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    constexpr int kHow[] = {SHUT_RD, SHUT_WR, SHUT_RDWR};
    hostile->connection->half_close(kHow[script_.byte() % 3]);
  }

  // It lives on, dies first, or dies at the same time.
  void hang_up() {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    const std::uint8_t how = script_.byte() % 4;
    if (how == 0) {
      hostile->process.end();
      if (script_.byte() % 2 == 0) stage_.run();
    }
    hostile->connection.reset();
    if (how == 1) hostile->process.end();
    if (how != 2) return;
    // The same process again.
    hostile->connection = std::make_unique<Connection>(stage_.path(), hostile->process);
    stage_.run();
  }

  void leave(Hostile& hostile) {
    hostile.connection.reset();
    hostile.process.end();
  }

  // Takes up what it is sent; answers what it is asked, or not.
  void read(bool answers) {
    Hostile* const hostile = who();
    if (hostile == nullptr) return;
    wire::Received received;
    while (wire::receive_message(hostile->connection->socket(), received, false) ==
           wire::ReceiveResult::kReceived) {
      const wire::Message& message = received.message;
      if (message.kind == MessageKind::kOpened) hostile->ports.push_back(message.port);
      if (message.peer != 0) hostile->ports.push_back(message.peer);
      if (message.link != 0) hostile->numbers.push_back(message.link);
      if (message.kind == MessageKind::kSync) {
        hostile->numbers.push_back(message.request);
        wire::Message synced;
        synced.kind = MessageKind::kSynced;
        synced.request = message.request;
        if (answers) hostile->connection->send(synced);
      }
      for (std::size_t i = 0; i < received.descriptor_count; ++i) {
        descriptors_.keep(std::move(received.descriptors[i]));
      }
    }
  }

  shm::PortInstance port(const Hostile& hostile) {
    const std::uint8_t choice = script_.byte();
    if (choice % 2 == 0 && !hostile.ports.empty()) {
      return hostile.ports[choice / 2 % hostile.ports.size()];
    }
    return choice == 255 ? script_.word() : choice / 2;
  }
  std::uint64_t one_of(const std::vector<std::uint64_t>& numbers) {
    return numbers.empty() ? script_.number() : numbers[script_.byte() % numbers.size()];
  }
  Script& script_;
  Descriptors descriptors_{script_};
  Stage stage_;  // counts descriptors when it begins
  std::vector<Hostile> hostile_;
};

}  // namespace
}  // namespace arbiter::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::size_t before = arbiter::fuzz::count_descriptors();
  {
    arbiter::fuzz::Script script(data, size);
    arbiter::fuzz::Run(script).go();
  }
  arbiter::fuzz::require(arbiter::fuzz::count_descriptors() == before,
                         "a daemon that has ended leaves no descriptor behind");
  return 0;
}
