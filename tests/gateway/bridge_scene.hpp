// A gateway that drives a base, for navigation and a joystick: its middleware is played by the
// test.
#pragma once

#include <gtest/gtest.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/core/bridge.hpp"
#include "shm/file_descriptor.hpp"
#include "tests/gateway/foreign.hpp"
#include "tests/gateway/mapping_text.hpp"

namespace arbiter::gateway {

inline constexpr const char* kDriving =
    "<behaviors timeout='60s'>"
    "<behavior name='Drive'><config at='/Base/cmd:i'>/Nav/cmd:o</config></behavior>"
    "<behavior name='Steer'><config at='/Base/cmd:i'>/Joy/cmd:o</config>"
    "<inhibition>Drive</inhibition></behavior></behaviors>";

inline constexpr const char* kEntries =
    "<in topic='/nav' type='a/msg/B' port='/Nav/cmd:o' max_size='64'/>"
    "<in topic='/joy' type='a/msg/B' port='/Joy/cmd:o' max_size='64'/>"
    "<out port='/Base/cmd:i' topic='/base' type='a/msg/B' idle='zero' size='4'/>";

// As long as it takes, for a test has an end of its own.
template <class Condition>
void await(Condition condition) {
  while (!condition()) ::usleep(1000);
}

// Delivers what the test says, on the test's thread.
class PlayedMiddleware : public Middleware {
 public:
  Sender& sender(const Gateway&, const Entry&, Account&) override { return sender_; }
  void start(const std::vector<OpenIn>& ins, const std::vector<OpenOut>& outs) override {
    const std::lock_guard lock(mutex_);
    for (const OpenIn& in : ins) {
      const std::string& name = in.incoming.entry().ports().front()->name;
      ins_[name] = &in.incoming;
      accounts_[name] = &in.account;
    }
    for (const OpenOut& out : outs) accounts_[out.outgoing.entry().port->name] = &out.account;
    outs_ += outs.size();
  }
  void stop() noexcept override {
    if (const auto call = std::exchange(at_stop, {})) call();
  }
  // In each round of the loop.
  void tend() override {
    if (at_tend) at_tend();
    ++tends_;
  }

  [[nodiscard]] int tends() const { return tends_; }
  [[nodiscard]] std::vector<std::string> sent() {
    const std::lock_guard lock(mutex_);
    return sender_.sent;
  }
  // Whether this thread has sent something.
  [[nodiscard]] bool has_sent_here() {
    const std::lock_guard lock(mutex_);
    return sender_.senders.count(std::this_thread::get_id()) != 0;
  }
  [[nodiscard]] bool serves(const std::string& source) {
    const std::lock_guard lock(mutex_);
    return ins_.count(source) != 0;
  }
  [[nodiscard]] std::size_t outs() {
    const std::lock_guard lock(mutex_);
    return outs_;
  }
  [[nodiscard]] Account& account(const std::string& port) {
    const std::lock_guard lock(mutex_);
    return *accounts_.at(port);
  }
  [[nodiscard]] Incoming* in(const std::string& source) {
    const std::lock_guard lock(mutex_);
    return ins_.at(source);
  }
  Incoming::Fate deliver(const std::string& source, const std::string& bytes) {
    return in(source)->deliver(BytesSample(bytes), Time::max());
  }

  std::function<void()> at_stop{};  // once
  std::function<void()> at_tend{};  // on the loop's thread; set before that runs

 private:
  // On the loop's thread and the test's.
  class LockedSender : public Sender {
   public:
    explicit LockedSender(std::mutex& mutex) : mutex_(mutex) {}
    [[nodiscard]] Result send(Bytes sample) noexcept override {
      const std::lock_guard lock(mutex_);
      sent.emplace_back(reinterpret_cast<const char*>(sample.data()), sample.size());
      senders.insert(std::this_thread::get_id());
      return Result::kSent;
    }
    std::vector<std::string> sent;
    std::set<std::thread::id> senders;

   private:
    std::mutex& mutex_;
  };

  std::mutex mutex_;
  LockedSender sender_{mutex_};
  std::map<std::string, Incoming*> ins_;
  std::map<std::string, Account*> accounts_;  // by their ports
  std::size_t outs_ = 0;
  std::atomic<int> tends_{0};
};

// A gateway that runs.
class Running {
 public:
  explicit Running(const std::string& name = "gateway", const std::string& entries = kEntries,
                   std::function<void()> at_tend = {})
      : stop_(::eventfd(0, EFD_CLOEXEC)) {
    middleware.at_tend = std::move(at_tend);
    mappings_.push_back(read_dds(entries).mapping);
    bridge_.emplace(BridgeOptions{name, "", [this] { ++signs_; }}, mappings_, Kind::kDds, bell_,
                    middleware);
    thread_ = std::thread([this] { bridge_->run(stop_.get()); });
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;
  ~Running() {
    if (thread_.joinable()) end();
  }
  void end() {
    const std::uint64_t one = 1;
    EXPECT_EQ(::write(stop_.get(), &one, sizeof one), static_cast<ssize_t>(sizeof one));
    thread_.join();
  }

  // So many times it has asked for a port: a sign of life comes after each, and in each round.
  [[nodiscard]] int tries() const { return signs_ - middleware.tends(); }

  PlayedMiddleware middleware;

 private:
  std::atomic<int> signs_{0};
  shm::FileDescriptor stop_;
  Bell bell_;
  std::vector<Mapping> mappings_;
  std::optional<Bridge> bridge_;
  std::thread thread_;
};

}  // namespace arbiter::gateway
