// A real arbiterd in a runtime directory of its own.
#pragma once

#include <dirent.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/child_process.hpp"
#include "tests/support/datagram_socket.hpp"
#include "tests/support/raw_client.hpp"
#include "tests/support/temporary_directory.hpp"

namespace arbiter::test {

// Sets a variable of this process for as long as it lives; nullopt: not set.
class ScopedVariable {
 public:
  ScopedVariable(const char* name, const std::optional<std::string>& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    set(value);
  }
  ScopedVariable(const ScopedVariable&) = delete;
  ScopedVariable& operator=(const ScopedVariable&) = delete;
  ~ScopedVariable() { set(before_); }

 private:
  void set(const std::optional<std::string>& value) const {
    if (value) {
      ::setenv(name_, value->c_str(), 1);
    } else {
      ::unsetenv(name_);
    }
  }

  const char* name_;
  std::optional<std::string> before_;
};

// Where a service manager would hear that the daemon is ready.
class NotifySocket {
 public:
  explicit NotifySocket(std::string path)
      : path_(std::move(path)), socket_(datagram_socket_at(path_)) {}

  [[nodiscard]] const std::string& path() const { return path_; }
  // True: a message that contains `text` has come; false: the process ended before it.
  bool wait_for(const std::string& text, const ChildProcess& process) {
    for (;;) {
      pollfd polled[2]{{socket_.get(), POLLIN, 0}, {process.descriptor(), POLLIN, 0}};
      if (::poll(polled, 2, -1) < 0) continue;
      const std::string message = receive();
      if (message.find(text) != std::string::npos) return true;
      if (message.empty() && polled[1].revents != 0) return false;
    }
  }
  // What the daemon has asked to be kept (FDSTORE=1) and not to be given up, by name.
  const std::map<std::string, shm::FileDescriptor>& stored() {
    while (!receive().empty()) {
    }
    return stored_;
  }

 private:
  static std::string name_in(const std::string& message) {
    const auto name = message.find("FDNAME=") + std::strlen("FDNAME=");
    return message.substr(name, message.find('\n', name) - name);
  }
  // Empty: there is none.
  std::string receive() {
    char text[512];
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))];
    iovec data{text, sizeof text};
    msghdr header{};
    header.msg_iov = &data;
    header.msg_iovlen = 1;
    header.msg_control = control;
    header.msg_controllen = sizeof control;
    const ssize_t size = ::recvmsg(socket_.get(), &header, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
    if (size <= 0) return {};
    const std::string message(text, static_cast<std::size_t>(size));
    if (message.find("FDSTOREREMOVE=1") != std::string::npos) stored_.erase(name_in(message));
    if (const cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(part), sizeof fd);
      stored_[name_in(message)].reset(fd);
    }
    return message;
  }

  std::map<std::string, shm::FileDescriptor> stored_;
  std::string path_;
  shm::FileDescriptor socket_;
};

inline std::string arbiterd_path() { return std::string(ARBITER_PROGRAMS) + "/arbiterd"; }

inline const std::string kNoRules = "<behaviors/>";

// Starts a daemon and lets this process, and those that it starts, find it: while one lives,
// XDG_RUNTIME_DIR and ARBITER_INSTANCE are set to its own.
class Daemon {
 public:
  struct Options {
    std::string instance = "test";
    std::optional<std::string> application{};
    std::vector<std::string> arguments{};
    bool without_model = false;
    std::optional<std::string> runtime_directory{};  // else one of its own
    std::optional<int> max_descriptors{};
    std::vector<std::string> by{};  // a program that is given the daemon's command line to execute
    std::string program = arbiterd_path();
  };

  explicit Daemon(const std::string& model = kNoRules) : Daemon(model, Options()) {}
  Daemon(const std::string& model, Options options)
      : options_(std::move(options)),
        runtime_("XDG_RUNTIME_DIR", options_.runtime_directory.value_or(directory_.path())),
        instance_("ARBITER_INSTANCE", options_.instance),
        own_("RUNTIME_DIRECTORY", std::nullopt),
        notify_(directory_.path() + "/notify") {
    write_model(model);
    if (options_.application) directory_.write("application.xml", *options_.application);
    start();
    require_ready();
  }
  ~Daemon() {
    if (!process_.runs()) return;
    process_.signal(SIGTERM);
    EXPECT_EQ(process_.wait(), 0) << log();
  }
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;

  // Whole or not at all, for the daemon may be reading what was there.
  void write_model(const std::string& text) { replace("model.xml", text); }
  void write_application(const std::string& text) { replace("application.xml", text); }

  // Puts a model in force; returns when it is.
  void load(const std::string& model) {
    const auto before = status()["model"];
    write_model(model);
    hang_up();
    for (auto now = before; now["generation"] == before["generation"]; now = status()["model"]) {
      if (now["reloads_refused"] != before["reloads_refused"]) throw std::runtime_error(log());
    }
  }
  // The same with one that must be refused.
  void load_bad(const std::string& model) {
    const auto before = refused();
    write_model(model);
    hang_up();
    while (refused() == before) {
    }
  }
  void hang_up() const { process_.signal(SIGHUP); }
  int terminate() {
    process_.signal(SIGTERM);
    return process_.wait();
  }
  void kill() { process_.kill(); }
  // What the next daemon would take over by. After it has ended.
  void lose_state() const {
    const std::string socket = socket_path();
    ::unlink((socket.substr(0, socket.rfind(".sock")) + ".state").c_str());
  }
  // After it has ended.
  void restart() {
    start();
    require_ready();
  }

  nlohmann::json status() {
    RawClient client(options_.instance);
    client.hello("status");
    return client.status();
  }
  nlohmann::json source(const std::string& name) { return named(status()["sources"], name); }
  // Of an output port, by the status.
  std::size_t taps_of(const std::string& name) {
    return source(name).value("taps", nlohmann::json::array()).size();
  }
  nlohmann::json input(const std::string& name) { return named(status()["inputs"], name); }
  nlohmann::json connection(const std::string& from, const std::string& to) {
    const nlohmann::json port = input(to);
    for (const auto& each : port["connections"]) {
      if (each["source"] == from) return each;
    }
    return nullptr;
  }
  std::uint64_t generation() { return status()["model"]["generation"]; }
  std::uint64_t refused() { return status()["model"]["reloads_refused"]; }

  void restart_without_model() {
    options_.without_model = true;
    restart();
  }
  // The same, with what the last one has stored, as a service manager would.
  void restart_with_stored() {
    std::string redirections = "exec";
    std::string names;
    std::vector<shm::FileDescriptor> inherited;
    int number = 3;
    for (const auto& [name, descriptor] : notify_.stored()) {
      inherited.emplace_back(::fcntl(descriptor.get(), F_DUPFD, 100));
      redirections +=
          " " + std::to_string(number++) + "<&" + std::to_string(inherited.back().get());
      names += (names.empty() ? "" : ":") + name;
    }
    start({"/bin/bash", "-c",
           redirections + "; LISTEN_PID=$$ LISTEN_FDS=" + std::to_string(number - 3) +
               " LISTEN_FDNAMES=" + names + R"( exec "$0" "$@")"});
    require_ready();
  }

  [[nodiscard]] const std::string& instance() const { return options_.instance; }
  // Where its files are.
  [[nodiscard]] std::string directory() const { return directory_.path(); }
  [[nodiscard]] std::string socket_path() const {
    return options_.runtime_directory.value_or(directory()) + "/arbiter/" + instance() + ".sock";
  }
  [[nodiscard]] ChildProcess& process() { return process_; }
  [[nodiscard]] NotifySocket& notify() { return notify_; }
  [[nodiscard]] std::string log() const {
    std::ifstream file(directory() + "/log");
    return {std::istreambuf_iterator<char>(file), {}};
  }
  [[nodiscard]] std::size_t open_descriptors() const {
    std::size_t count = 0;
    DIR* const listing = ::opendir(("/proc/" + std::to_string(process_.pid()) + "/fd").c_str());
    if (listing == nullptr) return 0;
    while (::readdir(listing) != nullptr) ++count;
    ::closedir(listing);
    return count;
  }

 private:
  void replace(const std::string& name, const std::string& text) {
    std::filesystem::rename(directory_.write(name + ".new", text), directory_.file(name));
  }

  static nlohmann::json named(const nlohmann::json& list, const std::string& name) {
    for (const auto& each : list) {
      if (each["name"] == name) return each;
    }
    return nullptr;
  }

  void start(const std::vector<std::string>& by = {}) {
    std::vector<std::string> argv{options_.program, "--instance", options_.instance, "--log-level",
                                  "debug"};
    if (!options_.without_model) {
      argv.insert(argv.end(), {"--model", directory_.path() + "/model.xml"});
    }
    if (options_.application) {
      argv.insert(argv.end(), {"--application", directory_.path() + "/application.xml"});
    }
    argv.insert(argv.end(), options_.arguments.begin(), options_.arguments.end());
    if (options_.max_descriptors) {
      const std::string limit = "ulimit -n " + std::to_string(*options_.max_descriptors);
      argv.insert(argv.begin(), {"/bin/sh", "-c", limit + R"( && exec "$0" "$@")"});
    }
    argv.insert(argv.begin(), by.begin(), by.end());
    argv.insert(argv.begin(), options_.by.begin(), options_.by.end());
    const shm::FileDescriptor log(::open((directory_.path() + "/log").c_str(),
                                         O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    process_ = ChildProcess(argv, {{"NOTIFY_SOCKET", notify_.path()}}, {-1, -1, log.get()});
  }
  void require_ready() {
    if (!notify_.wait_for("READY=1", process_)) {
      throw std::runtime_error("arbiterd did not become ready:\n" + log());
    }
  }

  Options options_;
  TemporaryDirectory directory_;
  ScopedVariable runtime_;
  ScopedVariable instance_;
  ScopedVariable own_;
  NotifySocket notify_;
  ChildProcess process_;
};

}  // namespace arbiter::test
