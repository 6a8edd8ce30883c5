#include "service/ports/foreign_parts.hpp"

#include <fcntl.h>

#include <cerrno>
#include <stdexcept>
#include <string>
#include <system_error>

#include "shm/foreign.hpp"
#include "shm/limits.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {
namespace {

// A descriptor says what a process was given, not what it may open: root's daemon would pass on
// what another user's program was tricked into sending. Root may make what it likes.
void require_own(const shm::FileDescriptor& descriptor, const std::string& what, uid_t user) {
  const uid_t maker = shm::maker_of(descriptor.get());
  if (user == 0 || maker == user) return;
  throw std::runtime_error(what + " was made by user " + std::to_string(maker) +
                           ", and handed in by user " + std::to_string(user));
}

}  // namespace

void require_descriptors(const wire::Received& open, std::size_t descriptors) {
  if (open.descriptor_count != descriptors) {
    throw std::runtime_error("the request came with " + std::to_string(open.descriptor_count) +
                             " descriptors instead of " + std::to_string(descriptors));
  }
}

shm::FileDescriptor kept(const shm::FileDescriptor& descriptor) {
  shm::FileDescriptor copy = shm::duplicate(descriptor.get());
  if (!copy) throw std::system_error(errno, std::generic_category(), "keeping a descriptor");
  return copy;
}

std::size_t own_segment(const shm::FileDescriptor& segment, uid_t user, std::size_t least) {
  const std::size_t size = shm::checked_size(segment, shm::Seals::kOneWriter);
  require_own(segment, "the segment", user);
  if (size < least) throw std::runtime_error("the segment is too small");
  if (size > shm::kMaxSegmentSize) {
    throw std::runtime_error("the segment has " + std::to_string(size) +
                             " bytes, more than a port's may have (kMaxSegmentSize)");
  }
  if (shm::allocated_size(segment) < least) {
    throw std::runtime_error("the segment's memory is not allocated");
  }
  return size;
}

std::shared_ptr<const PortBell> own_bell(const shm::FileDescriptor& bell, uid_t user) {
  if (shm::foreign_kind(bell.get()) != shm::ForeignKind::kPipe) {
    throw std::runtime_error("the bell is not a pipe");
  }
  require_own(bell, "the bell", user);
  if ((fcntl(bell.get(), F_GETFL) & O_ACCMODE) != O_WRONLY) {
    throw std::runtime_error("the bell is not a pipe's write end");
  }
  return std::make_shared<const PortBell>(kept(bell), user);
}

}  // namespace arbiter::service
