// A node: the conversation with the daemon, and the registry of the ports that it concerns.
//
// Thread safety: opening and closing ports may come from any thread; what the daemon says is
// handled by one thread at a time, the service thread, or whoever calls service() where there is
// none. `mutex_` guards the registry and the replies; nothing on the data path takes it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include <arbiter/detail/cores.hpp>

#include "client/input_core.hpp"
#include "client/memory.hpp"
#include "client/output_core.hpp"
#include "shm/wire.hpp"

namespace arbiter::detail {

class NodeCore : public std::enable_shared_from_this<NodeCore> {
 public:
  // Connects. Throws Error.
  NodeCore(std::string_view name, const NodeOptions& options);
  NodeCore(const NodeCore&) = delete;
  NodeCore& operator=(const NodeCore&) = delete;
  ~NodeCore();

  std::shared_ptr<OutputCore> open_output(std::string_view name, const PortType& type,
                                          const OutputPortOptions& options);
  std::shared_ptr<InputCore> open_input(std::string_view name, const PortType& type,
                                        const InputPortOptions& options);
  void close(shm::PortInstance port) noexcept;

  // Without a service thread: takes up what the daemon has said so far, without blocking.
  void service();
  // Readable when there is something to take up.
  [[nodiscard]] int service_fd() const noexcept { return epoll_.get(); }

  // Asks the daemon and waits for the answer. Throws Error where it refuses, or is gone.
  shm::Received ask(const shm::Message& question,
                    std::array<int, shm::kMaxDescriptors> descriptors);

  [[nodiscard]] const std::string& instance() const noexcept { return instance_; }
  [[nodiscard]] const std::shared_ptr<SharedMemory>& memory() const noexcept { return memory_; }
  // Names of input ports, as far as the daemon has told them (kObserve).
  [[nodiscard]] std::map<shm::PortId, std::string> port_names();

 private:
  struct Reply {
    bool opened = false;  // kOpened came
    bool finished = false;
    std::string refusal;
    shm::Received received;
    std::function<void(const shm::Received&)> on_opened;
  };

  void connect(std::string_view name, const NodeOptions& options);
  void run_service_thread();
  // Waits up to `timeout_ms` for something to do and does it; false once the daemon is gone.
  bool pump(int timeout_ms);
  void handle(shm::Received& received);
  void handle_reply(shm::Received& received);
  void wake_inputs();
  void handle_peer(shm::Received& received);
  void refuse_peer(const shm::Message& announced, const std::string& why);
  void lose_daemon();
  void send(const shm::Message& message,
            std::array<int, shm::kMaxDescriptors> descriptors = {-1, -1});
  shm::Received converse(const shm::Message& question,
                         std::array<int, shm::kMaxDescriptors> descriptors,
                         std::function<void(const shm::Received&)> on_opened);

  std::string instance_;
  shm::FileDescriptor socket_;
  shm::FileDescriptor epoll_;
  std::shared_ptr<SharedMemory> memory_;

  std::mutex mutex_;
  std::condition_variable replied_;
  std::mutex pump_mutex_;  // without a service thread: one caller at a time
  bool daemon_gone_ = false;
  bool stopping_ = false;
  std::uint64_t next_request_ = 1;
  std::map<std::uint64_t, Reply> replies_;
  std::map<shm::PortInstance, std::shared_ptr<OutputCore>> outputs_;
  std::map<shm::PortInstance, std::shared_ptr<InputCore>> inputs_;
  std::map<shm::PortId, std::string> port_names_;

  std::thread service_thread_;  // last: it uses all of the above
};

}  // namespace arbiter::detail
