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

  // Sends it to a socket that does not block, or keeps it. False: as of keep(). Where the daemon
  // has hung up what is said is lost with the conversation.
  [[nodiscard]] bool send(int socket, const wire::Message& message,
                          Descriptors descriptors = {-1, -1}) noexcept;
  // For later, with copies of the descriptors. False: nothing can be said any more, and the
  // conversation is to be begun anew: too much waits, or there is no descriptor for a copy.
  [[nodiscard]] bool keep(const wire::Message& message,
                          Descriptors descriptors = {-1, -1}) noexcept;
  // What there is room for by now.
  void flush(int socket) noexcept;

  // Nobody waits for the answer any more. False: it has been sent.
  bool withdraw(std::uint64_t request) noexcept;

  [[nodiscard]] bool empty() const noexcept { return waiting_.empty(); }
  // Whoever answers what he hears had better hear no more for now.
  [[nodiscard]] bool is_half_full() const noexcept { return waiting_.size() >= kMostWaiting / 2; }
  // The user had too many descriptors under way at the last flush: room in the socket is no news.
  [[nodiscard]] bool has_too_many() const noexcept { return has_too_many_; }
  // With the conversation.
  void clear() noexcept {
    waiting_.clear();
    has_too_many_ = false;
  }

 private:
  // 7 MB. To begin anew costs less than more.
  static constexpr std::size_t kMostWaiting = 4096;

  struct Waiting {
    wire::Message message;
    std::array<shm::FileDescriptor, wire::kMaxDescriptors> descriptors;
  };

  std::deque<Waiting> waiting_;
  bool has_too_many_ = false;
};

// Its calls return at once from now on.
void make_non_blocking(const shm::FileDescriptor& socket) noexcept;

}  // namespace arbiter::detail
