#include "gateway/core/descriptors.hpp"

#include <fcntl.h>
#include <sys/resource.h>

#include <algorithm>
#include <new>
#include <utility>

namespace arbiter::gateway {
namespace {

// More than a file of the most entries, all with two ports, needs. The kernel keeps a table of
// them.
constexpr rlim_t kMost = 32768;

}  // namespace

void raise_descriptor_limit() noexcept {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
  const rlim_t wanted = std::min(limit.rlim_max, kMost);
  if (limit.rlim_cur >= wanted) return;
  limit.rlim_cur = wanted;
  static_cast<void>(::setrlimit(RLIMIT_NOFILE, &limit));  // if it may not, there are fewer
}

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
