// iceoryx, from one publisher to many subscribers of one process.
#include <unistd.h>

#include <memory>
#include <vector>

#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

#include "bench/harness/batches.hpp"
#include "bench/peers/iceoryx_roudi.hpp"
#include "bench/peers/spin.hpp"
#include "bench/peers/systems.hpp"

namespace arbiter::bench {
namespace {

constexpr std::uint32_t kBytes = 64;

iox::capro::ServiceDescription service(const std::string& unique) {
  using iox::capro::IdString_t;
  return {IdString_t("arbiter-bench"), IdString_t(iox::cxx::TruncateToCapacity, unique),
          IdString_t("fan-out")};
}

void register_as(const std::string& name) {
  quieten_iceoryx();
  iox::runtime::PoshRuntime::initRuntime(iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name));
}

void subscribe(Conversation& with, const std::string& unique, int subscribers) {
  register_as(unique + "-subscribers");
  iox::popo::SubscriberOptions options;
  options.queueCapacity = 8;
  std::vector<std::unique_ptr<iox::popo::UntypedSubscriber>> all;
  for (int i = 0; i < subscribers; ++i) {
    all.push_back(std::make_unique<iox::popo::UntypedSubscriber>(service(unique), options));
  }
  with.say(1);
  for (const auto& each : all) {
    spin_until([&] { return each->getSubscriptionState() == iox::SubscribeState::SUBSCRIBED; });
  }
  with.say(1);
  for (std::uint64_t word = 0; with.hear_or_end(word);) {
  }
}

}  // namespace

Contender iceoryx_fan_out(int subscribers, int batch) {
  static int sessions = 0;
  const std::string unique =
      "arbiter-bench-" + std::to_string(::getpid()) + "-fan-out-" + std::to_string(++sessions);
  auto roudi = IceoryxRoudi::share();
  auto receivers = std::make_shared<Worker>(
      "iceoryx, subscribers", [=](Conversation& with) { subscribe(with, unique, subscribers); });
  receivers->hear();
  Contender one = in_batches(kIceoryx, Role::kPeer, batch, [=] {
    register_as(unique + "-publisher");
    auto publisher = std::make_shared<iox::popo::UntypedPublisher>(service(unique));
    return [publisher] {
      auto loan = publisher->loan(kBytes);
      if (loan.has_error()) throw BenchError("no memory for a sample");
      publisher->publish(loan.value());
    };
  });
  receivers->hear();
  one.round = [roudi, receivers, round = std::move(one.round)](double seconds) {
    return round(seconds);
  };
  return one;
}

}  // namespace arbiter::bench
