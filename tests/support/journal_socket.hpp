// Where a journal would listen: records in systemd's native protocol, as its documentation has it.
#pragma once

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/file_descriptor.hpp"
#include "tests/support/datagram_socket.hpp"

namespace arbiter::test {

using JournalRecord = std::multimap<std::string, std::string>;  // fields; one may be there twice

inline JournalRecord parse_journal_record(std::string_view bytes) {
  JournalRecord record;
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    if (end == std::string_view::npos) throw std::runtime_error("a field without a line end");
    const std::string_view line = bytes.substr(0, end);
    bytes.remove_prefix(end + 1);
    const std::size_t equals = line.find('=');
    if (equals != std::string_view::npos) {
      record.emplace(line.substr(0, equals), line.substr(equals + 1));
      continue;
    }
    std::uint64_t size =
        0;  // a value that may have line ends: its size, little endian, goes before
    if (bytes.size() < sizeof size) throw std::runtime_error("a field without a size");
    std::memcpy(&size, bytes.data(), sizeof size);
    bytes.remove_prefix(sizeof size);
    if (bytes.size() <= size) throw std::runtime_error("a field that is too short");
    record.emplace(line, bytes.substr(0, size));
    bytes.remove_prefix(size + 1);
  }
  return record;
}

class JournalServer {
 public:
  explicit JournalServer(std::string path)
      : path_(std::move(path)), socket_(datagram_socket_at(path_)) {}

  [[nodiscard]] const std::string& path() const { return path_; }
  // Waits for one.
  JournalRecord receive() {
    std::string bytes(1 << 18, '\0');
    const ssize_t size = ::recv(socket_.get(), bytes.data(), bytes.size(), 0);
    if (size < 0) throw std::runtime_error("recv");
    return parse_journal_record({bytes.data(), static_cast<std::size_t>(size)});
  }
  // Those that have come. None comes any more once the writer has ended.
  std::vector<JournalRecord> rest() {
    std::vector<JournalRecord> records;
    pollfd readable{socket_.get(), POLLIN, 0};
    while (::poll(&readable, 1, 0) == 1) records.push_back(receive());
    return records;
  }
  // The first of that event that has all these fields; another that came before may come after.
  JournalRecord wait_for(const std::string& event, const JournalRecord& fields = {}) {
    const auto is_wanted = [&](const JournalRecord& record) {
      return has(record, {"ARBITER_EVENT", event}) &&
             std::all_of(fields.begin(), fields.end(),
                         [&](const auto& field) { return has(record, field); });
    };
    for (std::size_t i = 0;; ++i) {
      if (i == seen_.size()) seen_.push_back(receive());
      if (is_wanted(seen_[i])) return seen_[i];
    }
  }

 private:
  static bool has(const JournalRecord& record, const JournalRecord::value_type& field) {
    const auto [begin, end] = record.equal_range(field.first);
    return std::any_of(begin, end, [&](const auto& each) { return each.second == field.second; });
  }

  std::string path_;
  shm::FileDescriptor socket_;
  std::vector<JournalRecord> seen_;
};

}  // namespace arbiter::test
