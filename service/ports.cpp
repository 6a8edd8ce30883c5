#include "service/ports.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <stdexcept>

namespace arbiter::service {
namespace {

// A descriptor that the client could not use to change the segment, whatever it does with its own.
shm::FileDescriptor read_only(const shm::FileDescriptor& segment) {
  return shm::reopen(segment, O_RDONLY);
}

void require(const shm::Received& open, std::size_t descriptors) {
  if (open.descriptor_count != descriptors) {
    throw std::runtime_error("the request came with " + std::to_string(open.descriptor_count) +
                             " descriptors instead of " + std::to_string(descriptors));
  }
}

}  // namespace

std::unique_ptr<OutputPort> adopt_output(const shm::Received& open) {
  // What is handed back comes with the activity page.
  require(open, open.message.kind == shm::MessageKind::kHandBackOutput ? 2 : 1);
  auto port = std::make_unique<OutputPort>();
  const std::size_t size = shm::checked_size(open.descriptors[0], shm::Seals::kOneWriter);
  if (size < sizeof(shm::OutputHeader)) throw std::runtime_error("the segment is too small");
  port->segment = read_only(open.descriptors[0]);
  port->mapping = shm::Mapping(port->segment, size, shm::Access::kReadOnly);
  port->layout = shm::OutputLayout::checked(port->header(), size);
  if (port->layout.total_size == 0) {
    throw std::runtime_error("the segment is not an output port's of this version");
  }
  port->type = open.message.type;
  return port;
}

std::unique_ptr<InputPort> adopt_input(const shm::Received& open) {
  require(open, 2);
  auto port = std::make_unique<InputPort>();
  const std::size_t size = shm::checked_size(open.descriptors[0], shm::Seals::kOneWriter);
  if (size != sizeof(shm::InputSegment)) {
    throw std::runtime_error("the segment is not an input port's of this version");
  }
  port->segment = read_only(open.descriptors[0]);
  port->mapping = shm::Mapping(port->segment, size, shm::Access::kReadOnly);
  if (!port->shared().is_consistent()) {
    throw std::runtime_error("the segment is not an input port's of this version");
  }
  struct stat bell {};
  if (fstat(open.descriptors[1].get(), &bell) != 0 || !S_ISFIFO(bell.st_mode)) {
    throw std::runtime_error("the bell is not a pipe");
  }
  port->bell = shm::reopen(open.descriptors[1], O_WRONLY | O_NONBLOCK);
  port->bell_for_peers = shm::reopen(open.descriptors[1], O_WRONLY | O_NONBLOCK);
  port->type = open.message.type;
  return port;
}

}  // namespace arbiter::service
