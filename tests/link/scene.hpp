// Hosts: each a daemon with a model of its own and a link, all on this machine. Between them the
// loopback interface, in a domain that no other test uses meanwhile; or cables (cables.hpp).
#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "shm/file_descriptor.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/await.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/temporary_directory.hpp"
#include "tests/support/text_files.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"

namespace arbiter::test {

using namespace std::chrono_literals;

class Host {
 public:
  // `model`: empty, and the host has none. `by`: what starts the link, such as in a network
  // namespace. `arguments`: more of the daemon's. `called`: otherwise than its instance.
  Host(std::string name, const TemporaryDirectory& runtime, const std::string& model,
       std::vector<std::string> network, std::vector<std::string> by = {},
       std::vector<std::string> arguments = {}, std::string called = "")
      : name_(std::move(name)),
        called_(called.empty() ? name_ : std::move(called)),
        daemon_(model, options_of(name_, runtime, model.empty(), std::move(arguments))),
        log_(daemon_.directory() + "/link.log"),
        by_(std::move(by)),
        network_(std::move(network)) {
    start_link();
  }

  [[nodiscard]] Daemon& daemon() { return daemon_; }
  [[nodiscard]] ChildProcess& link() { return link_; }
  // A component of this host.
  [[nodiscard]] Node node(const std::string& name) const {
    NodeOptions options;
    options.instance = name_;
    options.on_notice = [](const Notice&) {};
    return Node(name, options);
  }
  void start_link() {
    std::vector<std::string> arguments = by_;
    arguments.insert(arguments.end(), {std::string(ARBITER_PROGRAMS) + "/arbiter-link",
                                       "--instance", name_, "--host", called_});
    arguments.insert(arguments.end(), network_.begin(), network_.end());
    const shm::FileDescriptor log(
        ::open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600));
    link_ = ChildProcess(arguments, {{"CYCLONEDDS_URI", std::nullopt}}, {-1, -1, log.get()});
  }
  [[nodiscard]] std::string log() const { return content_of(log_); }
  // Returns once the link has said so.
  void see(const std::string& text) const {
    await([&] {
      pollfd ended{link_.descriptor(), POLLIN, 0};
      if (::poll(&ended, 1, 0) == 1) throw std::runtime_error("the link has ended: " + log());
      return log().find(text) != std::string::npos;
    });
  }
  // What the status says of where a source comes from; empty: nobody has it open here.
  [[nodiscard]] std::string described(const std::string& source) {
    const nlohmann::json found = daemon_.source(source);
    return found.is_null() ? "" : found.value("described", "");
  }
  // The daemon hears it a little later.
  void await_described(const std::string& source, const std::string& text) {
    await([&] { return described(source).find(text) != std::string::npos; });
  }

 private:
  static Daemon::Options options_of(const std::string& name, const TemporaryDirectory& runtime,
                                    bool without_model, std::vector<std::string> arguments) {
    Daemon::Options options;
    options.arguments = std::move(arguments);
    options.instance = name;
    options.without_model = without_model;
    options.runtime_directory = runtime.path();
    return options;
  }

  const std::string name_;
  const std::string called_;
  Daemon daemon_;
  const std::string log_;
  const std::vector<std::string> by_;
  const std::vector<std::string> network_;
  ChildProcess link_;
};

// Hosts that find each other on the loopback interface.
class LoopbackHosts : public testing::Test {
 protected:
  // What each link is told of it.
  [[nodiscard]] std::vector<std::string> network() const {
    return {"--domain", std::to_string(domain_.number())};
  }

  const OwnDomain domain_;
  const TemporaryDirectory runtime_;
};

}  // namespace arbiter::test
