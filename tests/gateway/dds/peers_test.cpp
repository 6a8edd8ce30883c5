// Who is there, where more come than are looked at. All in one process: Cyclone tells a participant
// of another one's ends without a network.
#include "gateway/dds/peers.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <vector>

#include "gateway/dds/opaque_type.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/support/await.hpp"

namespace arbiter::gateway::dds {
namespace {

class Crowds : public ::testing::Test {
 protected:
  // A writer or reader of a stranger's.
  Entity end_of(End end) {
    const dds_entity_t made =
        end == End::kReader ? dds_create_reader(stranger_.get(), topic_.get(), nullptr, nullptr)
                            : dds_create_writer(stranger_.get(), topic_.get(), nullptr, nullptr);
    return {made, "end"};
  }
  std::vector<Entity> ends_of(End end, std::size_t count) {
    std::vector<Entity> ends;
    for (std::size_t i = 0; i < count; ++i) ends.push_back(end_of(end));
    return ends;
  }
  const PeersOfTopic& seen() {
    peers_.update();
    return peers_.of("t");
  }
  bool is_seen(const Entity& end) {
    dds_guid_t guid{};
    EXPECT_EQ(dds_get_guid(end.get(), &guid), DDS_RETCODE_OK);
    Guid key{};
    std::copy(std::begin(guid.v), std::end(guid.v), key.begin());
    return seen().ends.contains(key);
  }

  const test::OwnDomain number_;
  const Entity domain_{dds_create_domain(number_.number(), test::kLoopback), "domain"};
  const Entity own_{dds_create_participant(number_.number(), nullptr, nullptr), "participant"};
  const Bell bell_;
  Peers peers_{own_.get(), {"t"}, bell_};
  const Entity stranger_{dds_create_participant(number_.number(), nullptr, nullptr), "participant"};
  ddsi_sertype* type_ = make_opaque_type("T", false);
  const Entity topic_{
      dds_create_topic_sertype(stranger_.get(), "t", &type_, nullptr, nullptr, nullptr), "topic"};
};

TEST_F(Crowds, WhoFoundNoPlaceIsSeenWhenOthersHaveGone) {
  std::vector<Entity> first = ends_of(End::kWriter, Peers::kMaxOfTopic);
  test::await([&] { return seen().ends.size() == Peers::kMaxOfTopic; });
  EXPECT_FALSE(seen().has_more());
  const Entity late = end_of(End::kWriter);
  test::await([&] { return seen().has_more(); });
  EXPECT_FALSE(is_seen(late));
  const std::uint64_t revision = seen().revision;
  first.resize(10);
  test::await([&] { return seen().ends.size() == 11; });
  EXPECT_TRUE(is_seen(late));
  for (const Entity& each : first) EXPECT_TRUE(is_seen(each));
  EXPECT_FALSE(seen().has_more());
  EXPECT_GT(seen().revision, revision);
  first.clear();
  test::await([&] { return seen().ends.size() == 1; });
}

// A look costs as much as there are ends: one that comes and goes must not cause it each time.
TEST_F(Crowds, OneThatGoesIsNotEnoughToLookAgain) {
  std::vector<Entity> first = ends_of(End::kWriter, Peers::kMaxOfTopic);
  test::await([&] { return seen().ends.size() == Peers::kMaxOfTopic; });
  const Entity late = end_of(End::kWriter);
  test::await([&] { return seen().has_more(); });
  first.pop_back();
  test::await([&] { return seen().ends.size() == Peers::kMaxOfTopic - 1; });
  EXPECT_TRUE(seen().has_more());
  EXPECT_FALSE(is_seen(late));
}

TEST_F(Crowds, ReadersHideNoWriter) {
  const std::vector<Entity> readers = ends_of(End::kReader, Peers::kMaxOfTopic + 1);
  test::await([&] { return seen().has_more(); });
  const Entity writer = end_of(End::kWriter);
  test::await([&] { return is_seen(writer); });
}

// Else a gateway would warn of itself.
TEST_F(Crowds, OfOurOwnAreNobodyElses) {
  ddsi_sertype* type = make_opaque_type("T", false);
  const Entity topic(dds_create_topic_sertype(own_.get(), "t", &type, nullptr, nullptr, nullptr),
                     "topic");
  const Entity own(dds_create_writer(own_.get(), topic.get(), nullptr, nullptr), "end");
  const Entity theirs = end_of(End::kWriter);  // Cyclone tells of it later
  test::await([&] { return is_seen(theirs); });
  EXPECT_FALSE(is_seen(own));
}

}  // namespace
}  // namespace arbiter::gateway::dds
