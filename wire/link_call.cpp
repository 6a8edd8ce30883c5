#include "wire/link_call.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "shm/utf8.hpp"
#include "wire/document.hpp"
#include "wire/instances.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::wire {
namespace {

struct Packet {
  std::string bytes;
  shm::FileDescriptor document;
  bool was_asked = true;  // false: the link has hung up on a question that it has not read
};

constexpr const char* kNotAsked = "the link has hung up before it could be asked";

// `is_sent`: false, and it can only be the reason why the question was not taken.
Packet receive_packet(int socket, bool is_sent) {
  Packet packet{std::string(kMaxLinkPacket, '\0'), {}, is_sent};
  iovec data{packet.bytes.data(), packet.bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  header.msg_control = control.data();
  header.msg_controllen = control.size();
  ssize_t size = 0;
  for (;;) {
    size = recvmsg(socket, &header, MSG_CMSG_CLOEXEC | MSG_DONTWAIT);
    if (size >= 0 || (errno != EINTR && errno != ECONNRESET)) break;
    // Said once, before what the link has sent: it may have said why.
    if (errno == ECONNRESET) packet.was_asked = false;
  }
  if (size <= 0 && !packet.was_asked) throw NotAskedError(kNotAsked);
  if (size <= 0) throw CallError("the link has gone without an answer");
  if ((header.msg_flags & MSG_CTRUNC) != 0) {
    throw CallError(no_descriptor_left("what the link sends"));
  }
  packet.bytes.resize(static_cast<std::size_t>(size));
  const cmsghdr* const part = CMSG_FIRSTHDR(&header);
  if (part != nullptr && part->cmsg_level == SOL_SOCKET && part->cmsg_type == SCM_RIGHTS) {
    int descriptor = -1;
    std::memcpy(&descriptor, CMSG_DATA(part), sizeof descriptor);
    packet.document.reset(descriptor);
  }
  return packet;
}

}  // namespace

LinkCall::LinkCall(const std::string& instance, std::chrono::milliseconds answer_time)
    : answer_time_(answer_time) {
  const std::string name = instance_name(instance);
  std::string why_not;
  auto socket = connect_to_link(name, why_not);
  if (!socket) {
    throw NoLinkError("no arbiter-link of instance \"" + name + "\" runs on this host" +
                      (why_not.empty() ? "" : " (" + why_not + ")") +
                      "; start one with: arbiter-link --interface NAME --instance " + name);
  }
  socket_ = std::move(*socket);
}

std::string LinkCall::ask(const LinkQuestion& question) {
  const std::string text = write_link_question(question);
  if (text.size() > kMaxLinkPacket) throw CallError("that question is too long");
  const bool is_sent = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) >= 0;
  // It may have said why before it hung up.
  if (!is_sent && errno != EPIPE && errno != ECONNRESET) {
    throw NotAskedError("the link cannot be asked");
  }
  pollfd answered{socket_.get(), POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&answered, 1, static_cast<int>(answer_time_.count()));
  } while (ready < 0 && errno == EINTR);
  if (ready == 0) {
    throw CallError("arbiter-link runs, but did not answer within " +
                    std::to_string(answer_time_.count()) +
                    " ms: " + describe_silence(socket_.get()));
  }
  const Packet packet = receive_packet(socket_.get(), is_sent);
  if (!packet.was_asked) throw NotAskedError(shm::printable(packet.bytes));
  if (!packet.document) throw RefusedError(shm::printable(packet.bytes));
  return read_document(packet.document);
}

std::vector<HostAnswer> LinkCall::ask_hosts(const LinkQuestion& question) {
  return read_host_answers(ask(question));
}

}  // namespace arbiter::wire
