// A name server that does not answer.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <poll.h>

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <mutex>
#include <string>

#include "gateway/dds/dds_middleware.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/await.hpp"

namespace {

constexpr const char* kSilent = "silent.example";

struct NameServer {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_asked = false;  // and has not answered
  bool answers = false;
  int given_up = 0;  // how often somebody has waited to the end
};
NameServer& name_server() {
  static NameServer& one = *new NameServer;
  return one;
}

}  // namespace

// Cyclone calls it in place of the C library's. So long that nobody waits for it by chance, and not
// for ever, so that who does wait fails.
extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints,
                           addrinfo** result) {
  if (node != nullptr && std::strcmp(node, kSilent) == 0) {
    NameServer& silent = name_server();
    std::unique_lock lock(silent.mutex);
    silent.is_asked = true;
    const auto answers = [&] { return silent.answers; };
    if (!silent.changed.wait_for(lock, std::chrono::seconds(5), answers)) ++silent.given_up;
    silent.is_asked = false;
    return EAI_AGAIN;
  }
  static const auto real =
      reinterpret_cast<decltype(&getaddrinfo)>(::dlsym(RTLD_NEXT, "getaddrinfo"));
  return real(node, service, hints, result);
}

namespace arbiter::gateway::dds {
namespace {

// A service manager takes a gateway whose loop does not go round for one that hangs.
TEST(DdsNames, ANameServerThatIsSilentHoldsUpItsDomainAndNotTheLoop) {
  const test::OwnDomain number;
  const Read read = read_text(
      "<gateway kind='dds' interface='lo' domain='" + std::to_string(number.number()) +
      "' peers='silent.example'><out port='/Base:i' topic='T' type='B' size='4'/></gateway>");
  const std::vector<Mapping> mappings{read.mapping};
  const Bell bell;
  LatchedSamples latched;
  DdsMiddleware middleware(mappings, bell, latched);
  Account account(read.entry().outside(), "subscriber");
  Sender& sender = middleware.sender(read.mapping.gateways.front(), read.entry(), account);
  const auto send = [&] {
    return sender.send({reinterpret_cast<const std::byte*>(kZeros.data()), kZeros.size()});
  };
  middleware.start({}, {});
  middleware.tend();
  test::await([] {
    const std::lock_guard lock(name_server().mutex);
    return name_server().is_asked || name_server().given_up != 0;
  });
  {
    const std::lock_guard lock(name_server().mutex);
    EXPECT_EQ(name_server().given_up, 0) << "the loop has waited for it";
    EXPECT_EQ(send(), Sender::Result::kNotReady);
    name_server().answers = true;
    name_server().changed.notify_all();
  }
  // The loop looks when it rings: for the last time once the domain is joined.
  pollfd rings{bell.descriptor(), POLLIN, 0};
  do {
    ASSERT_EQ(::poll(&rings, 1, 30'000), 1);
    bell.silence();
    middleware.tend();
  } while (send() != Sender::Result::kSent);
}

}  // namespace
}  // namespace arbiter::gateway::dds
