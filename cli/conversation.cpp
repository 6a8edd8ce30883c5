#include "cli/conversation.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <iostream>

#include <arbiter/result.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "shm/clock.hpp"
#include "wire/instances.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::cli {
namespace {

// Of a daemon that has accepted us. It may be busy: it reads large models within seconds.
constexpr int kMaxSilenceMs = 5000;
// Nobody is told of a shorter wait.
constexpr int kQuietMs = 2000;

}  // namespace

Conversation::Conversation(const std::string& verb, const std::string& given)
    : instance_(shm::instance_name(given)) {
  std::string why_not;
  auto socket = shm::connect_to_daemon(instance_, why_not);
  if (!socket) {
    throw Error("no arbiterd of instance \"" + instance_ + "\" is running" +
                (why_not.empty() ? "" : " (" + why_not + ")") +
                shm::describe_listening_instances());
  }
  socket_ = std::move(*socket);
  shm::Message hello;
  hello.kind = shm::MessageKind::kHello;
  hello.value = shm::kWireVersion;
  hello.set_name("arbiter-" + verb);
  receive_answer(hello, kMaxSilenceMs);
}

shm::Received Conversation::ask(shm::Message question) { return receive_answer(question, -1); }

shm::Received Conversation::receive_answer(const shm::Message& question, int limit_ms) {
  shm::Message numbered = question;
  numbered.request = ++last_request_;
  const bool is_sent = shm::send_message(socket_.get(), numbered) == shm::SendResult::kSent;
  shm::Received reply;
  while (is_sent) {
    if (!wait_for(socket_.get(), limit_ms, "to answer")) {
      throw Error(shm::describe_daemon(socket_.get(), instance_) +
                  " runs, but did not answer within " + std::to_string(limit_ms) +
                  " ms: it is stopped, or busy; nothing was asked of it");
    }
    if (shm::receive_message(socket_.get(), reply, true) != shm::ReceiveResult::kReceived) break;
    if (reply.message.request != numbered.request) continue;
    if (reply.message.kind == shm::MessageKind::kRefused) {
      throw Error(std::string(reply.message.text_view()));
    }
    return reply;
  }
  throw Error("the daemon has gone without an answer");
}

bool Conversation::wait_for(int descriptor, int limit_ms, const std::string& what) {
  const shm::Nanoseconds begin = shm::monotonic_now();
  for (;;) {
    const auto waited = static_cast<int>((shm::monotonic_now() - begin) / 1'000'000);
    if (limit_ms >= 0 && waited >= limit_ms) return false;
    int next = limit_ms < 0 ? -1 : limit_ms - waited;
    if (!has_told_ && waited >= kQuietMs) {
      has_told_ = true;
      std::cerr << "arbiter: waiting for " + shm::describe_daemon(socket_.get(), instance_) + ' ' +
                       what + '\n';
    }
    if (!has_told_) next = kQuietMs - waited;
    pollfd polled{descriptor, POLLIN, 0};
    if (::poll(&polled, 1, next) == 1) return true;
  }
}

nlohmann::json Conversation::ask_for_change(shm::Message question, bool json) {
  question.flags |= shm::kWantsReport;
  nlohmann::json report = read_document(ask(question).descriptors[0]);
  if (json) {
    std::cout << report.dump(2) << '\n';
    return report;
  }
  std::cerr << report.at("text").get<std::string>();
  if (report.at("has_errors").get<bool>()) {
    std::cerr << "arbiter: refused; nothing has changed\n";
  } else if (!report.at("ok").get<bool>()) {
    std::cerr << "arbiter: " << report.at("why").get<std::string>() << '\n';
  }
  return report;
}

shm::FileDescriptor Conversation::process() const {
  ucred peer{};
  socklen_t size = sizeof peer;
  if (getsockopt(socket_.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) return {};
  return shm::FileDescriptor(static_cast<int>(syscall(SYS_pidfd_open, peer.pid, 0)));
}

void Conversation::wait_until_gone(const shm::FileDescriptor& process) {
  shm::Received rest;
  do {
    wait_for(socket_.get(), -1, "to end");
  } while (shm::receive_message(socket_.get(), rest, true) == shm::ReceiveResult::kReceived);
  if (process) wait_for(process.get(), -1, "to end");
}

void write_in_force(const nlohmann::json& report) {
  std::cout << "model " << report.at("generation") << " is in force\n";
  if (const auto& past = report.at("back_to"); !past.is_null()) {
    std::cout << "  it is model " << past.at("generation")
              << " again: " << past.at("name").get<std::string>();
    for (const auto& file : past.at("files")) std::cout << ' ' << file.get<std::string>();
    std::cout << " (" << past.at("how").get<std::string>() << ")\n";
  }
  if (!report.at("changes").is_null()) {
    std::cout << "  " << report.at("changes").at("summary").get<std::string>() << '\n';
  }
}

int write_result(const nlohmann::json& report, bool json) {
  const bool is_done = report.at("ok").get<bool>();
  if (is_done && !json) write_in_force(report);
  return is_done ? 0 : 1;
}

}  // namespace arbiter::cli
