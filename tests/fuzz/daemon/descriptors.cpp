#include "tests/fuzz/daemon/descriptors.hpp"

#include <fcntl.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>

#include "tests/fuzz/daemon/peer.hpp"
#include "wire/messages.hpp"

namespace arbiter::fuzz {

std::vector<int> Descriptors::some(const Owner& owner) {
  std::size_t count = script_.byte() % 4;
  if (count == 3) count = script_.byte() % 40u;
  std::vector<int> result;
  while (result.size() < count) {
    const int descriptor = one(owner);
    if (descriptor < 0) return {};
    result.push_back(descriptor);
  }
  return result;
}

int Descriptors::make(shm::FileDescriptor descriptor) {
  made_.push_back(std::move(descriptor));
  return made_.back().get();
}

void Descriptors::keep(shm::FileDescriptor descriptor) {
  constexpr std::size_t kMostGiven = 64;
  if (given_.size() < kMostGiven) given_.push_back(std::move(descriptor));
}

int Descriptors::given(std::size_t index) const {
  return given_.empty() ? -1 : given_[index % given_.size()].get();
}

bool Descriptors::is_made(int descriptor) const {
  return descriptor == bell() ||
         std::any_of(made_.begin(), made_.end(),
                     [descriptor](const auto& made) { return made.get() == descriptor; });
}

void Descriptors::close() {
  given_.clear();
  made_.clear();
}

int Descriptors::one(const Owner& owner) {
  const std::uint8_t kind = script_.byte();
  // Those that came later have bytes of their own, so that the corpus still means what it did.
  switch (kind >= 252 ? 14 + kind % 3 : kind % 18 > 13 ? 17 : kind % 18) {
    case 0:
      return make(make_output_segment({}, 1 + script_.byte() % 8u));
    case 1:
      return make(make_input_segment(1 + script_.byte() % 8u));
    case 2:
      return make(make_output_segment(1 + script_.byte() % 8u, script_.byte(), script_.number()));
    case 3:
      return make(make_input_segment(script_.byte(), script_.number()));
    case 4:
      return bell();
    case 5:
      return bell_.read_end();
    case 6:
      return owner.process;
    case 7:
      return owner.socket;
    case 8:
      return make(shm::FileDescriptor(::open("/dev/zero", O_RDWR | O_CLOEXEC)));
    case 9:
      return make(shm::FileDescriptor(::open("/", O_RDONLY | O_DIRECTORY | O_CLOEXEC)));
    case 10:
      return make(shm::FileDescriptor(::open("/", O_PATH | O_CLOEXEC)));
    case 11:
      return make(shm::FileDescriptor(::epoll_create1(EPOLL_CLOEXEC)));
    case 12:
      return make(shm::make_segment("fuzz", script_.word() % (1u << 24)));
    case 13:
      return segment();
    case 14:
      return fifo(kind);
    case 15:
      return pipe();
    case 16:
      return queued(owner);
    default:
      return given_.empty() ? -1 : given(script_.byte());
  }
}

int Descriptors::segment() {
  auto segment = shm::make_segment("fuzz", script_.number() % (1u << 24));
  shm::seal(segment, script_.byte() % 2 == 0 ? shm::Seals::kFixedSize : shm::Seals::kOneWriter);
  return make(std::move(segment));
}

int Descriptors::pipe() {
  int ends[2];
  if (::pipe2(ends, O_CLOEXEC) != 0) return -1;
  make(shm::FileDescriptor(ends[0]));
  return make(shm::FileDescriptor(ends[1]));
}

// A pipe with a name, by which a daemon of root might open it for others.
int Descriptors::fifo(std::uint8_t kind) {
  const std::string path = names_.path() + "/pipe:[1]";
  static_cast<void>(::mkfifo(path.c_str(), 0600));
  const int flags = kind % 2 == 0 ? O_PATH : O_RDWR;
  return make(shm::FileDescriptor(::open(path.c_str(), flags | O_CLOEXEC)));
}

// A socket with another in a message that nobody reads.
int Descriptors::queued(const Owner& owner) {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) return make({});
  shm::FileDescriptor inner(ends[0]);
  const shm::FileDescriptor outer(ends[1]);
  static_cast<void>(wire::send_message(outer.get(), {}, {owner.process, -1}));
  return make(std::move(inner));
}

}  // namespace arbiter::fuzz
