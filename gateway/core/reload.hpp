// A running gateway that begins anew: it is asked to read its mapping again (SIGUSR1), or the
// daemon's state is lost. What is bad changes nothing.
//
// Thread safety: one thread, the gateway's loop.
#pragma once

#include <functional>
#include <memory>

#include "gateway/core/bridge.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/settings.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

// What a gateway runs by. The middleware, which nobody has started yet, refers to the rest.
struct Setup {
  Settings settings;
  Bell bell;
  std::unique_ptr<Middleware> middleware;
};

class Reload {
 public:
  // `asked`, `stop`: descriptors of signals. `prepare`: reads it all again; null where something is
  // wrong, which has been said.
  Reload(int asked, int stop, std::function<std::unique_ptr<Setup>()> prepare);

  // Readable when the bridge is to return: `stop` is, or there is another setup.
  [[nodiscard]] int ends() const noexcept { return ends_.get(); }
  // Whether it is asked now; ten times a second.
  void look();
  // By that setup, which takes the place of one that waits already.
  void begin_anew(std::unique_ptr<Setup> next);
  [[nodiscard]] bool has_next() const noexcept { return next_ != nullptr; }
  // Null: it is to stop.
  [[nodiscard]] std::unique_ptr<Setup> take();

 private:
  const int asked_;
  const std::function<std::unique_ptr<Setup>()> prepare_;
  Bell changed_;
  shm::FileDescriptor ends_;
  std::unique_ptr<Setup> next_;
};

// Takes what has come off a descriptor of signals; false: nothing has.
bool take_signal(int descriptor);

}  // namespace arbiter::gateway
