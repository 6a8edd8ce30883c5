#include "cli/live.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <utility>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "shm/clock.hpp"

namespace arbiter::cli {

void add_instance_option(CLI::App& verb, std::string& instance) {
  verb.add_option("--instance", instance,
                  "Which daemon; without it $ARBITER_INSTANCE, else \"default\"")
      ->type_name("NAME");
}

NodeOptions live_options(const std::string& instance) {
  NodeOptions options;
  options.instance = instance;
  options.connect_timeout = kConnectTimeout;
  options.on_notice = [](const Notice& notice) { std::cerr << "arbiter: " << notice.text << '\n'; };
  return options;
}

std::shared_ptr<detail::NodeCore> connect(const std::string& verb, const std::string& instance) {
  NodeOptions options = live_options(instance);
  // Of names that the model does not mention the verbs speak themselves.
  options.on_notice = [say = std::move(options.on_notice)](const Notice& notice) {
    if (notice.kind != NoticeKind::unmentioned) say(notice);
  };
  return detail::make_node("arbiter-" + verb, options);
}

nlohmann::json fetch_document(detail::NodeCore& node, shm::MessageKind kind) {
  shm::Message question;
  question.kind = kind;
  return read_document(node.ask(question, {-1, -1}).descriptors[0]);
}

nlohmann::json read_document(const shm::FileDescriptor& descriptor) {
  const int document = descriptor.get();
  struct stat status {};
  if (document < 0 || fstat(document, &status) != 0) throw Error("the daemon sent no document");
  std::string text(static_cast<std::size_t>(status.st_size), '\0');
  std::size_t at = 0;
  while (at < text.size()) {
    const ssize_t got = pread(document, text.data() + at, text.size() - at, static_cast<off_t>(at));
    if (got <= 0) throw Error("the daemon's document cannot be read");
    at += static_cast<std::size_t>(got);
  }
  return nlohmann::json::parse(text);
}

nlohmann::json fetch_status(detail::NodeCore& node) {
  return fetch_document(node, shm::MessageKind::kStatus);
}

shm::FileDescriptor catch_interrupts() {
  sigset_t caught;
  sigemptyset(&caught);
  sigaddset(&caught, SIGINT);
  sigaddset(&caught, SIGTERM);
  sigprocmask(SIG_BLOCK, &caught, nullptr);
  return shm::FileDescriptor(signalfd(-1, &caught, SFD_CLOEXEC | SFD_NONBLOCK));
}

bool sleep_until(shm::Nanoseconds time, const shm::FileDescriptor& interrupts) {
  for (;;) {
    const shm::Nanoseconds left = time - shm::monotonic_now();
    pollfd interrupt{interrupts.get(), POLLIN, 0};
    const timespec span{std::max<shm::Nanoseconds>(left, 0) / 1'000'000'000,
                        std::max<shm::Nanoseconds>(left, 0) % 1'000'000'000};
    if (ppoll(&interrupt, 1, &span, nullptr) == 1) return true;
    if (left <= 0) return false;
  }
}

// /proc/PID/stat: "pid (name) state …".
bool is_stopped(int pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string text;
  std::getline(file, text);
  const auto end = text.rfind(") ");
  return end != std::string::npos && end + 2 < text.size() &&
         (text[end + 2] == 'T' || text[end + 2] == 't');
}

std::string seconds_text(shm::Nanoseconds span) {
  char text[64];
  std::snprintf(text, sizeof text, "%.3f s", static_cast<double>(span) / 1e9);
  return text;
}

}  // namespace arbiter::cli
