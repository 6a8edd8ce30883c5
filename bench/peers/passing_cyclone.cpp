// What passes from DDS to DDS, by Cyclone: samples of the benchmark's own type, and ROS 2's Twist.
#include <dds/ddsi/ddsi_serdata.h>

#include <algorithm>
#include <atomic>
#include <utility>

#include "bench/harness/cpu.hpp"
#include "bench/harness/worker.hpp"
#include "bench/peers/cyclone.hpp"
#include "bench/peers/passing.hpp"
#include "dds_sample.h"
#include "messages.h"

namespace arbiter::bench {
namespace {

struct DeleteListener {
  void operator()(dds_listener_t* listener) const { dds_delete_listener(listener); }
};
using Listener = std::unique_ptr<dds_listener_t, DeleteListener>;

// A type of samples that begin with what is passed.
class Blob {
 public:
  using Type = arbiter_bench_PassedSample;
  static constexpr const char* kTopicPrefix = "";
  static constexpr const char* kTypeInMapping = "arbiter_bench::PassedSample";

  explicit Blob(std::size_t bytes) : payload_(bytes - std::min(bytes, kBefore)) {
    sample_.payload._buffer = payload_.data();
    sample_.payload._length = sample_.payload._maximum =
        static_cast<std::uint32_t>(payload_.size());
  }
  static const dds_topic_descriptor_t& descriptor() { return arbiter_bench_PassedSample_desc; }
  const Type& with(const Passed& passed) {
    sample_.sent_ns = passed.sent_ns;
    sample_.number = passed.number;
    return sample_;
  }
  static Passed in(const Type& sample) { return {sample.sent_ns, sample.number}; }

 private:
  // The two numbers, and the length of the sequence.
  static constexpr std::size_t kBefore = 20;
  std::vector<std::uint8_t> payload_;
  Type sample_{};
};

// Doubles that hold what is passed exactly: nanoseconds of the first hundred days of a machine.
class Twist {
 public:
  using Type = geometry_msgs_msg_dds__Twist_;
  static constexpr const char* kTopicPrefix = "rt/";  // as ROS 2 names its topics in DDS
  static constexpr const char* kTypeInMapping = "geometry_msgs/msg/Twist";

  explicit Twist(std::size_t /*bytes*/) {}
  static const dds_topic_descriptor_t& descriptor() { return geometry_msgs_msg_dds__Twist__desc; }
  const Type& with(const Passed& passed) {
    sample_.linear.x = static_cast<double>(passed.number);
    sample_.angular.z = static_cast<double>(passed.sent_ns);
    return sample_;
  }
  static Passed in(const Type& sample) {
    return {static_cast<std::int64_t>(sample.angular.z),
            static_cast<std::uint64_t>(sample.linear.x)};
  }

 private:
  Type sample_{};
};

// A worker's own, which all its ends share.
std::shared_ptr<DdsParticipant> own_participant() {
  static std::weak_ptr<DdsParticipant> current;
  if (auto made = current.lock()) return made;
  const auto made = std::make_shared<DdsParticipant>();
  current = made;
  return made;
}

// Names of topics: DDS does not allow hyphens.
std::string plain(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

template <class Kind>
DdsEntity topic_of(const DdsParticipant& participant, const std::string& name) {
  return {dds_create_topic(participant.get(), &Kind::descriptor(),
                           (Kind::kTopicPrefix + plain(name)).c_str(), nullptr, nullptr),
          "dds_create_topic"};
}

// ROS 2's default profile.
DdsQos default_profile() {
  DdsQos qos(dds_create_qos());
  dds_qset_reliability(qos.get(), DDS_RELIABILITY_RELIABLE, DDS_MSECS(100));
  dds_qset_history(qos.get(), DDS_HISTORY_KEEP_LAST, 10);
  return qos;
}

template <class Kind>
class CyclonePublisher : public PassingPublisher {
 public:
  CyclonePublisher(const std::string& name, std::size_t bytes)
      : sample_(bytes),
        topic_(topic_of<Kind>(*participant_, name)),
        writer_(
            dds_create_writer(participant_->get(), topic_.get(), default_profile().get(), nullptr),
            "dds_create_writer") {}

  void publish(const Passed& sample) override {
    const dds_return_t result = dds_write(writer_.get(), &sample_.with(sample));
    if (result != 0) throw BenchError(std::string("dds_write: ") + dds_strretcode(-result));
  }

 private:
  Kind sample_;
  std::shared_ptr<DdsParticipant> participant_ = own_participant();
  DdsEntity topic_;
  DdsEntity writer_;
};

// Takes in the listener, on the thread that has received it.
template <class Kind>
class CycloneSubscriber : public PassingEnd {
 public:
  CycloneSubscriber(const std::string& name, OnPassed on_passed)
      : on_passed_(std::move(on_passed)), topic_(topic_of<Kind>(*participant_, name)) {
    const Listener listener(dds_create_listener(this));
    dds_lset_data_available(listener.get(), [](dds_entity_t reader, void* self) {
      static_cast<CycloneSubscriber*>(self)->take(reader);
    });
    reader_ = {dds_create_reader(participant_->get(), topic_.get(), default_profile().get(),
                                 listener.get()),
               "dds_create_reader"};
  }

 private:
  void take(dds_entity_t reader) const {
    void* sample = nullptr;  // on loan from the reader
    dds_sample_info_t info;
    while (dds_take(reader, &sample, &info, 1, 1) > 0) {
      if (info.valid_data) on_passed_(Kind::in(*static_cast<const typename Kind::Type*>(sample)));
      dds_return_loan(reader, &sample, 1);
      sample = nullptr;
    }
  }

  OnPassed on_passed_;
  std::shared_ptr<DdsParticipant> participant_ = own_participant();
  DdsEntity topic_;
  DdsEntity reader_;
};

// Takes serialised samples in the listener, and publishes them from there as they are: nothing is
// converted, and no thread is woken but the one that receives.
template <class Kind>
class CycloneRelay : public PassingEnd {
 public:
  CycloneRelay(const std::vector<std::string>& from, const std::string& to)
      : out_topic_(topic_of<Kind>(*participant_, to)),
        writer_(dds_create_writer(participant_->get(), out_topic_.get(), default_profile().get(),
                                  nullptr),
                "dds_create_writer"),
        inputs_(from.size()) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      Input& input = inputs_[i];
      input.relay = this;
      input.topic = topic_of<Kind>(*participant_, from[i]);
      const Listener listener(dds_create_listener(&input));
      dds_lset_data_available(listener.get(), [](dds_entity_t reader, void* argument) {
        auto* const self = static_cast<Input*>(argument);
        self->relay->pass_on(*self, reader);
      });
      input.reader = {dds_create_reader(participant_->get(), input.topic.get(),
                                        default_profile().get(), listener.get()),
                      "dds_create_reader"};
    }
  }

 private:
  struct Input {
    CycloneRelay* relay = nullptr;
    std::atomic<std::int64_t> heard_ns = -kSilentNs;
    DdsEntity topic;
    DdsEntity reader;
  };
  static constexpr std::int64_t kSilentNs = Passing::kSilentNs;

  void pass_on(Input& from, dds_entity_t reader) {
    ddsi_serdata* sample = nullptr;
    dds_sample_info_t info;
    while (dds_takecdr(reader, &sample, 1, &info, DDS_ANY_STATE) > 0) {
      if (info.valid_data && commands(from)) {
        dds_writecdr(writer_.get(), sample);  // which takes the reference over
      } else {
        ddsi_serdata_unref(sample);
      }
      sample = nullptr;
    }
  }

  bool commands(Input& from) {
    if (inputs_.size() == 1) return true;
    const std::int64_t now = now_ns();
    from.heard_ns.store(now, std::memory_order_relaxed);
    for (const Input& higher : inputs_) {
      if (&higher == &from) return true;
      if (now - higher.heard_ns.load(std::memory_order_relaxed) < kSilentNs) return false;
    }
    return true;
  }

  std::shared_ptr<DdsParticipant> participant_ = own_participant();
  DdsEntity out_topic_;
  DdsEntity writer_;
  std::vector<Input> inputs_;
};

template <class Kind>
class CyclonePassing : public Passing {
 public:
  std::unique_ptr<PassingPublisher> publisher(const std::string& topic,
                                              std::size_t bytes) override {
    return std::make_unique<CyclonePublisher<Kind>>(topic, bytes);
  }
  std::unique_ptr<PassingEnd> subscriber(const std::string& topic, OnPassed on_passed) override {
    return std::make_unique<CycloneSubscriber<Kind>>(topic, std::move(on_passed));
  }
  std::unique_ptr<PassingEnd> relay(const std::vector<std::string>& from,
                                    const std::string& to) override {
    return std::make_unique<CycloneRelay<Kind>>(from, to);
  }
  [[nodiscard]] std::string gateway() const override { return "arbiter-gateway-dds"; }
  // The same configuration as the programs that it stands between.
  [[nodiscard]] Program::Variables variables() const override {
    return {{"CYCLONEDDS_URI", dds_configuration()}};
  }
  [[nodiscard]] std::string mapping(const std::vector<Port>& in, const Port& out) const override {
    std::string entries;
    for (const Port& each : in) entries += "<in " + entry_of(each) + "/>\n";
    return "<gateway kind=\"dds\" domain=\"" + std::to_string(kDdsDomain) + "\">\n" + entries +
           "<out " + entry_of(out) + "/>\n</gateway>\n";
  }

 private:
  static std::string entry_of(const Port& port) {
    const bool is_ros = *Kind::kTopicPrefix != '\0';
    return std::string("topic=\"") + (is_ros ? "/" : "") + plain(port.topic) + "\" type=\"" +
           Kind::kTypeInMapping + "\" depth=\"10\" port=\"" + port.port + "\" max_size=\"2MiB\"";
  }
};

}  // namespace

std::unique_ptr<Passing> cyclone_passing() { return std::make_unique<CyclonePassing<Blob>>(); }
std::unique_ptr<Passing> twist_passing() { return std::make_unique<CyclonePassing<Twist>>(); }

}  // namespace arbiter::bench
