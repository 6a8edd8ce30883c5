#include "link/dds/datagram_train.hpp"

#include <dds/ddsrt/retcode.h>
#include <dds/ddsrt/sockets.h>
#include <dlfcn.h>
#include <netinet/udp.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstring>

#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

// What this thread boards; null: nothing.
thread_local DatagramTrain* train_of_thread = nullptr;

// Datagrams of samples that Cyclone's own threads have sent: each a repetition. Relaxed is enough:
// it is only a count, and one that is seen later counts then.
std::atomic<std::uint64_t> repeated_datagrams{0};
constexpr std::size_t kLargeDatagram = 1000;  // what is not of a large sample is smaller, mostly

constexpr shm::Nanoseconds kWorthWaiting = 50'000;  // that is worth a system call
void wait_for(shm::Nanoseconds time) noexcept {
  const timespec wait{time / 1'000'000'000, time % 1'000'000'000};
  ::nanosleep(&wait, nullptr);
}

ssize_t send_at_once(int socket, const msghdr& message, int flags) noexcept {
  ssize_t sent = 0;
  do sent = ::sendmsg(socket, &message, flags);
  while (sent < 0 && errno == EINTR);
  return sent;
}

std::size_t bytes_of(const msghdr& message) noexcept {
  std::size_t bytes = 0;
  for (std::size_t i = 0; i < message.msg_iovlen; ++i) bytes += message.msg_iov[i].iov_len;
  return bytes;
}

}  // namespace

DatagramTrain::Boarding::Boarding(DatagramTrain& train) noexcept { train_of_thread = &train; }

DatagramTrain::Boarding::~Boarding() {
  train_of_thread->depart();
  train_of_thread = nullptr;
}

bool DatagramTrain::fits(int socket, const msghdr& message, int flags,
                         std::size_t size) const noexcept {
  if (count_ == 0) return true;
  return !is_closed_ && count_ < kMostDatagrams && size <= each_ && bytes_ + size <= kMostBytes &&
         socket == socket_ && flags == flags_ && message.msg_namelen == address_bytes_ &&
         std::memcmp(message.msg_name, &address_, address_bytes_) == 0;
}

bool DatagramTrain::board(int socket, const msghdr& message, int flags) noexcept {
  const std::size_t size = bytes_of(message);
  const bool may_wait = message.msg_name != nullptr && message.msg_namelen <= sizeof address_ &&
                        message.msg_controllen == 0 && size != 0 && size <= kMostBytes;
  if (!may_wait || !fits(socket, message, flags, size)) depart();
  if (!may_wait) return false;
  if (count_ == 0) {
    socket_ = socket;
    flags_ = flags;
    address_bytes_ = message.msg_namelen;
    std::memcpy(&address_, message.msg_name, address_bytes_);
    each_ = size;
  }
  for (std::size_t i = 0; i < message.msg_iovlen; ++i) {
    const iovec& part = message.msg_iov[i];
    if (part.iov_len != 0) std::memcpy(buffer_.data() + bytes_, part.iov_base, part.iov_len);
    bytes_ += part.iov_len;
  }
  ++count_;
  is_closed_ = size < each_;
  return true;
}

void DatagramTrain::depart() noexcept {
  if (count_ == 0) return;
  if (count_ == 1 || !can_depart_together_ || !depart_together()) depart_alone();
  const shm::Nanoseconds wait =
      pace_.leave(bytes_, repeated_datagrams.load(std::memory_order_relaxed), shm::monotonic_now());
  if (wait > kWorthWaiting) wait_for(wait);
  count_ = 0;
  bytes_ = 0;
  is_closed_ = false;
}

// False: they have to leave one by one, and all that follow, too.
bool DatagramTrain::depart_together() noexcept {
  iovec all{buffer_.data(), bytes_};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint16_t))> control{};
  msghdr message{};
  message.msg_name = &address_;
  message.msg_namelen = address_bytes_;
  message.msg_iov = &all;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const segment = CMSG_FIRSTHDR(&message);
  segment->cmsg_level = SOL_UDP;
  segment->cmsg_type = UDP_SEGMENT;
  segment->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
  const auto each = static_cast<std::uint16_t>(each_);
  std::memcpy(CMSG_DATA(segment), &each, sizeof each);
  if (send_at_once(socket_, message, flags_) >= 0) return true;
  // Not known to this kernel; not possible for this network interface; datagrams that do not fit
  // it, so that IP has to cut them.
  can_depart_together_ = errno != EINVAL && errno != EIO && errno != EMSGSIZE &&
                         errno != ENOPROTOOPT && errno != EOPNOTSUPP;
  return can_depart_together_;
}

void DatagramTrain::depart_alone() noexcept {
  for (std::size_t at = 0; at < bytes_; at += each_) {
    iovec one{buffer_.data() + at, std::min(each_, bytes_ - at)};
    msghdr message{};
    message.msg_name = &address_;
    message.msg_namelen = address_bytes_;
    message.msg_iov = &one;
    message.msg_iovlen = 1;
    static_cast<void>(send_at_once(socket_, message, flags_));
  }
}

}  // namespace arbiter::link

// In place of Cyclone's function of that name.
extern "C" dds_return_t ddsrt_sendmsg(ddsrt_socket_t sock, const ddsrt_msghdr_t* msg, int flags,
                                      ssize_t* sent) {
  using arbiter::link::train_of_thread;
  if (train_of_thread != nullptr && train_of_thread->board(sock, *msg, flags)) {
    *sent = static_cast<ssize_t>(arbiter::link::bytes_of(*msg));
    return DDS_RETCODE_OK;
  }
  if (train_of_thread == nullptr && arbiter::link::bytes_of(*msg) >= arbiter::link::kLargeDatagram)
    arbiter::link::repeated_datagrams.fetch_add(1, std::memory_order_relaxed);
  static const auto cyclones =
      reinterpret_cast<decltype(&ddsrt_sendmsg)>(::dlsym(RTLD_NEXT, "ddsrt_sendmsg"));
  return cyclones == nullptr ? DDS_RETCODE_UNSUPPORTED : cyclones(sock, msg, flags, sent);
}
