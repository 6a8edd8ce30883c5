// Samples between a writer and a reader of one process: Cyclone hands them over without a network.
#include "gateway/dds/reader_cache.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gateway/dds/arrived_sample.hpp"
#include "gateway/dds/entity.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "tests/gateway/dds/own_domain.hpp"

namespace arbiter::gateway::dds {
namespace {

using ::testing::ElementsAre;

class Collected : public SampleTaker {
 public:
  void take(const Payload& payload, const SampleWriter& /*writer*/) noexcept override {
    const ArrivedSample sample(payload);
    std::string bytes(sample.size(), '?');
    EXPECT_TRUE(
        sample.copy(0, WritableBytes(reinterpret_cast<std::byte*>(bytes.data()), bytes.size())));
    all.push_back(bytes);
  }
  std::vector<std::string> all;
};

struct OpaqueTopic {
  OpaqueTopic(dds_entity_t participant, const std::string& name, bool keyed)
      : type(make_opaque_type("T", keyed)),
        entity(
            dds_create_topic_sertype(participant, name.c_str(), &type, nullptr, nullptr, nullptr),
            "topic") {}
  ddsi_sertype* type;
  Entity entity;
};

class ReaderCacheOf : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Kinds, ReaderCacheOf, ::testing::Values(false, true),
                         [](const auto& each) { return each.param ? "keyed" : "keyless"; });

TEST_P(ReaderCacheOf, ATopicGivesEachSampleWholeAndInOrderBeforeTheWriteReturns) {
  const test::OwnDomain number;
  const Entity domain(dds_create_domain(number.number(), test::kLoopback), "domain");
  const Entity participant(dds_create_participant(number.number(), nullptr, nullptr),
                           "participant");
  const OpaqueTopic topic(participant.get(), "t", GetParam());
  Collected collected;
  ReaderCache cache(collected);
  {
    const Entity reader(dds_create_reader_rhc(participant.get(), topic.entity.get(), nullptr,
                                              nullptr, cache.cache()),
                        "reader");
    const Entity writer(dds_create_writer(participant.get(), topic.entity.get(), nullptr, nullptr),
                        "writer");
    const auto payload_with = [&](const std::string& bytes) {
      return make_payload(topic.type,
                          Bytes(reinterpret_cast<const std::byte*>(bytes.data()), bytes.size()));
    };
    const auto write = [&](const std::string& bytes) {
      Payload* const payload = payload_with(bytes);
      EXPECT_EQ(dds_writecdr(writer.get(), &payload->cyclone), DDS_RETCODE_OK);
    };
    const std::string head("\0\1\0\0", 4);
    write(head + "a");
    write(head);
    write(head + std::string(100'000, 'x'));
    EXPECT_THAT(collected.all, ElementsAre(head + "a", head, head + std::string(100'000, 'x')));
    // Its last word on the instance is a sample all the same.
    Payload* const last = payload_with(head);
    last->cyclone.statusinfo = 1;  // disposed of
    last->cyclone.timestamp.v = dds_time();
    EXPECT_EQ(dds_forwardcdr(writer.get(), &last->cyclone), DDS_RETCODE_OK);
    EXPECT_EQ(collected.all.size(), 4u);
    // That the instance has ended is none: a publisher that goes would have one more arrival.
    Payload* const end = payload_with(head);
    end->cyclone.kind = SDK_KEY;
    end->cyclone.statusinfo = 1;
    end->cyclone.timestamp.v = dds_time();
    EXPECT_EQ(dds_forwardcdr(writer.get(), &end->cyclone), DDS_RETCODE_OK);
    EXPECT_EQ(collected.all.size(), 4u);
  }
  // The reader has gone; another may have the same cache.
  const Entity again(
      dds_create_reader_rhc(participant.get(), topic.entity.get(), nullptr, nullptr, cache.cache()),
      "reader");
}

}  // namespace
}  // namespace arbiter::gateway::dds
