// Who taps which live port, and telling both of each other.
//
// A tap is no port: it has no name of its own, no page, and no place in the registry, and a daemon
// that takes over is asked for it again. It watches the sources that it wants: the output port of
// its name, or all that the model in force connects to the input port of its name. For each the
// component that has the output port open is asked, and the tap is told what that answers.
//
// Thread safety: none, it is the loop's.
#pragma once

#include <sys/types.h>

#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "service/clients/client.hpp"
#include "service/kept/registry.hpp"
#include "service/policy/shares.hpp"
#include "service/ports/port_names.hpp"
#include "service/ports/ports.hpp"
#include "shm/decision_table.hpp"
#include "shm/file_descriptor.hpp"

namespace arbiter::service {

struct Tap {
  shm::PortInstance instance = 0;
  Client* client = nullptr;
  std::string name;            // of the port that is tapped
  bool is_input = false;       // it is an input port
  uid_t user = 0;              // whose the segment is
  bool is_privileged = false;  // root, or the daemon's own user
  bool is_back = false;        // another daemon has opened it
  shm::FileDescriptor segment;
  std::shared_ptr<const PortBell> bell;
  Charge charge;

  ~Tap();
};

// Descriptors that the daemon keeps of a tap.
inline constexpr std::uint64_t kDescriptorsOfTap = 2;

// Takes what a client has handed over. Throws std::runtime_error saying what is wrong with it.
std::unique_ptr<Tap> adopt_tap(const wire::Received& open, uid_t user);

class Taps {
 public:
  using Outputs = std::map<shm::PortInstance, std::unique_ptr<OutputPort>>;
  using Inputs = std::map<shm::PortInstance, std::unique_ptr<InputPort>>;

  Taps(PortNames& names, Registry& registry) : names_(names), registry_(registry) {}

  Tap& add(std::unique_ptr<Tap> tap, Client& client);
  [[nodiscard]] bool is_of(const Client& client, shm::PortInstance tap) const;
  // It closes: publishers are told that it has gone.
  void remove(shm::PortInstance tap, const Outputs& outputs, const Inputs& inputs);
  // The same of all that a client has. If its process lives, it may still be reading samples:
  // publishers are told to look after that.
  void lose(const Client& client, bool lives, const Outputs& outputs, const Inputs& inputs);

  // Asks the components of the output ports that are to be tapped under a table, and have not been
  // asked yet: of all output ports, or of one. Calls `told(client)` for each that is asked.
  template <class Told>
  void link(const shm::TableView& table, const Outputs& outputs, Told told) {
    for (const auto& [instance, output] : outputs) link(table, *output, told);
  }
  template <class Told>
  void link(const shm::TableView& table, const OutputPort& output, Told told) {
    if (taps_.empty() || output.client->is_returning) return;
    for (const auto& [instance, tap] : taps_) {
      if (wants(*tap, output, table) && ask(*tap, output)) told(output.client);
    }
  }
  // A tap that another daemon has opened knows sources of whom this one may not have heard: it is
  // told of those that nobody has open, and will be of those that are away.
  void tell_ends(const Tap& tap, const shm::TableView& table);
  // Taps of an input port give up what a table does not connect to it any more.
  void unlink(const shm::TableView& table, const Outputs& outputs);
  // A component answers. False: it was not asked, or the tap has closed meanwhile.
  bool tell(const OutputPort& output, const wire::Received& answer);
  void refuse(const OutputPort& output, shm::PortInstance tap, const std::string& why);
  // Its component is lost for a while: when it is back it is asked again.
  void set_away(shm::PortInstance output);
  // It has closed, or died.
  void end(shm::PortInstance output);
  // The same of input ports: taps of that name read what the port counts, which then counts more.
  void show(const Tap& tap, const InputPort& input) const;
  void show(const InputPort& input) const;
  void end(shm::PortInstance input, const std::string& name) const;

  // Those that an output port's component has taken in.
  [[nodiscard]] std::vector<const Tap*> of(shm::PortInstance output) const;

 private:
  static void measure(const InputPort& input, bool is_tapped);
  // A tap and an output port whose component has been asked.
  struct Link {
    bool is_asked = false;  // and has not answered; it answers once
    bool is_told = false;   // the tap has been told what it answered
    bool is_away = false;
  };
  using LinkKey = std::pair<shm::PortInstance, shm::PortInstance>;  // output, tap

  void tell_end(const Tap& tap, const Source& source);
  [[nodiscard]] bool wants(const Tap& tap, const OutputPort& output,
                           const shm::TableView& table) const;
  bool ask(const Tap& tap, const OutputPort& output);

  PortNames& names_;
  Registry& registry_;
  std::map<shm::PortInstance, std::unique_ptr<Tap>> taps_;
  std::map<LinkKey, Link> links_;
};

}  // namespace arbiter::service
