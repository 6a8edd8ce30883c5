#include "cli/flight_recorder.hpp"

#include <signal.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/signalfd.h>

#include <iostream>
#include <mutex>
#include <optional>
#include <utility>

#include "cli/condition.hpp"
#include "cli/live.hpp"
#include "recorder/dump_socket.hpp"
#include "recorder/recorder.hpp"
#include "recorder/ring.hpp"
#include "recorder/statement_watch.hpp"

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
        condition_(condition_of(options)),
        interrupts_(catch_interrupts()),
        signal_(catch_dump_signal()),
        written_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
        events_(epoll_create1(EPOLL_CLOEXEC)),
        socket_(options.prefix),
        ring_(ring_options(file, info)),
        recorder_(settings, ring_) {
    for (const int each :
         {interrupts_.get(), signal_.get(), written_.get(), socket_.descriptor()}) {
      epoll_event event{};
      event.events = EPOLLIN;
      epoll_ctl(events_.get(), EPOLL_CTL_ADD, each, &event);
    }
    if (condition_) {
      statement_.emplace(
          settings.caller, *condition_, [this] { ring_.request("when"); }, settings.say);
    }
  }

  int run() {
    std::cerr << "arbiter: keeping the last " + seconds_text(options_.span) + " of " +
                     std::to_string(recorder_.taps()) + " sources\n";
    recorder_.run(options_.end, events_.get(), [this] { return take_up_events(); });
    statement_.reset();
    recorder_.finish();
    take_up_answers();
    return 0;
  }

 private:
  static std::optional<rules::Statement> condition_of(const FlightOptions& options) {
    if (options.when.empty()) return std::nullopt;
    return read_condition("--when", options.when);
  }

  recorder::RingOptions ring_options(const recording::McapOptions& file,
                                     const evidence::RecordingInfo& info) {
    recorder::RingOptions options;
    options.span = options_.span;
    options.memory = options_.memory;
    options.prefix = options_.prefix;
    options.file = file;
    options.info = info;
    options.told = [this](const std::string& path, const std::string& error) {
      const std::lock_guard lock(mutex_);
      answers_.push_back(error.empty() ? "written " + path : "failed " + error);
      eventfd_write(written_.get(), 1);
    };
    return options;
  }

  // False: it is to end.
  bool take_up_events() {
    signalfd_siginfo signal{};
    if (::read(interrupts_.get(), &signal, sizeof signal) > 0) return false;
    if (::read(signal_.get(), &signal, sizeof signal) > 0) ring_.request("signal");
    if (socket_.accept()) ring_.request("asked");
    take_up_answers();
    return true;
  }

  void take_up_answers() {
    eventfd_t count = 0;
    static_cast<void>(eventfd_read(written_.get(), &count));
    std::vector<std::string> answers;
    {
      const std::lock_guard lock(mutex_);
      answers.swap(answers_);
    }
    for (const std::string& answer : answers) {
      std::cout << answer << std::endl;
      socket_.answer(answer + '\n');
    }
  }

  const FlightOptions& options_;
  const std::optional<rules::Statement> condition_;
  const shm::FileDescriptor interrupts_;
  const shm::FileDescriptor signal_;
  const shm::FileDescriptor written_;
  const shm::FileDescriptor events_;
  std::mutex mutex_;
  std::vector<std::string> answers_;  // under it
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

int dump(const std::string& prefix) {
  const std::string answer = recorder::ask_for_dump(prefix);
  std::cout << answer;
  return answer.starts_with("written ") ? 0 : 1;
}

}  // namespace arbiter::cli
