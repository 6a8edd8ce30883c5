// A stranger by Cyclone DDS, with types made by idlc. Listens as CYCLONEDDS_URI says.
#include <dds/dds.h>
#include <dds/ddsrt/log.h>
#include <unistd.h>

#include <cstring>
#include <vector>

#include "command_line.hpp"
#include "strangers.h"

namespace {

using strangers::CommandLine;

template <class Sample>
struct Type;

template <>
struct Type<geometry_msgs_msg_dds__Twist_> {
  static const dds_topic_descriptor_t& descriptor() { return geometry_msgs_msg_dds__Twist__desc; }
  static void fill(geometry_msgs_msg_dds__Twist_& sample, double first, double second) {
    sample.linear.x = first;
    sample.angular.z = second;
  }
  static void write(const geometry_msgs_msg_dds__Twist_& sample) {
    strangers::write_numbers(sample.linear.x, sample.angular.z);
  }
};

template <>
struct Type<std_msgs_msg_dds__Bool_> {
  static const dds_topic_descriptor_t& descriptor() { return std_msgs_msg_dds__Bool__desc; }
  static void fill(std_msgs_msg_dds__Bool_& sample, double first, double /*second*/) {
    sample.data = first != 0;
  }
  static void write(const std_msgs_msg_dds__Bool_& sample) {
    strangers::write_numbers(sample.data ? 1 : 0, 0);
  }
};

template <>
struct Type<strangers_Blob> {
  static const dds_topic_descriptor_t& descriptor() { return strangers_Blob_desc; }
  // The second number says how many bytes: the count of the first, so that mixed ones are seen.
  static void fill(strangers_Blob& sample, double first, double second) {
    static std::vector<std::uint8_t> bytes;
    bytes.assign(static_cast<std::size_t>(second), static_cast<std::uint8_t>(first));
    sample.number = static_cast<std::uint32_t>(first);
    sample.bytes._buffer = bytes.data();
    sample.bytes._length = sample.bytes._maximum = static_cast<std::uint32_t>(bytes.size());
    sample.bytes._release = false;
  }
  static void write(const strangers_Blob& sample) {
    for (std::uint32_t i = 0; i < sample.bytes._length; ++i) {
      if (sample.bytes._buffer[i] == static_cast<std::uint8_t>(sample.number)) continue;
      strangers::write_line("wrong byte at " + std::to_string(i));
      return;
    }
    strangers::write_numbers(sample.number, sample.bytes._length);
  }
};

template <>
struct Type<strangers_Robot> {
  static const dds_topic_descriptor_t& descriptor() { return strangers_Robot_desc; }
  static void fill(strangers_Robot& sample, double first, double second) {
    sample.id = static_cast<std::int32_t>(first);
    sample.battery = second;
  }
  static void write(const strangers_Robot& sample) {
    strangers::write_numbers(sample.id, sample.battery);
  }
};

dds_entity_t require(dds_entity_t entity) {
  if (entity >= 0) return entity;
  std::fprintf(stderr, "Cyclone: %s\n", dds_strretcode(-entity));
  std::exit(1);
}

dds_qos_t* make_qos(const CommandLine& line) {
  dds_qos_t* const qos = dds_create_qos();
  dds_qset_reliability(qos, line.reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT,
                       DDS_SECS(10));
  dds_qset_durability(
      qos, line.transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, line.depth);
  dds_qset_durability_service(qos, 0, DDS_HISTORY_KEEP_LAST, line.depth, -1, -1, -1);
  if (line.deadline_ms > 0) dds_qset_deadline(qos, DDS_MSECS(line.deadline_ms));
  if (!line.partition.empty()) dds_qset_partition1(qos, line.partition.c_str());
  if (!line.user_data.empty()) {
    dds_qset_userdata(qos, line.user_data.data(), line.user_data.size());
  }
  return qos;
}

template <class Sample>
void on_data(dds_entity_t reader, void* /*argument*/) {
  for (;;) {
    void* samples[1] = {nullptr};
    dds_sample_info_t info;
    const dds_return_t taken = dds_take(reader, samples, &info, 1, 1);
    if (taken <= 0) return;
    if (info.valid_data) Type<Sample>::write(*static_cast<Sample*>(samples[0]));
    dds_return_loan(reader, samples, taken);
  }
}

template <class Sample>
void run(const CommandLine& line) {
  const dds_entity_t participant = require(dds_create_participant(line.domain, nullptr, nullptr));
  dds_topic_descriptor_t descriptor = Type<Sample>::descriptor();
  if (!line.type_name.empty()) descriptor.m_typename = line.type_name.c_str();
  const dds_entity_t topic =
      require(dds_create_topic(participant, &descriptor, line.topic.c_str(), nullptr, nullptr));
  dds_qos_t* const qos = make_qos(line);
  dds_listener_t* const listener = dds_create_listener(nullptr);
  if (!line.publishes) {
    dds_lset_data_available(listener, on_data<Sample>);
    dds_lset_subscription_matched(
        listener, [](dds_entity_t, const dds_subscription_matched_status_t status, void*) {
          strangers::write_matched(static_cast<int>(status.current_count));
        });
    require(dds_create_reader(participant, topic, qos, listener));
    double first = 0;
    double second = 0;
    while (strangers::read_numbers(first, second)) {
    }
  } else {
    dds_lset_publication_matched(
        listener, [](dds_entity_t, const dds_publication_matched_status_t status, void*) {
          strangers::write_matched(static_cast<int>(status.current_count));
        });
    const dds_entity_t writer = require(dds_create_writer(participant, topic, qos, listener));
    double first = 0;
    double second = 0;
    while (strangers::read_numbers(first, second)) {
      Sample sample{};
      Type<Sample>::fill(sample, first, second);
      require(dds_write(writer, &sample));
    }
    dds_wait_for_acks(writer, DDS_SECS(5));
  }
  dds_delete(participant);
}

// Writes a line for each end of the topic that somebody else has: what its user data say.
template <dds_entity_t kEnds>
void watch_ends(dds_entity_t participant, const CommandLine& line) {
  dds_listener_t* const listener = dds_create_listener(const_cast<CommandLine*>(&line));
  dds_lset_data_available(listener, [](dds_entity_t reader, void* argument) {
    constexpr const char* kWhat =
        kEnds == DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION ? "reader " : "writer ";
    for (;;) {
      void* samples[1] = {nullptr};
      dds_sample_info_t info;
      const dds_return_t taken = dds_take(reader, samples, &info, 1, 1);
      if (taken <= 0) return;
      const auto* const end = static_cast<dds_builtintopic_endpoint_t*>(samples[0]);
      void* data = nullptr;
      std::size_t size = 0;
      if (info.valid_data && static_cast<CommandLine*>(argument)->topic == end->topic_name &&
          dds_qget_userdata(end->qos, &data, &size)) {
        strangers::write_line(kWhat + std::string(static_cast<char*>(data), size));
        dds_free(data);
      }
      dds_return_loan(reader, samples, taken);
    }
  });
  require(dds_create_reader(participant, kEnds, nullptr, listener));
}

void watch(const CommandLine& line) {
  const dds_entity_t participant = require(dds_create_participant(line.domain, nullptr, nullptr));
  watch_ends<DDS_BUILTIN_TOPIC_DCPSSUBSCRIPTION>(participant, line);
  watch_ends<DDS_BUILTIN_TOPIC_DCPSPUBLICATION>(participant, line);
  double first = 0;
  double second = 0;
  while (strangers::read_numbers(first, second)) {
  }
  dds_delete(participant);
}

}  // namespace

int main(int argc, char** argv) {
  const CommandLine line = strangers::parse(argc, argv);
  dds_set_log_mask(DDS_LC_FATAL);  // not of what the tests send to it
  if (std::strcmp(argv[1], "watch") == 0) {
    watch(line);
    return 0;
  }
  if (line.type == "twist") run<geometry_msgs_msg_dds__Twist_>(line);
  if (line.type == "bool") run<std_msgs_msg_dds__Bool_>(line);
  if (line.type == "blob") run<strangers_Blob>(line);
  if (line.type == "robot") run<strangers_Robot>(line);
}
