// A file that is read from its beginning to its end, a piece at a time.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace arbiter::recording {

class InputFile {
 public:
  // Throws McapError: what cannot be opened, and what is no file, such as a pipe.
  explicit InputFile(const std::string& path);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  // When it was opened. One that is being written has more by now; that is not read.
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }

  // The bytes from `offset`, all of which lie before size(); valid until the next call. Throws
  // Damage where they cannot be read.
  std::string_view read(std::uint64_t offset, std::size_t count);

 private:
  int fd_ = -1;
  std::uint64_t size_ = 0;
  std::string window_;
  std::uint64_t window_at_ = 0;
};

}  // namespace arbiter::recording
