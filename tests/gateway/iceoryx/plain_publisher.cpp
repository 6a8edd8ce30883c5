// A publisher of iceoryx that knows of nothing else: publishes each line of its standard input.
//
//   plain_publisher SERVICE INSTANCE EVENT [HEADER [HISTORY]]
//
// A line is a payload; "#SIZE" stands for SIZE bytes "x". HEADER: bytes of a user header, "h" each.
// HISTORY: so many are given to a subscriber that comes later and asks for them.
// Says "ready" when it can publish, and "published" after each line.
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>

#include <iceoryx_posh/mepoo/chunk_header.hpp>
#include <iceoryx_posh/popo/untyped_publisher.hpp>
#include <iceoryx_posh/runtime/posh_runtime.hpp>

namespace {

iox::capro::IdString_t id(const char* text) {
  return iox::capro::IdString_t(iox::cxx::TruncateToCapacity, text);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const auto header = static_cast<std::uint32_t>(argc > 4 ? std::atoi(argv[4]) : 0);
  const std::string name = "plain-publisher-" + std::to_string(::getpid());
  iox::runtime::PoshRuntime::initRuntime(
      iox::RuntimeName_t(iox::cxx::TruncateToCapacity, name.c_str()));
  iox::popo::PublisherOptions options;
  options.historyCapacity = static_cast<std::uint64_t>(argc > 5 ? std::atoi(argv[5]) : 0);
  iox::popo::UntypedPublisher publisher({id(argv[1]), id(argv[2]), id(argv[3])}, options);
  std::cout << "ready" << std::endl;
  for (std::string line; std::getline(std::cin, line);) {
    if (line.rfind('#', 0) == 0) line = std::string(std::stoul(line.substr(1)), 'x');
    publisher.loan(static_cast<std::uint32_t>(line.size()), 8, header, header == 0 ? 1 : 4)
        .and_then([&](void* payload) {
          auto* const chunk = iox::mepoo::ChunkHeader::fromUserPayload(payload);
          if (header != 0) std::memset(chunk->userHeader(), 'h', header);
          std::memcpy(payload, line.data(), line.size());
          publisher.publish(payload);
        })
        .or_else([](auto&) { std::cerr << "no chunk" << std::endl; });
    std::cout << "published" << std::endl;
  }
  return 0;
}
