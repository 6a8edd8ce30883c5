#include "link/dds/datagram_train.hpp"

#include <dds/ddsi/q_thread.h>
#include <dds/ddsrt/retcode.h>
#include <dds/ddsrt/sockets.h>
#include <dlfcn.h>
#include <netinet/udp.h>
#include <time.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <exception>

#include "link/dds/host_search.hpp"

namespace arbiter::link {
namespace {

// What this thread boards; null: nothing.
thread_local DatagramTrains* trains_of_thread = nullptr;

// Relaxed is enough: it is only a count, and one that is seen later counts then.
std::atomic<std::uint64_t> repeated{0};
constexpr std::size_t kLargeDatagram = 1000;  // what is not of a large sample is smaller, mostly

// Not one of ours, which may send a sample as large as that for the first time.
bool is_cyclones_thread() noexcept {
  return tsd_thread_state != nullptr && tsd_thread_state->state == THREAD_STATE_ALIVE;
}

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

std::uint64_t repeated_datagrams() noexcept { return repeated.load(std::memory_order_relaxed); }

DatagramTrains::Boarding::Boarding(DatagramTrains& trains) noexcept { trains_of_thread = &trains; }

DatagramTrains::Boarding::~Boarding() {
  trains_of_thread->depart();
  trains_of_thread = nullptr;
}

bool DatagramTrains::board(int socket, const msghdr& message, int flags) noexcept {
  const std::size_t size = bytes_of(message);
  const bool may_wait = message.msg_name != nullptr &&
                        message.msg_namelen <= sizeof(sockaddr_storage) &&
                        message.msg_controllen == 0 && size != 0 && size <= kMostBytes;
  if (!may_wait) depart();
  Train* const train = may_wait ? train_to(socket, message, flags) : nullptr;
  if (train == nullptr) return false;
  if (!train->fits(size)) depart(*train);
  train->add(message, size);
  return true;
}

void DatagramTrains::depart() noexcept {
  for (const auto& train : trains_) depart(*train);
}

DatagramTrains::Train* DatagramTrains::train_to(int socket, const msghdr& message,
                                                int flags) noexcept {
  for (const auto& train : trains_) {
    if (train->is_to(socket, message, flags)) return train.get();
  }
  if (trains_.size() < kMostAddresses) {
    try {
      trains_.push_back(std::make_unique<Train>());
    } catch (const std::exception&) {
      return nullptr;
    }
    trains_.back()->assign(socket, message, flags);
    return trains_.back().get();
  }
  for (const auto& train : trains_) {
    if (train->count != 0) continue;
    train->assign(socket, message, flags);
    return train.get();
  }
  return nullptr;
}

void DatagramTrains::depart(Train& train) noexcept {
  if (train.count == 0) return;
  const shm::Nanoseconds now = now_();
  const bool may_go_together = train.count != 1 && now >= train.alone_until;
  if (!may_go_together || !train.depart_together()) {
    if (may_go_together) train.alone_until = now + kTryAgain;
    train.depart_alone();
  }
  const shm::Nanoseconds wait = pace_.leave(train.bytes, repeated_datagrams(), now);
  if (wait > kWorthWaiting) wait_for(wait);
  train.count = 0;
  train.bytes = 0;
  train.is_closed = false;
}

bool DatagramTrains::Train::is_to(int to_socket, const msghdr& message,
                                  int with_flags) const noexcept {
  return socket == to_socket && flags == with_flags && message.msg_namelen == address_bytes &&
         std::memcmp(message.msg_name, &address, address_bytes) == 0;
}

// Nobody is on board.
void DatagramTrains::Train::assign(int to_socket, const msghdr& message, int with_flags) noexcept {
  socket = to_socket;
  flags = with_flags;
  address_bytes = message.msg_namelen;
  std::memcpy(&address, message.msg_name, address_bytes);
  alone_until = 0;
}

bool DatagramTrains::Train::fits(std::size_t size) const noexcept {
  return count == 0 ||
         (!is_closed && count < kMostDatagrams && size <= each && bytes + size <= kMostBytes);
}

void DatagramTrains::Train::add(const msghdr& message, std::size_t size) noexcept {
  if (count == 0) each = size;
  for (std::size_t i = 0; i < message.msg_iovlen; ++i) {
    const iovec& part = message.msg_iov[i];
    if (part.iov_len != 0) std::memcpy(buffer.data() + bytes, part.iov_base, part.iov_len);
    bytes += part.iov_len;
  }
  ++count;
  is_closed = size < each;
}

msghdr DatagramTrains::Train::message_of(iovec& part) noexcept {
  msghdr message{};
  message.msg_name = &address;
  message.msg_namelen = address_bytes;
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  return message;
}

// False: trains cannot go there. The kernel does not know them; the network interface cannot take
// them; datagrams do not fit it, so that IP has to cut them; a firewall takes them for too large.
// Where there is no way at all, single ones would not arrive either.
bool DatagramTrains::Train::depart_together() noexcept {
  iovec all{buffer.data(), bytes};
  msghdr message = message_of(all);
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(std::uint16_t))> control{};
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  cmsghdr* const segment = CMSG_FIRSTHDR(&message);
  segment->cmsg_level = SOL_UDP;
  segment->cmsg_type = UDP_SEGMENT;
  segment->cmsg_len = CMSG_LEN(sizeof(std::uint16_t));
  const auto size = static_cast<std::uint16_t>(each);
  std::memcpy(CMSG_DATA(segment), &size, sizeof size);
  return send_at_once(socket, message, flags) >= 0 || errno == ENETUNREACH || errno == ENETDOWN ||
         errno == EHOSTUNREACH || errno == EHOSTDOWN || errno == ECONNREFUSED;
}

void DatagramTrains::Train::depart_alone() noexcept {
  for (std::size_t at = 0; at < bytes; at += each) {
    iovec one{buffer.data() + at, std::min(each, bytes - at)};
    static_cast<void>(send_at_once(socket, message_of(one), flags));
  }
}

}  // namespace arbiter::link

// In place of Cyclone's function of that name.
extern "C" dds_return_t ddsrt_sendmsg(ddsrt_socket_t sock, const ddsrt_msghdr_t* msg, int flags,
                                      ssize_t* sent) {
  using arbiter::link::trains_of_thread;
  if ((trains_of_thread != nullptr && trains_of_thread->board(sock, *msg, flags)) ||
      arbiter::link::HostSearch::of_process().send(sock, *msg, flags)) {
    *sent = static_cast<ssize_t>(arbiter::link::bytes_of(*msg));
    return DDS_RETCODE_OK;
  }
  if (arbiter::link::is_cyclones_thread() &&
      arbiter::link::bytes_of(*msg) >= arbiter::link::kLargeDatagram) {
    arbiter::link::repeated.fetch_add(1, std::memory_order_relaxed);
  }
  static const auto cyclones =
      reinterpret_cast<decltype(&ddsrt_sendmsg)>(::dlsym(RTLD_NEXT, "ddsrt_sendmsg"));
  return cyclones == nullptr ? DDS_RETCODE_UNSUPPORTED : cyclones(sock, msg, flags, sent);
}
