// Which live ports are linked, under the model in force, and telling their components so.
//
// Owns the live ports. Every change (a port opens or closes, a model comes into force) ends in
// link(): it works out how things should stand and tells clients the difference, no more.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "service/ports/ports.hpp"
#include "service/ports/taps.hpp"
#include "shm/decision_table.hpp"
#include "shm/table_ring.hpp"

namespace arbiter::service {

class Switchboard {
 public:
  Switchboard(PortNames& names, Registry& registry)
      : names_(names), registry_(registry), taps_(names, registry) {}

  using LinkKey = std::pair<shm::PortInstance, shm::PortInstance>;  // output, input
  using Told = std::set<Client*>;  // clients that have news to take up

  // A new port takes its place. The name must be free. Returns its instance.
  OutputPort& add(std::unique_ptr<OutputPort> port, Client& client, Source& source);
  InputPort& add(std::unique_ptr<InputPort> port, Client& client, InputName& name);
  // A port closes or dies: its peers are told, its name is free.
  void remove(shm::PortInstance port);

  // Taps of live ports: one is opened, its client closes a port or tap, or has gone.
  // `opened` is called when it has its number, and before anybody is told.
  Told add_tap(std::unique_ptr<Tap> tap, Client& client, const shm::TableView& table,
               const std::function<void()>& opened);
  [[nodiscard]] bool has_tap(const Client& client, shm::PortInstance tap) const {
    return taps_.is_of(client, tap);
  }
  [[nodiscard]] std::vector<const Tap*> taps_of(shm::PortInstance output) const {
    return taps_.of(output);
  }
  void remove_tap(shm::PortInstance tap) { taps_.remove(tap, outputs_, inputs_); }
  void lose_taps(const Client& client, bool lives) { taps_.lose(client, lives, outputs_, inputs_); }
  // What the component of an output port has answered to a tap.
  void tell_tap(const wire::Received& answer);

  // The component lives, but its conversation is lost: its links stand, and become claims of its
  // peers; its name is kept for it. What it counts, which goes on.
  [[nodiscard]] Charge set_away(shm::PortInstance port);
  // It comes back, with the instance that it had.
  OutputPort& readmit(std::unique_ptr<OutputPort> port, Client& client, Source& source);
  InputPort& readmit(std::unique_ptr<InputPort> port, Client& client, InputName& name);
  void claim(shm::PortInstance port, shm::PortInstance peer, Claim claim);
  // Makes links of the port's claims and its peers' where they agree. `is_away`: whether a port may
  // still come back.
  void settle_claims(shm::PortInstance port, const std::function<bool(shm::PortInstance)>& is_away);
  // Ports that were away will not come back.
  void forget_away(const KeptPorts& ports);

  // Sends the pages, and makes the links, that a table asks for: all of them, or those of one
  // port. Links that it does not ask for any more stay until unlink(). Of a port that has come back
  // while it was being opened, link_one() tells those, too, with whom it was linked then: nobody
  // has waited for them.
  Told link_all(const shm::TableView& table);
  Told link_one(const shm::TableView& table, shm::PortInstance port);
  Told unlink(const shm::TableView& table);
  // An output port takes up a receiver by using more of its segment. Once it has, receivers must be
  // told, to map it before they need it: the one that is new, at once; the others by and by, once
  // for all that have come meanwhile (show_growth(), for as long as there is some to show).
  // The links that were made since this was asked last: their publishers are taking them up.
  [[nodiscard]] std::vector<LinkKey> take_fresh() { return std::exchange(fresh_, {}); }
  Told show_segments(const std::vector<LinkKey>& fresh);
  void show_growth();
  [[nodiscard]] bool has_growth_to_show() const { return !growth_.empty(); }
  // Shows the source's next page to all components that have been sent the one in force.
  Told show_next_page(const Source& source);
  // Tells an observer what has come after `told`, which moves on: at most `left` pieces, and
  // nothing more once it does not read. True: there is more that it would read.
  bool show_news(Client& client, std::uint64_t& told, int& left);
  // A client could not take up a peer.
  void refuse(shm::PortInstance port, shm::PortInstance peer, std::string why);
  // Tells the components, and the log, once, whose ports the model in force does not mention: of
  // all ports, or of one. `table` of generation 0: there is no model.
  void tell_unmentioned(const shm::TableSnapshot& in_force);
  void tell_unmentioned(const shm::TableSnapshot& in_force, shm::PortInstance port);
  // Tells who taps an output port by the name that is an input port's in the model, or the other
  // way round. One that nobody has named yet may come.
  void tell_wrong_end(const shm::TableSnapshot& in_force, const Tap& tap) const;
  // A component says that its port cannot see all that its rules read: for the log, once.
  void note_blind(shm::PortInstance port, const std::string& text);
  // What its component says of it.
  void describe(shm::PortInstance port, Description description);
  // Asks an output port that yields to go: `who` wants its name. Once for each port.
  void ask_to_yield(shm::PortInstance port, const std::string& who);
  // Wakes every component that waits, to look anew.
  void ring_all() const;
  // Wakes those that a source concerns.
  void ring_concerned(const shm::TableView& table, shm::SourceId source) const;

  [[nodiscard]] const OutputPort* output(shm::PortInstance instance) const;
  [[nodiscard]] const InputPort* input(shm::PortInstance instance) const;
  [[nodiscard]] const std::map<shm::PortInstance, std::unique_ptr<OutputPort>>& outputs() const {
    return outputs_;
  }
  [[nodiscard]] const std::map<shm::PortInstance, std::unique_ptr<InputPort>>& inputs() const {
    return inputs_;
  }
  [[nodiscard]] const std::map<LinkKey, Link>& links() const { return links_; }

 private:
  using Wanted = std::map<LinkKey, LinkKind>;
  void want_links(const OutputPort& output, const shm::TableView& table, Wanted& wanted) const;
  void want_links(const InputPort& input, const shm::TableView& table, Wanted& wanted) const;
  void make_links(const Wanted& wanted, Told& told);
  void send_pages(const OutputPort& output, const shm::TableView& table, Told& told);
  void make_link(const OutputPort& output, const InputPort& input, LinkKind kind, Told& told);
  void send_pages(Client& client, shm::PortId port, const shm::TableView& table, Told& told);
  [[nodiscard]] bool is_connected(const LinkKey& key) const;
  void note_growth(shm::PortInstance output);
  // Whoever claims a link with that port is told that it has gone.
  void end_claims_on(shm::PortInstance port);
  void tell_refusal(const LinkKey& key, shm::PortInstance to, const std::string& why) const;
  template <class Port>
  static void say_unmentioned(Port& port, const std::string& text);
  [[nodiscard]] std::string unmentioned_text(const shm::TableSnapshot& in_force,
                                             const std::string& name, bool is_output) const;
  static bool send_page(Client& client, const Source& source);
  void insert(std::unique_ptr<OutputPort> port, Client& client, Source& source);
  void insert(std::unique_ptr<InputPort> port, Client& client, InputName& name);
  void erase(shm::PortInstance port);
  [[nodiscard]] std::vector<LinkKey> links_of(shm::PortInstance port) const;
  // Made if need be.
  Link& link_at(const LinkKey& key);
  Link take_link(const LinkKey& key);
  void settle(OutputPort& output, InputPort& input);
  std::optional<std::uint64_t> take_claim(shm::PortInstance port, shm::PortInstance peer);
  [[nodiscard]] Claims& claims_of(shm::PortInstance port) const;
  [[nodiscard]] Client& client_of(shm::PortInstance port) const;

  PortNames& names_;
  Registry& registry_;
  std::map<shm::PortInstance, std::unique_ptr<OutputPort>> outputs_;
  std::map<shm::PortInstance, std::unique_ptr<InputPort>> inputs_;
  std::map<LinkKey, Link> links_;
  // The same the other way round: input, output.
  std::set<std::pair<shm::PortInstance, shm::PortInstance>> linked_;
  // Who claims a link with whom, the one that is claimed first: many ports may end at once, and
  // others wait meanwhile.
  std::set<std::pair<shm::PortInstance, shm::PortInstance>> claimed_;
  Taps taps_;
  std::vector<LinkKey> fresh_;  // links whose receivers are to be shown the segment
  std::set<LinkKey> growth_;    // links whose receivers are to be shown that it has grown
};

}  // namespace arbiter::service
