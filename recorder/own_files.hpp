// The files that a flight recorder writes of its own accord: it keeps the last few, so that a
// statement that flips, or a component that dies again and again, cannot fill the disk.
//
// It knows its own by a list beside them, PREFIX.files, so that those of an earlier run count too.
// What is not in the list, or is not the file any more that was listed, it never touches: a file
// that somebody has moved away is theirs. Nor what the list of an older recorder has, which does
// not say enough to know it again.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace arbiter::recorder {

class OwnFiles {
 public:
  // Reads the list. `prefix`: of all names; nobody else has it now (dump_socket.hpp).
  OwnFiles(std::string prefix, std::size_t most);

  // This one has been written. Returns those that were removed for it, the oldest. A list that
  // cannot be written, as on a full disk, counts for this run all the same.
  std::vector<std::string> add(const std::string& path);
  // Where the disk is full. Returns which one; empty: there is none but the newest, which stays.
  std::string remove_oldest();

 private:
  struct File {
    std::string path;
    dev_t device = 0;
    ino_t inode = 0;
    // A file that was removed leaves its inode to the next one. They do not change any more.
    off_t size = 0;
    std::int64_t modified = 0;  // nanoseconds

    bool operator==(const File&) const = default;
  };

  // As it is there now.
  [[nodiscard]] static std::optional<File> seen(const std::string& path);
  void forget_those_gone();
  void read_list();
  void write_list() const;

  const std::string prefix_;
  const std::size_t most_;
  std::deque<File> files_;  // the oldest first
};

}  // namespace arbiter::recorder
