// One client's connection: whose it is, what it has been told, what waits to be sent.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <deque>
#include <memory>
#include <set>
#include <string>

#include "shm/file_descriptor.hpp"
#include "shm/ids.hpp"
#include "shm/wire.hpp"

namespace arbiter::service {

using ClientId = std::uint64_t;

class Client {
 public:
  // Takes over an accepted socket. Throws std::system_error.
  Client(ClientId id, shm::FileDescriptor socket);

  // Sends, or queues where the client is slow to read. Descriptors are duplicated if need be.
  void send(const shm::Message& message,
            std::array<int, shm::kMaxDescriptors> descriptors = {-1, -1});
  // Sends what is queued, as far as it goes.
  void flush();
  [[nodiscard]] bool has_queue() const { return !queue_.empty(); }
  // The client has gone, or does not read what it is sent.
  [[nodiscard]] bool is_lost() const { return lost_; }
  // Asks the kernel whether the process has ended, which may be known before its socket is closed.
  [[nodiscard]] bool has_died() const;

  [[nodiscard]] ClientId id() const { return id_; }
  [[nodiscard]] int socket() const { return socket_.get(); }
  [[nodiscard]] int process() const { return process_.get(); }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] uid_t user() const { return user_; }
  // For messages to people: node "object-detector" (pid 4711).
  [[nodiscard]] std::string description() const;

  std::string name;  // of the node; empty until it has said hello
  bool has_service_thread = false;
  bool observes = false;
  bool watches_queue = false;         // the loop waits until it can be written
  std::set<shm::SourceId> pages;      // those that it has been sent
  std::set<shm::PortInstance> ports;  // that it has open

 private:
  struct Queued {
    shm::Message message;
    std::array<shm::FileDescriptor, shm::kMaxDescriptors> descriptors;
  };
  static constexpr std::size_t kMaxQueue = 65536;

  const ClientId id_;
  shm::FileDescriptor socket_;
  shm::FileDescriptor process_;  // a pidfd
  pid_t pid_ = 0;
  uid_t user_ = 0;
  bool lost_ = false;
  std::deque<std::unique_ptr<Queued>> queue_;
};

}  // namespace arbiter::service
