// How conversations with programs of this host end: link/local_socket.hpp.
#include "link/local_socket.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <future>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "tests/link/known_hosts.hpp"
#include "tests/link/scene.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/lingering.hpp"
#include "tests/support/temporary_directory.hpp"
#include "wire/errands.hpp"
#include "wire/hosts.hpp"
#include "wire/link_call.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

// Of this thread: there is no memory from now on.
thread_local bool is_out_of_memory = false;

}  // namespace
}  // namespace arbiter::test

void* operator new(std::size_t size) {
  void* const memory = arbiter::test::is_out_of_memory ? nullptr : std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }

namespace arbiter::test {
namespace {

// A program that goes on asking on one connection.
class Asker {
 public:
  Asker() {
    std::string why_not;
    auto socket = wire::connect_to_link("here", why_not);
    if (socket) socket_ = std::move(*socket);
    EXPECT_TRUE(socket_) << why_not;
  }
  void ask() const {
    const std::string question = wire::write_link_question({"", "hosts"});
    static_cast<void>(::send(socket_.get(), question.data(), question.size(), MSG_NOSIGNAL));
  }
  // False: it has hung up.
  [[nodiscard]] bool is_answered() const {
    std::string bytes(wire::kMaxLinkPacket, '\0');
    return ::recv(socket_.get(), bytes.data(), bytes.size(), 0) > 0;
  }

 private:
  shm::FileDescriptor socket_;
};

class LocalSocketOfALink : public testing::Test {
 protected:
  const TemporaryDirectory runtime_;
  const ScopedVariable directory_{"RUNTIME_DIRECTORY", runtime_.path()};
};

TEST_F(LocalSocketOfALink, EndsItsConversationsWhenItCloses) {
  link::LocalSocket socket(
      "here", [](const link::LocalUser&, const wire::LinkQuestion&) { return std::string("{}"); });
  const Asker asker;
  asker.ask();
  EXPECT_TRUE(asker.is_answered());
  socket.close();
  asker.ask();
  EXPECT_FALSE(asker.is_answered());
}

// Who knows that may say that nothing has happened.
TEST_F(LocalSocketOfALink, WhoeverAsksWhenItHasClosedKnowsThatNobodyWasAsked) {
  link::LocalSocket socket(
      "here", [](const link::LocalUser&, const wire::LinkQuestion&) { return std::string("{}"); });
  wire::LinkCall call("here");
  EXPECT_EQ(call.ask({"", "hosts"}), "{}");
  socket.close();
  EXPECT_THROW(static_cast<void>(call.ask({"", "hosts"})), wire::NotAskedError);
}

TEST_F(LocalSocketOfALink, SaysWhyItTurnsSomebodyAway) {
  link::LocalSocket socket(
      "here", [](const link::LocalUser&, const wire::LinkQuestion&) { return std::string("{}"); });
  std::vector<wire::LinkCall> calls;
  for (unsigned i = 0; i < link::LocalSocket::kMostOfUser; ++i) {
    EXPECT_EQ(calls.emplace_back("here").ask({"", "hosts"}), "{}");
  }
  wire::LinkCall one_more("here");
  EXPECT_EQ(error_of([&] {
              static_cast<void>(one_more.ask({"", "hosts"}));
            }),
            "too many programs ask the link at once");
}

// Of this process: the socket that listens at that path.
int listening_at(const std::string& path) {
  for (const auto& each : std::filesystem::directory_iterator("/proc/self/fd")) {
    const int descriptor = std::stoi(each.path().filename().string());
    sockaddr_un address{};
    socklen_t size = sizeof address;
    if (::getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size) == 0 &&
        address.sun_family == AF_UNIX && address.sun_path == path) {
      return descriptor;
    }
  }
  return -1;
}

// It would come back at once, and take the whole processor.
TEST_F(LocalSocketOfALink, SaysThatItCannotLetInWhoComes) {
  link::LocalSocket socket(
      "here", [](const link::LocalUser&, const wire::LinkQuestion&) { return std::string("{}"); });
  const int listening = listening_at(socket.path());
  ASSERT_GE(listening, 0);
  testing::internal::CaptureStderr();
  std::string said;
  ASSERT_EQ(::shutdown(listening, SHUT_RD), 0);  // accept() fails from now on
  await([&] {
    said += testing::internal::GetCapturedStderr();
    testing::internal::CaptureStderr();
    return said.find('\n') != std::string::npos;
  });
  socket.close();
  said += testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("a program that asks the link cannot be let in (accept: Invalid argument); "
                      "trying again"),
            std::string::npos)
      << said;
}

TEST_F(LocalSocketOfALink, HangsUpWhereItHasNoMemoryToSayWhy) {
  std::atomic<int> asked = 0;
  link::LocalSocket socket("here", [&](const link::LocalUser&, const wire::LinkQuestion&) {
    const std::runtime_error why("there is no memory for this answer");
    is_out_of_memory = asked++ == 0;
    if (is_out_of_memory) throw why;
    return std::string("{}");
  });
  const Asker asker;
  asker.ask();
  EXPECT_FALSE(asker.is_answered());
  const Asker another;
  another.ask();
  EXPECT_TRUE(another.is_answered());
}

TEST_F(LocalSocketOfALink, AnswersWhoHasAskedBeforeItCloses) {
  std::promise<void> asked;
  std::promise<void> closed;
  link::LocalSocket socket("here", [&](const link::LocalUser&, const wire::LinkQuestion&) {
    asked.set_value();
    closed.get_future().wait();
    return std::string("{}");
  });
  const Asker asker;
  asker.ask();
  asked.get_future().wait();
  socket.close();
  closed.set_value();
  EXPECT_TRUE(asker.is_answered());
  EXPECT_FALSE(asker.is_answered());
}

// Programs of this host send the link what takes for ever to close.
class LocalSocketAndWhatLingers : public LoopbackHosts {
 protected:
  // More than are let in: these keep their places. The link is the last to close what they send,
  // and has read none of it.
  LocalSocketAndWhatLingers() {
    std::optional<shm::FileDescriptor> first;  // once the link can be asked
    await([&] { return (first = connect()).has_value(); });
    base_.link().stop();
    for (Lingering& each : many_) {
      sent_.push_back(sent_.empty() ? std::move(*first) : connect().value());
      EXPECT_TRUE(
          try_to_send_with(sent_.back().get(), std::as_bytes(std::span("?")), {each.get()}));
      each.close();
    }
  }
  static std::optional<shm::FileDescriptor> connect() {
    std::string why_not;
    return wire::connect_to_link("base", why_not);
  }

  Host base_{"base", runtime_, kNoRules, network()};
  std::vector<Lingering> many_{link::LocalSocket::kMostOfUser + wire::Errands::kMaxLostOfAUser + 2};
  std::vector<shm::FileDescriptor> sent_;
};

TEST_F(LocalSocketAndWhatLingers, OthersAreHeardMeanwhile) {
  base_.link().resume();
  base_.see("4 of 4");
  std::string said(wire::kMaxLinkPacket, '\0');
  const auto one_more = connect().value();
  EXPECT_GT(::recv(one_more.get(), said.data(), said.size(), 0), 0);
  EXPECT_NE(said.find("too many programs"), std::string::npos);
  for (Lingering& each : many_) each.release();
  await_hosts("base", [](const auto& hosts) { return hosts.host == "base"; });
}

TEST_F(LocalSocketAndWhatLingers, TheLinkEndsMeanwhile) {
  base_.link().resume();
  base_.see("4 of 4");
  base_.link().signal(SIGTERM);
  EXPECT_EQ(base_.link().wait(), 0);
}

// Perhaps before it has let anybody in.
TEST_F(LocalSocketAndWhatLingers, TheLinkEndsBeforeItHasHeardThem) {
  base_.link().signal(SIGTERM);
  base_.link().resume();
  EXPECT_EQ(base_.link().wait(), 0);
}

}  // namespace
}  // namespace arbiter::test
