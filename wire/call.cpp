#include "wire/call.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "shm/clock.hpp"
#include "shm/descendants.hpp"
#include "wire/instances.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::wire {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

// How often a daemon is looked for that does not answer yet.
constexpr milliseconds kInterval{20};
// The longest time to wait for one; longer means for ever.
constexpr milliseconds kMaxPatience = std::chrono::hours(24 * 365);
// The longest wait for an answer before another daemon is looked for.
constexpr milliseconds kMaxAnswerTime{60'000};

milliseconds since(Clock::time_point begin) {
  return std::chrono::duration_cast<milliseconds>(Clock::now() - begin);
}

// Waits until the descriptor is readable or `limit` has passed (then false); says so once.
bool wait_readable(const Caller& caller, int descriptor, std::optional<milliseconds> limit,
                   const std::string& whom, bool& has_told) {
  const auto begin = Clock::now();
  for (;;) {
    const milliseconds waited = since(begin);
    if (limit && waited >= *limit) return false;
    if (!has_told && waited >= caller.quiet) {
      has_told = true;
      if (caller.on_waiting) caller.on_waiting(whom);
    }
    auto left = limit ? *limit - waited : kMaxAnswerTime;
    if (!has_told) left = std::min(left, caller.quiet - waited);
    pollfd polled{descriptor, POLLIN, 0};
    if (::poll(&polled, 1, static_cast<int>(std::max(left, milliseconds(1)).count())) == 1) {
      return true;
    }
  }
}

// Of what has come: nothing of it has been lost.
void require_descriptors(const Received& received) {
  if (received.lost_descriptors) throw CallError(no_descriptor_left("what the daemon sends"));
}

std::string silence_text(const shm::FileDescriptor& socket, const Caller& caller,
                         Clock::time_point asked, const char* more = "") {
  return describe_daemon(socket.get(), caller.instance) + " runs, but did not answer within " +
         std::to_string(since(asked).count()) + " ms" + more + ": " +
         describe_silence(socket.get());
}

class Joining {
 public:
  explicit Joining(const Caller& caller) : caller_(caller) {}

  Welcome run() {
    std::string why_not;
    for (;;) {
      silence_.clear();
      Welcome welcome;
      if (auto socket = connect_to_daemon(caller_.instance, why_not, &welcome.directory)) {
        welcome.socket = std::move(*socket);
        shm::close_in_children(welcome.socket);
        if (is_let_in(welcome)) return welcome;
      }
      const auto now = Clock::now();
      if (now >= give_up_) {
        throw CallError(silence_.empty()
                            ? nobody_answers(caller_, why_not) + describe_listening_instances()
                            : silence_);
      }
      if (!has_told_ && since(begin_) >= caller_.quiet) {
        has_told_ = true;
        if (caller_.on_waiting)
          caller_.on_waiting("an arbiterd of instance \"" + caller_.instance + '"');
      }
      std::this_thread::sleep_for(std::min<Clock::duration>(kInterval, give_up_ - now));
    }
  }

 private:
  // False: it has not answered.
  bool is_let_in(Welcome& welcome) {
    welcome.asked = shm::monotonic_now();
    if (send_message(welcome.socket.get(), hello_of(caller_)) != SendResult::kSent) return false;
    const auto asked = Clock::now();
    const auto left = std::chrono::duration_cast<milliseconds>(give_up_ - asked);
    const auto limit =
        std::clamp(left, std::min(caller_.answer_time, kMaxAnswerTime), kMaxAnswerTime);
    const std::string whom = describe_daemon(welcome.socket.get(), caller_.instance) + " to answer";
    if (!wait_readable(caller_, welcome.socket.get(), limit, whom, has_told_)) {
      silence_ = silence_text(welcome.socket, caller_, asked, ", so that nothing was asked of it");
      return false;
    }
    if (receive_message(welcome.socket.get(), welcome.received, false) !=
        ReceiveResult::kReceived) {
      return false;
    }
    const Message& answer = welcome.received.message;
    if (answer.kind == MessageKind::kRefused) {
      throw RefusedError("the daemon refuses: " + std::string(answer.text_view()));
    }
    require_descriptors(welcome.received);
    return answer.kind == MessageKind::kWelcome;
  }

  const Caller& caller_;
  const Clock::time_point begin_ = Clock::now();
  const Clock::time_point give_up_ = begin_ + std::min(caller_.patience, kMaxPatience);
  bool has_told_ = false;
  std::string silence_;  // of a daemon that is there and says nothing
};

}  // namespace

Message hello_of(const Caller& caller) {
  Message hello;
  hello.kind = MessageKind::kHello;
  hello.value = kWireVersion;
  hello.flags = caller.flags;
  hello.set_name(caller.name);
  return hello;
}

std::string nobody_answers(const Caller& caller, const std::string& why_not) {
  return "no arbiterd of instance \"" + caller.instance + "\" answered within " +
         std::to_string(caller.patience.count()) + " ms" +
         (why_not.empty() ? "" : " (" + why_not + ")") +
         "; components that run go on by its last model; start one with: arbiterd --model FILE "
         "--instance " +
         caller.instance;
}

std::string no_descriptor_left(std::string_view what_for) {
  return "process " + std::to_string(::getpid()) + " has no descriptor left for " +
         std::string(what_for) +
         ": raise RLIMIT_NOFILE (ulimit -n, LimitNOFILE= in a systemd unit)";
}

Welcome join(const Caller& caller) { return Joining(caller).run(); }

Call::Call(Caller caller) : caller_(std::move(caller)), socket_(join(caller_).socket) {}

Received Call::ask(Message question, std::optional<milliseconds> limit) {
  question.request = ++last_request_;
  const auto asked = Clock::now();
  Received answer;
  if (send_message(socket_.get(), question) == SendResult::kSent) {
    while (wait_for(socket_.get(), limit ? std::optional(*limit - since(asked)) : limit,
                    "to answer")) {
      if (receive_message(socket_.get(), answer, false) != ReceiveResult::kReceived) {
        throw CallError("the daemon has gone without an answer");
      }
      if (answer.message.request != question.request) continue;
      if (answer.message.kind == MessageKind::kRefused) {
        throw RefusedError(std::string(answer.message.text_view()));
      }
      require_descriptors(answer);
      return answer;
    }
    throw CallError(silence_text(socket_, caller_, asked));
  }
  throw CallError("the daemon has gone without an answer");
}

bool Call::wait_for(int descriptor, std::optional<milliseconds> limit, const char* what) {
  return wait_readable(caller_, descriptor, limit,
                       describe_daemon(socket_.get(), caller_.instance) + ' ' + what, has_told_);
}

shm::FileDescriptor Call::process() const {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket_.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return {};
  return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, peer.pid, 0)));
}

void Call::wait_until_gone(const shm::FileDescriptor& process) {
  Received rest;
  do {
    wait_for(socket_.get(), {}, "to end");
  } while (receive_message(socket_.get(), rest, false) == ReceiveResult::kReceived);
  if (process) wait_for(process.get(), {}, "to end");
}

}  // namespace arbiter::wire
