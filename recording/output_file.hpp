// A file that is written from its beginning, a whole record at a time.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "recording/mcap.hpp"

namespace arbiter::recording {

class OutputFile {
 public:
  // Makes it; throws McapError, also where there is one already. NoRoomError, as write() and
  // close(), where that is why.
  OutputFile(const std::string& path, Unfinished unfinished);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  // All or nothing: if it cannot, it takes back what it has written of them, and throws McapError.
  // It then writes nothing any more. This and the next two throw where somebody has deleted the
  // file meanwhile, or cut it.
  void write(std::string_view bytes);
  // Returns when a power cut cannot take what was written.
  void sync();
  void close();
  // For mistakes of the caller, which are about this file all the same.
  [[noreturn]] void refuse(const std::string& what, const std::string& reason) const;

  [[nodiscard]] std::uint64_t bytes() const noexcept { return bytes_; }
  [[nodiscard]] std::uint32_t crc() const noexcept { return crc_; }  // of all that was written

 private:
  void require_open(const std::string& what) const;
  [[nodiscard]] std::string text_of(const std::string& what, const std::string& reason) const;
  // Says what could not be done, and ends the file.
  [[noreturn]] void fail(const char* what, int error);
  void require_untouched();
  // False: it is not there any more.
  bool unlink_mine() noexcept;

  std::string path_;
  Unfinished unfinished_;
  int fd_ = -1;
  std::uint64_t bytes_ = 0;
  std::uint32_t crc_ = 0;
  std::string ended_;  // why nothing more is written
  bool is_synced_before_ = false;
};

}  // namespace arbiter::recording
