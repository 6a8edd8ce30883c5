#include "tests/link/failures/component.hpp"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <thread>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "shm/file_descriptor.hpp"
#include "tests/link/failures/command.hpp"
#include "tests/link/failures/time.hpp"
#include "tests/stress/sample.hpp"

namespace arbiter::failures {
namespace {

using Pair = std::pair<std::uint32_t, std::uint64_t>;

constexpr Nanoseconds kGivenUp = 120 * kSecond;  // no daemon is dead for so long

// A dead predecessor has the name until the daemon has noticed; a daemon may be dead itself.
template <class Open>
auto open(Open open_port) {
  for (const Nanoseconds since = now();;) {
    try {
      return open_port();
    } catch (const Error&) {
      if (now() - since > kGivenUp) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  }
}

NodeOptions node_options(const ComponentOptions& options) {
  NodeOptions result;
  result.instance = options.instance;
  result.on_notice = [](const Notice&) {};
  result.on_waiting = [](const std::string&) {};
  return result;
}

Type type() { return Type::variable("failures/Command", kLarge); }

int heard(int signals) {
  signalfd_siginfo info{};
  return ::read(signals, &info, sizeof info) == sizeof info ? static_cast<int>(info.ssi_signo) : 0;
}

class Rival {
 public:
  explicit Rival(const ComponentOptions& options)
      : options_(options),
        node_(open([&] { return Node("rival", node_options(options)); })),
        port_(open([&] { return node_.output_port(kShared, type()); })) {}

  void run(int signals) {
    bool is_over = false;
    for (std::uint64_t number = 1;;) {
      const int signal = heard(signals);
      if (signal == SIGTERM) return;
      is_over = is_over || signal == SIGUSR2;
      if (!is_over) {
        const Command command{options_.host, options_.life, number++, now()};
        port_.publish(Bytes(reinterpret_cast<const std::byte*>(&command), sizeof command));
      }
      std::this_thread::sleep_for(std::chrono::nanoseconds(options_.period_ns));
    }
  }

 private:
  const ComponentOptions options_;
  Node node_;
  OutputPort<void> port_;
};

class Component {
 public:
  explicit Component(const ComponentOptions& options)
      : options_(options),
        random_(options.seed * 977 + options.host * 31 + options.life),
        node_(open([&] { return Node("component", node_options(options)); })),
        port_(open([&] { return node_.output_port(source_of(options.host), type()); })),
        hold_(open([&] { return node_.output_port(hold_of(options.host), type()); })),
        motor_(open([&] { return node_.input_port(motor_of(options.host), type()); })) {}

  void run(int signals) {
    Nanoseconds next = now();
    for (;;) {
      switch (heard(signals)) {
        case SIGTERM:
          return;
        case SIGUSR1:
          is_steady_ = true;
          break;
        case SIGUSR2:
          is_over_ = true;
          break;
        default:
          break;
      }
      step();
      next = std::max(next + options_.period_ns, now());
      while (now() < next) {
        const auto left = std::chrono::nanoseconds(next - now());
        if (const auto got = motor_.wait_for(std::max(left, std::chrono::nanoseconds(0)))) {
          look_at(*got);
        } else if (got.idle()) {
          std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
      }
      while (const auto got = motor_.take()) look_at(*got);
    }
  }

 private:
  void step() {
    if (is_over_) return;
    publish(hold_, ++held_);
    const Nanoseconds time = now();
    if (!is_steady_ && time >= until_) {
      is_silent_ = !is_silent_;
      // Now and then so long that whoever has lost the deactivation has been told again.
      const std::uint32_t most = !is_silent_ ? 2500 : random_.one_in(4) ? 3000 : 700;
      until_ = time + (100 + random_.below(most)) * kMs;
      if (is_silent_ && random_.one_in(2)) port_.deactivate();
    }
    if (is_steady_ || !is_silent_) publish(port_, ++published_);
  }
  void publish(OutputPort<void>& port, std::uint64_t number) {
    const Command command{options_.host, options_.life, number, now()};
    std::memcpy(bytes_.data(), &command, sizeof command);
    port.publish(Bytes(bytes_.data(), sample_size(options_.host)));
  }

  void look_at(const Sample<void>& sample) {
    Command command;
    std::memcpy(&command, sample.data(), sizeof command);
    Pair& last = last_[{std::string(sample.source()), command.host}];
    const Pair current{command.life, command.number};
    if (current <= last) {
      std::fprintf(stderr, "FOUND %s took %u.%llu of %s after %u.%llu\n",
                   motor_of(options_.host).c_str(), command.life,
                   static_cast<unsigned long long>(command.number), sample.source().c_str(),
                   last.first, static_cast<unsigned long long>(last.second));
    }
    last = current;
    look_at_origin(sample, command);
  }

  // What its publisher has published while nobody was there to have it, it has not counted: a
  // sample is never an earlier one than that of its number.
  void look_at_origin(const Sample<void>& sample, const Command& command) {
    const Origin origin = sample.origin();
    if (origin.publisher == 0) return;
    std::uint64_t& before =
        uncounted_[{std::string(sample.source()), {command.host, command.life}}];
    const std::uint64_t uncounted = command.number - origin.sequence;
    if (origin.sequence > command.number || uncounted < before) {
      std::fprintf(stderr, "FOUND %s took %u.%llu of %s as number %llu\n",
                   motor_of(options_.host).c_str(), command.life,
                   static_cast<unsigned long long>(command.number), sample.source().c_str(),
                   static_cast<unsigned long long>(origin.sequence));
    }
    before = uncounted;
  }

  const ComponentOptions options_;
  stress::Random random_;
  Node node_;
  OutputPort<void> port_;
  OutputPort<void> hold_;
  InputPort<void> motor_;
  std::array<std::byte, kLarge> bytes_{};
  std::uint64_t published_ = 0;
  std::uint64_t held_ = 0;
  bool is_silent_ = true;
  bool is_steady_ = false;
  bool is_over_ = false;
  Nanoseconds until_ = 0;
  std::map<std::pair<std::string, std::uint32_t>, Pair> last_;  // of each speaker
  // Of each life of each speaker.
  std::map<std::pair<std::string, Pair>, std::uint64_t> uncounted_;
};

}  // namespace

int run_component(const ComponentOptions& options) {
  sigset_t heard;
  sigemptyset(&heard);
  for (const int each : {SIGTERM, SIGUSR1, SIGUSR2}) sigaddset(&heard, each);
  sigprocmask(SIG_BLOCK, &heard, nullptr);
  const shm::FileDescriptor signals(::signalfd(-1, &heard, SFD_NONBLOCK | SFD_CLOEXEC));
  if (options.is_rival) {
    Rival(options).run(signals.get());
  } else {
    Component(options).run(signals.get());
  }
  return 0;
}

}  // namespace arbiter::failures
