// iceoryx behind a gateway: finds RouDi, stays with it, and ends the process when it is gone, for
// another process to begin anew (core/supervisor.hpp): iceoryx cannot leave a RouDi and join
// another.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "gateway/core/middleware.hpp"
#include "gateway/iceoryx/session.hpp"

namespace arbiter::gateway {

class Iceoryx final : public Middleware {
 public:
  // `name`: what the runtime's name begins with.
  explicit Iceoryx(std::string name);
  ~Iceoryx() override;

  Sender& sender(const Gateway& gateway, const Entry& entry, Account& account) override;
  void start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) override;
  void stop() noexcept override;
  // Throws NeedsNewProcess.
  void tend() override;

 private:
  // What keeps all topics from working; empty: nothing.
  void set_obstacle(const std::string& text);
  void tell_obstacles();
  void look_after_senders();

  // Of an `out` entry.
  struct Out {
    std::unique_ptr<ChunkSender> sender;
    Outgoing* outgoing = nullptr;  // while its port is not open, or there is no bridge: null
    bool had_readers = false;
    std::string obstacle{};  // as its account has it
  };

  const std::string name_;
  std::vector<Out> outs_;
  std::vector<OpenIn> ins_;
  std::unique_ptr<Session> session_;
  shm::Nanoseconds joined_ = 0;      // when the session began
  shm::Nanoseconds told_roudi_ = 0;  // when it could be told something last
  std::string obstacle_;
  bool has_started_ = false;
};

}  // namespace arbiter::gateway
