// A file in memory, and the way back from a byte of it to its line and column.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "rules/text/diagnostic.hpp"

namespace arbiter::rules {

inline constexpr std::size_t kMaxFileBytes = 16u << 20;

// A file that cannot be opened or read; the message names it and says why.
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What is read out of a file refers to its bytes by std::string_view, hence it stays where it is.
class TextFile {
 public:
  // Takes a byte order mark off: it has no place on the first line, for an editor hides it.
  TextFile(std::string path, std::string content);
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] std::string_view content() const { return content_; }

  // Offsets beyond the end are taken for the end.
  [[nodiscard]] Location locate(std::size_t offset) const;
  // Of a byte of content(), or the one behind the last.
  [[nodiscard]] std::size_t offset_of(const char* byte) const {
    return static_cast<std::size_t>(byte - content_.data());
  }

 private:
  std::string path_;
  std::string content_;
  std::vector<std::size_t> line_starts_;
};

// A pipe may stand for a file on a command line, but no FIFO that has a name: nobody may ever write
// to it. Who must go on whatever the files are reads regular ones only: to open or to read anything
// else may take for ever, or set a device off.
enum class Accept { kAnyFile, kRegularFile };

// The whole of a file, but not much more than `limit` bytes of it: a device or a pipe may have no
// end. Throws FileError.
std::string read_bytes(const std::string& path, std::size_t limit = kMaxFileBytes,
                       Accept accept = Accept::kAnyFile);

// "a.xml,b.xml" in place of a file: its parts, where each of them is a file and the whole is none;
// otherwise nothing.
std::vector<std::string> files_in(const std::string& list);

// Reports a file that is larger than the limit, and returns false.
bool check_size(const TextFile& file, std::size_t limit, Diagnostics& diagnostics);

// Whether a model may consist of these bytes: UTF-8 within the limit, without control characters
// (some of which end a file early in a careless reader). Reports the first place where it may not.
// With `begin` and `end`, only the bytes between these are looked at.
bool check_characters(const TextFile& file, Diagnostics& diagnostics, std::size_t begin = 0,
                      std::size_t end = std::string_view::npos);

// What an application file must hold to: the limit, and no NUL. Its other bytes are not ours to
// judge; real ones have names of authors in Latin-1.
bool check_readable(const TextFile& file, Diagnostics& diagnostics);

}  // namespace arbiter::rules
