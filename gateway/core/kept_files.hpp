// The files that a mapping consists of, as they were when they were good. A supervised program
// hands them to each worker: one that starts while somebody edits the mapping must not be without
// any.
#pragma once

#include <map>
#include <string>

#include "gateway/mapping/read_mapping.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

class KeptFiles {
 public:
  KeptFiles() = default;
  // Of what in_memory() has made, in another process. Throws rules::FileError.
  explicit KeptFiles(int descriptor);

  // Reads from the disk, regular files alone if `only_regular`, and keeps what it has read. Refers
  // to this.
  [[nodiscard]] ReadFile from_disk(bool only_regular);
  // Reads what is kept. Refers to this.
  [[nodiscard]] ReadFile kept() const;
  // A file without a name, which processes inherit that are started. Throws std::system_error.
  [[nodiscard]] shm::FileDescriptor in_memory() const;

 private:
  std::map<std::string, std::string> by_path_;
};

}  // namespace arbiter::gateway
