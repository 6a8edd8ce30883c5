// A stranger by Fast DDS, with types made by fastddsgen. Uses the loopback interface alone.
#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastrtps/utils/IPLocator.h>

#include <memory>

#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/DataWriterListener.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/DataReaderListener.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TypeSupport.hpp>

#include "command_line.hpp"
#include "strangersPubSubTypes.h"

namespace {

using namespace eprosima::fastdds::dds;
using strangers::CommandLine;
using Duration = eprosima::fastrtps::Duration_t;

template <class Sample>
struct Type;

template <>
struct Type<geometry_msgs::msg::dds_::Twist_> {
  using Support = geometry_msgs::msg::dds_::Twist_PubSubType;
  static void fill(geometry_msgs::msg::dds_::Twist_& sample, double first, double second) {
    sample.linear().x(first);
    sample.angular().z(second);
  }
  static void write(const geometry_msgs::msg::dds_::Twist_& sample) {
    strangers::write_numbers(sample.linear().x(), sample.angular().z());
  }
};

template <>
struct Type<std_msgs::msg::dds_::Bool_> {
  using Support = std_msgs::msg::dds_::Bool_PubSubType;
  static void fill(std_msgs::msg::dds_::Bool_& sample, double first, double /*second*/) {
    sample.data(first != 0);
  }
  static void write(const std_msgs::msg::dds_::Bool_& sample) {
    strangers::write_numbers(sample.data() ? 1 : 0, 0);
  }
};

template <>
struct Type<strangers::Blob> {
  using Support = strangers::BlobPubSubType;
  static void fill(strangers::Blob& sample, double first, double second) {
    sample.number(static_cast<std::uint32_t>(first));
    sample.bytes().assign(static_cast<std::size_t>(second), static_cast<std::uint8_t>(first));
  }
  static void write(const strangers::Blob& sample) {
    for (std::size_t i = 0; i < sample.bytes().size(); ++i) {
      if (sample.bytes()[i] == static_cast<std::uint8_t>(sample.number())) continue;
      strangers::write_line("wrong byte at " + std::to_string(i));
      return;
    }
    strangers::write_numbers(sample.number(), static_cast<double>(sample.bytes().size()));
  }
};

template <>
struct Type<strangers::Robot> {
  using Support = strangers::RobotPubSubType;
  static void fill(strangers::Robot& sample, double first, double second) {
    sample.id(static_cast<std::int32_t>(first));
    sample.battery(second);
  }
  static void write(const strangers::Robot& sample) {
    strangers::write_numbers(sample.id(), sample.battery());
  }
};

template <class Sample>
class Reading : public DataReaderListener {
 public:
  void on_data_available(DataReader* reader) override {
    Sample sample;
    SampleInfo info;
    while (reader->take_next_sample(&sample, &info) == ReturnCode_t::RETCODE_OK) {
      if (info.valid_data) Type<Sample>::write(sample);
    }
  }
  void on_subscription_matched(DataReader* /*reader*/,
                               const SubscriptionMatchedStatus& status) override {
    strangers::write_matched(status.current_count);
  }
};

class Writing : public DataWriterListener {
 public:
  void on_publication_matched(DataWriter* /*writer*/,
                              const PublicationMatchedStatus& status) override {
    strangers::write_matched(status.current_count);
  }
};

DomainParticipantQos loopback() {
  DomainParticipantQos qos;
  auto transport = std::make_shared<eprosima::fastdds::rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.push_back("127.0.0.1");
  // Of participants on this machine that are looked for without multicast: all that a test has, not
  // the first four.
  transport->maxInitialPeersRange = 16;
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  eprosima::fastrtps::rtps::Locator_t here;
  eprosima::fastrtps::rtps::IPLocator::setIPv4(here, 127, 0, 0, 1);
  qos.wire_protocol().builtin.initialPeersList.push_back(here);
  qos.name("stranger");
  return qos;
}

template <class EndQos>
void set(EndQos& qos, const CommandLine& line) {
  qos.reliability().kind = line.reliable ? RELIABLE_RELIABILITY_QOS : BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind =
      line.transient_local ? TRANSIENT_LOCAL_DURABILITY_QOS : VOLATILE_DURABILITY_QOS;
  qos.history().kind = KEEP_LAST_HISTORY_QOS;
  qos.history().depth = line.depth;
  qos.endpoint().history_memory_policy =
      eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  // One that is killed would leave its shared memory behind.
  qos.data_sharing().off();
  if (line.deadline_ms > 0) {
    qos.deadline().period = Duration(
        line.deadline_ms / 1000, static_cast<std::uint32_t>(line.deadline_ms % 1000) * 1'000'000);
  }
  if (!line.user_data.empty()) {
    qos.user_data().setValue({line.user_data.begin(), line.user_data.end()});
  }
}

template <class Sample>
void run(const CommandLine& line) {
  DomainParticipantFactory& factory = *DomainParticipantFactory::get_instance();
  DomainParticipant* const participant = factory.create_participant(line.domain, loopback());
  auto* const support = new typename Type<Sample>::Support;  // the participant's
  if (!line.type_name.empty()) support->setName(line.type_name.c_str());
  TypeSupport type(support);
  type.register_type(participant);
  Topic* const topic =
      participant->create_topic(line.topic, type.get_type_name(), TOPIC_QOS_DEFAULT);
  double first = 0;
  double second = 0;
  if (!line.publishes) {
    SubscriberQos group;
    if (!line.partition.empty()) group.partition().push_back(line.partition.c_str());
    DataReaderQos qos;
    set(qos, line);
    Reading<Sample> listener;
    DataReader* const reader =
        participant->create_subscriber(group)->create_datareader(topic, qos, &listener);
    while (strangers::read_numbers(first, second)) {
    }
    reader->set_listener(nullptr);
  } else {
    PublisherQos group;
    if (!line.partition.empty()) group.partition().push_back(line.partition.c_str());
    DataWriterQos qos;
    set(qos, line);
    qos.publish_mode().kind = ASYNCHRONOUS_PUBLISH_MODE;  // large samples need it
    Writing listener;
    DataWriter* const writer =
        participant->create_publisher(group)->create_datawriter(topic, qos, &listener);
    while (strangers::read_numbers(first, second)) {
      Sample sample;
      Type<Sample>::fill(sample, first, second);
      if (!writer->write(&sample)) strangers::write_line("not written");
    }
    writer->wait_for_acknowledgments(Duration(5, 0));
    writer->set_listener(nullptr);
  }
  participant->delete_contained_entities();
  factory.delete_participant(participant);
}

}  // namespace

int main(int argc, char** argv) {
  const CommandLine line = strangers::parse(argc, argv);
  if (line.type == "twist") run<geometry_msgs::msg::dds_::Twist_>(line);
  if (line.type == "bool") run<std_msgs::msg::dds_::Bool_>(line);
  if (line.type == "blob") run<strangers::Blob>(line);
  if (line.type == "robot") run<strangers::Robot>(line);
}
