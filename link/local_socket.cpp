#include "link/local_socket.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <condition_variable>
#include <cstring>
#include <exception>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"
#include "shm/memory_file.hpp"
#include "wire/errands.hpp"
#include "wire/hang_up.hpp"
#include "wire/link_call.hpp"

namespace arbiter::link {
namespace {

// For a program to say something, or to take its answer.
constexpr timeval kPatience{10, 0};
constexpr int kLookAgain = 1000;                   // ms
constexpr uid_t kNobody = static_cast<uid_t>(-1);  // in particular

bool is_stuck(uid_t user) { return wire::Errands::of_the_process().is_stuck(user); }

// In milliseconds, rounded up, as poll() wants it.
int until_errands_are_due() {
  const shm::Nanoseconds due = wire::Errands::of_the_process().deadline();
  if (due == shm::kForever) return -1;
  return static_cast<int>(std::max<shm::Nanoseconds>(due - shm::monotonic_now(), 0) / 1'000'000) +
         1;
}

// A file in memory that can only be read.
shm::FileDescriptor sealed_document(const std::string& text) {
  const shm::FileDescriptor file =
      shm::memory_file("arbiter-hosts", text, MFD_CLOEXEC | MFD_ALLOW_SEALING);
  if (::fcntl(file.get(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_GROW | F_SEAL_SHRINK | F_SEAL_SEAL) !=
      0) {
    throw std::system_error(errno, std::generic_category(), "the answer cannot be sealed");
  }
  const std::string path = "/proc/self/fd/" + std::to_string(file.get());
  shm::FileDescriptor readable(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (!readable) throw std::system_error(errno, std::generic_category(), "no descriptor is left");
  return readable;
}

// False: it has gone, or does not read.
bool send_packet(int socket, const std::string& bytes, int document) {
  iovec data{const_cast<char*>(bytes.data()), bytes.size()};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(int))> control{};
  msghdr header{};
  header.msg_iov = &data;
  header.msg_iovlen = 1;
  if (document >= 0) {
    header.msg_control = control.data();
    header.msg_controllen = control.size();
    cmsghdr* const part = CMSG_FIRSTHDR(&header);
    part->cmsg_level = SOL_SOCKET;
    part->cmsg_type = SCM_RIGHTS;
    part->cmsg_len = CMSG_LEN(sizeof document);
    std::memcpy(CMSG_DATA(part), &document, sizeof document);
  }
  return ::sendmsg(socket, &header, MSG_NOSIGNAL) >= 0;
}

bool refuse(int socket, const std::string& why) {
  return send_packet(socket, why.substr(0, wire::kMaxLinkPacket), -1);
}

}  // namespace

struct LocalSocket::Shared {
  explicit Shared(Serve with) : serve(std::move(with)) {}

  // As many as are let in have a place, which they give back.
  bool take_place(uid_t user, int socket) {
    const std::lock_guard lock(mutex);
    const bool is_privileged = user == 0 || user == ::geteuid();
    unsigned& own = of_user[user];
    if (ends || own >= kMostOfUser || (count >= kMost && !is_privileged)) return false;
    conversations.insert(socket);  // or throws before anything is counted
    ++own;
    ++count;
    return true;
  }
  void give_back_place(uid_t user) {
    const std::lock_guard lock(mutex);
    --count;
    if (--of_user[user] == 0) of_user.erase(user);
  }
  // Before the socket is closed: another one may have its number then.
  void end_conversation(int socket) {
    const std::lock_guard lock(mutex);
    conversations.erase(socket);
  }
  // Nobody can ask any more; who has asked is answered.
  void end_conversations() {
    const std::lock_guard lock(mutex);
    ends = true;
    for (const int socket : conversations) ::shutdown(socket, SHUT_RD);
  }
  // Throws why there is none.
  std::string answer(const LocalUser& who, const std::string& question);

  const Serve serve;
  std::mutex mutex;
  std::condition_variable changed;
  std::map<uid_t, unsigned> of_user;
  unsigned count = 0;
  std::set<int> conversations;
  unsigned serving = 0;
  bool ends = false;
};

std::string LocalSocket::Shared::answer(const LocalUser& who, const std::string& question) {
  {
    const std::lock_guard lock(mutex);
    if (ends) throw std::runtime_error("the link ends");
    ++serving;
  }
  const auto finish = [this] {
    const std::lock_guard lock(mutex);
    --serving;
    changed.notify_all();
  };
  try {
    std::string document = serve(who, wire::read_link_question(question));
    finish();
    return document;
  } catch (...) {
    finish();
    throw;
  }
}

LocalSocket::LocalSocket(const std::string& instance, Serve serve)
    : listener_(wire::listen_as_link(wire::daemon_directory(), wire::instance_name(instance))),
      end_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)),
      shared_(std::make_shared<Shared>(std::move(serve))) {
  if (!end_) throw std::system_error(errno, std::generic_category(), "no descriptor is left");
  thread_ = std::thread([this] { run(); });
}

void LocalSocket::close() {
  if (!thread_.joinable()) return;
  const std::uint64_t one = 1;
  static_cast<void>(!::write(end_.get(), &one, sizeof one));
  thread_.join();
  ::unlink(listener_.path.c_str());
  // Who has connected and was not let in may have sent something, too.
  wire::Errands::of_the_process().close(::geteuid(), std::move(listener_.socket));
  listener_.lock.reset();
  shared_->end_conversations();
}

LocalSocket::~LocalSocket() {
  close();
  std::unique_lock lock(shared_->mutex);
  shared_->changed.wait(lock, [this] { return shared_->serving == 0; });
}

void LocalSocket::run() {
  for (;;) {
    std::erase_if(stuck_, [](uid_t user) { return !is_stuck(user); });
    // Each that is turned away would keep a descriptor of the link.
    const bool is_full = !stuck_.empty();
    std::array<pollfd, 2> ends{
        {{end_.get(), POLLIN, 0}, {is_full ? -1 : listener_.socket.get(), POLLIN, 0}}};
    if (::poll(ends.data(), ends.size(), is_full ? kLookAgain : until_errands_are_due()) < 0) {
      continue;
    }
    if (ends[0].revents != 0) return;
    const std::string lost = wire::Errands::of_the_process().look_after(shm::monotonic_now());
    if (!lost.empty()) say_sparingly(gateway::Level::kWarning, lost);
    if (ends[1].revents != 0) let_in();
  }
}

// What it has sent may take for ever to close.
void LocalSocket::turn_away(shm::FileDescriptor socket, uid_t user) {
  wire::hang_up(std::move(socket), user);
  if (is_stuck(user)) stuck_.insert(user);
}

// May be lost for long in the descriptors that a program has sent: it keeps what it needs, and a
// place of that user.
void LocalSocket::serve_program(Shared& shared, const LocalUser& who, shm::FileDescriptor& socket) {
  try {
    converse(shared, who, socket);
  } catch (const std::exception&) {
    // No memory is left, not even to say so: the program sees that the link has hung up.
  }
  shared.end_conversation(socket.get());
  socket.reset();
  shared.give_back_place(who.user);
}

// Until the program has gone.
void LocalSocket::converse(Shared& shared, const LocalUser& who,
                           const shm::FileDescriptor& socket) {
  ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);
  std::string packet(wire::kMaxLinkPacket, '\0');
  for (bool is_sent = true; is_sent;) {
    const ssize_t size = ::recv(socket.get(), packet.data(), packet.size(), 0);
    if (size < 0 && errno == EINTR) continue;  // the link was stopped
    if (size <= 0) break;
    std::string why_not;
    try {
      const std::string document =
          shared.answer(who, packet.substr(0, static_cast<std::size_t>(size)));
      is_sent = send_packet(socket.get(), "{}", sealed_document(document).get());
    } catch (const std::exception& error) {
      why_not = error.what();
    }
    if (!why_not.empty()) is_sent = refuse(socket.get(), why_not);
  }
}

void LocalSocket::let_in() {
  shm::FileDescriptor socket(::accept4(listener_.socket.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!socket) {
    if (errno == EAGAIN || errno == ECONNABORTED || errno == EINTR) return;
    say_sparingly(gateway::Level::kWarning,
                  std::string("a program that asks the link cannot be let in (accept: ") +
                      std::strerror(errno) + "); trying again");
    // It stays readable: others need the processor, too.
    ::poll(nullptr, 0, 100);
    return;
  }
  LocalUser who;
  try {
    who = wire::user_at(socket.get());
  } catch (const std::system_error&) {  // it has gone
    return turn_away(std::move(socket), kNobody);
  }
  const auto one = std::make_shared<shm::FileDescriptor>(std::move(socket));
  if (!shared_->take_place(who.user, one->get())) {
    refuse(one->get(), "too many programs ask the link at once");
    return turn_away(std::move(*one), who.user);
  }
  try {
    std::thread([shared = shared_, who, one] { serve_program(*shared, who, *one); }).detach();
  } catch (const std::exception&) {  // no thread is left, or no memory
    shared_->end_conversation(one->get());
    shared_->give_back_place(who.user);
    turn_away(std::move(*one), who.user);
  }
}

}  // namespace arbiter::link
