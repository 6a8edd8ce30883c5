// What a node says to the daemon, in order. A daemon that is stopped, or busy, does not hold up who
// says it: what the socket has no room for waits here.
//
// Thread safety: none, it is guarded by whoever has it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>

#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::detail {

class Outbox {
 public:
  using Descriptors = std::array<int, wire::kMaxDescriptors>;

  // Sends it to a socket that does not block, or keeps it, with copies of the descriptors. False:
  // nothing can be said any more, and the conversation is to be begun anew: too much waits, or
  // there is no descriptor for a copy, or the user has too many under way. Where the daemon has
  // hung up what is said is lost with the conversation.
  [[nodiscard]] bool send(int socket, const wire::Message& message,
                          Descriptors descriptors = {-1, -1}) noexcept;
  // What there is room for by now. As send().
  [[nodiscard]] bool flush(int socket) noexcept;

  // Nobody waits for the answer any more. False: it has been sent.
  bool withdraw(std::uint64_t request) noexcept;

  [[nodiscard]] bool empty() const noexcept { return waiting_.empty(); }
  // With the conversation.
  void clear() noexcept { waiting_.clear(); }

 private:
  // 7 MB. To begin anew costs less than more.
  static constexpr std::size_t kMostWaiting = 4096;

  struct Waiting {
    wire::Message message;
    std::array<shm::FileDescriptor, wire::kMaxDescriptors> descriptors;
  };

  [[nodiscard]] bool keep(const wire::Message& message, Descriptors descriptors) noexcept;

  std::deque<Waiting> waiting_;
};

// Its calls return at once from now on.
void make_non_blocking(const shm::FileDescriptor& socket) noexcept;

}  // namespace arbiter::detail
