// The files that a mapping consists of, as they were when they were good. A supervised program
// hands them to each worker, and any gateway leaves them to who sends its idle samples when it has
// died: neither must be without a mapping because somebody has just made a mistake in it.
#pragma once

#include <map>
#include <string>
#include <string_view>

#include "gateway/mapping/read_mapping.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

class KeptFiles {
 public:
  KeptFiles() = default;
  // Of what in_memory() has made, in another process. Throws rules::FileError.
  explicit KeptFiles(int descriptor);
  // Of what save() has written, whoever has written there since. Throws rules::FileError.
  [[nodiscard]] static KeptFiles saved(const std::string& path);

  // Reads from the disk, regular files alone if `only_regular`, and keeps what it has read. Refers
  // to this.
  [[nodiscard]] ReadFile from_disk(bool only_regular);
  // Reads what is kept. Refers to this.
  [[nodiscard]] ReadFile kept() const;
  // A file without a name, which processes inherit that are started. Throws std::system_error.
  [[nodiscard]] shm::FileDescriptor in_memory() const;
  // Into a file, in the place of what it has, in one step. Throws std::system_error.
  void save(const std::string& path) const;

 private:
  explicit KeptFiles(std::string_view content);
  [[nodiscard]] std::string content() const;

  std::map<std::string, std::string> by_path_;
};

}  // namespace arbiter::gateway
