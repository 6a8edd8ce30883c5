// A component below the client library that has an output port open, and tells its taps what it
// likes.
#pragma once

#include <fcntl.h>

#include <optional>
#include <string>

#include "shm/clock.hpp"
#include "shm/destination_list.hpp"
#include "shm/event_ring.hpp"
#include "tests/support/raw_port.hpp"
#include "tests/support/written.hpp"

namespace arbiter::test {

class RawPublisher {
 public:
  RawPublisher(const std::string& instance, const std::string& name)
      : client_(instance), output_(raw_output_segment()) {
    events().initialize({});
    shm::seal(events_.descriptor, shm::Seals::kOneWriter);
    writer_.emplace(events());
    client_.hello("raw-publisher");
    const wire::Received opened = open_raw_output(client_, name, output_);
    page_ = shm::Mapping(opened.descriptors[0], sizeof(shm::ActivityPage), shm::Access::kReadWrite);
    source_ = opened.message.id;
    port_ = opened.message.port;
  }

  // Takes the next tap in, once it comes.
  void admit() {
    const wire::Message tap = client_.expect(wire::MessageKind::kTap).message;
    auto answer = RawClient::message(wire::MessageKind::kTapped);
    answer.port = tap.port;
    answer.peer = tap.peer;
    answer.value = taps_;
    answer.link = ++taps_;
    writer_->join(answer.value, answer.link);
    shm::EventRecord state;
    state.joined = answer.link;
    writer_->write(state);
    client_.send(answer, {shm::reopen(events_.descriptor, O_RDONLY).get(), -1});
  }
  // A signal that came at that time, by the list of that revision and a model.
  void signal_at(shm::Nanoseconds time, std::uint64_t revision = 0, std::uint64_t generation = 0) {
    shm::EventRecord record;
    record.kind = shm::EventKind::kSignal;
    record.time = time;
    record.activity = shm::kForeverFlag | time;
    record.revision = revision;
    record.generation = generation;
    record.masks.accepted = 1;
    write(record);
  }
  // It can go on telling.
  void close() { close_raw(client_, port_); }
  void write(const shm::EventRecord& record) { writer_->write(record); }

  [[nodiscard]] shm::EventSegment& events() const { return *events_; }
  [[nodiscard]] shm::Activity& activity() const {
    return page_.as<shm::ActivityPage>()->of(source_);
  }

 private:
  RawClient client_;
  const shm::FileDescriptor output_;
  const Written<shm::EventSegment> events_;
  std::optional<shm::EventWriter> writer_;
  shm::Mapping page_;
  shm::SourceId source_ = 0;
  shm::PortInstance port_ = 0;
  std::uint32_t taps_ = 0;
};

}  // namespace arbiter::test
