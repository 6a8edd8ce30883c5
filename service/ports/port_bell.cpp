#include "service/ports/port_bell.hpp"

#include "shm/bell.hpp"
#include "wire/errands.hpp"

namespace arbiter::service {

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

}  // namespace arbiter::service
