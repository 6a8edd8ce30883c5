// The live ports, as the daemon knows them: whose, where their segments are, who they are linked
// with.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "service/client.hpp"
#include "service/directory.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "shm/segment.hpp"

namespace arbiter::service {

// Links that a component had when it was lost to a daemon, or its peer was: the peer, and the
// link's number (0: not connected). They stand, in shared memory, until both ends are here again.
using Claims = std::map<shm::PortInstance, std::uint64_t>;

// Descriptors that the daemon keeps of a port.
inline constexpr std::uint64_t kDescriptorsOfOutput = 1;
inline constexpr std::uint64_t kDescriptorsOfInput = 3;

struct OutputPort {
  shm::PortInstance instance = 0;
  Client* client = nullptr;
  Source* source = nullptr;
  shm::TypeInfo type;
  shm::FileDescriptor segment;  // read-only
  shm::Mapping mapping;
  shm::OutputLayout layout;
  Claims claims;
  Charge charge;

  [[nodiscard]] const shm::OutputHeader& header() const {
    return *mapping.as<const shm::OutputHeader>();
  }
};

struct InputPort {
  shm::PortInstance instance = 0;
  Client* client = nullptr;
  InputName* name = nullptr;
  shm::TypeInfo type;
  shm::FileDescriptor segment;  // read-only
  shm::FileDescriptor bell;     // its write end
  // The same, opened anew, to be handed out: who gets it could make its writes block.
  shm::FileDescriptor bell_for_peers;
  shm::Mapping mapping;
  Claims claims;
  Charge charge;

  [[nodiscard]] const shm::InputSegment& shared() const {
    return *mapping.as<const shm::InputSegment>();
  }
};

// Check what a client has handed over for a port: its segment and, for an input port, its bell.
// Throw std::runtime_error saying what is wrong with it.
std::unique_ptr<OutputPort> adopt_output(const shm::Received& open);
std::unique_ptr<InputPort> adopt_input(const shm::Received& open);

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
};

}  // namespace arbiter::service
