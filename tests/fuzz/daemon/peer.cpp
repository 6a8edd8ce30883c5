#include "tests/fuzz/daemon/peer.hpp"

#include <fcntl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "tests/fuzz/fuzz.hpp"

namespace arbiter::fuzz {

using wire::MessageKind;

Process::Process(pid_t pid, uid_t user) : pid_(pid), user_(user) {
  int ends[2];
  require(::pipe2(ends, O_CLOEXEC | O_NONBLOCK) == 0, "a pipe can be made");
  ended_.reset(ends[0]);
  lives_.reset(ends[1]);
}

void Process::end() { lives_.reset(); }

namespace {

constexpr std::uint32_t kDepth = 4;

template <class Header, class Set>
shm::FileDescriptor make_segment(const char* name, std::size_t size, Set set) {
  auto segment = shm::make_segment(name, size);
  require(!shm::allocate(segment, 0, size), "memory can be allocated");
  const shm::Mapping mapping(segment, size, shm::Access::kReadWrite);
  set(*mapping.as<Header>());
  shm::seal(segment, shm::Seals::kOneWriter);
  return segment;
}

void write_header(shm::OutputHeader& header, const shm::TypeInfo& type, std::uint32_t slots) {
  header.magic = shm::OutputHeader::kMagic;
  header.version = shm::OutputHeader::kVersion;
  header.slot_count = slots;
  header.type = type;
}

void write_header(shm::InputHeader& header, std::uint32_t depth) {
  header.magic = shm::InputHeader::kMagic;
  header.version = shm::InputHeader::kVersion;
  header.depth = depth;
  header.max_held = 1;
  header.newest_link.store(UINT64_MAX, std::memory_order_relaxed);
}

template <class Header>
void change(Header& header, std::size_t word, std::uint64_t value) {
  const std::size_t words = sizeof header / sizeof value;
  std::memcpy(reinterpret_cast<std::byte*>(&header) + word % words * sizeof value, &value,
              sizeof value);
}

}  // namespace

shm::FileDescriptor make_output_segment(const shm::TypeInfo& type, std::uint32_t slots) {
  const std::size_t size = shm::OutputLayout::plan(type, slots).total_size;
  return make_segment<shm::OutputHeader>(
      "arbiter-fuzz-output", size,
      [&](shm::OutputHeader& header) { write_header(header, type, slots); });
}

shm::FileDescriptor make_output_segment(std::uint32_t slots, std::size_t word,
                                        std::uint64_t value) {
  const std::size_t size = shm::OutputLayout::plan({}, slots).total_size;
  return make_segment<shm::OutputHeader>("arbiter-fuzz-output", size,
                                         [&](shm::OutputHeader& header) {
                                           write_header(header, {}, slots);
                                           change(header, word, value);
                                         });
}

shm::FileDescriptor make_input_segment(std::uint32_t depth) {
  return make_segment<shm::InputHeader>(
      "arbiter-fuzz-input", sizeof(shm::InputSegment),
      [&](shm::InputHeader& header) { write_header(header, depth); });
}

shm::FileDescriptor make_input_segment(std::size_t word, std::uint64_t value) {
  return make_segment<shm::InputHeader>("arbiter-fuzz-input", sizeof(shm::InputSegment),
                                        [&](shm::InputHeader& header) {
                                          write_header(header, kDepth);
                                          change(header, word, value);
                                        });
}

Connection::Connection(const std::string& path, const Process& process)
    : user_(process.identity().user),
      socket_(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  Loop::connecting = process.identity();
  require(
      ::connect(socket_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0,
      "the daemon can be connected to");
}

wire::SendResult Connection::send_bytes(const void* data, std::size_t size,
                                        const std::vector<int>& descriptors) const {
  for (const int fd : Loop::senders_are_makers ? descriptors : std::vector<int>()) {
    Loop::forget_maker(fd);
    Loop::declare_maker(fd, user_);
  }
  iovec part{const_cast<void*>(data), size};
  msghdr header{};
  header.msg_iov = &part;
  header.msg_iovlen = 1;
  std::vector<std::byte> control(CMSG_SPACE(sizeof(int) * descriptors.size()));
  if (!descriptors.empty()) {
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    cmsghdr* const rights = CMSG_FIRSTHDR(&header);
    rights->cmsg_level = SOL_SOCKET;
    rights->cmsg_type = SCM_RIGHTS;
    rights->cmsg_len = CMSG_LEN(sizeof(int) * descriptors.size());
    std::memcpy(CMSG_DATA(rights), descriptors.data(), sizeof(int) * descriptors.size());
  }
  if (::sendmsg(socket_.get(), &header, MSG_NOSIGNAL | MSG_DONTWAIT) >= 0) {
    return wire::SendResult::kSent;
  }
  return errno == EAGAIN ? wire::SendResult::kFull : wire::SendResult::kClosed;
}

wire::SendResult Connection::send(const wire::Message& message,
                                  std::vector<int> descriptors) const {
  return send_bytes(&message, sizeof message, descriptors);
}

void Connection::half_close(int how) const { ::shutdown(socket_.get(), how); }

Honest::Honest(const std::string& path, const Process& process, const std::string& name)
    : connection_(path, process) {
  wire::Message hello;
  hello.kind = MessageKind::kHello;
  hello.flags = wire::kHasServiceThread;
  hello.value = wire::kWireVersion;
  hello.set_name(name);
  require(connection_.send(hello) == wire::SendResult::kSent, "an honest client can say hello");
}

bool Honest::read() {
  bool any = false;
  for (;;) {
    wire::Received received;
    switch (wire::receive_message(connection_.socket(), received, false)) {
      case wire::ReceiveResult::kReceived:
        any = true;
        hear(received);
        break;
      case wire::ReceiveResult::kNothing:
        return any;
      case wire::ReceiveResult::kClosed:
      case wire::ReceiveResult::kMalformed:
        require(false, "an honest client is not hung up on");
    }
  }
}

void Honest::hear(const wire::Received& received) {
  const wire::Message& message = received.message;
  const auto has = [&](std::size_t count) {
    require(received.descriptor_count == count, "messages come with their descriptors");
  };
  switch (message.kind) {
    case MessageKind::kWelcome:
      has(2);
      welcome_ = true;
      break;
    case MessageKind::kOpened:
      port_ = message.port;
      break;
    case MessageKind::kConnected:
      connected_ = true;
      break;
    case MessageKind::kRefused:
      refusal_ = message.text_view();
      break;
    case MessageKind::kSourcePage:
      has(1);
      pages_[message.id] = message.name_view();
      break;
    case MessageKind::kOutputPeer:
    case MessageKind::kInputPeer:
      has(message.kind == MessageKind::kOutputPeer ? 1 : 2);
      require(message.port == port_, "peers are those of the client's own port");
      peers_[message.peer] = message.id;
      break;
    case MessageKind::kOutputGrown:
      has(0);
      require(peers_.count(message.peer) == 1, "only a peer grows");
      break;
    case MessageKind::kPeerGone:
      require(peers_.erase(message.peer) == 1, "only a peer goes");
      break;
    case MessageKind::kSync: {
      wire::Message synced;
      synced.kind = MessageKind::kSynced;
      synced.request = message.request;
      require(connection_.send(synced) == wire::SendResult::kSent, "an honest client can answer");
      break;
    }
    case MessageKind::kStatusReply: {
      has(1);
      char text[16384];
      ssize_t count = 0;
      status_.clear();
      while ((count = ::pread(received.descriptors[0].get(), text, sizeof text,
                              static_cast<off_t>(status_.size()))) > 0) {
        status_.append(text, static_cast<std::size_t>(count));
      }
      break;
    }
    case MessageKind::kDone:
      ++done_;
      break;
    case MessageKind::kDisconnected:
      require(peers_.count(message.peer) == 1, "only a peer is disconnected");
      if (is_input_) peers_.erase(message.peer);
      break;
    case MessageKind::kConnectionRefused:
      require(message.port == port_, "what is refused is a connection of the client's own port");
      peers_[message.peer] = message.id;  // of which it is told when it goes
      break;
    case MessageKind::kUnmentioned:
      require(message.port == port_, "the port that is not mentioned is the client's own");
      break;
    case MessageKind::kModelInForce:
      require(message.link > model_, "each model that the daemon tells of is a later one");
      model_ = message.link;
      break;
    case MessageKind::kPortName:
    case MessageKind::kModelReply:
      break;
    default:
      require(false, "the daemon says nothing but what it may");
  }
}

void Honest::open(const wire::Message& message, const std::vector<int>& descriptors) {
  port_ = 0;
  connected_ = false;
  refusal_.clear();
  require(connection_.send(message, descriptors) == wire::SendResult::kSent,
          "an honest client can ask");
}

void Honest::open_output(const std::string& name) {
  wire::Message message;
  message.kind = MessageKind::kOpenOutput;
  message.set_name(name);
  message.type.size = 8;
  const auto segment = make_output_segment(message.type, kDepth);
  is_input_ = false;
  open(message, {segment.get()});
}

void Honest::open_input(const std::string& name) {
  wire::Message message;
  message.kind = MessageKind::kOpenInput;
  message.set_name(name);
  message.type.size = 8;
  const auto segment = make_input_segment(kDepth);
  is_input_ = true;
  open(message, {segment.get(), bell_.write_end().get()});
}

void Honest::close_port() {
  wire::Message message;
  message.kind = MessageKind::kClosePort;
  message.port = port_;
  require(connection_.send(message) == wire::SendResult::kSent, "an honest client can close");
  port_ = 0;
  peers_.clear();
}

void Honest::ask(MessageKind kind, const std::string& name) {
  wire::Message message;
  message.kind = kind;
  message.set_name(name);
  refusal_.clear();
  require(connection_.send(message) == wire::SendResult::kSent, "an honest client can ask");
}

}  // namespace arbiter::fuzz
