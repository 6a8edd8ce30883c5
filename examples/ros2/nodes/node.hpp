// What a node of ROS 2 does, with Cyclone DDS alone: topics by their names in DDS, ROS 2's default
// QoS, the domain of ROS_DOMAIN_ID. Nothing here knows of Arbiter.
#pragma once

#include <dds/dds.h>

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "messages.h"

namespace ros2_demo {

using Twist = geometry_msgs_msg_dds__Twist_;
using Bool = std_msgs_msg_dds__Bool_;
using Clock = std::chrono::steady_clock;

inline const dds_topic_descriptor_t& descriptor_of(const Twist*) {
  return geometry_msgs_msg_dds__Twist__desc;
}
inline const dds_topic_descriptor_t& descriptor_of(const Bool*) {
  return std_msgs_msg_dds__Bool__desc;
}

inline Twist twist(double forwards, double turning) {
  Twist result{};
  result.linear.x = forwards;
  result.angular.z = turning;
  return result;
}

// Whether it was asked for, and has been printed.
inline bool printed_help(int argc, char** argv, const char* help) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word != "--help" && word != "-h") continue;
    std::printf("%s\nIts domain is that of ROS_DOMAIN_ID, or 0. It goes on until you stop it.\n",
                help);
    return true;
  }
  return false;
}

class Node {
 public:
  Node() {
    const char* const domain = std::getenv("ROS_DOMAIN_ID");
    participant_ = checked(dds_create_participant(
        domain == nullptr ? 0 : static_cast<dds_domainid_t>(std::atoi(domain)), nullptr, nullptr));
  }
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node() { dds_delete(participant_); }

  // Returns what publishes.
  template <class Message>
  std::function<void(const Message&)> publisher(const std::string& topic) {
    const dds_entity_t writer =
        checked(dds_create_writer(participant_, this->topic<Message>(topic), qos(), nullptr));
    return [writer](const Message& message) { dds_write(writer, &message); };
  }
  // Calls it on a thread of Cyclone's. It lives as long as the node.
  template <class Message>
  void subscribe(const std::string& topic, std::function<void(const Message&)>& on_message) {
    dds_listener_t* const listener = dds_create_listener(&on_message);
    dds_lset_data_available(listener, [](dds_entity_t reader, void* call) {
      void* sample = nullptr;
      dds_sample_info_t info;
      while (dds_take(reader, &sample, &info, 1, 1) > 0) {
        if (info.valid_data) {
          (*static_cast<std::function<void(const Message&)>*>(call))(
              *static_cast<const Message*>(sample));
        }
        dds_return_loan(reader, &sample, 1);
        sample = nullptr;
      }
    });
    checked(dds_create_reader(participant_, this->topic<Message>(topic), qos(), listener));
    dds_delete_listener(listener);
  }

 private:
  static dds_entity_t checked(dds_entity_t entity) {
    if (entity >= 0) return entity;
    std::fprintf(stderr, "Cyclone DDS: %s\n", dds_strretcode(-entity));
    std::exit(1);
  }
  template <class Message>
  dds_entity_t topic(const std::string& name) {
    return checked(dds_create_topic(participant_, &descriptor_of(static_cast<Message*>(nullptr)),
                                    name.c_str(), nullptr, nullptr));
  }
  static const dds_qos_t* qos() {  // ROS 2's default profile
    static dds_qos_t* const qos = [] {
      dds_qos_t* const result = dds_create_qos();
      dds_qset_reliability(result, DDS_RELIABILITY_RELIABLE, DDS_INFINITY);
      dds_qset_history(result, DDS_HISTORY_KEEP_LAST, 10);
      return result;
    }();
    return qos;
  }

  dds_entity_t participant_ = 0;
};

// When a node acts: seconds since the start that the first argument says, by the steady clock in
// nanoseconds; the others are intervals, "5-9".
class Script {
 public:
  Script(int argc, char** argv) {
    if (argc > 1) start_ = Clock::time_point(Clock::duration(std::atoll(argv[1])));
    for (int i = 2; i < argc; ++i) {
      double from = 0;
      double to = 0;
      if (std::sscanf(argv[i], "%lf-%lf", &from, &to) == 2) intervals_.emplace_back(from, to);
    }
  }
  // Sleeps until the next of its periods begins.
  void wait(std::chrono::milliseconds period) {
    next_ += period;
    std::this_thread::sleep_until(next_);
  }
  // Whether the time lies in an interval: the number in the order of arguments.
  [[nodiscard]] bool is_in(std::size_t number) const {
    if (number >= intervals_.size()) return false;
    const double now = std::chrono::duration<double>(Clock::now() - start_).count();
    return now >= intervals_[number].first && now < intervals_[number].second;
  }

 private:
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = Clock::now();
  std::vector<std::pair<double, double>> intervals_;
};

}  // namespace ros2_demo
