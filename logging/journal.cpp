#include "logging/journal.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::logging {

bool is_journal(int fd, const char* journal_stream) {
  struct stat status {};
  if (journal_stream == nullptr || ::fstat(fd, &status) != 0) return false;
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino) == journal_stream;
}

void add_field(std::string& record, const char* field, std::string_view value) {
  record.append(field).append("=").append(value).append("\n");
}

std::string journal_record(std::string_view message, char priority) {
  std::string record;
  add_field(record, "MESSAGE", shm::printable(message));
  add_field(record, "PRIORITY", std::string(1, priority));
  add_field(record, "SYSLOG_IDENTIFIER", "arbiterd");
  return record;
}

JournalSocket::JournalSocket(std::string path) : path_(std::move(path)) {
  if (path_.size() >= sizeof(sockaddr_un::sun_path)) {
    throw std::invalid_argument("the path of the journal's socket is too long: " + path_);
  }
  socket_.reset(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  if (!socket_) throw std::system_error(errno, std::generic_category(), "a socket to the journal");
}

// Not connected, for a journal that is restarted may listen at another socket of that path.
bool JournalSocket::send(std::string_view record) const {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path_.data(), path_.size());
  for (;;) {
    const ssize_t sent = ::sendto(socket_.get(), record.data(), record.size(), MSG_NOSIGNAL,
                                  reinterpret_cast<const sockaddr*>(&address), sizeof address);
    if (sent >= 0) return true;
    if (errno != EINTR) return false;
  }
}

}  // namespace arbiter::logging
