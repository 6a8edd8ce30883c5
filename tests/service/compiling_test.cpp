// The daemon serves while it compiles. A gate holds the compiler's thread, so that what is asked
// meanwhile is asked for certain while a change is prepared.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "service/daemon.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/raw_client.hpp"
#include "tests/support/temporary_directory.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;
using wire::MessageKind;

// Where the compiler's thread waits before it reads files.
class Gate {
 public:
  void wait(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    ++came_;
    changed_.notify_all();
    is_stopped_ = !changed_.wait(lock, stop, [this] { return is_open_; });
    changed_.notify_all();
    if (!error_.empty()) throw std::runtime_error(error_);
  }
  void open(const std::string& error = {}) {
    const std::lock_guard lock(mutex_);
    is_open_ = true;
    error_ = error;
    changed_.notify_all();
  }
  void close() {
    const std::lock_guard lock(mutex_);
    is_open_ = false;
    came_ = 0;
  }
  void await(int count = 1) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return came_ >= count; });
  }
  void await_stop() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return is_stopped_; });
  }
  int came() {
    const std::lock_guard lock(mutex_);
    return came_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable_any changed_;
  bool is_open_ = true;
  bool is_stopped_ = false;
  int came_ = 0;
  std::string error_;
};

class Compiling : public testing::Test {
 protected:
  Compiling()
      : runtime_("XDG_RUNTIME_DIR", files_.path()),
        own_("RUNTIME_DIRECTORY", std::nullopt),
        name_("ARBITER_INSTANCE", kInstance) {
    int ends[2];
    if (::pipe2(ends, O_CLOEXEC | O_NONBLOCK) != 0) throw std::runtime_error("no pipe");
    signals_.reset(ends[0]);
    signaller_.reset(ends[1]);
    files_.write("model.xml", model("/a"));
    options_.models = {{"one", {{files_.path() + "/model.xml"}, {}}}};
    options_.instance = kInstance;
    options_.directory = wire::daemon_directory();
    options_.stop_descriptor = signals_.get();
    options_.before_reading = [this](const std::stop_token& stop) { gate_.wait(stop); };
  }
  ~Compiling() override {
    gate_.open();
    if (!loop_.joinable()) return;
    signal(SIGTERM);
    loop_.join();
  }

  static std::string model(const std::string& source) {
    return "<behaviors><arbiter at=\"/in\"><select from=\"" + source + "\"/></arbiter></behaviors>";
  }
  // The gate is closed from then on.
  void start() {
    daemon_ = std::make_unique<service::Daemon>(options_);
    gate_.close();
    loop_ = std::thread([this] { daemon_->run(signals_.get()); });
  }
  void signal(int number) {
    signalfd_siginfo info{};
    info.ssi_signo = static_cast<std::uint32_t>(number);
    ASSERT_EQ(::write(signaller_.get(), &info, sizeof info), static_cast<ssize_t>(sizeof info));
  }
  static std::unique_ptr<RawClient> client(const std::string& name) {
    auto client = std::make_unique<RawClient>(kInstance);
    client->hello(name);
    return client;
  }
  static void ask_for_reload(RawClient& client, std::uint32_t flags = 0) {
    auto message = RawClient::message(MessageKind::kReload);
    message.flags = flags;
    client.send(message);
  }

  static constexpr const char* kInstance = "compiling";
  TemporaryDirectory files_;
  ScopedVariable runtime_, own_, name_;
  shm::FileDescriptor signals_, signaller_;
  Gate gate_;
  service::DaemonOptions options_;
  std::unique_ptr<service::Daemon> daemon_;
  std::thread loop_;
};

TEST_F(Compiling, OthersAreServedMeanwhile) {
  start();
  const auto asking = client("asking");
  ask_for_reload(*asking);
  gate_.await();
  const auto other = client("other");
  EXPECT_EQ(other->status()["model"]["generation"], 1);
  EXPECT_EQ(asking->status()["model"]["generation"], 1);
  gate_.open();
  EXPECT_EQ(asking->expect(MessageKind::kDone).message.value, 2u);
  EXPECT_EQ(other->status()["model"]["generation"], 2);
}

TEST_F(Compiling, OthersAreServedWhileADryRunIsPrepared) {
  start();
  const auto asking = client("asking");
  ask_for_reload(*asking, wire::kWantsReport | wire::kDryRun);
  gate_.await();
  EXPECT_EQ(client("other")->status()["model"]["generation"], 1);
  gate_.open();
  asking->expect(MessageKind::kReport);
}

// Nobody knows what the reload will make of the model's name, and whoever asks does not wait.
TEST_F(Compiling, ADryRunOfASwitchIsRefusedMeanwhileAtOnce) {
  start();
  const auto reloading = client("reloading");
  ask_for_reload(*reloading);
  gate_.await();
  const auto asking = client("asking");
  auto message = RawClient::message(MessageKind::kSwitch, "one");
  message.flags = wire::kDryRun;
  asking->send(message);
  EXPECT_EQ(asking->expect_refusal(), "another change of the model is under way");
  gate_.open();
  reloading->expect(MessageKind::kDone);
  asking->send(message);
  asking->expect(MessageKind::kDone);
}

TEST_F(Compiling, AStopEndsItAtOnce) {
  start();
  const auto asking = client("asking");
  ask_for_reload(*asking);
  gate_.await();
  client("stopping")->send(RawClient::message(MessageKind::kStop));
  loop_.join();
  daemon_.reset();  // would wait for ever if the job did not stop
  gate_.await_stop();
  EXPECT_TRUE(asking->is_hung_up_on());
}

TEST_F(Compiling, ASignalEndsItAtOnce) {
  start();
  const auto asking = client("asking");
  ask_for_reload(*asking);
  gate_.await();
  signal(SIGTERM);
  loop_.join();
  daemon_.reset();
  gate_.await_stop();
}

TEST_F(Compiling, ASignalEndsTheFirstModelToo) {
  gate_.close();
  signal(SIGTERM);
  EXPECT_THROW(service::Daemon daemon(options_), rules::Stopped);
  gate_.await_stop();
}

TEST_F(Compiling, AHangUpWhileTheFirstModelIsReadIsAReloadAfterIt) {
  gate_.close();
  signal(SIGHUP);
  std::thread opener([this] {
    gate_.await();
    gate_.open();
  });
  daemon_ = std::make_unique<service::Daemon>(options_);
  opener.join();
  loop_ = std::thread([this] { daemon_->run(signals_.get()); });
  gate_.await(2);
}

TEST_F(Compiling, AChangeThatIsAskedForMeanwhileComesAfterIt) {
  start();
  const auto first = client("first"), second = client("second"), third = client("third");
  ask_for_reload(*first);
  gate_.await();
  ask_for_reload(*second);
  ask_for_reload(*third);
  second->status();  // both have been heard
  third->status();
  EXPECT_EQ(gate_.came(), 1);
  files_.write("model.xml", model("/b"));
  gate_.open();
  EXPECT_EQ(first->expect(MessageKind::kDone).message.value, 2u);
  EXPECT_EQ(second->expect(MessageKind::kDone).message.value, 3u);
  EXPECT_EQ(third->expect(MessageKind::kDone).message.value, 3u);
  EXPECT_EQ(gate_.came(), 2);
}

TEST_F(Compiling, AReloadHappensThoughWhoAskedHasGone) {
  start();
  auto asking = client("asking");
  ask_for_reload(*asking);
  gate_.await();
  asking.reset();
  const auto other = client("other");
  gate_.open();
  ask_for_reload(*other);
  EXPECT_EQ(other->expect(MessageKind::kDone).message.value, 3u);
}

TEST_F(Compiling, ADryRunStopsWhenWhoAskedHasGone) {
  start();
  auto asking = client("asking");
  ask_for_reload(*asking, wire::kWantsReport | wire::kDryRun);
  gate_.await();
  asking.reset();
  gate_.await_stop();
  gate_.open();
  const auto other = client("other");
  ask_for_reload(*other);
  EXPECT_EQ(other->expect(MessageKind::kDone).message.value, 2u);
}

TEST_F(Compiling, WhatGoesWrongInItIsARefusalAndTheNextOneWorks) {
  start();
  const auto asking = client("asking");
  ask_for_reload(*asking);
  gate_.await();
  gate_.open("the disk has gone");
  EXPECT_THAT(asking->expect_refusal(), HasSubstr("the disk has gone"));
  gate_.open();
  ask_for_reload(*asking);
  EXPECT_EQ(asking->expect(MessageKind::kDone).message.value, 2u);
}

}  // namespace
}  // namespace arbiter::test
