// A client below the client library that notes what the daemon says, field by field.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <stdexcept>
#include <string>

#include "shm/bell.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/message_kinds.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {

using Words = std::set<std::string>;

// What was heard of one kind: the fields that were not 0, and how many descriptors came.
struct Heard {
  Words fields;
  std::set<std::size_t> descriptors;
};

inline Words used_fields(const wire::Message& message) {
  Words fields;
  const auto add = [&](const char* name, bool is_used) {
    if (is_used) fields.insert(name);
  };
  add("flags", message.flags != 0);
  add("request", message.request != 0);
  add("port", message.port != 0);
  add("peer", message.peer != 0);
  add("link", message.link != 0);
  add("id", message.id != 0);
  add("value", message.value != 0);
  add("type", message.type.is_typed() || message.type.size != 0);
  add("name", message.name[0] != '\0');
  add("text", message.text[0] != '\0');
  return fields;
}

// A client that notes all that it hears, and says kSynced as a component would.
class Listener {
 public:
  explicit Listener(const Daemon& daemon) : client_(daemon.instance()) {}

  // Sends it with a number of its own, and returns the kinds that answer it.
  Words ask(wire::Message message, RawClient::Descriptors descriptors = {-1, -1}) {
    message.request = ++last_request_;
    client_.send(message, descriptors);
    Words kinds;
    do {
      const wire::Message answer = hear_next();
      if (answer.kind == wire::MessageKind::kSync || answer.request != message.request) continue;
      kinds.insert(name_of(answer.kind));
      last_answer_ = answer;
    } while (kinds.empty() || kinds == Words{"kOpened"});
    return kinds;
  }
  Words ask(wire::MessageKind kind, const std::string& name = {}, std::uint32_t flags = 0) {
    auto message = RawClient::message(kind, name);
    message.flags = flags;
    return ask(message);
  }
  Words hello() { return ask(RawClient::hello_message("listener", wire::kHasServiceThread)); }
  // The kinds that answer a message of which there may be no answer: it comes before that to a
  // question that is asked after it.
  Words say(wire::MessageKind kind) {
    auto message = RawClient::message(kind);
    const std::uint64_t request = message.request = ++last_request_;
    client_.send(message);
    auto question = RawClient::message(wire::MessageKind::kStatus);
    question.request = ++last_request_;
    client_.send(question);
    Words kinds;
    for (;;) {
      const wire::Message answer = hear_next();
      if (answer.request == question.request) return kinds;
      if (answer.request == request) kinds.insert(name_of(answer.kind));
    }
  }
  Words open_output(const std::string& name, std::uint32_t flags = 0) {
    const auto segment = raw_output_segment();
    auto open = RawClient::message(wire::MessageKind::kOpenOutput, name);
    open.flags = flags;
    return ask(open, {segment.get(), -1});
  }
  Words open_input(const std::string& name) {
    const auto segment = raw_input_segment();
    const shm::Bell bell;
    return ask(RawClient::message(wire::MessageKind::kOpenInput, name),
               {segment.get(), bell.for_publishers().get()});
  }
  Words open_tap(const std::string& name, std::uint32_t flags = 0) {
    const auto segment = raw_tap_segment();
    const shm::Bell bell;
    auto open = RawClient::message(wire::MessageKind::kOpenTap, name);
    open.flags = flags;
    return ask(open, {segment.get(), bell.for_publishers().get()});
  }
  void hear(wire::MessageKind kind) {
    while (hear_next().kind != kind) {
    }
  }
  [[nodiscard]] const std::map<std::string, Heard>& heard() const { return heard_; }
  [[nodiscard]] const wire::Message& last_answer() const { return last_answer_; }
  [[nodiscard]] shm::PortInstance last_opened() const { return last_opened_; }

 private:
  wire::Message hear_next() {
    wire::Received received;
    if (!client_.receive(received)) throw std::runtime_error("the daemon has hung up");
    const wire::Message& message = received.message;
    Heard& heard = heard_[name_of(message.kind)];
    heard.fields.merge(used_fields(message));
    heard.descriptors.insert(received.descriptor_count);
    if (message.kind == wire::MessageKind::kOpened) last_opened_ = message.port;
    if (message.kind == wire::MessageKind::kSync) {
      auto synced = RawClient::message(wire::MessageKind::kSynced);
      synced.request = message.request;
      client_.send(synced);
    }
    return message;
  }

  RawClient client_;
  std::uint64_t last_request_ = 1'000'000;  // beyond the numbers of barriers
  std::map<std::string, Heard> heard_;
  wire::Message last_answer_;
  shm::PortInstance last_opened_ = 0;
};

}  // namespace arbiter::test
