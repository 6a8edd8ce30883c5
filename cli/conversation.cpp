#include "cli/conversation.hpp"

#include <sys/socket.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <iostream>

#include <arbiter/result.hpp>
#include <nlohmann/json.hpp>

#include "cli/live.hpp"
#include "shm/rendezvous.hpp"

namespace arbiter::cli {

Conversation::Conversation(const std::string& verb, const std::string& given) {
  const std::string instance = shm::instance_name(given);
  std::string why_not;
  auto socket = shm::connect_to_daemon(instance, why_not);
  if (!socket) {
    throw Error("no arbiterd of instance \"" + instance + "\" is running" +
                (why_not.empty() ? "" : " (" + why_not + ")"));
  }
  socket_ = std::move(*socket);
  shm::Message hello;
  hello.kind = shm::MessageKind::kHello;
  hello.value = shm::kWireVersion;
  hello.set_name("arbiter-" + verb);
  ask(hello);
}

shm::Received Conversation::ask(shm::Message question) {
  question.request = ++last_request_;
  const bool is_sent = shm::send_message(socket_.get(), question) == shm::SendResult::kSent;
  shm::Received reply;
  while (is_sent &&
         shm::receive_message(socket_.get(), reply, true) == shm::ReceiveResult::kReceived) {
    if (reply.message.request != question.request) continue;
    if (reply.message.kind == shm::MessageKind::kRefused) {
      throw Error(std::string(reply.message.text_view()));
    }
    return reply;
  }
  throw Error("the daemon has gone without an answer");
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

void Conversation::wait_until_hung_up() {
  shm::Received rest;
  while (shm::receive_message(socket_.get(), rest, true) == shm::ReceiveResult::kReceived) {
  }
}

void write_in_force(const nlohmann::json& report) {
  std::cout << "model " << report.at("generation") << " is in force\n";
  if (!report.at("changes").is_null()) {
    std::cout << "  " << report.at("changes").get<std::string>() << '\n';
  }
}

int write_result(const nlohmann::json& report, bool json) {
  const bool is_done = report.at("ok").get<bool>();
  if (is_done && !json) write_in_force(report);
  return is_done ? 0 : 1;
}

}  // namespace arbiter::cli
