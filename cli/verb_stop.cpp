// arbiter stop: ends the daemon, and returns when it is gone.
#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <iostream>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "cli/live.hpp"
#include "cli/verbs.hpp"
#include "shm/rendezvous.hpp"
#include "shm/wire.hpp"

namespace arbiter::cli {
namespace {

// A conversation of its own: a node would look for another daemon where this one goes.
class Conversation {
 public:
  explicit Conversation(const std::string& instance) {
    std::string why_not;
    auto socket = shm::connect_to_daemon(instance, why_not);
    if (!socket) {
      throw Error("no arbiterd of instance \"" + instance + "\" is running" +
                  (why_not.empty() ? "" : " (" + why_not + ")"));
    }
    socket_ = std::move(*socket);
  }

  void ask(shm::Message question) {
    question.request = ++last_request_;
    if (shm::send_message(socket_.get(), question) != shm::SendResult::kSent) fail();
    shm::Received reply;
    while (shm::receive_message(socket_.get(), reply, true) == shm::ReceiveResult::kReceived) {
      if (reply.message.request != question.request) continue;
      if (reply.message.kind == shm::MessageKind::kRefused) {
        throw Error(std::string(reply.message.text_view()));
      }
      return;
    }
    fail();
  }

  // The daemon's process as a descriptor, none where it cannot be seen from here.
  [[nodiscard]] shm::FileDescriptor process() const {
    ucred peer{};
    socklen_t size = sizeof peer;
    if (getsockopt(socket_.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return {};
    return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, peer.pid, 0)));
  }

  void wait_until_hung_up() {
    shm::Received rest;
    while (shm::receive_message(socket_.get(), rest, true) == shm::ReceiveResult::kReceived) {
    }
  }

 private:
  [[noreturn]] static void fail() { throw Error("the daemon has gone without an answer"); }

  shm::FileDescriptor socket_;
  std::uint64_t last_request_ = 0;
};

int stop(const std::string& given) {
  Conversation daemon(shm::instance_name(given));
  shm::Message hello;
  hello.kind = shm::MessageKind::kHello;
  hello.value = shm::kWireVersion;
  hello.set_name("arbiter-stop");
  daemon.ask(hello);
  const shm::FileDescriptor process = daemon.process();
  shm::Message question;
  question.kind = shm::MessageKind::kStop;
  daemon.ask(question);
  daemon.wait_until_hung_up();
  pollfd ended{process.get(), POLLIN, 0};
  while (process && ::poll(&ended, 1, -1) < 0) {
  }
  std::cout << "the daemon has stopped; ports that are connected work on\n";
  return 0;
}

}  // namespace

void add_stop(CLI::App& app, int& exit_code) {
  const auto instance = std::make_shared<std::string>();
  CLI::App* verb = app.add_subcommand("stop", "End the daemon; returns when it is gone");
  add_instance_option(*verb, *instance);
  verb->footer("Example:\n  arbiter stop");
  verb->callback([instance, &exit_code] { exit_code = stop(*instance); });
}

}  // namespace arbiter::cli
