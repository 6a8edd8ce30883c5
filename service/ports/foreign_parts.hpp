// What clients hand over of their ports and taps, judged before it is used or passed on.
//
// Each throws std::runtime_error saying what is wrong.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <memory>

#include "service/ports/port_bell.hpp"
#include "shm/file_descriptor.hpp"
#include "wire/messages.hpp"

namespace arbiter::service {

void require_descriptors(const wire::Received& open, std::size_t descriptors);
// A descriptor of our own: the request may have to wait, and come again with what it came with.
shm::FileDescriptor kept(const shm::FileDescriptor& descriptor);
// The size of a segment that the user has made, with so much of it allocated as is read: a hole
// would be filled, and paid, by who reads.
std::size_t own_segment(const shm::FileDescriptor& segment, uid_t user, std::size_t least);
std::shared_ptr<const PortBell> own_bell(const shm::FileDescriptor& bell, uid_t user);

}  // namespace arbiter::service
