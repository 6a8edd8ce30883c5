// How a daemon comes by what its predecessor left: from the clients who kept it, or from the
// service manager.
//
// What a client hands back is believed only if it is what the predecessor made: a memfd of our own
// user with the identity that the predecessor wrote down in the runtime directory, where nobody
// else may write.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// Which file a descriptor is open on.
struct Identity {
  dev_t device = 0;
  ino_t inode = 0;

  static Identity of(const shm::FileDescriptor& file);
  friend bool operator==(const Identity&, const Identity&) = default;
};

// The board and the registry that the clients of an instance map.
struct Realm {
  Identity board;
  Identity registry;
  friend bool operator==(const Realm&, const Realm&) = default;
};

// Remembers, beside the socket, which realm the instance's clients live in.
class StateFile {
 public:
  StateFile(const std::string& directory, const std::string& instance);
  // Nothing, too, where the file is not one.
  [[nodiscard]] std::optional<Realm> read() const;
  // Replaces it at once. Throws std::system_error.
  void write(const Realm& realm) const;
  void remove() const noexcept;

 private:
  std::string path_;
};

// Opens for writing what a daemon of this user made and clients may only read. Throws
// std::runtime_error where it is not that.
shm::FileDescriptor reopen_inherited(const shm::FileDescriptor& handed_back, std::size_t size);

// The service manager's descriptor store. Without a service manager it keeps and gives nothing.
struct StoredDescriptor {
  std::string name;
  shm::FileDescriptor descriptor;
};
void store(const std::string& name, const shm::FileDescriptor& descriptor);
void discard_stored(const std::string& name);
std::vector<StoredDescriptor> take_stored();

}  // namespace arbiter::service
