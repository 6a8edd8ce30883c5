#include "service/ports/ports.hpp"

#include <fcntl.h>

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "service/ports/foreign_parts.hpp"
#include "shm/foreign.hpp"
#include "shm/utf8.hpp"
#include "wire/errands.hpp"

namespace arbiter::service {
namespace {

// The names of types stand in logs and documents, as those of ports do.
shm::TypeInfo fine_type(const wire::Message& open) {
  if (const auto fault = shm::fault_of(open.type)) {
    throw std::runtime_error("the port's type \"" + shm::printable(open.type.type_name()) +
                             "\" is not one: " + *fault);
  }
  return open.type;
}

}  // namespace

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

wire::Message message_to(wire::MessageKind kind, shm::PortInstance port, shm::PortInstance peer,
                         std::uint32_t id) {
  wire::Message message;
  message.kind = kind;
  message.port = port;
  message.peer = peer;
  message.id = id;
  return message;
}

}  // namespace arbiter::service
