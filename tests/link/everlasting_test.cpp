// Rules 3 and 6 of docs/hosts.md: how long a host is there without a word, is not for it to say. To
// DDS it is: each participant says how long it is to be believed to live.
#include <dds/dds.h>
#include <dds/ddsi/ddsi_sertype.h>
#include <gtest/gtest.h>

#include <string>

#include "gateway/dds/cyclone_qos.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "link/core/cards.hpp"
#include "link/core/topic_names.hpp"
#include "link/dds/event_topic.hpp"
#include "link/dds/network.hpp"
#include "tests/link/cabled_robot.hpp"
#include "tests/link/known_hosts.hpp"
#include "tests/link/robot.hpp"

namespace arbiter::test {
namespace {

constexpr int kFar = 3;

// A program that offers the planner, says that it lives for an hour, and nothing else.
class EverlastingHost {
 public:
  EverlastingHost()
      : domain_(dds_create_domain(kDomain,
                                  "<General><Interfaces><NetworkInterface name=\"eth0\"/>"
                                  "</Interfaces></General><Discovery><LeaseDuration>3600s"
                                  "</LeaseDuration></Discovery>"),
                "a domain"),
        participant_(dds_create_participant(kDomain, nullptr, nullptr), "a participant") {
    const Type type = type_of<Speed>();
    link::OfferCard card;
    card.incarnation = 666;
    card.host = "far";
    card.source = kPlanner;
    card.type_revision = 1;
    card.type.set_name(type.name());
    card.type.size = type.size();
    card.type.alignment = type.alignment();
    write(link::topic_of_source(kPlanner), "arbiter::Event", link::write_offer_card(card), {});
    link::HostCard host;
    host.incarnation = 666;
    host.host = "far";
    host.instance = "far";
    host.output_count = 1;
    host.outputs = {kPlanner};
    write(link::kHostTopic, "arbiter::Message", {}, link::write_host_card(host));
  }

 private:
  static constexpr dds_domainid_t kDomain = 43;  // that of links

  void write(const std::string& topic_name, const char* type_name, const link::ByteString& data,
             const link::ByteString& message) const {
    const gateway::dds::CycloneQos qos(dds_create_qos());
    dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, 0);
    dds_qset_durability(qos.get(), DDS_DURABILITY_TRANSIENT_LOCAL);
    dds_qset_userdata(qos.get(), data.data(), data.size());
    ddsi_sertype* type = gateway::dds::make_opaque_type(type_name, false);
    const ddsi_sertype* const made = type;
    const dds_entity_t topic = dds_create_topic_sertype(participant_.get(), topic_name.c_str(),
                                                        &type, nullptr, nullptr, nullptr);
    const dds_entity_t writer = dds_create_writer(participant_.get(), topic, qos.get(), nullptr);
    ASSERT_GT(writer, 0);
    if (message.empty()) return;
    gateway::dds::Payload* const payload = gateway::dds::make_payload(
        made, {link::encapsulation(), Bytes(message.data(), message.size())});
    ASSERT_EQ(dds_writecdr(writer, &payload->cyclone), DDS_RETCODE_OK);
  }

  const link::Entity domain_;
  const link::Entity participant_;
};

// Its port would stay open, and a winner whose T is `forever` would command for as long; and no
// other host would ever be heard in its place.
TEST_F(Cable, AHostThatSaysThatItLivesForAnHourIsGoneAllTheSame) {
  CabledRobot robot;
  const NetworkNamespace far_network;
  robot.cables.connect(far_network, kFar);
  Host base = robot.base(motor_model("forever"));
  Host head = robot.head(source_model("forever"));
  run_in(far_network, [&] {
    const EverlastingHost far;
    base.see("/Planner/speed:o comes from host far");
    await_host("base", "far");
    Planner planner(head);
    base.await_described(kPlanner, "open on several hosts: far, head");
    robot.cables.cut(kFar);
    base.see("/Planner/speed:o comes from host head");
    await_hosts("base", [](const wire::HostsDocument& hosts) {
      const wire::HostStatus* const found = hosts.find_host("far");
      return found != nullptr && !found->is_up;
    });
  });
}

}  // namespace
}  // namespace arbiter::test
