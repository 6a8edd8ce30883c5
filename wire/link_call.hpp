// A question to the link of this host (arbiter-link), through its local socket: about this host or,
// which the link passes on, to others.
//
// The socket is called INSTANCE.link, and lies where a daemon's may lie, or in /run/arbiter-link
// (wire/rendezvous.hpp). A question is one packet, a JSON object (LinkQuestion). The answer is one
// packet: with a memfd, which has the document; without one, its bytes say why there is none.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "wire/call.hpp"
#include "wire/hosts.hpp"

namespace arbiter::wire {

// Bytes of a question, and of the reason in an answer.
inline constexpr std::size_t kMaxLinkPacket = 8192;

// No link of this instance runs here: the message says where one was looked for.
class NoLinkError : public CallError {
 public:
  using CallError::CallError;
};

// The link has hung up and not heard the question, so that nobody has been asked.
class NotAskedError : public CallError {
 public:
  using CallError::CallError;
};

class LinkCall {
 public:
  // Longer than a link waits for other hosts and its daemon together.
  static constexpr std::chrono::milliseconds kAnswerTime{5000};

  // Throws NoLinkError; std::invalid_argument where that is no name for an instance.
  explicit LinkCall(const std::string& instance,
                    std::chrono::milliseconds answer_time = kAnswerTime);

  // The document with which this host's link answers. Throws NotAskedError; another CallError where
  // it refuses, has gone, or says nothing within the answer time.
  [[nodiscard]] std::string ask(const LinkQuestion& question);
  // The same question to that host, or to all: what became of it at each. Takes little more than a
  // second at most; to have all prepare a switch, 1.5 s longer while the link has just joined its
  // network. Throws CallError, DocumentError.
  [[nodiscard]] std::vector<HostAnswer> ask_hosts(const LinkQuestion& question);

 private:
  const std::chrono::milliseconds answer_time_;
  shm::FileDescriptor socket_;
};

}  // namespace arbiter::wire
