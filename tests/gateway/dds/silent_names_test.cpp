// A name server that does not answer, or answers later.
#include <dds/dds.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

#include <chrono>
#include <condition_variable>
#include <cstring>
#include <functional>
#include <mutex>
#include <string>
#include <vector>

#include "gateway/dds/dds_middleware.hpp"
#include "gateway/dds/entity.hpp"
#include "gateway/dds/opaque_type.hpp"
#include "tests/gateway/dds/own_domain.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"
#include "tests/support/await.hpp"

namespace {

constexpr const char* kSilent = "silent.example";
constexpr const char* kLater = "later.example";

struct Questions {
  int by_us = 0;
  int by_dds = 0;
};
struct NameServer {
  std::mutex mutex;
  std::condition_variable changed;
  bool is_asked = false;  // and has not answered
  bool answers = false;
  int given_up = 0;              // how often somebody has waited to the end
  std::string address_of_later;  // empty: it has none yet
  Questions about_later;
  bool may_join = true;  // or whoever joins a domain waits
};
NameServer& name_server() {
  static NameServer& one = *new NameServer;
  return one;
}

std::vector<std::string> configurations;  // of the domains that were joined

}  // namespace

// Called in place of Cyclone's.
extern "C" dds_entity_t dds_create_domain(dds_domainid_t domain, const char* configuration) {
  static const auto real =
      reinterpret_cast<decltype(&dds_create_domain)>(::dlsym(RTLD_NEXT, "dds_create_domain"));
  {
    std::unique_lock lock(name_server().mutex);
    configurations.emplace_back(configuration);
    name_server().changed.wait(lock, [] { return name_server().may_join; });
  }
  return real(domain, configuration);
}

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
  if (node != nullptr && std::strcmp(node, kLater) == 0) {
    const std::lock_guard lock(name_server().mutex);
    // Cyclone does not say for what kind of socket.
    Questions& asked = name_server().about_later;
    ++(hints != nullptr && hints->ai_socktype == SOCK_DGRAM ? asked.by_us : asked.by_dds);
    const std::string& address = name_server().address_of_later;
    return address.empty() ? EAI_AGAIN : real(address.c_str(), service, hints, result);
  }
  return real(node, service, hints, result);
}

namespace arbiter::gateway::dds {
namespace {

class DdsNames : public ::testing::Test {
 protected:
  void SetUp() override {
    name_server().answers = false;
    name_server().given_up = 0;
    name_server().address_of_later.clear();
    name_server().about_later = {};
    name_server().may_join = true;
    configurations.clear();
  }
  ~DdsNames() override { answer(); }

  static void answer() {
    const std::lock_guard lock(name_server().mutex);
    name_server().answers = true;
    name_server().changed.notify_all();
  }
  static void let_join(bool may) {
    const std::lock_guard lock(name_server().mutex);
    name_server().may_join = may;
    name_server().changed.notify_all();
  }
  static int given_up() {
    const std::lock_guard lock(name_server().mutex);
    return name_server().given_up;
  }
  static Questions questions() {
    const std::lock_guard lock(name_server().mutex);
    return name_server().about_later;
  }
  // As each domain was configured.
  static std::vector<std::string> joined() {
    const std::lock_guard lock(name_server().mutex);
    return configurations;
  }
  // How often we had asked before.
  static int give_address() {
    const std::lock_guard lock(name_server().mutex);
    name_server().address_of_later = "127.0.0.2";
    return name_server().about_later.by_us;
  }
  static void await_question() {
    test::await([] {
      const std::lock_guard lock(name_server().mutex);
      return name_server().is_asked || name_server().given_up != 0;
    });
  }
  static Sender::Result send(Sender& sender) {
    return sender.send({reinterpret_cast<const std::byte*>(kZeros.data()), kZeros.size()});
  }
  // The loop looks when it rings, until that can be sent.
  static void tend_until_sent(const Bell& bell, DdsMiddleware& middleware, Sender& sender) {
    pollfd rings{bell.descriptor(), POLLIN, 0};
    do {
      ASSERT_EQ(::poll(&rings, 1, 30'000), 1);
      bell.silence();
      middleware.tend();
    } while (send(sender) != Sender::Result::kSent);
  }
  static std::string gateway_of(const test::OwnDomain& domain, const std::string& port,
                                const std::string& attributes = "") {
    return "<gateway kind='dds' interface='lo' domain='" + std::to_string(domain.number()) + "' " +
           attributes + "><out port='" + port + "' topic='T' type='B' size='4'/></gateway>";
  }

  const Bell bell_;
  LatchedSamples latched_;
};

// A service manager takes a gateway whose loop does not go round for one that hangs.
TEST_F(DdsNames, ANameServerThatIsSilentHoldsUpItsDomainAndNotTheLoop) {
  const test::OwnDomain number;
  const Read read = read_text(gateway_of(number, "/Base:i", "peers='silent.example'"));
  const std::vector<Mapping> mappings{read.mapping};
  DdsMiddleware middleware(mappings, bell_, latched_);
  Account account(read.entry().outside(), "subscriber");
  Sender& sender = middleware.sender(read.mapping.gateways.front(), read.entry(), account);
  middleware.start({}, {});
  middleware.tend();
  await_question();
  EXPECT_EQ(given_up(), 0) << "the loop has waited for it";
  EXPECT_EQ(send(sender), Sender::Result::kNotReady);
  const shm::Nanoseconds before = middleware.tend_period();
  answer();
  tend_until_sent(bell_, middleware, sender);
  EXPECT_LT(before, middleware.tend_period()) << "to join is tried again soon";
}

// Cyclone joins one domain after the other.
TEST_F(DdsNames, ADomainThatHasNoNamesIsServedThoughTheNameServerOfAnotherIsSilent) {
  const test::OwnDomain one;
  const test::OwnDomain two;
  const bool is_one_first = one.number() < two.number();
  const Read read = read_text(
      "<gateways>" +
      gateway_of(is_one_first ? one : two, "/Head:i", "peers='127.0.0.1,silent.example'") +
      gateway_of(is_one_first ? two : one, "/Base:i", "peers='127.0.0.1'") + "</gateways>");
  ASSERT_EQ(read.mapping.gateways.size(), 2u);
  const std::vector<Mapping> mappings{read.mapping};
  DdsMiddleware middleware(mappings, bell_, latched_);
  const Gateway& named = mappings.front().gateways.front();
  const Gateway& other = mappings.front().gateways.back();
  Account account(named.entries.front().outside(), "subscriber");
  Account other_account(other.entries.front().outside(), "subscriber");
  Sender& of_named = middleware.sender(named, named.entries.front(), account);
  Sender& of_other = middleware.sender(other, other.entries.front(), other_account);
  middleware.start({}, {});
  bell_.ring();
  tend_until_sent(bell_, middleware, of_other);
  EXPECT_EQ(given_up(), 0) << "it has waited for the other";
  EXPECT_EQ(send(of_named), Sender::Result::kNotReady);
  answer();  // or its end would wait
}

// Somebody else's reader of that topic.
Entity reader_of_topic(const Entity& participant) {
  ddsi_sertype* type = make_opaque_type("B", false);
  const dds_entity_t topic =
      dds_create_topic_sertype(participant.get(), "T", &type, nullptr, nullptr, nullptr);
  return {dds_create_reader(participant.get(), topic, nullptr, nullptr), "a reader"};
}

// That is silence for all of its topics.
TEST_F(DdsNames, ADomainIsJoinedAgainForAnAddressThatComesLaterOnceSomebodyIsMissing) {
  const test::OwnDomain number;
  const Read read = read_text(gateway_of(number, "/Base:i", "peers='later.example'"));
  const std::vector<Mapping> mappings{read.mapping};
  DdsMiddleware middleware(mappings, bell_, latched_);
  Account account(read.entry().outside(), "subscriber");
  Sender& sender = middleware.sender(read.mapping.gateways.front(), read.entry(), account);
  middleware.start({}, {});
  bell_.ring();
  tend_until_sent(bell_, middleware, sender);
  const auto tend_until = [&](const std::function<bool()>& holds) {
    test::await([&] {
      middleware.tend();
      return holds();
    });
  };
  {
    const Entity participant(dds_create_participant(number.number(), nullptr, nullptr), "another");
    const Entity reader = reader_of_topic(participant);
    tend_until([&] { return account.state().find("1 subscriber matched") != std::string::npos; });
    const int before = give_address();
    tend_until([&] { return questions().by_us > before + 1; });  // the one before has been answered
    EXPECT_EQ(joined().size(), 1u);
    let_join(false);
  }
  tend_until([&] { return joined().size() == 2; });
  EXPECT_EQ(account.state().find("matched"), std::string::npos) << account.state();
  let_join(true);
  tend_until([&] { return send(sender) == Sender::Result::kSent; });
  tend_until([&] { return account.state().find("no subscriber matched") != std::string::npos; });
  EXPECT_NE(joined().back().find("127.0.0.2"), std::string::npos);
  EXPECT_EQ(questions().by_dds, 1) << "a name server may be silent again";
}

}  // namespace
}  // namespace arbiter::gateway::dds
