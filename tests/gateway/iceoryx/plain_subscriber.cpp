// A subscriber of iceoryx that knows of nothing else: writes a line for each sample that it gets.
//
//   plain_subscriber SERVICE INSTANCE EVENT [blocking]
//
// With "blocking" it asks its publishers to wait for it.
// "HEADER|PAYLOAD", where a payload of nothing but zero bytes is "zeros SIZE", and one of more than
// 100 bytes "SIZE bytes BEGIN". Says "ready" when it is subscribed to a publisher.
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <iostream>
#include <string>

#include <iceoryx_posh/mepoo/chunk_header.hpp>
#include <iceoryx_posh/popo/untyped_subscriber.hpp>
#include <iceoryx_posh/popo/wait_set.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

namespace {

iox::capro::IdString_t id(const char* text) {
  return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, text);
}

std::string in_words(const std::string& payload) {
  if (payload.find_first_not_of('\0') == std::string::npos) {
    return "zeros " + std::to_string(payload.size());
  }
  if (payload.size() <= 100) return payload;
  const bool is_whole =
      std::all_of(payload.begin(), payload.end(), [&](char c) { return c == payload[0]; });
  return std::to_string(payload.size()) + " bytes " + (is_whole ? payload[0] : '?');
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const std::string name = "plain-subscriber-" + std::to_string(::getpid());
  iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  iox::popo::SubscriberOptions options;
  if (argc > 4) options.queueFullPolicy = iox::popo::QueueFullPolicy::BLOCK_PRODUCER;
  iox::popo::UntypedSubscriber subscriber({id(argv[1]), id(argv[2]), id(argv[3])}, options);
  iox::popo::WaitSet<> waits;
  waits.attachState(subscriber, iox::popo::SubscriberState::HAS_DATA).or_else([](auto&) {
    std::exit(1);
  });
  while (subscriber.getSubscriptionState() != iox::SubscribeState::SUBSCRIBED) {
    ::usleep(1000);
  }
  std::cout << "ready" << std::endl;
  for (;;) {
    static_cast<void>(waits.wait());
    for (;;) {
      auto taken = subscriber.take();
      if (taken.has_error()) break;
      const auto* const chunk = iox::mepoo::ChunkHeader::fromUserPayload(taken.value());
      const std::string header(static_cast<const char*>(chunk->userHeader()),
                               chunk->userHeaderSize());
      const std::string payload(static_cast<const char*>(taken.value()), chunk->userPayloadSize());
      std::cout << header << '|' << in_words(payload) << std::endl;
      subscriber.release(taken.value());
    }
  }
}
