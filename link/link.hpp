// A link: sends to other hosts what they want from this one, and imports what the model here wants
// from them. No host is special, and none asks another before it decides (docs/hosts.md).
//
// Thread safety: all of it runs on the thread that calls run(), but for what its parts say.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include <arbiter/node.hpp>

#include "gateway/core/bridge.hpp"
#include "link/core/held_tokens.hpp"
#include "link/core/patience.hpp"
#include "link/core/sent_tokens.hpp"
#include "link/dds/network.hpp"
#include "link/dds/token_topic.hpp"
#include "link/exports.hpp"
#include "link/host_view.hpp"
#include "link/import.hpp"
#include "link/token_clock.hpp"

namespace arbiter::link {

struct LinkOptions {
  std::string host;      // its name for the others
  std::string instance;  // as NodeOptions has it
  NetworkOptions network;
  // Called by the loop ten times a second, and between calls that wait for the daemon, so that
  // somebody can see that it goes round.
  std::function<void()> on_round = [] {};
};

class Link {
 public:
  explicit Link(LinkOptions options);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link() = default;

  // Returns when `stop` is readable. Waits for the daemon and for the network, and says so.
  void run(int stop);

 private:
  void make_node(int stop);
  void join_network(int stop);
  void loop(int stop);
  void choose_imports(const Patience& patience);
  void say_once(std::string& said, const std::string& text);
  // Sleeps, or until the bell rings; true: `stop` is readable.
  [[nodiscard]] bool waits(int stop, int milliseconds) const;

  const LinkOptions options_;
  const Incarnation incarnation_;
  const gateway::Bell bell_;
  HostView view_;
  SentTokens sent_;
  HeldTokens held_;
  std::string said_;
  std::string said_of_view_;
  bool stops_ = false;

  // Destroyed in reverse: callers go before what they call.
  std::optional<Node> node_;
  std::optional<Network> network_;
  std::optional<TokenTopic> tokens_;
  std::optional<Exports> exports_;
  std::map<std::string, std::unique_ptr<Import>, std::less<>> imports_;
  std::optional<TokenClock> clock_;
};

}  // namespace arbiter::link
