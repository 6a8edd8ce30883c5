// An honest component, and all that a client legitimately gets hold of who connects to it: the
// descriptors to attack.
#pragma once

#include <string>
#include <utility>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "shm/clock.hpp"
#include "shm/input_segment.hpp"
#include "shm/output_segment.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {

class Prey {
 public:
  // Output segments, input segments and bells come with introductions; board and pages from the
  // daemon itself.
  shm::FileDescriptor board;
  shm::FileDescriptor registry;  // what a daemon that takes over finds
  shm::FileDescriptor page;      // of the prey's source
  shm::FileDescriptor output;
  shm::FileDescriptor input;
  shm::FileDescriptor bell;

  // The attacker's own memory.
  shm::OutputSegment attackers_output;
  shm::InputSegment* attackers_input = nullptr;
  std::uint64_t link_to_prey = 0;
  shm::PortInstance preys_output = 0;

  // The attacker's source says that it is active.
  void activate_attacker() const {
    activate_attacker_until(shm::arrival(shm::monotonic_now(), shm::kForever));
  }
  void activate_attacker_until(shm::ActivityWord word) const {
    const shm::Mapping mapped(own_page_, sizeof(shm::ActivityPage), shm::Access::kReadWrite);
    mapped.as<shm::ActivityPage>()->of(own_source_).word = word;
  }

  // Its first sample, with a time of arrival of its own making.
  void publish_as_attacker(std::int64_t stamp) const {
    shm::SlotHeader& header = attackers_output.slot_header(0);
    header.sequence = 1;
    header.stamp = stamp;
    header.size = sizeof(int);
    shm::Channel& channel = attackers_output.channel(0);
    channel.first = 1;
    channel.depth = 1;
    attackers_output.ring(0, link_to_prey)[0] = shm::make_entry(1, 0);
    channel.accepted = 1;
    channel.receiver = link_to_prey;
    attackers_output.header().joins = 1;
  }

  void remove_attacker() { attacker_.hang_up(); }

  Prey()
      : daemon_(
            "<behaviors>"
            "<arbiter at='/prey:i'><select from='/attacker:o'>not /prey:o</select></arbiter>"
            "<arbiter at='/attacker:i'><select from='/prey:o'/></arbiter>"
            "</behaviors>"),
        node_("prey"),
        out_(node_.output_port<int>("/prey:o")),
        in_(node_.input_port<int>("/prey:i")),
        attacker_(daemon_.instance()) {
    auto hello = RawClient::message(wire::MessageKind::kHello, "attacker");
    hello.value = wire::kWireVersion;
    attacker_.send(hello);
    wire::Received welcome = attacker_.expect(wire::MessageKind::kWelcome);
    board = std::move(welcome.descriptors[0]);
    registry = std::move(welcome.descriptors[1]);
    open_ports();
    hear_all(node_);
  }

  Daemon& daemon() { return daemon_; }
  OutputPort<int>& out() { return out_; }
  InputPort<int>& in() { return in_; }

 private:
  void open_ports() {
    // Segments that are well made; no attack yet.
    const auto type = in_type();
    const auto layout = shm::OutputLayout::plan(type, 8);
    own_output_ = shm::make_segment("attacker-output", layout.total_size);
    allocate(own_output_, layout.total_size);
    own_output_mapping_ = shm::Mapping(own_output_, layout.total_size, shm::Access::kReadWrite);
    attackers_output = shm::OutputSegment(own_output_mapping_.data(), layout);
    auto& header = attackers_output.header();
    header.magic = shm::OutputHeader::kMagic;
    header.version = shm::OutputHeader::kVersion;
    header.slot_count = layout.slot_count;
    header.type = type;
    shm::seal(own_output_, shm::Seals::kOneWriter);
    auto open = RawClient::message(wire::MessageKind::kOpenOutput, "/attacker:o");
    open.type = type;
    attacker_.send(open, {own_output_.get(), -1});
    collect();

    own_input_ = shm::make_segment("attacker-input", sizeof(shm::InputSegment));
    allocate(own_input_, sizeof(shm::InputSegment));
    own_input_mapping_ =
        shm::Mapping(own_input_, sizeof(shm::InputSegment), shm::Access::kReadWrite);
    attackers_input = own_input_mapping_.as<shm::InputSegment>();
    auto& input_header = attackers_input->header;
    input_header.magic = shm::InputHeader::kMagic;
    input_header.version = shm::InputHeader::kVersion;
    input_header.depth = 1;
    input_header.max_held = 1;
    input_header.refuse_new = 1;
    input_header.newest_link.store(UINT64_MAX, std::memory_order_relaxed);
    input_header.type = type;
    shm::seal(own_input_, shm::Seals::kOneWriter);
    auto open_input = RawClient::message(wire::MessageKind::kOpenInput, "/attacker:i");
    open_input.type = type;
    attacker_.send(open_input, {own_input_.get(), own_bell_.write_end().get()});
    collect();
    if (!page || !output || !input || !bell) throw std::runtime_error("not all has come");
  }

  static void allocate(const shm::FileDescriptor& segment, std::size_t size) {
    if (shm::allocate(segment, 0, size)) throw std::runtime_error("no memory");
  }

  static shm::TypeInfo in_type() {
    shm::TypeInfo type;
    type.set_name("int");
    type.size = sizeof(int);
    type.alignment = alignof(int);
    return type;
  }

  void collect() {
    wire::Received received;
    while (attacker_.receive(received)) {
      switch (received.message.kind) {
        case wire::MessageKind::kSourcePage:
          if (received.message.name_view() == "/prey:o") page = std::move(received.descriptors[0]);
          break;
        case wire::MessageKind::kOpened:
          if (!received.descriptors[0]) break;
          own_page_ = std::move(received.descriptors[0]);
          own_source_ = received.message.id;
          break;
        case wire::MessageKind::kOutputPeer:
          preys_output = received.message.peer;
          output = std::move(received.descriptors[0]);
          break;
        case wire::MessageKind::kInputPeer:
          link_to_prey = received.message.link;
          input = std::move(received.descriptors[0]);
          bell = std::move(received.descriptors[1]);
          break;
        case wire::MessageKind::kRefused:
          throw std::runtime_error(std::string(received.message.text_view()));
        case wire::MessageKind::kConnected:
          return;
        default:
          break;
      }
    }
  }

  Daemon daemon_;
  Node node_;
  OutputPort<int> out_;
  InputPort<int> in_;
  RawClient attacker_;
  shm::FileDescriptor own_output_;
  shm::Mapping own_output_mapping_;
  shm::Mapping own_input_mapping_;
  shm::FileDescriptor own_page_;
  shm::SourceId own_source_ = shm::kNone;
  shm::FileDescriptor own_input_;
  shm::Bell own_bell_;
};

}  // namespace arbiter::test
