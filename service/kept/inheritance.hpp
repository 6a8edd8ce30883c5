// How a daemon comes by what its predecessor left: from the clients who kept it, or from the
// service manager.
//
// What a client hands back is believed only if it is what the predecessor made: a memfd of our own
// user with the identity that the predecessor wrote down in the runtime directory, where nobody
// else may write.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "service/kept/process.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

// Which file a descriptor is open on.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;

  static FileIdentity of(const shm::FileDescriptor& file);
  friend bool operator==(const FileIdentity&, const FileIdentity&) = default;
};

// The board and the registry that the clients of an instance map.
struct Realm {
  FileIdentity board;
  FileIdentity registry;
  friend bool operator==(const Realm&, const Realm&) = default;
};

// What a daemon that is gone has left behind.
struct Predecessor {
  Realm realm;
  bool is_survived = false;  // a component of its lives, and may hand back the realm
};

// Remembers, beside the socket, which realm the instance's components live in, and who they are.
class StateFile {
 public:
  StateFile(const std::string& directory, const std::string& instance);
  // Nothing, too, where it is not such a file.
  [[nodiscard]] std::optional<Predecessor> read() const;
  // Replaces it at once. Throws std::system_error.
  void write(const Realm& realm, const std::vector<Process>& components);
  // One more component. Whoever it cannot be told of may have to start anew after a restart.
  void add(const Process& component) noexcept;
  // How many components it names, some of which may have ended.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  void remove() const noexcept;

 private:
  std::string path_;
  std::size_t size_ = 0;
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
