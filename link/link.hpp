// A link: sends to other hosts what they want from this one, and imports what the model here wants
// from them. No host is special, and none asks another before it decides (docs/hosts.md).
//
// It is made again where the network has to be joined again: of what it knew of other hosts nothing
// holds then but that they were there, and for them it is a link that has been started again.
//
// Thread safety: all of it runs on the thread that calls run(), but for hear() and what its parts
// say. That thread alone changes imports_, under imports_mutex_; others look there under it.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <arbiter/node.hpp>

#include "gateway/core/bridge.hpp"
#include "gateway/dds/peer_watch.hpp"
#include "link/core/held_tokens.hpp"
#include "link/core/neighbours.hpp"
#include "link/core/patience.hpp"
#include "link/core/sent_tokens.hpp"
#include "link/core/stream.hpp"
#include "link/dds/demands.hpp"
#include "link/dds/network.hpp"
#include "link/dds/token_topic.hpp"
#include "link/desk.hpp"
#include "link/exports.hpp"
#include "link/host_view.hpp"
#include "link/import.hpp"
#include "link/interface_watch.hpp"
#include "link/token_clock.hpp"

namespace arbiter::link {

struct LinkOptions {
  std::string host;      // its name for the others
  std::string instance;  // as NodeOptions has it
  std::string version;
  NetworkOptions network;
  // How old a sample may be when it arrives, where its T is `forever` or longer; nothing: as the
  // model says.
  std::optional<shm::Nanoseconds> max_age;
  // Called by the loop ten times a second, and between calls that wait for the daemon, so that
  // somebody can see that it goes round; on another thread while the loop joins or leaves the
  // network.
  std::function<void()> on_round = [] {};
};

class Link {
 public:
  // `peers`: those of `options`; outlives it. `known`: the hosts that it knew in an earlier life.
  Link(LinkOptions options, gateway::dds::PeerWatch& peers, Neighbours known);
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  ~Link();

  // Returns when `stop` is readable; or when the network has to be joined again, and says so. Waits
  // for the daemon and for the network, and says that, too.
  enum class End : std::uint8_t { kStopped, kNetworkChanged };
  [[nodiscard]] End run(int stop);

  // After run(): what still answers programs that have asked, closed. To destroy it may take some
  // seconds; it needs nothing of the link.
  [[nodiscard]] std::unique_ptr<Desk> take_desk();

 private:
  void make_node(int stop);
  void join_network(int stop);
  // One of several interfaces that is not there does not keep it from the others.
  [[nodiscard]] NetworkOptions network_there() const;
  // Throws DdsError; then leave_network() follows.
  void enter_network();
  void leave_network();
  // Of what Cyclone may need some seconds for.
  template <class Step>
  void while_seen(const Step& step) const;
  End loop(int stop);
  // True, and said: the network has to be joined again.
  [[nodiscard]] bool has_network_changed();
  // What has become of names of hosts that are missing; empty: nothing.
  [[nodiscard]] std::string change_of_peers() const;
  // Once, when it is known.
  void say_what_passes();
  // Where the daemon does not know what this link has open: closes it. A node that has nothing open
  // is let in, and what is wanted is opened again.
  void leave_lost_ports();
  void set_max_ages();
  void choose_imports(const Patience& patience);
  using Imports = std::map<std::string, std::unique_ptr<Import>, std::less<>>;
  void end(Imports gone);
  void remember(const std::string& source, const Stream& stream);
  void add_import(const std::string& source);
  // On the node's thread, which waits for nothing: a component that wants its name does not wait
  // for what the loop is doing.
  void hear(const Notice& notice);
  // Tells the desk how this host stands. `obstacle`: what the link waits for; empty: nothing.
  void tell_desk(const std::string& obstacle);
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
  shm::Nanoseconds tell_again_ = 0;
  shm::Nanoseconds left_ = 0;  // the ports of a daemon whose state is lost
  bool has_said_what_passes_ = false;
  bool stops_ = false;
  InterfaceWatch interfaces_;
  gateway::dds::PeerWatch& peers_;
  // Of sources that were imported and are not wanted now: the model may want them again.
  std::map<std::string, Stream, std::less<>> streams_;
  std::mutex imports_mutex_;
  // Empty before what they use goes; the node's thread may look there until the node has gone.
  Imports imports_;

  // Destroyed in reverse: callers go before what they call.
  std::optional<Node> node_;
  std::optional<Network> network_;
  std::optional<TokenTopic> tokens_;
  std::optional<Exports> exports_;
  std::optional<DemandTeller> demands_;
  std::optional<TokenClock> clock_;
  std::unique_ptr<Desk> desk_;  // null: it has been taken
};

}  // namespace arbiter::link
