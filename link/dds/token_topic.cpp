#include "link/dds/token_topic.hpp"

#include <dds/ddsi/ddsi_sertype.h>

#include <array>
#include <utility>

#include "gateway/dds/arrived_sample.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/event_topic.hpp"

namespace arbiter::link {
namespace {

// As long as it is now; later versions may say more.
constexpr std::size_t kTokenMessageBytes = 21;

}  // namespace

TokenTopic::TokenTopic(const Network& network, Heard heard)
    : heard_(std::move(heard)), cache_(*this) {
  ddsi_sertype* type = gateway::dds::make_opaque_type("arbiter::Token", false);
  const dds_entity_t topic = dds_create_topic_sertype(network.participant(), kTokenTopic, &type,
                                                      nullptr, nullptr, nullptr);
  if (topic < 0) ddsi_sertype_unref(type);
  topic_ = Entity(topic, std::string("topic ") + kTokenTopic);
  type_ = type;
  const gateway::dds::CycloneQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_BEST_EFFORT, 0);
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 1);
  dds_qset_ignorelocal(qos.get(), DDS_IGNORELOCAL_PARTICIPANT);
  writer_ = Entity(dds_create_writer(network.participant(), topic, qos.get(), nullptr),
                   "a writer of tokens");
  reader_ = Entity(
      dds_create_reader_rhc(network.participant(), topic, qos.get(), nullptr, cache_.cache()),
      "a reader of tokens");
}

// The reader first: nothing is heard from then on.
TokenTopic::~TokenTopic() { reader_ = Entity(); }

void TokenTopic::send(const TokenMessage& message) noexcept {
  const ByteString bytes = write_token_message(message);
  gateway::dds::Payload* const payload =
      gateway::dds::make_payload(type_, {encapsulation(), Bytes(bytes.data(), bytes.size())});
  // One that is not sent is one that is lost.
  if (payload != nullptr) static_cast<void>(dds_writecdr(writer_.get(), &payload->cyclone));
}

void TokenTopic::take(const gateway::dds::Payload& payload,
                      const gateway::dds::SampleWriter& writer) noexcept {
  const std::size_t before = encapsulation().size();
  std::array<std::byte, kTokenMessageBytes> bytes{};
  if (payload.size < before + bytes.size()) return;
  const gateway::dds::ArrivedSample sample(payload);
  if (!sample.copy(before, WritableBytes(bytes.data(), bytes.size()))) return;
  if (const auto message = read_token_message(Bytes(bytes.data(), bytes.size())))
    heard_(*message, writer.handle);
}

}  // namespace arbiter::link
