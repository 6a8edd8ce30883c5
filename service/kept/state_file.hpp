// Which memory an instance's components live in, and who they are: written down beside the socket,
// where only the daemon's user may write, for a successor to judge by.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "service/kept/process.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

// The board and the registry that the clients of an instance map.
struct Realm {
  shm::SegmentIdentity board;
  shm::SegmentIdentity registry;
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
  [[nodiscard]] std::optional<Predecessor> read();
  // Replaces it at once. Throws std::system_error: then it is what it was if it names that realm,
  // else it is gone, for a successor would look for what nobody has.
  void write(const Realm& realm, const std::vector<Process>& components);
  // Whether there is one, with the realm that was read or written last.
  [[nodiscard]] bool is_there() const { return named_.has_value(); }
  // One more component, where there is one. Throws std::system_error.
  void add(const Process& component);
  // How many components it names, some of which may have ended.
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  void remove() noexcept;

 private:
  void replace(const Realm& realm, const std::vector<Process>& components);

  std::string path_;
  std::optional<Realm> named_;  // the realm that it names
  std::size_t size_ = 0;
};

}  // namespace arbiter::service
