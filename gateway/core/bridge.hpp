// A gateway's loop: opens the ports of a mapping, sends what they take, looks after ages, idle
// samples and descriptions, until it is told to end.
//
// Where a port cannot be opened, because it is taken or the policy does not allow it, it says so,
// serves the other entries, and tries again once a second; where the daemon does not answer, which
// holds up the loop, 10 to 20 s later. A daemon that goes and comes again is the node's business
// (arbiter/node.hpp); samples pass meanwhile. Where its state is lost the node cannot come back:
// whoever runs the bridge makes another one.
//
// Thread safety: all of it runs on the thread that calls run(), but for wake().
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <arbiter/node.hpp>

#include "gateway/core/account.hpp"
#include "gateway/core/incoming.hpp"
#include "gateway/core/max_ages.hpp"
#include "gateway/core/middleware.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/core/pauses.hpp"
#include "gateway/core/spare_descriptors.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::gateway {

struct BridgeOptions {
  std::string name;      // of the node, and in the log
  std::string instance;  // as NodeOptions has it
  // Called by the loop every Middleware::tend_period() at least, so that somebody can see that it
  // goes round.
  std::function<void()> on_round{};
  // Called, at most once a second, where the daemon does not know what this bridge has open: only
  // another bridge in its place is let in.
  std::function<void()> on_turned_away{};
};

// Lets a bridge's loop look at everything now. Any thread; also a signal handler.
class Bell {
 public:
  Bell();
  void ring() const noexcept;
  void silence() const noexcept;
  [[nodiscard]] int descriptor() const noexcept { return descriptor_.get(); }

 private:
  shm::FileDescriptor descriptor_;
};

class Bridge {
 public:
  // Of the gateways of that kind in `mappings`. Keeps references.
  Bridge(BridgeOptions options, const std::vector<Mapping>& mappings, Kind kind, const Bell& bell,
         Middleware& middleware);
  Bridge(const Bridge&) = delete;
  Bridge& operator=(const Bridge&) = delete;
  ~Bridge();

  // Returns when `stop` has become readable. Throws what Middleware::sender() throws.
  void run(int stop);

 private:
  // Each change of it is said once.
  class Saying {
   public:
    void say_once(const std::string& text);

   private:
    std::string last_;
  };

  // An entry with all that belongs to it.
  struct Part {
    Part(const Gateway& in, const Entry& of);
    const Gateway& gateway;
    const Entry& entry;
    Account account;
    Sender* sender = nullptr;
    std::unique_ptr<Incoming> incoming;
    std::unique_ptr<Outgoing> outgoing;
    News news;  // in the log
    std::string described;
    bool is_trouble = false;  // so described
    Saying waiting;           // for its port
    std::size_t first = 0;    // of its ports, to be opened
    [[nodiscard]] bool is_open() const { return incoming != nullptr || outgoing != nullptr; }
  };

  void make_node(int stop);
  // Opens what is not open yet, as far as it can be, and lets the middleware serve that.
  void open_closed();
  [[nodiscard]] bool is_any(bool open) const;
  // False: not now, and the log says why.
  bool try_to_open(Part& part, SpareDescriptors& spare);
  void open(Part& part);
  // `whose`: a Part, or what else the loop knows the descriptor by.
  void watch(int descriptor, const void* whose) const;
  void watch_news();
  void start(const std::vector<Part*>& opened);
  void loop(int stop);
  // To whoever obeys an `out` entry. An entry whose port was not opened is somebody else's.
  void take_leave();
  void look_after(shm::Nanoseconds now, bool all);
  [[nodiscard]] shm::Nanoseconds next_round() const;
  // False: `stop` is readable.
  bool hear(int milliseconds, bool& all);
  void serve(shm::Nanoseconds now, bool all);
  void look_after_all();
  // Sleeps; true: `stop` is readable.
  static bool waits(int stop, int milliseconds);

  const BridgeOptions options_;
  const Bell& bell_;
  Middleware& middleware_;
  MaxAges max_ages_;
  shm::FileDescriptor epoll_;
  std::optional<Node> node_;
  std::vector<std::unique_ptr<Part>> parts_;
  FeedBySource feeds_;
  shm::Nanoseconds open_again_ = 0;  // what is not open yet
  std::size_t open_next_ = 0;        // of parts_
  Saying waiting_;                   // for the daemon
  Saying ages_;
  bool has_started_ = false;
  shm::Nanoseconds tend_at_ = 0;
  shm::Nanoseconds tell_at_ = 0;
  bool watches_news_ = false;  // of the daemon's, for max_ages_
  bool stops_ = false;
};

}  // namespace arbiter::gateway
