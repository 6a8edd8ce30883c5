// A client of the daemon that says what it likes, below the client library.
#pragma once

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <stdexcept>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "shm/segment.hpp"
#include "wire/call.hpp"
#include "wire/messages.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {

// What a reply has brought, of kStatusReply or the like.
inline nlohmann::json read_document(const wire::Received& reply) {
  std::string text;
  std::array<char, 65536> buffer;
  ssize_t count = 0;
  off_t at = 0;
  while ((count = ::pread(reply.descriptors[0].get(), buffer.data(), buffer.size(), at)) > 0) {
    text.append(buffer.data(), static_cast<std::size_t>(count));
    at += count;
  }
  return nlohmann::json::parse(text);
}

class RawClient {
 public:
  using Descriptors = std::array<int, wire::kMaxDescriptors>;

  // Connected by other means.
  explicit RawClient(shm::FileDescriptor socket) : socket_(std::move(socket)) {}

  explicit RawClient(const std::string& instance) {
    std::string why_not;
    auto socket = wire::connect_to_daemon(instance, why_not);
    if (!socket) throw std::runtime_error("no daemon of instance " + instance + " " + why_not);
    socket_ = std::move(*socket);
  }

  static wire::Message message(wire::MessageKind kind, const std::string& name = {}) {
    wire::Message result;
    result.kind = kind;
    result.request = 77;
    result.set_name(name);
    return result;
  }

  wire::SendResult send(const wire::Message& message, Descriptors descriptors = {-1, -1}) {
    return wire::send_message(socket_.get(), message, descriptors);
  }
  bool send_bytes(const void* data, std::size_t size) {
    return ::send(socket_.get(), data, size, MSG_NOSIGNAL) == static_cast<ssize_t>(size);
  }
  // Blocks. False: the daemon has closed the connection.
  bool receive(wire::Received& received) {
    return wire::receive_message(socket_.get(), received, true) == wire::ReceiveResult::kReceived;
  }
  // Waits for the next message of that kind, and lets others pass.
  wire::Received expect(wire::MessageKind kind) {
    wire::Received received;
    while (receive(received)) {
      if (received.message.kind == kind) return received;
      if (received.message.kind == wire::MessageKind::kRefused) {
        throw std::runtime_error(std::string(received.message.text_view()));
      }
    }
    throw std::runtime_error("the daemon has hung up");
  }
  // The text of the refusal that comes next.
  std::string expect_refusal() {
    wire::Received received;
    while (receive(received)) {
      if (received.message.kind == wire::MessageKind::kRefused) {
        return std::string(received.message.text_view());
      }
    }
    return "(hung up)";
  }
  // True once the daemon has closed the connection.
  bool is_hung_up_on() {
    wire::Received received;
    while (receive(received)) {
    }
    return true;
  }

  static wire::Message hello_message(const std::string& name, std::uint32_t flags = 0) {
    wire::Caller caller;
    caller.name = name;
    caller.flags = flags;
    wire::Message hello = wire::hello_of(caller);
    hello.request = 77;
    return hello;
  }
  // What it is welcomed with.
  wire::Received hello(const std::string& name = "raw", std::uint32_t flags = 0) {
    send(hello_message(name, flags));
    return expect(wire::MessageKind::kWelcome);
  }

  nlohmann::json status() {
    send(message(wire::MessageKind::kStatus));
    return read_document(expect(wire::MessageKind::kStatusReply));
  }

  void hang_up() { socket_.reset(); }

  [[nodiscard]] int socket() const { return socket_.get(); }

 private:
  shm::FileDescriptor socket_;
};

}  // namespace arbiter::test
