// The daemon: hosts the shared memory's directory, loads models, introduces components to each
// other.
//
// One thread, one epoll. It is off the data path: what it does slowly makes nobody publish slowly.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "rules/load.hpp"
#include "service/barriers.hpp"
#include "service/client.hpp"
#include "service/directory.hpp"
#include "service/models.hpp"
#include "service/switchboard.hpp"
#include "shm/rendezvous.hpp"

namespace arbiter::service {

struct DaemonOptions {
  rules::ModelFiles files;
  std::string instance;   // checked
  std::string directory;  // where to listen
};

class Daemon {
 public:
  // Loads the model and listens. Throws BadModel, std::runtime_error.
  explicit Daemon(const DaemonOptions& options);
  Daemon(const Daemon&) = delete;
  Daemon& operator=(const Daemon&) = delete;
  ~Daemon();

  // Serves until stop_descriptor is readable. SIGHUP and SIGTERM come by signalfd, see main.cpp.
  void run(int signal_descriptor);

  [[nodiscard]] const std::string& path() const { return listener_.path; }

 private:
  enum class Tag : std::uint32_t { kListener, kSignals, kClient, kProcess };

  void watch(int fd, Tag tag, ClientId client, std::uint32_t events);
  [[nodiscard]] int timeout_ms() const;
  // True: stop.
  bool handle_signal(int signal_descriptor);
  void accept_client();
  void turn_away_client();
  // Handles what it has sent, a bounded part of it: others wait too.
  void serve(Client& client);
  void drop(ClientId id);
  void settle();

  void handle(Client& client, shm::Received& received);
  void hello(Client& client, const shm::Message& message);
  void open_output(Client& client, shm::Received& received);
  void open_input(Client& client, shm::Received& received);
  void connect(Client& client, std::uint64_t request, shm::PortInstance port);
  void close_port(Client& client, shm::PortInstance port);
  void send_status(Client& client, std::uint64_t request);
  void deactivate(Client& client, const shm::Message& message);
  void refuse(Client& client, std::uint64_t request, const std::string& why);
  // Throws std::runtime_error if a live component has the name. One that has closed its port, or
  // has ended, before `asking` asked, has not.
  void require_free(const Client& asking, shm::PortInstance holder, const std::string& what);

  void reload();
  void put_in_force();

  const std::string instance_;
  Directory directory_;
  Models models_;
  Switchboard switchboard_{directory_};
  Barriers barriers_;
  shm::Listener listener_;
  shm::FileDescriptor epoll_;
  shm::FileDescriptor reserve_;  // given up for a moment to turn a client away when none is left
  std::map<ClientId, std::unique_ptr<Client>> clients_;
  ClientId last_client_ = 0;
  bool swapping_ = false;       // a model waits for its barrier
  bool reload_wanted_ = false;  // another SIGHUP came meanwhile
  std::uint64_t reloads_refused_ = 0;
};

}  // namespace arbiter::service
