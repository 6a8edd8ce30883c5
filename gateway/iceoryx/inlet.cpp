#include "gateway/iceoryx/inlet.hpp"

#include <chrono>
#include <string>
#include <utility>

#include "gateway/iceoryx/publisher.hpp"
#include "shm/clock.hpp"

namespace arbiter::gateway {
namespace {

iox::popo::SubscriberOptions options_of(const IceoryxTopic& topic) {
  iox::popo::SubscriberOptions options;
  options.queueCapacity = topic.queue;
  options.historyRequest = 0;  // nothing old
  return options;
}

}  // namespace

iox::capro::ServiceDescription service_of(const IceoryxTopic& topic) {
  const auto id = [](const std::string& text) {
    return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, text);
  };
  return {id(topic.service), id(topic.instance), id(topic.event)};
}

Inlet::Inlet(const Middleware::OpenIn& open)
    : in_(open),
      topic_(*open.incoming.entry().iceoryx),
      subscriber_(service_of(topic_), options_of(topic_)),
      freshness_(topic_.queue) {}

void Inlet::take_all() {
  for (std::uint32_t i = 0; i <= topic_.queue; ++i) {
    const shm::Nanoseconds before = shm::monotonic_now();
    last_fault_of_iceoryx.clear();
    const auto taken = subscriber_.takeChunk();
    if (taken.has_error() && last_fault_of_iceoryx.empty()) {
      freshness_.note_empty(before);
      break;
    }
    freshness_.note_taken(before);
    if (taken.has_error()) {  // it has dropped one, and more may wait behind it
      in_.incoming.fail();
      tell(Fault::kVersion);
      continue;
    }
    const Chunk chunk(*taken.value(), topic_);
    const Fault fault = fault_of(chunk);
    if (fault != Fault::kNone)
      tell(fault, fault == Fault::kHeader ? chunk.header_size() : chunk.size());
    subscriber_.release_chunk(*taken.value());
  }
  if (subscriber_.hasMissedData()) {
    in_.account.overflows.add();
    if (!std::exchange(has_overflown_, true)) {
      in_.account.set_last_reason("its queue has lost samples; write a larger queue=");
    }
  }
}

Inlet::Fault Inlet::fault_of(const Chunk& chunk) {
  const bool is_whole = chunk.is_whole();
  if (!chunk.has_right_header() || !is_whole) {
    in_.incoming.fail();
    return is_whole ? Fault::kHeader : Fault::kOutside;
  }
  const Time deadline{std::chrono::nanoseconds(freshness_.deadline(max_age()))};
  const auto fate = in_.incoming.deliver(chunk, deadline);
  return fate == Incoming::Fate::kTooLarge ? Fault::kTooLarge : Fault::kNone;
}

void Inlet::tell(Fault fault, std::size_t size) {
  if (fault == told_fault_ && size == told_size_) return;
  told_fault_ = fault;
  told_size_ = size;
  in_.account.set_last_reason(sentence(fault, size));
}

std::string Inlet::sentence(Fault fault, std::size_t size) const {
  switch (fault) {
    case Fault::kNone:
      return "";
    case Fault::kVersion:
      return "the header of the last bad chunk has another version than that of iceoryx 2.0";
    case Fault::kOutside:
      return "the header of the last bad chunk does not lead to a payload in its memory segment";
    case Fault::kHeader:
      return "chunks have a user header of " + std::to_string(size) +
             " bytes; write user_header=\"" + std::to_string(size) +
             "\", also where <out> sends them on";
    case Fault::kTooLarge:
      break;
  }
  return does_not_fit(in_.incoming.entry(), size);
}

void Inlet::count_publishers(const PortList& list) const {
  in_.account.set_peers(static_cast<std::uint32_t>(list.publishers_of(topic_).size()));
}

}  // namespace arbiter::gateway
