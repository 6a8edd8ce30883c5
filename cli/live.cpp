#include "cli/live.hpp"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <stdexcept>
#include <utility>

#include <CLI/CLI.hpp>

#include "recorder/sleep.hpp"
#include "shm/clock.hpp"
#include "wire/document.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::cli {
namespace {

// What the daemon has to answer a question that changes nothing.
constexpr std::chrono::milliseconds kAnswerTime{10'000};

std::string status_text(wire::Caller caller, std::chrono::milliseconds answer_time) {
  wire::Call daemon(std::move(caller));
  wire::Message question;
  question.kind = wire::MessageKind::kStatus;
  return wire::read_document(daemon.ask(question, answer_time).descriptors[0]);
}

std::string problem_of_instance(std::string& name) try {
  static_cast<void>(wire::instance_name(name));
  return "";
} catch (const std::invalid_argument& error) {
  return error.what();
}

}  // namespace

void add_instance_option(CLI::App& verb, std::string& instance) {
  verb.add_option(
          "--instance", instance,
          "Which daemon to use; by default $ARBITER_INSTANCE, or \"default\" if that is not set")
      ->type_name("NAME")
      ->check(CLI::Validator(problem_of_instance, ""));
}

NodeOptions live_options(const std::string& instance) {
  NodeOptions options;
  options.instance = wire::instance_name(instance);
  options.connect_timeout = kConnectTimeout;
  // Longer than that it waits only for a daemon that is there: for that it has a time of its own.
  options.on_waiting = [whom = options.instance](const std::string&) {
    std::cerr << "arbiter: waiting for the arbiterd of instance \"" + whom + "\" to answer\n";
  };
  options.on_notice = [](const Notice& notice) { std::cerr << "arbiter: " << notice.text << '\n'; };
  return options;
}

wire::Caller caller(const std::string& verb, const std::string& instance) {
  wire::Caller caller;
  caller.name = "arbiter-" + verb;
  caller.instance = wire::instance_name(instance);
  caller.patience = kConnectTimeout;
  caller.on_waiting = [](const std::string& whom) {
    std::cerr << "arbiter: waiting for " + whom + '\n';
  };
  return caller;
}

std::shared_ptr<watch::Instance> watch_instance(const std::string& verb,
                                                const std::string& instance) {
  return std::make_shared<watch::Instance>(caller(verb, instance));
}

std::shared_ptr<watch::Instance> follow_instance(const std::string& verb,
                                                 const std::string& instance,
                                                 std::chrono::milliseconds most,
                                                 std::chrono::milliseconds patience) {
  wire::Caller follower = caller(verb, instance);
  follower.patience = patience;
  follower.answer_time = most;
  return std::make_shared<watch::Instance>(std::move(follower));
}

void DaemonNews::tell(const watch::Instance& instance) {
  const watch::DaemonPresence::Change change = presence_.look(instance);
  if (change.has_gone) {
    std::cerr
        << "arbiter: the daemon has gone; its last decisions stay in force, and arbiter keeps "
        << goes_on_ << " them\n";
  }
  if (change.is_back) std::cerr << "arbiter: a daemon is there again\n";
}

ModelNews::Model ModelNews::in_force(const watch::Instance& instance) {
  return {instance.memory(), instance.memory()->tables().generation()};
}

std::optional<ModelNews::Model> ModelNews::unknown(const watch::Instance& instance) const {
  Model model = in_force(instance);
  if (model == noted_ || !instance.has_daemon()) return std::nullopt;
  if (shm::monotonic_now() < ask_again_) return std::nullopt;
  return model;
}

void ModelNews::put_off() {
  constexpr shm::Nanoseconds kAskAgainLater = 5'000'000'000;
  ask_again_ = shm::monotonic_now() + kAskAgainLater;
}

std::string fetch_status_text(const std::string& verb, const std::string& instance) {
  return status_text(caller(verb, instance), kAnswerTime);
}

wire::Status fetch_status(const std::string& verb, const std::string& instance) {
  return fetch_status(caller(verb, instance), kAnswerTime);
}

wire::Status fetch_status(wire::Caller caller, std::chrono::milliseconds answer_time) {
  return wire::read_status(status_text(std::move(caller), answer_time));
}

shm::FileDescriptor catch_interrupts() {
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGINT);
  sigaddset(&caught, SIGTERM);
  // nohup has it ignored; but a signal that is blocked is read here all the same.
  struct sigaction hangup {};
  if (sigaction(SIGHUP, nullptr, &hangup) != 0 || hangup.sa_handler != SIG_IGN) {
    sigaddset(&caught, SIGHUP);
  }
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  return shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

int interrupted_exit_code(const shm::FileDescriptor& interrupts) {
  signalfd_siginfo signal{};
  const bool is_known = ::read(interrupts.get(), &signal, sizeof signal) == sizeof signal;
  return 128 + (is_known ? static_cast<int>(signal.ssi_signo) : SIGINT);
}

bool sleep_until(shm::Nanoseconds time, const shm::FileDescriptor& interrupts) {
  return recorder::sleep_until(time, {interrupts.get()});
}

std::string seconds_text(shm::Nanoseconds span) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(span) / 1e9);
  return text;
}

}  // namespace arbiter::cli
