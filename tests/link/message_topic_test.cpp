// Who writes on a topic of links: link/dds/message_topic.hpp. What is too large to be written.
#include "link/dds/message_topic.hpp"

#include <dds/ddsi/ddsi_sertype.h>
#include <gtest/gtest.h>

#include <vector>

#include "gateway/dds/opaque_type.hpp"
#include "link/core/event_header.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/event_topic.hpp"
#include "tests/link/scene.hpp"

namespace arbiter::test {
namespace {

// A program on the network that makes many writers on the topic of hosts, and says nothing.
class ManyWriters {
 public:
  ManyWriters(unsigned domain, std::size_t count)
      : participant_(dds_create_participant(domain, nullptr, nullptr), "a participant") {
    const gateway::dds::CycloneQos qos(dds_create_qos());
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
    ddsi_sertype* type = gateway::dds::make_opaque_type("arbiter::Message", false);
    const dds_entity_t topic = dds_create_topic_sertype(participant_.get(), link::kHostTopic, &type,
                                                        nullptr, nullptr, nullptr);
    for (std::size_t i = 0; i < count; ++i) {
      EXPECT_GT(dds_create_writer(participant_.get(), topic, qos.get(), nullptr), 0);
    }
  }

 private:
  const link::Entity participant_;  // and all that it has
};

// A host whose writer is left out is taken for gone.
TEST(MessageTopic, NamesAllWritersHoweverMany) {
  constexpr std::size_t kMany = 300;
  const OwnDomain domain;
  const link::Network network({domain.number(), {}, {}});
  const gateway::Bell bell;
  const link::MessageTopic cards(
      network, link::kHostTopic, link::Delivery::kState, 100,
      [](Bytes, const gateway::dds::SampleWriter&) {}, bell);
  const ManyWriters many(domain.number(), kMany);
  await([&] { return cards.writers().size() == kMany; });
}

// In either direction: what is larger is not put together, however much of it comes.
TEST(NetworkOfLinks, CarriesTheLargestSampleAndNothingMuchLarger) {
  const OwnDomain domain;
  const link::Network network({domain.number(), {}, {}});
  const gateway::Bell bell;
  link::OfferCard card;
  card.incarnation = 1;
  card.host = "head";
  card.source = "/Camera/image:o";
  link::EventWriter writer(network, card, bell);
  const link::ByteString header(link::kMaxHeaderBytes);
  const std::vector<std::byte> sample(link::kMaxSampleBytes + 4096);
  const auto writes = [&](std::size_t size) {
    return writer.write(Bytes(header.data(), header.size()), Bytes(sample.data(), size));
  };
  EXPECT_TRUE(writes(link::kMaxSampleBytes));
  EXPECT_FALSE(writes(sample.size()));
}

}  // namespace
}  // namespace arbiter::test
