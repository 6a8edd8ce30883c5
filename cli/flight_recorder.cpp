#include "cli/flight_recorder.hpp"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <functional>
#include <iostream>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "cli/condition.hpp"
#include "cli/live.hpp"
#include "logging/log_writer.hpp"
#include "recorder/dump_socket.hpp"
#include "recorder/recorder.hpp"
#include "recorder/ring.hpp"
#include "recorder/statement_watch.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

// SIGUSR1 as a descriptor. Call before threads start.
shm::FileDescriptor catch_dump_signal() {
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGUSR1);
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  return shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

class Flight {
 public:
  Flight(const FlightOptions& options, const recorder::RecorderOptions& settings,
         const recording::McapOptions& file, const evidence::RecordingInfo& info)
      : options_(options),
        say_(settings.say),
        condition_(condition_of(options)),
        interrupts_(catch_interrupts()),
        signal_(catch_dump_signal()),
        written_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        events_(epoll_create1(EPOLL_CLOEXEC)),
        socket_(options.prefix),
        ring_(ring_options(file, info)),
        recorder_(settings, ring_) {
    for (const int each : {interrupts_.get(), signal_.get(), written_.get()}) {
      watch(each, EPOLLIN);
    }
    // Whoever has to wait at the door must not keep the loop awake.
    watch(socket_.descriptor(), EPOLLIN | EPOLLET);
    if (condition_) {
      statement_.emplace(
          settings.caller, *condition_, [this] { ring_.request(recorder::Cause::when); },
          settings.say);
    }
  }

  int run() {
    const std::string span = options_.span == shm::kForever ? "records that fit into the memory"
                                                            : seconds_text(options_.span);
    say_("keeping the last " + span + " of " + rules::counted(recorder_.taps(), "source"));
    recorder_.run(time_after(shm::monotonic_now(), options_.duration), events_.get(),
                  [this] { return take_up_events(); });
    statement_.reset();
    recorder_.finish();
    take_up_answers();
    return 0;
  }

 private:
  static std::optional<rules::Statement> condition_of(const FlightOptions& options) {
    if (!options.when) return std::nullopt;
    return read_condition("--when", *options.when);
  }

  recorder::RingOptions ring_options(const recording::McapOptions& file,
                                     const evidence::RecordingInfo& info) {
    recorder::RingOptions options;
    options.span = options_.span;
    options.memory = options_.memory;
    options.prefix = options_.prefix;
    options.file = file;
    options.info = info;
    options.keep = options_.keep;
    options.after = options_.after;
    options.told = [this](const recorder::Dumped& dumped) {
      const std::lock_guard lock(mutex_);
      dumped_.push_back(dumped);
      eventfd_write(written_.get(), 1);
    };
    return options;
  }

  // False: it is to end.
  bool take_up_events() {
    signalfd_siginfo signal{};
    if (::read(interrupts_.get(), &signal, sizeof signal) > 0) return false;
    if (::read(signal_.get(), &signal, sizeof signal) > 0) {
      ring_.request(recorder::Cause::signal);
    }
    take_up_answers();
    socket_.accept([this] { return ring_.request(recorder::Cause::asked); });
    return true;
  }

  void take_up_answers() {
    eventfd_t count = 0;
    static_cast<void>(eventfd_read(written_.get(), &count));
    std::vector<recorder::Dumped> all;
    {
      const std::lock_guard lock(mutex_);
      all.swap(dumped_);
    }
    for (const recorder::Dumped& each : all) {
      const std::string answer =
          each.error.empty() ? "written " + each.file : "failed " + each.error;
      out_.put(answer + '\n');
      for (const std::string& file : each.removed) out_.put("removed " + file + '\n');
      for (const std::uint64_t request : each.requests) socket_.answer(request, answer + '\n');
    }
  }

  void watch(int descriptor, std::uint32_t events) const {
    epoll_event event{};
    event.events = events;
    epoll_ctl(events_.get(), EPOLL_CTL_ADD, descriptor, &event);
  }

  const FlightOptions& options_;
  const std::function<void(const std::string&)> say_;
  logging::LogWriter out_{STDOUT_FILENO};  // nobody need read it while it records
  const std::optional<rules::Statement> condition_;
  const shm::FileDescriptor interrupts_;
  const shm::FileDescriptor signal_;
  const shm::FileDescriptor written_;
  const shm::FileDescriptor events_;
  std::mutex mutex_;
  std::vector<recorder::Dumped> dumped_;  // under it
  recorder::DumpSocket socket_;
  recorder::Ring ring_;
  recorder::Recorder recorder_;
  std::optional<recorder::StatementWatch> statement_;
};

}  // namespace

int fly(const FlightOptions& options, const recorder::RecorderOptions& settings,
        const recording::McapOptions& file, const evidence::RecordingInfo& info) {
  return Flight(options, settings, file, info).run();
}

int dump(const std::string& prefix, shm::Nanoseconds patience) {
  const std::string answer = recorder::ask_for_dump(prefix, patience);
  std::cout << answer;
  return answer.starts_with("written ") ? 0 : 1;
}

}  // namespace arbiter::cli
