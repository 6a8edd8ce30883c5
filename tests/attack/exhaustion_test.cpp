// What the kernel or the daemon counts for all together, used up by one.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <cstring>
#include <deque>
#include <string>

#include <arbiter/arbiter.hpp>

#include "tests/support/daemon.hpp"
#include "tests/support/other_user.hpp"
#include "tests/support/raw_port.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using wire::MessageKind;

// A child process of another user that does its part when it is told to, in two steps.
class Accomplice {
 public:
  // `prepare` returns what `act` needs.
  template <class Prepare, class Act>
  Accomplice(const User& user, Prepare prepare, Act act) {
    pid_ = ::fork();
    if (pid_ != 0) {
      ready_.close(1);
      go_.close(0);
      end_.close(0);
      return;
    }
    ready_.close(0);
    go_.close(1);
    end_.close(1);
    try {
      if (!become(user)) ::_exit(2);
      auto prepared = prepare();
      pass(ready_);
      wait(go_);
      act(prepared);
      pass(ready_);
      wait(end_);
    } catch (const std::exception&) {
      ::_exit(3);
    }
    ::_exit(0);
  }
  Accomplice(const Accomplice&) = delete;
  Accomplice& operator=(const Accomplice&) = delete;
  ~Accomplice() { end(); }

  // False: it has failed.
  bool is_ready() { return wait(ready_); }
  bool act() { return pass(go_) && is_ready(); }
  // It dies, with all that it has.
  void end() {
    if (pid_ <= 0) return;
    pass(end_);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
  }

 private:
  static bool pass(program_detail::Pipe& pipe) { return ::write(pipe.ends[1], "x", 1) == 1; }
  static bool wait(program_detail::Pipe& pipe) {
    char byte = 0;
    return ::read(pipe.ends[0], &byte, 1) == 1;
  }

  program_detail::Pipe ready_, go_, end_;
  pid_t pid_ = -1;
};

class Exhaustion : public testing::Test {
 protected:
  void SetUp() override {
    if (!may_be_another_user()) GTEST_SKIP() << "only root can start processes of other users";
  }
};

// By whomever the daemon is run.
RawClient connected_to(const std::string& path) {
  shm::FileDescriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    throw std::runtime_error("no daemon at " + path);
  }
  return RawClient(std::move(socket));
}

// Asks for descriptors and leaves them unread; then, until all that has been asked was handled.
void ask_and_not_read(std::deque<RawClient>& clients, const std::string& path) {
  constexpr int kClients = 10;
  constexpr int kRequests = 200;
  const auto hello = RawClient::hello_message("deaf");
  RawClient last = connected_to(path);
  for (int i = 0; i < kClients; ++i) {
    clients.push_back(connected_to(path));
    clients.back().send(hello);
    for (int j = 0; j < kRequests; ++j)
      clients.back().send(RawClient::message(MessageKind::kModel));
  }
  // Each of these is answered after one more turn of each of the others, of a message at least.
  for (int i = 0; i <= kRequests; ++i) {
    last.send(RawClient::message(MessageKind::kModel));
    last.expect_refusal();  // it has not said hello
  }
}

// The kernel does not count what a daemon with CAP_SYS_RESOURCE sends: this one is not root's.
TEST_F(Exhaustion, OfDescriptorsUnderWayLeavesOthersTheirs) {
  const std::string become_it = R"(chown 54321 "$XDG_RUNTIME_DIR"; chmod 755 "$XDG_RUNTIME_DIR"; )"
                                R"(chmod 666 "$NOTIFY_SOCKET"; exec setpriv --reuid=54321 )"
                                R"(--regid=54321 --clear-groups "$0" "$@")";
  Daemon daemon(kNoRules, {.without_model = true,
                           .max_descriptors = kFewDescriptors,
                           .by = {"/bin/sh", "-c", become_it}});
  std::deque<RawClient> clients;
  Accomplice deaf(
      kNobody, [] { return 0; }, [&](int) { ask_and_not_read(clients, daemon.socket_path()); });
  ASSERT_TRUE(deaf.is_ready());
  ASSERT_TRUE(deaf.act());
  EXPECT_EQ(as_user(kStranger,
                    [] {
                      Node node("modest");
                      auto port = node.output_port<int>("/modest:o");
                      return std::string("opened");
                    }),
            "opened");
}

// Links with ports that have never been, one after the other.
TEST(Claims, AreNoMoreThanTheShareOfTheirUser) {
  constexpr std::uint64_t kMost = 1'000'000;
  Daemon daemon;
  RawClient known(daemon.instance());
  const wire::Received welcome = known.hello("liar");
  RawClient liar(daemon.instance());
  liar.send(RawClient::hello_message("liar", wire::kRejoins),
            {welcome.descriptors[0].get(), welcome.descriptors[1].get()});
  liar.expect(MessageKind::kWelcome);
  const auto segment = raw_output_segment();
  auto claim = RawClient::message(MessageKind::kHandBackLink);
  claim.port = open_raw_output(liar, "/liar:o", segment).message.port;
  std::string refusal;
  for (claim.peer = 1000; claim.peer < kMost && refusal.empty(); ++claim.peer) {
    liar.send(claim);
    if (claim.peer % 1000 != 0) continue;
    liar.send(RawClient::message(MessageKind::kConnect));
    refusal = liar.expect_refusal();
    if (refusal == "the port is not open") refusal.clear();
  }
  EXPECT_THAT(refusal, HasSubstr("limit-exceeded: user"));
  EXPECT_THAT(refusal, HasSubstr("bytes of waiting messages"));
}

// A process that ends with all its nodes is forgotten node by node.
TEST_F(Exhaustion, OfTheDaemonsTimeByDyingLeavesOthersTheirTurns) {
  constexpr std::size_t kNodes = 100;
  Daemon daemon;
  ASSERT_EQ(::chmod(daemon.directory().c_str(), 0711), 0);
  std::deque<RawClient> clients;
  Accomplice dying(
      kStranger,
      [&] {
        for (std::size_t i = 0; i < kNodes; ++i) {
          clients.emplace_back(daemon.instance()).hello("dying");
        }
        return 0;
      },
      [](int) {});
  RawClient honest(daemon.instance());
  honest.hello("honest");
  ASSERT_TRUE(dying.is_ready());
  ASSERT_TRUE(dying.act());
  daemon.process().stop();
  dying.end();
  honest.send(RawClient::message(MessageKind::kStatus));
  daemon.process().resume();
  // Both have had one turn by now.
  EXPECT_GE(read_document(honest.expect(MessageKind::kStatusReply))["clients"], kNodes - 1);
}

}  // namespace
}  // namespace arbiter::test
