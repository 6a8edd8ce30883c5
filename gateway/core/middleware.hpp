// What a gateway's middleware half gives the common one.
#pragma once

#include <stdexcept>
#include <vector>

#include "gateway/core/account.hpp"
#include "gateway/core/incoming.hpp"
#include "gateway/core/outgoing.hpp"
#include "gateway/mapping/mapping.hpp"
#include "shm/activity.hpp"

namespace arbiter::gateway {

// The middleware cannot go on in this process: the supervisor starts another one.
class NeedsNewProcess : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// The same where the daemon does not know what the gateway has open: to send still works, so that
// whoever obeys an `out` entry can be told first.
class LostPorts : public NeedsNewProcess {
 public:
  using NeedsNewProcess::NeedsNewProcess;
};

// All calls come from the bridge's thread.
class Middleware {
 public:
  Middleware() = default;
  Middleware(const Middleware&) = delete;
  Middleware& operator=(const Middleware&) = delete;
  virtual ~Middleware() = default;

  // Of an `out` entry, for as long as this lives; send() may be called from then on, and answers
  // kNotReady where nothing can be sent yet. Throws what is wrong with the entry for good.
  virtual Sender& sender(const Gateway& gateway, const Entry& entry, Account& account) = 0;

  // An entry's ports are open.
  struct OpenIn {
    const Gateway& gateway;
    Incoming& incoming;
    Account& account;
  };
  struct OpenOut {
    const Gateway& gateway;
    Outgoing& outgoing;
    Account& account;
  };
  // From here on samples may be delivered, on threads of its own. Called again with entries whose
  // ports could be opened only later. What it refers to outlives stop().
  virtual void start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) = 0;
  // When it returns, deliver() is not called any more. Also called where start() was not.
  virtual void stop() noexcept = 0;

  // Every tend_period(), and at Bell::ring(): to look after what is out there, to count peers.
  // Throws NeedsNewProcess.
  virtual void tend() {}
  // Nothing can be sent yet, since what takes long to join is being joined.
  [[nodiscard]] virtual bool is_joining() const { return false; }
  // A middleware that rings for what happens need not be asked often.
  [[nodiscard]] virtual shm::Nanoseconds tend_period() const { return 100'000'000; }
};

}  // namespace arbiter::gateway
