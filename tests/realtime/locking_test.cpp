// Memory is locked on request (NodeOptions::lock_memory), all of it that is used and no more; and
// where the limit is too small, whoever asks is told which.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"
#include "tests/support/hear_all.hpp"

namespace arbiter::test {
namespace {

using testing::HasSubstr;

// What /proc/self/smaps says of our mappings of the instance's memory.
struct Mapped {
  std::string name;
  bool is_locked = false;
  long resident_kib = 0;
};

std::vector<Mapped> mapped() {
  std::vector<Mapped> result;
  std::ifstream maps("/proc/self/smaps");
  bool is_ours = false;
  for (std::string line; std::getline(maps, line);) {
    std::istringstream words(line);
    std::string key;
    words >> key;
    if (key.back() != ':') {
      const auto name = line.find("/memfd:arbiter-");
      is_ours = name != std::string::npos;
      if (is_ours) result.push_back({line.substr(name + 7), false, 0});
    } else if (is_ours && key == "Rss:") {
      words >> result.back().resident_kib;
    } else if (is_ours && key == "VmFlags:") {
      for (std::string flag; words >> flag;) result.back().is_locked |= flag == "lo";
    }
  }
  return result;
}

long locked_kib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.rfind("VmLck:", 0) == 0) return std::stol(line.substr(6));
  }
  return -1;
}

NodeOptions locked() {
  NodeOptions options;
  options.lock_memory = true;
  return options;
}

// The limit, for this thread and those that it starts, and without the capability that lifts it.
class ScopedLimit {
 public:
  explicit ScopedLimit(rlim_t bytes) {
    ::getrlimit(RLIMIT_MEMLOCK, &limit_);
    set_limit({bytes, limit_.rlim_max});
    ::syscall(SYS_capget, &header_, capabilities_);
    __user_cap_data_struct fewer[2]{capabilities_[0], capabilities_[1]};
    fewer[0].effective &= ~(1u << CAP_IPC_LOCK);
    ::syscall(SYS_capset, &header_, fewer);
  }
  ~ScopedLimit() {
    ::syscall(SYS_capset, &header_, capabilities_);
    set_limit(limit_);
  }
  ScopedLimit(const ScopedLimit&) = delete;
  ScopedLimit& operator=(const ScopedLimit&) = delete;

 private:
  static void set_limit(const rlimit& limit) {
    if (::setrlimit(RLIMIT_MEMLOCK, &limit) != 0) throw std::runtime_error("setrlimit");
  }
  rlimit limit_{};
  __user_cap_header_struct header_{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct capabilities_[2]{};
};

TEST(Locking, NothingIsLockedUnlessItIsAskedFor) {
  Daemon daemon(override_model());
  Node node("test");
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  ASSERT_FALSE(mapped().empty());
  for (const Mapped& each : mapped()) EXPECT_FALSE(each.is_locked) << each.name;
}

TEST(Locking, AllThatANodeUsesIsLocked) {
  Daemon daemon(override_model());
  Node sender("sender", locked());
  Node receiver("receiver", locked());
  auto low = sender.output_port<Number>("/low");
  auto in = receiver.input_port<Number>("/in");
  auto high = sender.output_port<Number>("/high");
  hear_all(receiver);
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(low.publish(Number{i}).delivered, 1u);
    EXPECT_TRUE(in.take());
  }
  std::map<std::string, long> resident_kib;
  for (const Mapped& each : mapped()) {
    EXPECT_EQ(each.is_locked, each.resident_kib != 0) << each.name;
    resident_kib[each.name.substr(0, each.name.find(' '))] += each.resident_kib;
  }
  // Two nodes: boards with a table of one page; three pages; two output ports, one input port, with
  // their peers.
  EXPECT_EQ(resident_kib["arbiter-board"], 2 * 8);
  EXPECT_GE(resident_kib["arbiter-activity"], 2 * 3 * 4);
  EXPECT_EQ(resident_kib["arbiter-input"], 36 + 2 * 36);
  EXPECT_GE(resident_kib["arbiter-output"], 2 * 2 * (4 + 4 + 8 + 4 + 4));
}

TEST(Locking, WhatTapsUseIsLockedToo) {
  Daemon daemon(single_model());
  Node sender("sender", locked());
  Node watcher("watcher", locked());
  auto out = sender.output_port<Number>("/out");
  auto in = sender.input_port<Number>("/in");
  auto tap = watcher.tap<Number>("/out");
  auto tap_of_input = watcher.tap<Number>("/in", {.of = TapOf::input});
  hear_all(sender);
  for (int i = 0; i < 100; ++i) out.publish(Number{i});
  EXPECT_TRUE(tap.take());
  EXPECT_TRUE(tap_of_input.take());
  std::map<std::string, int> mappings;
  for (const Mapped& each : mapped()) {
    EXPECT_EQ(each.is_locked, each.resident_kib != 0) << each.name;
    ++mappings[each.name.substr(0, each.name.find(' '))];
  }
  EXPECT_EQ(mappings["arbiter-events"], 3) << "the port's, and for each tap one";
  EXPECT_EQ(mappings["arbiter-tap"], 4);
  EXPECT_EQ(mappings["arbiter-input"], 3);
}

// An output port reserves what it may ever need: of that nothing is taken up before it is needed.
TEST(Locking, WhatIsOnlyReservedIsNotLocked) {
  Daemon daemon(single_model());
  const long before = locked_kib();
  Node sender("sender", locked());
  Node receiver("receiver", locked());
  auto out = sender.output_port<std::array<char, 100'000>>("/out");
  auto in = receiver.input_port<std::array<char, 100'000>>("/in", {.depth = 1});
  EXPECT_LT(locked_kib() - before, 2000) << "of two mappings of 1 GiB";
}

TEST(Locking, MemoryOfANewModelIsLocked) {
  Daemon daemon(override_model());
  Node node("test", locked());
  auto low = node.output_port<Number>("/low");
  auto in = node.input_port<Number>("/in");
  auto other = node.output_port<Number>("/other");
  daemon.load(rules(arbiter_at("/in", select("/low", "not /other and not /fourth"))));
  hear_all(node);
  EXPECT_EQ(low.publish(Number{1}).delivered, 1u);
  EXPECT_TRUE(in.take());
  for (const Mapped& each : mapped()) {
    EXPECT_EQ(each.is_locked, each.resident_kib != 0) << each.name;
  }
}

TEST(Locking, ANodeThatMayNotLockIsToldTheLimit) {
  Daemon daemon(override_model());
  const ScopedLimit limit(4096);
  const std::string error = error_of([] { Node("test", locked()); });
  EXPECT_THAT(error, HasSubstr("may lock 4 KiB (RLIMIT_MEMLOCK)"));
  EXPECT_THAT(error, HasSubstr("LimitMEMLOCK="));
}

// The kernel would lock all that is reserved; its own word for it is "try again".
TEST(Locking, AProcessThatLocksAllItMapsIsToldTheLimit) {
  Daemon daemon(single_model());
  const ScopedLimit limit(256 * 1024);
  ASSERT_EQ(::mlockall(MCL_FUTURE | MCL_ONFAULT), 0);
  const std::string error = error_of([] { Node("test"); });
  ::munlockall();
  EXPECT_THAT(error, HasSubstr("mapping 1"));
  EXPECT_THAT(error, HasSubstr("all of which would be locked (mlockall with MCL_FUTURE): a process "
                               "of this user may lock 256 KiB (RLIMIT_MEMLOCK) in all; raise it"));
  EXPECT_THAT(error, HasSubstr("or leave MCL_FUTURE out"));
}

TEST(Locking, APortThatMayNotLockIsToldTheLimitAndLeavesNothingBehind) {
  Daemon daemon(single_model());
  const ScopedLimit limit(256 * 1024);
  Node node("test", locked());
  const std::string error = error_of([&] { auto out = node.output_port<Image>("/out"); });
  EXPECT_THAT(error, HasSubstr("/out: locking 12288 KiB"));
  EXPECT_THAT(error, HasSubstr("may lock 256 KiB (RLIMIT_MEMLOCK)"));
  auto out = node.output_port<Number>("/out");
  auto in = node.input_port<Number>("/in");
  EXPECT_EQ(out.publish(Number{1}).delivered, 1u);
}

// What counts is all that a port needs, and an input port needs its publishers' memory.
TEST(Locking, APortWhosePeersCannotBeLockedIsToldTheLimitAndLeavesNothingBehind) {
  Daemon daemon(single_model());
  Node sender("sender");
  auto out = sender.output_port<Image>("/out");
  const ScopedLimit limit(256 * 1024);
  Node receiver("receiver", locked());
  const std::string error = error_of([&] { auto in = receiver.input_port<Image>("/in"); });
  EXPECT_THAT(error, HasSubstr("may lock 256 KiB (RLIMIT_MEMLOCK)"));
  Node unlocked("unlocked");
  auto in = unlocked.input_port<Image>("/in");
  hear_all(sender);
  EXPECT_EQ(out.publish(std::move(*out.loan())).delivered, 1u);
}

// A component that runs is not disturbed by one that comes with more than it can lock.
TEST(Locking, APeerThatComesLaterAndCannotBeLockedIsRefused) {
  Daemon daemon(fan_out_model(2));
  const ScopedLimit limit(1024 * 1024);
  Node sender("sender", locked());
  auto out = sender.output_port<std::array<char, 100'000>>("/out");
  Node other("other");
  auto first = other.input_port<std::array<char, 100'000>>("/in0", {.depth = 2});
  auto second = other.input_port<std::array<char, 100'000>>("/in1", {.depth = 16});
  hear_all(sender);
  EXPECT_EQ(out.publish({}).delivered, 1u);
  EXPECT_TRUE(first.take());
  EXPECT_THAT(daemon.connection("/out", "/in1")["mismatch"].get<std::string>(),
              HasSubstr("RLIMIT_MEMLOCK"));
  // It is not held against other ports.
  auto again = sender.output_port<Number>("/again");
}

}  // namespace
}  // namespace arbiter::test
