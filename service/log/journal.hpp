// The journal of systemd: whether standard error leads there, and records in its own protocol
// (https://systemd.io/JOURNAL_NATIVE_PROTOCOL), whose fields `journalctl` can filter by.
//
// libsystemd's sd_journal_sendv() would do this too, but drops a record that the socket does not
// take; ours then goes to standard error, as text.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <string_view>

#include "service/log/event.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

inline constexpr const char* kJournalSocket = "/run/systemd/journal/socket";

// `journal_stream`: the variable JOURNAL_STREAM, "device:inode" of the stream that the service
// manager has laid; null where it is not set. A stream that somebody has redirected since is not
// it.
[[nodiscard]] bool is_journal(int fd, const char* journal_stream);

// How many bytes of names a record has: who closes a thousand ports at once gets no larger share of
// the log.
inline constexpr std::size_t kMaxNamesInRecord = 4096;

// A datagram of fields, each on a line: all that came from elsewhere is made printable, and has no
// line end. `event` may be null. `user`: on whose account it is written.
[[nodiscard]] std::string journal_record(std::string_view message, log::level::level_enum level,
                                         const Event* event, std::optional<uid_t> user);

class JournalSocket {
 public:
  // Throws std::system_error where no socket can be had, std::invalid_argument if the path is too
  // long. Nobody need listen there yet.
  explicit JournalSocket(std::string path);

  // Waits for a reader that is slow. False: it did not take the record.
  [[nodiscard]] bool send(std::string_view record) const;

 private:
  std::string path_;
  shm::FileDescriptor socket_;
};

}  // namespace arbiter::service
