// The clients of the fuzz target, below the client library: one that babbles as the input says, and
// one that keeps to the protocol.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "shm/bell.hpp"
#include "shm/segment.hpp"
#include "tests/fuzz/daemon/loop.hpp"
#include "wire/messages.hpp"

namespace arbiter::fuzz {

// A process, as the daemon knows it, until it ends.
class Process {
 public:
  Process(pid_t pid, uid_t user);
  [[nodiscard]] Identity identity() const { return {pid_, user_, ended_.get()}; }
  void end();

 private:
  pid_t pid_;
  uid_t user_;
  shm::FileDescriptor ended_;
  shm::FileDescriptor lives_;
};

// Sealed as a component seals it. Its header is right.
shm::FileDescriptor make_output_segment(const shm::TypeInfo& type, std::uint32_t slots);
shm::FileDescriptor make_input_segment(std::uint32_t depth);
// The same, with a word of the header changed.
shm::FileDescriptor make_output_segment(std::uint32_t slots, std::size_t word, std::uint64_t value);
shm::FileDescriptor make_input_segment(std::size_t word, std::uint64_t value);

// A connection to the daemon that never blocks.
class Connection {
 public:
  Connection(const std::string& path, const Process& process);

  [[nodiscard]] int socket() const { return socket_.get(); }
  wire::SendResult send(const wire::Message& message, std::vector<int> descriptors = {}) const;
  wire::SendResult send_bytes(const void* data, std::size_t size,
                              const std::vector<int>& descriptors) const;
  void half_close(int how) const;

 private:
  const uid_t user_;
  shm::FileDescriptor socket_;
};

// A client that keeps to the protocol: it reads all it is sent, answers each kSync, and is never
// hung up on.
class Honest {
 public:
  Honest(const std::string& path, const Process& process, const std::string& name);

  // Returns whether there was anything.
  bool read();
  void open_output(const std::string& name);
  void open_input(const std::string& name);
  void close_port();
  void ask(wire::MessageKind kind, const std::string& name = {});

  [[nodiscard]] bool is_welcome() const { return welcome_; }
  [[nodiscard]] shm::PortInstance port() const { return port_; }
  [[nodiscard]] bool is_connected() const { return connected_; }
  // Sources whose page it was sent.
  [[nodiscard]] std::size_t pages() const { return pages_.size(); }
  // Peers of its port, connected, by instance.
  [[nodiscard]] const std::map<shm::PortInstance, std::uint32_t>& peers() const { return peers_; }
  [[nodiscard]] const std::string& refusal() const { return refusal_; }
  [[nodiscard]] std::uint64_t done() const { return done_; }
  [[nodiscard]] const std::string& status() const { return status_; }

 private:
  void hear(const wire::Received& received);
  void open(const wire::Message& message, const std::vector<int>& descriptors);

  Connection connection_;
  shm::Bell bell_;
  bool welcome_ = false;
  bool connected_ = false;
  shm::PortInstance port_ = 0;
  bool is_input_ = false;
  std::map<shm::SourceId, std::string> pages_;
  std::map<shm::PortInstance, std::uint32_t> peers_;
  std::uint64_t done_ = 0;
  std::uint64_t model_ = 0;  // the generation that it was told of last
  std::string refusal_;
  std::string status_;
};

}  // namespace arbiter::fuzz
