// What a dry run advises, and what it says where the daemon does not know that question.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "tests/cli/arbiter_program.hpp"
#include "tests/support/daemon.hpp"

namespace arbiter::test {
namespace {

using testing::EndsWith;
using wire::MessageKind;

TEST(DryRun, AdvisesWhatConcernsTheSameInstance) {
  Daemon daemon;
  daemon.load("<behaviors timeout='1s'/>");
  {
    const ScopedVariable another("ARBITER_INSTANCE", "another");
    EXPECT_THAT(arbiter({"rollback", "--dry-run", "--instance", "test"}).out,
                EndsWith("dry run: arbiter rollback 1 --instance test puts that model in force\n"));
    EXPECT_THAT(arbiter({"reload", "--dry-run", "--instance", "test"}).out,
                EndsWith("dry run: arbiter reload --instance test puts the files in force\n"));
  }
  EXPECT_THAT(arbiter({"reload", "--dry-run"}).out,
              EndsWith("dry run: arbiter reload puts the files in force\n"));
}

// Answers one client's hello and its question; of a rollback it knows nothing, and tries a reload.
void be_an_older_daemon(const wire::Listener& listener) {
  const shm::FileDescriptor client(::accept(listener.socket.get(), nullptr, nullptr));
  const shm::FileDescriptor report(::memfd_create("report", MFD_CLOEXEC));
  const std::string_view text =
      R"({"ok": true, "has_errors": false, "findings": [], "text": "", "models": []})";
  ASSERT_EQ(::write(report.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  for (const auto kind : {MessageKind::kWelcome, MessageKind::kReport}) {
    wire::Received question;
    ASSERT_EQ(wire::receive_message(client.get(), question, true), wire::ReceiveResult::kReceived);
    wire::Message reply = RawClient::message(kind);
    reply.request = question.message.request;
    const int descriptor = kind == MessageKind::kReport ? report.get() : -1;
    ASSERT_EQ(wire::send_message(client.get(), reply, {descriptor, -1}), wire::SendResult::kSent);
  }
}

TEST(DryRun, ShowsNoReportOfAnOlderDaemonThatTriedAReload) {
  const TemporaryDirectory runtime;
  const ScopedVariable directory("XDG_RUNTIME_DIR", runtime.path());
  const ScopedVariable own("RUNTIME_DIRECTORY", std::nullopt);
  std::filesystem::create_directory(runtime.path() + "/arbiter");
  const auto listener = wire::listen_at(runtime.path() + "/arbiter", "older");
  const std::vector<std::string> command{"rollback", "--dry-run", "--instance", "older"};
  for (const bool json : {false, true}) {
    std::thread daemon([&] { be_an_older_daemon(listener); });
    auto words = command;
    if (json) words.emplace_back("--json");
    const auto result = arbiter(words);
    daemon.join();
    EXPECT_EQ(result.exit_code, 1);
    EXPECT_EQ(result.out, "");
    EXPECT_EQ(result.err,
              "arbiter: the daemon is older than this program, and cannot say what a rollback "
              "would do; nothing has changed\n");
  }
}

}  // namespace
}  // namespace arbiter::test
