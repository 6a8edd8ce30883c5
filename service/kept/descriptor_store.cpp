#include "service/kept/descriptor_store.hpp"

#include <stdlib.h>
#include <systemd/sd-daemon.h>

namespace arbiter::service {

void store(const std::string& name, const shm::FileDescriptor& descriptor) {
  const int fd = descriptor.get();
  const std::string state = "FDSTORE=1\nFDNAME=" + name;
  static_cast<void>(sd_pid_notify_with_fds(0, 0, state.c_str(), &fd, 1));
}

void discard_stored(const std::string& name) {
  sd_notify(0, ("FDSTOREREMOVE=1\nFDNAME=" + name).c_str());
}

bool has_stored() { return sd_listen_fds(0) > 0; }

std::vector<StoredDescriptor> take_stored() {
  char** names = nullptr;
  const int count = sd_listen_fds_with_names(1, &names);
  std::vector<StoredDescriptor> stored;
  for (int i = 0; i < count; ++i) {
    stored.push_back({names[i], shm::FileDescriptor(SD_LISTEN_FDS_START + i)});
    free(names[i]);  // NOLINT: that is how libsystemd hands them out
  }
  free(names);  // NOLINT
  return stored;
}

}  // namespace arbiter::service
