// One question to the daemon, and what is said where it is not answered.
#include "wire/call.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/error_of.hpp"
#include "tests/watch/watched.hpp"
#include "wire/document.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

using std::chrono::milliseconds;
using testing::AllOf;
using testing::HasSubstr;
using wire::MessageKind;

wire::Message question(MessageKind kind) {
  wire::Message message;
  message.kind = kind;
  return message;
}

TEST(Call, BringsADocument) {
  Daemon daemon;
  wire::Call call(caller_of(daemon));
  const auto answer = call.ask(question(MessageKind::kStatus));
  EXPECT_EQ(wire::read_status(wire::read_document(answer.descriptors[0])).instance, "test");
}

TEST(Call, SaysWhatTheDaemonRefuses) {
  Daemon daemon;
  wire::Call call(caller_of(daemon));
  auto message = question(MessageKind::kSwitch);
  message.set_name("dance");
  EXPECT_THAT(error_of([&] { call.ask(message); }), HasSubstr("dance"));
}

TEST(Call, OfNoDaemonSaysWhichSocketsWereTriedAndWhichInstancesRun) {
  Daemon daemon;
  wire::Caller caller = caller_of(daemon);
  caller.instance = "another";
  caller.patience = milliseconds(1);
  EXPECT_THAT(error_of([&] { wire::Call call(caller); }),
              AllOf(HasSubstr("no arbiterd of instance \"another\" answered within 1 ms (tried "),
                    HasSubstr("another.sock: "), HasSubstr("arbiterd --model FILE --instance"),
                    HasSubstr("; these instances run: test")));
}

TEST(Call, OfADaemonThatIsStoppedSaysSo) {
  Daemon daemon;
  wire::Caller caller = caller_of(daemon);
  wire::Call before(caller);
  caller.answer_time = milliseconds(50);
  caller.patience = milliseconds(1);
  daemon.process().stop();
  const std::string who =
      "arbiterd (pid " + std::to_string(daemon.process().pid()) + ") of instance \"test\"";
  EXPECT_THAT(error_of([&] { wire::Call call(caller); }),
              AllOf(HasSubstr(who + " runs, but did not answer within "),
                    HasSubstr("nothing was asked of it: it is stopped; run: kill -CONT " +
                              std::to_string(daemon.process().pid()))));
  EXPECT_THAT(error_of([&] { before.ask(question(MessageKind::kStatus), milliseconds(50)); }),
              HasSubstr(who + " runs, but did not answer within "));
  daemon.process().signal(SIGCONT);
}

TEST(Call, SaysThatTheDaemonHasGone) {
  Daemon daemon;
  wire::Call call(caller_of(daemon));
  daemon.kill();
  EXPECT_EQ(error_of([&] { call.ask(question(MessageKind::kStatus)); }),
            "the daemon has gone without an answer");
}

TEST(Call, WaitsForADaemonThatIsNotThereYetAndSaysForWhom) {
  const TemporaryDirectory runtime;
  const ScopedVariable directory("XDG_RUNTIME_DIR", runtime.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  std::filesystem::create_directory(runtime.path() + "/arbiter");
  wire::Caller caller{.name = "early", .instance = "late"};
  caller.patience = std::chrono::hours(1);
  caller.quiet = milliseconds(1);
  std::vector<std::string> told;
  std::thread daemon;
  caller.on_waiting = [&](const std::string& whom) {
    told.push_back(whom);
    daemon = std::thread([&] {
      const auto listener = wire::listen_at(runtime.path() + "/arbiter", "late");
      const shm::FileDescriptor client(::accept(listener.socket.get(), nullptr, nullptr));
      wire::Received hello;
      ASSERT_EQ(wire::receive_message(client.get(), hello, true), wire::ReceiveResult::kReceived);
      EXPECT_EQ(hello.message.name_view(), "early");
      wire::Message refusal = question(MessageKind::kRefused);
      refusal.set_text("not you");
      ASSERT_EQ(wire::send_message(client.get(), refusal), wire::SendResult::kSent);
    });
  };
  EXPECT_EQ(error_of([&] { static_cast<void>(wire::join(caller)); }),
            "the daemon refuses: not you");
  daemon.join();
  EXPECT_THAT(told, testing::ElementsAre("an arbiterd of instance \"late\""));
}

}  // namespace
}  // namespace arbiter::test
