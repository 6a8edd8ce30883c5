// The service manager's descriptor store: it keeps the daemon's memory from one run to the next.
// Without a service manager it keeps and gives nothing.
#pragma once

#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::service {

struct StoredDescriptor {
  std::string name;
  shm::FileDescriptor descriptor;
};
void store(const std::string& name, const shm::FileDescriptor& descriptor);
void discard_stored(const std::string& name);
std::vector<StoredDescriptor> take_stored();
// Whether there is anything to take.
[[nodiscard]] bool has_stored();

}  // namespace arbiter::service
