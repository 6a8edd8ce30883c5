// The live ports, as the daemon knows them: whose, where their segments are, who they are linked
// with.
#pragma once

#include <sys/types.h>

#include <map>
#include <memory>
#include <string>
#include <utility>

#include "service/clients/client.hpp"
#include "service/ports/port_bell.hpp"
#include "service/ports/port_names.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

// Links that a component had when it was lost to a daemon, or its peer was: the peer, and the
// link's number (0: not connected). They stand, in shared memory, until both ends are here again.
struct Claim {
  std::uint64_t number = 0;
  Charge charge{};  // of the user whose component says so
};
using Claims = std::map<shm::PortInstance, Claim>;

// Descriptors that the daemon keeps of a port.
inline constexpr std::uint64_t kDescriptorsOfOutput = 1;
inline constexpr std::uint64_t kDescriptorsOfInput = 2;

// Of a port, by its component.
struct Description {
  std::string text;  // printable
  bool is_trouble = false;
};

struct OutputPort {
  shm::PortInstance instance = 0;
  Client* client = nullptr;
  Source* source = nullptr;
  shm::TypeInfo type;
  uid_t user = 0;  // whose the segment is
  shm::FileDescriptor segment;
  shm::Mapping mapping;  // of its beginning: the header and the channels
  shm::OutputLayout layout;
  Claims claims;
  bool is_told_unmentioned = false;  // that the model in force does not mention it
  bool is_known_blind = false;       // the log has it
  Description described;             // by its component
  bool yields = false;               // to another component that asks for its name
  bool is_asked_to_yield = false;    // one has asked
  bool has_returned = false;         // and has not been connected (link_one()) since
  Charge charge;

  ~OutputPort();
  [[nodiscard]] const shm::OutputHeader& header() const {
    return *mapping.as<const shm::OutputHeader>();
  }
};

struct InputPort {
  shm::PortInstance instance = 0;
  Client* client = nullptr;
  InputName* name = nullptr;
  shm::TypeInfo type;
  uid_t user = 0;  // whose the segment is
  shm::FileDescriptor segment;
  std::shared_ptr<const PortBell> bell;
  shm::Mapping mapping;
  Claims claims;
  bool is_told_unmentioned = false;
  bool is_known_blind = false;
  Description described;
  bool has_returned = false;
  Charge charge;

  ~InputPort();

  [[nodiscard]] const shm::InputSegment& shared() const {
    return *mapping.as<const shm::InputSegment>();
  }
};

// Take what a client has handed over for a port: its segment and, for an input port, its bell. They
// are passed on to peers as they came: nothing is opened for anybody with the daemon's rights.
// Throw std::runtime_error saying what is wrong with it, such as that another user has made it.
std::unique_ptr<OutputPort> adopt_output(const wire::Received& open, uid_t user);
std::unique_ptr<InputPort> adopt_input(const wire::Received& open, uid_t user);

// How an output port and an input port stand to each other.
enum class LinkKind {
  kSensing,    // the input port's rules read the source, or its selection depends on it
  kConnected,  // there is a connection
  kLapsed,     // neither any more; the publisher still heeds what the input port holds
};

struct Link {
  LinkKind kind = LinkKind::kSensing;
  std::uint64_t number = 0;  // if connected: by it both ends know their queue; never given twice
  std::string mismatch;  // why they are not connected although there is a connection; else empty

  // Both ends have been told of each other; else the publisher alone knows the input port.
  [[nodiscard]] bool is_mutual() const { return number != 0; }
  // Both ends have been told that they are not.
  [[nodiscard]] bool is_refused() const {
    return kind == LinkKind::kConnected && !mismatch.empty();
  }
};

// What `port` is to know of `peer`.
wire::Message message_to(wire::MessageKind kind, shm::PortInstance port, shm::PortInstance peer,
                         std::uint32_t id = 0);

}  // namespace arbiter::service
