// iceoryx 2: zero-copy publish and subscribe through shared memory, without arbitration.
#include <cstring>

#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "bench/peers/iceoryx_roudi.hpp"
#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

iox::capro::ServiceDescription service(const Exchange& exchange, const char* event) {
  using iox::capro::IdString_t;
  return {IdString_t("arbiter-bench"), IdString_t(iox::cxx::TruncateToCapacity, exchange.unique),
          IdString_t(iox::cxx::TruncateToCapacity, event)};
}

// Before a publisher or subscriber can be made.
const Exchange& registered(const Exchange& exchange, Side side) {
  quieten_iceoryx();
  const std::string name =
      exchange.unique + (side == Side::kInitiator ? "-initiator" : "-responder");
  iox::runtime::PoshRuntime::initRuntime(iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name));
  return exchange;
}

class IceoryxEndpoint : public Endpoint {
 public:
  IceoryxEndpoint(const Exchange& exchange, Side side)
      : exchange_(registered(exchange, side)),
        publisher_(service(exchange, side == Side::kInitiator ? "ping" : "pong")),
        subscriber_(service(exchange, side == Side::kInitiator ? "pong" : "ping"), queue()) {
    if (exchange.waiting == Waiting::kBlocking) {
      wait_set_.attachState(subscriber_, iox::popo::SubscriberState::HAS_DATA).or_else([](auto&) {
        throw BenchError("the WaitSet has not taken the subscriber");
      });
    }
    spin_until([&] {
      return publisher_.hasSubscribers() &&
             subscriber_.getSubscriptionState() == iox::SubscribeState::SUBSCRIBED;
    });
  }
  ~IceoryxEndpoint() override {
    if (exchange_.waiting == Waiting::kBlocking) {
      wait_set_.detachState(subscriber_, iox::popo::SubscriberState::HAS_DATA);
    }
  }

  void send(std::uint64_t number) override {
    auto loan = publisher_.loan(static_cast<std::uint32_t>(exchange_.bytes));
    if (loan.has_error()) throw BenchError("no memory for a sample");
    std::memcpy(loan.value(), &number, sizeof number);
    publisher_.publish(loan.value());
  }

  std::uint64_t receive() override {
    std::uint64_t number = 0;
    if (exchange_.waiting == Waiting::kSpinning) {
      spin_until([&] { return take(number); });
      return number;
    }
    while (!take(number)) {
      if (wait_set_.timedWait(iox::units::Duration::fromSeconds(10)).empty()) {
        throw BenchError("no sample has come for ten seconds");
      }
    }
    return number;
  }

 private:
  static iox::popo::SubscriberOptions queue() {
    iox::popo::SubscriberOptions options;
    options.queueCapacity = 8;
    return options;
  }

  bool take(std::uint64_t& number) {
    auto sample = subscriber_.take();
    if (sample.has_error()) return false;
    std::memcpy(&number, sample.value(), sizeof number);
    subscriber_.release(sample.value());
    return true;
  }

  Exchange exchange_;
  iox::popo::UntypedPublisher publisher_;
  iox::popo::UntypedSubscriber subscriber_;
  iox::popo::WaitSet<> wait_set_;
};

class IceoryxSession : public Session {
 public:
  explicit IceoryxSession(const Exchange& exchange)
      : exchange_(exchange), roudi_(IceoryxRoudi::share()) {}

  std::unique_ptr<Endpoint> open(Side side) override {
    return std::make_unique<IceoryxEndpoint>(exchange_, side);
  }

 private:
  Exchange exchange_;
  std::shared_ptr<IceoryxRoudi> roudi_;
};

class IceoryxSystem : public System {
 public:
  [[nodiscard]] std::string name() const override { return kIceoryx; }
  [[nodiscard]] Role role() const override { return Role::kPeer; }
  [[nodiscard]] bool can(const Exchange&) const override { return true; }
  std::unique_ptr<Session> prepare(const Exchange& exchange) override {
    return std::make_unique<IceoryxSession>(exchange);
  }
};

}  // namespace

std::unique_ptr<System> iceoryx_system() { return std::make_unique<IceoryxSystem>(); }

}  // namespace arbiter::bench
