#include "gateway/core/spare_descriptors.hpp"

#include <fcntl.h>

#include <new>
#include <utility>

namespace arbiter::gateway {

SpareDescriptors::SpareDescriptors() noexcept : is_any_left_(take(kSpare, held_)) {}

bool SpareDescriptors::leave_room() noexcept {
  std::vector<shm::FileDescriptor> more;
  is_any_left_ = is_any_left_ && take(kOfEntry, more);
  return is_any_left_;
}

bool SpareDescriptors::take(std::size_t count, std::vector<shm::FileDescriptor>& to) noexcept {
  try {
    to.reserve(count);
    while (to.size() < count) {
      shm::FileDescriptor next(::open("/dev/null", O_RDONLY | O_CLOEXEC));
      if (!next) return false;
      to.push_back(std::move(next));
    }
  } catch (const std::bad_alloc&) {
    return false;
  }
  return true;
}

}  // namespace arbiter::gateway
