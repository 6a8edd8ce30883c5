// What a client is answered.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "service/clients/client.hpp"
#include "shm/activity.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {

// A request that cannot be served yet, and why; it is tried again, at `deadline` for the last time.
class NotYet : public std::runtime_error {
 public:
  NotYet(const std::string& why, shm::Nanoseconds until)
      : std::runtime_error(why), deadline(until) {}
  const shm::Nanoseconds deadline;
};

// A refusal that the log has already.
class RefusedAgain : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// An answer to a client's question.
inline wire::Message reply_to(std::uint64_t request, wire::MessageKind kind) {
  wire::Message message;
  message.kind = kind;
  message.request = request;
  return message;
}

void refuse(Client& client, std::uint64_t request, const std::string& why);

// A file in memory that can only be read. Throws std::system_error, std::runtime_error.
[[nodiscard]] shm::FileDescriptor make_document(const std::string& document);
void send_document(Client& client, std::uint64_t request, wire::MessageKind kind,
                   const std::string& document);

}  // namespace arbiter::service
