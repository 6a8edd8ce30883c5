#include "link/dds/message_topic.hpp"

#include <dds/ddsi/ddsi_sertype.h>

#include <algorithm>
#include <new>
#include <utility>

#include "gateway/dds/arrived_sample.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "link/dds/event_topic.hpp"

namespace arbiter::link {
namespace {

// Of messages that are not through: what a reader that does not answer may have us keep.
constexpr std::int32_t kMostUnheard = 12;
// Until what was sent before is through, where it is much.
constexpr dds_duration_t kMessageWait = DDS_MSECS(200);

gateway::dds::CycloneQos qos_of(Delivery delivery) {
  gateway::dds::CycloneQos qos(dds_create_qos());
  dds_qset_reliability(
      qos.get(),
      delivery == Delivery::kPulse ? DDS_RELIABILITY_BEST_EFFORT : DDS_RELIABILITY_RELIABLE,
      delivery == Delivery::kMessage ? kMessageWait : 0);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST,
                   delivery == Delivery::kMessage ? kMostUnheard : 1);
  if (delivery == Delivery::kState) {
    dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_durability_service(qos.get(), 0, DDS_HISTORY_KEEP_LAST, 1, DDS_LENGTH_UNLIMITED,
                                DDS_LENGTH_UNLIMITED, DDS_LENGTH_UNLIMITED);
  }
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  return qos;
}

}  // namespace

MessageTopic::MessageTopic(const Network& network, const char* name, Delivery delivery,
                           std::size_t most, Heard heard, const gateway::Bell& bell)
    : most_(most), heard_(std::move(heard)), cache_(*this) {
  ddsi_sertype* type = gateway::dds::make_opaque_type("arbiter::Message", false);
  const dds_entity_t topic =
      dds_create_topic_sertype(network.participant(), name, &type, nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(type);
  topic_ = Entity(topic, std::string("topic ") + name);
  type_ = type;
  const gateway::dds::Listener listener(dds_create_listener(const_cast<gateway::Bell*>(&bell)));
  dds_lset_subscription_matched(
      listener.get(),
      [](dds_entity_t /*reader*/, const dds_subscription_matched_status_t /*status*/, void* rings) {
        static_cast<const gateway::Bell*>(rings)->ring();
      });
  const gateway::dds::CycloneQos qos = qos_of(delivery);
  reader_ = Entity(dds_create_reader_rhc(network.participant(), topic, qos.get(), listener.get(),
                                         cache_.cache()),
                   std::string("a reader of ") + name);
  writer_ = Entity(dds_create_writer(network.participant(), topic, qos.get(), nullptr),
                   std::string("a writer of ") + name);
}

// The reader first: nothing is heard from then on.
MessageTopic::~MessageTopic() { reader_ = Entity(); }

bool MessageTopic::send(const ByteString& message) noexcept {
  gateway::dds::Payload* const payload =
      gateway::dds::make_payload(type_, {encapsulation(), Bytes(message.data(), message.size())});
  return payload != nullptr && dds_writecdr(writer_.get(), &payload->cyclone) == DDS_RETCODE_OK;
}

// A part of them would not do: hosts outside of it would be taken for gone. A number costs next to
// nothing beside what Cyclone keeps of the writer.
std::vector<std::uint64_t> MessageTopic::writers() const { return writers_of(reader_.get()); }

void MessageTopic::take(const gateway::dds::Payload& payload,
                        const gateway::dds::SampleWriter& writer) noexcept {
  const std::size_t before = encapsulation().size();
  // RTPS counts in fours.
  if (payload.size < before || payload.size - before > most_ + 3) return;
  try {
    message_.resize(payload.size - before);
    const gateway::dds::ArrivedSample sample(payload);
    if (!sample.copy(before, WritableBytes(message_.data(), message_.size()))) return;
    heard_(Bytes(message_.data(), message_.size()), writer);
  } catch (const std::bad_alloc&) {
    // As if it had been lost.
  }
}

}  // namespace arbiter::link
