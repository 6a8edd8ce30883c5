// The journal of systemd: whether standard error leads there, and sending it records in its own
// protocol (https://systemd.io/JOURNAL_NATIVE_PROTOCOL), whose fields `journalctl` can filter by.
//
// libsystemd's sd_journal_sendv() would do this too, but drops a record that the socket does not
// take; ours then goes to standard error, as text.
#pragma once

#include <string>
#include <string_view>

#include "shm/file_descriptor.hpp"

namespace arbiter::logging {

inline constexpr const char* kJournalSocket = "/run/systemd/journal/socket";

// `journal_stream`: the variable JOURNAL_STREAM, "device:inode" of the stream that the service
// manager has laid; null where it is not set. A stream that somebody has redirected since is not
// it.
[[nodiscard]] bool is_journal(int fd, const char* journal_stream);

// As syslog counts them.
inline constexpr char kErrorPriority = '3';
inline constexpr char kWarningPriority = '4';
inline constexpr char kInfoPriority = '6';

// Adds a line, which has no line end within it: `value` is printable.
void add_field(std::string& record, const char* field, std::string_view value);

// A datagram of fields, of the daemon, which alone sends records. The message is made printable.
[[nodiscard]] std::string journal_record(std::string_view message, char priority);

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

}  // namespace arbiter::logging
