#include "wire/messages.hpp"

#include <sys/socket.h>
#include <sys/uio.h>

#include <cerrno>
#include <cstddef>
#include <cstring>
#include <utility>

#include "shm/clock.hpp"

namespace arbiter::wire {
namespace {

constexpr std::size_t kShortest = offsetof(Message, type);

union Control {
  cmsghdr header;
  char bytes[CMSG_SPACE(sizeof(int) * kMostDescriptorsOfAMessage)];
};

// Most messages bear no text, and many no name: what is zero at the end need not travel.
std::size_t used_size(const Message& message) noexcept {
  if (message.text[0] != '\0') return offsetof(Message, text) + message.text_view().size() + 1;
  if (message.name[0] != '\0') return offsetof(Message, name) + message.name_view().size() + 1;
  return offsetof(Message, name);
}

// Returns how many have come.
std::size_t take_descriptors(msghdr& header, Received& received) noexcept {
  std::size_t taken = 0;
  for (cmsghdr* part = CMSG_FIRSTHDR(&header); part != nullptr; part = CMSG_NXTHDR(&header, part)) {
    if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_RIGHTS) continue;
    const std::size_t count = (part->cmsg_len - CMSG_LEN(0)) / sizeof(int);
    for (std::size_t i = 0; i < count; ++i) {
      int fd = -1;
      std::memcpy(&fd, CMSG_DATA(part) + i * sizeof(int), sizeof fd);
      shm::FileDescriptor owned(fd);
      if (taken < kMaxDescriptors) {
        received.descriptors[taken] = std::move(owned);
      } else if (taken < kMostDescriptorsOfAMessage) {
        received.surplus[taken - kMaxDescriptors] = std::move(owned);
      }
      ++taken;
    }
  }
  return taken;
}

}  // namespace

SendResult send_message(int socket, const Message& message,
                        std::array<int, kMaxDescriptors> descriptors) noexcept {
  iovec data{const_cast<Message*>(&message), used_size(message)};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  Control control{};
  std::size_t count = 0;
  while (count < kMaxDescriptors && descriptors[count] >= 0) ++count;
  if (count != 0) {
    header.msg_control = &control;
    header.msg_controllen = CMSG_SPACE(sizeof(int) * count);
    cmsghdr* part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof(int) * count);
    std::memcpy(CMSG_DATA(part), descriptors.data(), sizeof(int) * count);
  }
  shm::Nanoseconds give_up = 0;  // each try has all of the socket's time (SO_SNDTIMEO)
  while (sendmsg(socket, &header, MSG_NOSIGNAL) < 0) {
    if (errno == EINTR) {
      const shm::Nanoseconds now = shm::monotonic_now();
      if (give_up == 0) give_up = now + kMaxWaitToSend * 1'000'000'000LL;
      if (now < give_up) continue;
      return SendResult::kFull;
    }
    if (errno == EAGAIN || errno == ENOBUFS) return SendResult::kFull;
    if (errno == ETOOMANYREFS) return SendResult::kTooMany;
    return SendResult::kClosed;
  }
  return SendResult::kSent;
}

ReceiveResult receive_message(int socket, Received& received, bool wait) noexcept {
  received.message = {};
  for (auto& descriptor : received.descriptors) descriptor.reset();
  for (auto& descriptor : received.surplus) descriptor.reset();
  received.descriptor_count = 0;
  received.lost_descriptors = received.is_strange = false;
  iovec data{&received.message, sizeof received.message};
  Control control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = &control;
  header.msg_controllen = sizeof control;
  ssize_t size = 0;
  bool was_reset = false;
  while ((size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC | (wait ? 0 : MSG_DONTWAIT))) < 0) {
    if (errno == EINTR) continue;
    // Said once where the other end has closed with messages unread, before what it sent itself.
    if (errno == ECONNRESET && !std::exchange(was_reset, true)) continue;
    return errno == EAGAIN ? ReceiveResult::kNothing : ReceiveResult::kClosed;
  }
  const std::size_t taken = take_descriptors(header, received);  // of an empty message too
  received.descriptor_count = taken < kMaxDescriptors ? taken : kMaxDescriptors;
  if (size == 0) return ReceiveResult::kClosed;
  // There was room for all in the control buffer.
  received.lost_descriptors = (header.msg_flags & MSG_CTRUNC) != 0;
  const bool cut = (header.msg_flags & MSG_TRUNC) != 0 || taken > kMaxDescriptors;
  if (cut || static_cast<std::size_t>(size) < kShortest) return ReceiveResult::kMalformed;
  Message& message = received.message;
  message.name[sizeof message.name - 1] = '\0';
  message.text[sizeof message.text - 1] = '\0';
  message.type.name[shm::kMaxTypeName] = '\0';
  return ReceiveResult::kReceived;
}

}  // namespace arbiter::wire
