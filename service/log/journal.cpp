#include "service/log/journal.hpp"

#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "shm/utf8.hpp"

namespace arbiter::service {
namespace {

// As syslog counts them.
char priority_of(log::level::level_enum level) {
  switch (level) {
    case log::level::critical:
      return '2';
    case log::level::err:
      return '3';
    case log::level::warn:
      return '4';
    case log::level::info:
      return '6';
    default:
      return '7';
  }
}

void add(std::string& record, const char* field, std::string_view value) {
  record.append(field).append("=").append(value).append("\n");
}

// A field may be there several times, and is found by each of its values.
void add_names(std::string& record, std::size_t limit, const char* field,
               const std::vector<std::string_view>& names) {
  for (const std::string_view name : names) {
    const std::string clean = shm::printable(name);
    if (record.size() + clean.size() <= limit) add(record, field, clean);
  }
}

}  // namespace

bool is_journal(int fd, const char* journal_stream) {
  struct stat status {};
  if (journal_stream == nullptr || ::fstat(fd, &status) != 0) return false;
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino) == journal_stream;
}

std::string journal_record(std::string_view message, log::level::level_enum level,
                           const Event* event, std::optional<uid_t> user) {
  std::string record;
  add(record, "MESSAGE", shm::printable(message));
  add(record, "PRIORITY", std::string(1, priority_of(level)));
  add(record, "SYSLOG_IDENTIFIER", "arbiterd");
  if (user) add(record, "ARBITER_USER", std::to_string(*user));
  if (event == nullptr) return record;
  const EventName& name = event_names.at(static_cast<std::size_t>(event->kind));
  add(record, "MESSAGE_ID", name.message_id);
  add(record, "ARBITER_EVENT", name.name);
  if (event->generation != 0) {
    add(record, "ARBITER_GENERATION", std::to_string(event->generation));
  }
  const std::size_t limit = record.size() + kMaxNamesInRecord;
  add_names(record, limit, "ARBITER_COMPONENT", event->components);
  add_names(record, limit, "ARBITER_SOURCE", event->sources);
  add_names(record, limit, "ARBITER_PORT", event->ports);
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

}  // namespace arbiter::service
