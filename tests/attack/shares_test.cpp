// Users who take all that they can get: something is left for the others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <deque>
#include <set>

#include <arbiter/arbiter.hpp>

#include "shm/bell.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using wire::MessageKind;

// Opens ports until that is refused: how many there were, and why there are no more.
std::string open_all_that_it_can(const std::string& instance, const std::string& prefix) {
  RawClient client(instance);
  client.hello("greedy");
  const auto segment = raw_output_segment();
  for (int i = 0;; ++i) {
    try {
      open_raw_output(client, prefix + std::to_string(i), segment);
    } catch (const std::exception& error) {
      return std::to_string(i) + " ports: " + error.what();
    }
  }
}

std::string open_one(const std::string& name) {
  Node node("modest");
  auto port = node.output_port<int>(name);
  return "opened";
}

class Greedy : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
    daemon_.emplace(kNoRules, Daemon::Options{.max_descriptors = kFewDescriptors});
    ASSERT_EQ(::chmod(daemon_->directory().c_str(), 0711), 0);
  }
  std::optional<Daemon> daemon_;
};

TEST_F(Greedy, UsersLeaveDescriptorsForTheOthers) {
  // He keeps what he has while the others come.
  const std::string said = as_user(kStranger, [&] {
    const std::string greedy = open_all_that_it_can(daemon_->instance(), "/greedy/");
    return greedy;
  });
  EXPECT_THAT(said, HasSubstr("limit-exceeded: user 54321 has "));
  EXPECT_THAT(said, HasSubstr("descriptors"));
  EXPECT_THAT(said, HasSubstr("close ports or nodes"));
}

TEST_F(Greedy, UsersDoNotShutOutOthers) {
  program_detail::Pipe full, go;
  const pid_t child = ::fork();
  if (child == 0) {
    if (!become(kStranger)) ::_exit(2);
    std::deque<RawClient> clients;
    const auto segment = raw_output_segment();
    int opened = 0;
    try {
      for (;;) {
        clients.emplace_back(daemon_->instance()).hello("greedy");
        open_raw_output(clients.back(), "/greedy/" + std::to_string(opened++), segment);
      }
    } catch (const std::exception&) {
    }
    char byte = 0;
    if (::write(full.ends[1], "x", 1) != 1 || ::read(go.ends[0], &byte, 1) != 1) ::_exit(3);
    ::_exit(opened > 10 ? 0 : 4);
  }
  char byte = 0;
  ASSERT_EQ(::read(full.ends[0], &byte, 1), 1);
  EXPECT_EQ(as_user(kNobody, [] { return open_one("/modest:o"); }), "opened");
  EXPECT_EQ(as_user({12345}, [] { return open_one("/modest:o"); }), "opened");
  EXPECT_EQ(open_one("/roots:o"), "opened");
  ASSERT_EQ(::write(go.ends[1], "x", 1), 1);
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

// Opening and closing: what no model names and nobody has open any more is given back.
TEST(NamesThatNobodyNeeds, AreGivenBack) {
  Daemon daemon(kNoRules, {.max_descriptors = 1024});
  RawClient client(daemon.instance());
  client.hello();
  const auto segment = raw_output_segment();
  const std::size_t before = daemon.open_descriptors();
  for (int i = 0; i < 2000; ++i) {
    const auto opened = open_raw_output(client, "/once/" + std::to_string(i), segment);
    close_raw(client, opened.message.port);
  }
  client.status();
  await([&] { return daemon.open_descriptors() <= before + 8; });  // a thread closes what it was
  EXPECT_EQ(open_one("/another:o"), "opened");
}

TEST(NamesThatNobodyNeeds, AreKeptWhileTheirActivityRuns) {
  Daemon daemon(
      "<behaviors timeout='forever'><arbiter at='/in'><select from='/out'/></arbiter></behaviors>");
  RawClient operator_of(daemon.instance());
  operator_of.hello();
  {
    Node node("test");
    auto port = node.output_port<int>("/unmentioned:o");
    port.signal();
  }
  { Node node("other"); }
  auto ask = RawClient::message(MessageKind::kDeactivate, "/unmentioned:o");
  operator_of.send(ask);
  EXPECT_EQ(operator_of.expect(MessageKind::kDone).message.value, 1u);
  operator_of.status();  // made at the end of a round, after names have been given back
  operator_of.send(ask);
  EXPECT_THAT(operator_of.expect_refusal(), HasSubstr("no model and no component has named"));
}

// An observer that does not read is told nothing more, and costs nothing more.
TEST(DeafObservers, CostNothing) {
  Daemon daemon;
  std::deque<RawClient> deaf;
  for (int i = 0; i < 30; ++i) {
    deaf.emplace_back(daemon.instance());
    deaf.back().hello("deaf");
    deaf.back().send(RawClient::message(MessageKind::kObserve));
  }
  RawClient client(daemon.instance());
  client.hello();
  const auto segment = raw_output_segment();
  const std::size_t before = daemon.open_descriptors();
  constexpr std::size_t kNames = 700;
  for (std::size_t i = 0; i < kNames; ++i) {
    open_raw_output(client, "/many/" + std::to_string(i), segment);
  }
  client.status();
  // Three for each name, and what waits for each observer.
  EXPECT_LE(daemon.open_descriptors(), before + 3 * kNames + 2 * deaf.size());
  // Once it reads it hears of each.
  std::set<std::string> heard;
  while (heard.size() < kNames) {
    wire::Received received;
    ASSERT_TRUE(deaf.front().receive(received));
    if (received.message.kind == MessageKind::kSourcePage) {
      heard.emplace(received.message.name_view());
    }
  }
}

// However many ask for a status document at one time, one is made for all.
TEST(StatusDocuments, AreSharedByThoseWhoAskTogether) {
  Daemon daemon;
  std::vector<std::optional<OutputPort<int>>> ports;
  Node node("test");
  for (int i = 0; i < 50; ++i) ports.emplace_back(node.output_port<int>("/o" + std::to_string(i)));
  std::deque<RawClient> asking;
  for (int i = 0; i < 64; ++i) {
    asking.emplace_back(daemon.instance());
    asking.back().hello("asking");
  }
  daemon.process().stop();
  for (RawClient& client : asking) client.send(RawClient::message(MessageKind::kStatus));
  daemon.process().signal(SIGCONT);
  std::set<ino_t> documents;
  for (RawClient& client : asking) {
    const wire::Received reply = client.expect(MessageKind::kStatusReply);
    struct stat status {};
    ASSERT_EQ(::fstat(reply.descriptors[0].get(), &status), 0);
    documents.insert(status.st_ino);
  }
  EXPECT_LT(documents.size(), asking.size() / 2);
}

TEST(StatusDocuments, AreNotMadeForThoseWhoDoNotRead) {
  Daemon daemon;
  RawClient deaf(daemon.instance());
  deaf.hello("deaf");
  for (int i = 0; i < 65; ++i) deaf.send(RawClient::message(MessageKind::kStatus));
  RawClient other(daemon.instance());
  other.hello("other");
  other.status();
}

}  // namespace
}  // namespace arbiter::test
