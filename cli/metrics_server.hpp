// Serves one document over HTTP, to a monitoring system on this machine.
//
// Clients are strangers: none may hold up another, or cost more than a little. So there are bounds
// on how many are connected (64), what each may send (16 KiB), and how long each may take in all
// (5 s, however busily it sends or reads). Every answer closes its connection. One thread, the
// caller's, does everything.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "shm/file_descriptor.hpp"

namespace arbiter::cli {

struct ListenAddress {
  std::string text;  // "127.0.0.1:9180", "[::1]:9180", "localhost:9180", "/run/arbiter/metrics"
  bool allow_remote = false;
};

class MetricsServer {
 public:
  // Binds and listens. Throws Error where the address is none, is not this machine's own (without
  // allow_remote), or is taken. `document` is called for each request, in run().
  MetricsServer(const ListenAddress& address, std::function<std::string()> document);
  ~MetricsServer();
  MetricsServer(const MetricsServer&) = delete;
  MetricsServer& operator=(const MetricsServer&) = delete;

  // Where it can be reached: with the port that the system has chosen, if that was 0.
  [[nodiscard]] const std::string& url() const noexcept;
  // Serves until `interrupts` is readable.
  void run(const shm::FileDescriptor& interrupts);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace arbiter::cli
