#include "service/ports/ports.hpp"

#include <fcntl.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "service/ports/foreign_parts.hpp"
#include "shm/bell.hpp"
#include "shm/foreign.hpp"
#include "shm/utf8.hpp"
#include "wire/errands.hpp"

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

// The names of types stand in logs and documents, as those of ports do.
shm::TypeInfo fine_type(const wire::Message& open) {
  if (const auto fault = shm::fault_of(open.type)) {
    throw std::runtime_error("the port's type \"" + shm::printable(open.type.type_name()) +
                             "\" is not one: " + *fault);
  }
  return open.type;
}

}  // namespace

void require_descriptors(const wire::Received& open, std::size_t descriptors) {
  if (open.descriptor_count != descriptors) {
    throw std::runtime_error("the request came with " + std::to_string(open.descriptor_count) +
                             " descriptors instead of " + std::to_string(descriptors));
  }
}

shm::FileDescriptor kept(const shm::FileDescriptor& descriptor) {
  shm::FileDescriptor copy(fcntl(descriptor.get(), F_DUPFD_CLOEXEC, 0));
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

PortBell::~PortBell() {
  wire::Errands::of_the_process().close(user_, shm::FileDescriptor(pipe_.release()));
}

void PortBell::ring() const {
  if (pending_.ask()) return;
  wire::Errands::of_the_process().run(user_, [self = shared_from_this()] {
    self->pending_.begin();
    shm::ring_bell(self->pipe_.get());
  });
}

// The last who closes a segment frees its memory, which takes its time.
OutputPort::~OutputPort() { wire::Errands::of_the_process().close(user, std::move(segment)); }
InputPort::~InputPort() { wire::Errands::of_the_process().close(user, std::move(segment)); }

std::unique_ptr<OutputPort> adopt_output(const wire::Received& open, uid_t user) {
  // What is handed back comes with the activity page.
  require_descriptors(open, open.message.kind == wire::MessageKind::kHandBackOutput ? 2 : 1);
  auto port = std::make_unique<OutputPort>();
  constexpr std::size_t kRead = shm::kOutputHeadBytes;
  const std::size_t size = own_segment(open.descriptors[0], user, kRead);
  port->mapping = shm::Mapping(open.descriptors[0], kRead, shm::Access::kReadOnly);
  port->layout = shm::OutputLayout::checked(port->header(), size);
  if (port->layout.total_size == 0) {
    throw std::runtime_error("the segment is not an output port's of this version");
  }
  port->segment = kept(open.descriptors[0]);
  port->user = user;
  port->type = fine_type(open.message);
  port->yields = (open.message.flags & wire::kYields) != 0;
  return port;
}

std::unique_ptr<InputPort> adopt_input(const wire::Received& open, uid_t user) {
  require_descriptors(open, 2);
  auto port = std::make_unique<InputPort>();
  const std::size_t size = own_segment(open.descriptors[0], user, sizeof(shm::InputSegment));
  if (size != sizeof(shm::InputSegment)) {
    throw std::runtime_error("the segment is not an input port's of this version");
  }
  port->mapping = shm::Mapping(open.descriptors[0], size, shm::Access::kReadOnly);
  if (!port->shared().is_consistent()) {
    throw std::runtime_error("the segment is not an input port's of this version");
  }
  port->bell = own_bell(open.descriptors[1], user);
  port->segment = kept(open.descriptors[0]);
  port->user = user;
  port->type = fine_type(open.message);
  return port;
}

}  // namespace arbiter::service
