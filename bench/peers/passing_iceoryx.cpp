// What passes from iceoryx to iceoryx.
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <thread>
#include <utility>

#include <iceoryx_posh/mepoo/chunk_header.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "bench/peers/iceoryx_roudi.hpp"
#include "bench/peers/passing.hpp"

namespace arbiter::bench {
namespace {

constexpr const char* kService = "arbiter-bench";
constexpr const char* kInstance = "passing";
constexpr std::uint64_t kQueue = 8;

// A process has one runtime, which is made before its first end.
iox::capro::ServiceDescription registered(const std::string& topic) {
  quieten_iceoryx();
  const std::string name = topic + "-" + std::to_string(::getpid());
  iox::runtime::PoshRuntime::initRuntime(iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name));
  using iox::capro::IdString_t;
  return {IdString_t(iox::cxx::TruncateToCapacity, kService),
          IdString_t(iox::cxx::TruncateToCapacity, kInstance),
          IdString_t(iox::cxx::TruncateToCapacity, topic)};
}

class IceoryxPublisher : public PassingPublisher {
 public:
  IceoryxPublisher(const std::string& topic, std::size_t bytes)
      : bytes_(static_cast<std::uint32_t>(bytes)), publisher_(registered(topic)) {}

  void publish(const Passed& sample) override {
    auto loan = publisher_.loan(bytes_);
    if (loan.has_error()) throw BenchError("no memory for a sample");
    std::memcpy(loan.value(), &sample, sizeof sample);
    publisher_.publish(loan.value());
  }

 private:
  std::uint32_t bytes_;
  iox::popo::UntypedPublisher publisher_;
};

// A thread that sleeps in a WaitSet until there are chunks, and takes all.
class Taker : public PassingEnd {
 public:
  using OnChunk = std::function<void(const void* payload)>;

  Taker(const std::string& topic, OnChunk on_chunk)
      : on_chunk_(std::move(on_chunk)), subscriber_(registered(topic), queue()) {
    wait_set_.attachState(subscriber_, iox::popo::SubscriberState::HAS_DATA).or_else([](auto&) {
      throw BenchError("the WaitSet has not taken the subscriber");
    });
    thread_ = std::thread([this] { run(); });
  }
  ~Taker() override {
    ends_ = true;
    wait_set_.markForDestruction();
    thread_.join();
    wait_set_.detachState(subscriber_, iox::popo::SubscriberState::HAS_DATA);
  }

 private:
  static iox::popo::SubscriberOptions queue() {
    iox::popo::SubscriberOptions options;
    options.queueCapacity = kQueue;
    return options;
  }

  void run() {
    while (!ends_) {
      static_cast<void>(wait_set_.wait());
      for (auto taken = subscriber_.take(); !taken.has_error(); taken = subscriber_.take()) {
        on_chunk_(taken.value());
        subscriber_.release(taken.value());
      }
    }
  }

  OnChunk on_chunk_;
  iox::popo::UntypedSubscriber subscriber_;
  iox::popo::WaitSet<> wait_set_;
  std::atomic<bool> ends_ = false;
  std::thread thread_;
};

class Relay : public PassingEnd {
 public:
  Relay(const std::string& from, const std::string& to)
      : publisher_(registered(to)), taker_(from, [this](const void* chunk) { pass_on(chunk); }) {}

 private:
  // Memory is the publisher's: a chunk that was taken is another's, and cannot be published again.
  void pass_on(const void* payload) {
    const auto* const header = iox::mepoo::ChunkHeader::fromUserPayload(payload);
    auto loan = publisher_.loan(header->userPayloadSize());
    if (loan.has_error()) return;  // the subscriber's side counts what is missing
    std::memcpy(loan.value(), payload, header->userPayloadSize());
    publisher_.publish(loan.value());
  }

  iox::popo::UntypedPublisher publisher_;
  Taker taker_;
};

std::string topic_of(const std::string& event) {
  return std::string("service=\"") + kService + "\" instance=\"" + kInstance + "\" event=\"" +
         event + "\"";
}

class IceoryxPassing : public Passing {
 public:
  std::unique_ptr<PassingPublisher> publisher(const std::string& topic,
                                              std::size_t bytes) override {
    return std::make_unique<IceoryxPublisher>(topic, bytes);
  }
  std::unique_ptr<PassingEnd> subscriber(const std::string& topic, OnPassed on_passed) override {
    return std::make_unique<Taker>(topic, [call = std::move(on_passed)](const void* payload) {
      Passed sample;
      std::memcpy(&sample, payload, sizeof sample);
      call(sample);
    });
  }
  std::unique_ptr<PassingEnd> relay(const std::vector<std::string>& from,
                                    const std::string& to) override {
    return std::make_unique<Relay>(from.at(0), to);
  }
  [[nodiscard]] std::string gateway() const override { return "arbiter-gateway-iceoryx"; }
  [[nodiscard]] std::string mapping(const std::vector<Port>& in, const Port& out) const override {
    std::string entries;
    for (const Port& each : in) {
      entries +=
          "<in " + topic_of(each.topic) + " port=\"" + each.port + "\" max_size=\"2MiB\"/>\n";
    }
    return "<gateway kind=\"iceoryx\">\n" + entries + "<out port=\"" + out.port + "\" " +
           topic_of(out.topic) + " max_size=\"2MiB\"/>\n</gateway>\n";
  }

 private:
  std::shared_ptr<IceoryxRoudi> roudi_ = IceoryxRoudi::share();
};

}  // namespace

std::unique_ptr<Passing> iceoryx_passing() { return std::make_unique<IceoryxPassing>(); }

}  // namespace arbiter::bench
