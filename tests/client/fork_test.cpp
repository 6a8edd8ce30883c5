// Processes that a component forks, and that do not call exec: whatever they do, their parent's
// ports, and the one-writer rule, stand.
#include <dirent.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arbiter/arbiter.hpp>

#include "tests/client/component.hpp"
#include "tests/client/models.hpp"
#include "tests/client/samples.hpp"
#include "tests/support/await.hpp"
#include "tests/support/daemon.hpp"
#include "tests/support/error_of.hpp"

namespace arbiter::test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

// What a child said, on its standard error too, and how it ended: 0, or 128 and a signal's number.
struct Said {
  std::string words;
  std::string errors;
  int status = -1;
};

std::string read_all(int fd) {
  std::string text;
  char buffer[4096];
  for (ssize_t size = 0; (size = ::read(fd, buffer, sizeof buffer)) > 0;) {
    text.append(buffer, static_cast<std::size_t>(size));
  }
  return text;
}

pid_t plain_fork() { return ::fork(); }
// By the kernel alone: no handler of the C library runs.
pid_t bare_clone() { return static_cast<pid_t>(::syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0)); }

Said in_child(const std::function<std::string()>& act, pid_t (*make_child)() = plain_fork) {
  int words[2];
  int errors[2];
  if (::pipe(words) != 0 || ::pipe(errors) != 0) throw std::runtime_error("pipe");
  const pid_t child = make_child();
  if (child == 0) {
    ::alarm(30);  // one that hangs has failed
    ::dup2(errors[1], STDERR_FILENO);
    const std::string answer = act();
    const bool is_said =
        ::write(words[1], answer.data(), answer.size()) == static_cast<ssize_t>(answer.size());
    ::_exit(is_said ? 0 : 1);
  }
  ::close(words[1]);
  ::close(errors[1]);
  Said said{read_all(words[0]), read_all(errors[0]), -1};
  ::close(words[0]);
  ::close(errors[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  said.status = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return said;
}

std::size_t count_of(const std::string& part, const std::string& text) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

std::string in_words(const Outcome& outcome) {
  return std::to_string(outcome.delivered) + " " + std::to_string(outcome.discarded) + " " +
         std::to_string(outcome.refused);
}

// Two ports of this process, connected.
struct ConnectedPair {
  Daemon daemon{single_model()};
  std::optional<Node> node{std::in_place, "test"};
  std::optional<OutputPort<Number>> out{node->output_port<Number>("/out")};
  std::optional<InputPort<Number>> in{node->input_port<Number>("/in", {.max_held = 2})};

  void expect_that_all_stands() {
    EXPECT_EQ(out->publish(Number{77}).delivered, 1u);
    EXPECT_EQ(take_from(*in), 77);
    EXPECT_TRUE(daemon.source("/out")["open"]);
    Component rival("rival");
    EXPECT_THAT(rival.tell("output /out"), HasSubstr("/out is held by node \"test\""));
    EXPECT_THAT(rival.tell("input /in 8 1 0"), HasSubstr("/in is held by node \"test\""));
  }
  // As at the end of main().
  std::string destroy_all() {
    out.reset();
    in.reset();
    node.reset();
    return "destroyed";
  }
};

TEST(Fork, AChildThatDestroysPortsAndNodeLeavesItsParentsOpen) {
  ConnectedPair pair;
  for (auto* const make : {plain_fork, bare_clone}) {
    const Said child = in_child([&] { return pair.destroy_all(); }, make);
    EXPECT_EQ(child.words, "destroyed");
    EXPECT_EQ(child.status, 0) << child.errors;
    pair.expect_that_all_stands();
  }
}

TEST(Fork, AChildThatReturnsFromMainLeavesItsParentsPortsOpen) {
  Daemon daemon(single_model());
  Component parent("parent");
  ASSERT_EQ(parent.tell("output /out"), "open");
  ASSERT_EQ(parent.tell("input /in 8 1 0"), "open");
  EXPECT_EQ(parent.tell("fork return"), "ended 0");
  EXPECT_EQ(parent.tell("fork exit"), "ended 0");
  EXPECT_EQ(parent.tell("publish /out 5"), "1 0 0");
  EXPECT_EQ(parent.tell("take /in"), "5");
  Component rival("rival");
  EXPECT_THAT(rival.tell("output /out"), HasSubstr("is held by"));
}

TEST(Fork, WhatAChildPublishesArrivesNowhereAndItIsToldOnceForEachPort) {
  for (auto* const make : {plain_fork, bare_clone}) {
    ConnectedPair pair;
    const Said child = in_child(
        [&] {
          std::string answer = in_words(pair.out->publish(Number{1}));
          answer += ", " + in_words(pair.out->signal());
          pair.out->deactivate();
          return answer + ", " + (pair.out->loan() ? "a loan" : "no loan");
        },
        make);
    EXPECT_EQ(child.words, "0 0 0, 0 0 0, no loan");
    EXPECT_EQ(child.status, 0);
    EXPECT_EQ(count_of("\n", child.errors), 1u) << child.errors;
    EXPECT_THAT(child.errors, HasSubstr("arbiter: /out belongs to process " +
                                        std::to_string(::getpid()) + ", and this is process "));
    EXPECT_THAT(child.errors, HasSubstr("make a Node of its own after fork()"));
    EXPECT_TRUE(pair.in->idle()) << "nothing has arrived";
    EXPECT_EQ(pair.daemon.source("/out")["published"], 0);
  }
}

TEST(Fork, AChildsDeactivateEndsNothing) {
  ConnectedPair pair;
  pair.out->signal();
  EXPECT_EQ(in_child([&] { return pair.out->deactivate(), std::string("done"); }).words, "done");
  EXPECT_EQ(pair.in->winner(), "/out");
}

TEST(Fork, CallsThatMayThrowSayWhoseThePortIs) {
  for (auto* const make : {plain_fork, bare_clone}) {
    ConnectedPair pair;
    EXPECT_EQ(pair.out->publish(Number{1}).delivered, 1u);
    const std::vector<std::function<void()>> calls{
        [&] { static_cast<void>(pair.in->take()); },
        [&] { static_cast<void>(pair.in->wait_for(std::chrono::hours::max())); },
        [&] { static_cast<void>(pair.in->fd()); },
        [&] { static_cast<void>(pair.node->output_port<Number>("/other")); },
        [&] { static_cast<void>(pair.node->input_port<Number>("/other")); },
        [&] { pair.node->switch_model("model"); },
        [&] { pair.node->service(); },
    };
    for (const auto& call : calls) {
      const Said child = in_child([&] { return error_of(call); }, make);
      EXPECT_THAT(child.words, HasSubstr("belongs to process " + std::to_string(::getpid())));
      EXPECT_THAT(child.words, HasSubstr("make a Node of its own after fork()"));
      EXPECT_EQ(child.status, 0);
    }
    const Said child = in_child(
        [&] {
          return (pair.in->idle() && !pair.in->winner() ? "idle " : "commanded ") +
                 std::to_string(pair.node->service_fd()) + pair.in->name() + pair.out->name();
        },
        make);
    EXPECT_EQ(child.words, "idle -1/in/out") << "it is to stop what it drives";
    EXPECT_EQ(take_from(*pair.in), 1) << "nobody has taken it";
  }
}

TEST(Fork, WhatAComponentHeldAtTheForkItsChildMayReadAndDestroy) {
  ConnectedPair pair;
  pair.out->publish(Number{41});
  pair.out->publish(Number{42});
  auto held = pair.in->take();
  auto loan = pair.out->loan();
  ASSERT_TRUE(held && loan);
  (*loan)->value = 43;
  const Said child = in_child([&] {
    const auto value = (**held).value;
    (*loan)->value = 1000;
    std::string answer =
        std::to_string(value) + " " + in_words(pair.out->publish(std::move(*loan)));
    held.reset();
    loan.reset();
    return answer + " " + pair.destroy_all();
  });
  EXPECT_EQ(child.words, "41 0 0 0 destroyed");
  EXPECT_EQ(child.status, 0) << child.errors;
  EXPECT_EQ((**held).value, 41) << "still held";
  EXPECT_EQ(pair.out->publish(std::move(*loan)).delivered, 1u);
  EXPECT_EQ(take_from(*pair.in), 42);
  EXPECT_EQ(take_from(*pair.in), 43);
}

TEST(Fork, OfASampleThatIsHeldAChildAlsoKnowsWhereItBegan) {
  ConnectedPair pair;
  // Not the first slot's, whose number a child reads where it has no holds.
  for (std::uint64_t i = 1; i <= 3; ++i) {
    pair.out->publish(std::move(*pair.out->loan()), Time::max(), {7, i});
  }
  static_cast<void>(pair.in->take());
  const auto held = pair.in->take();
  ASSERT_TRUE(held);
  const auto origin = [&] {
    const auto [publisher, sequence] = held->origin();
    return std::to_string(publisher) + " " + std::to_string(sequence) + " " + held->source();
  };
  EXPECT_EQ(origin(), "7 2 /out");
  for (auto* const make : {plain_fork, bare_clone})
    EXPECT_EQ(in_child(origin, make).words, "7 2 /out");
}

TEST(Fork, AChildIsToldNothingOfATap) {
  ConnectedPair pair;
  Node watcher("watcher");
  auto tap = watcher.tap("/in", {.of = TapOf::input});
  await([&] { return !tap.latencies().buckets().empty(); });
  const Said child = in_child([&] {
    return std::to_string(tap.latencies().buckets().size()) + " " +
           error_of([&] { static_cast<void>(tap.take()); });
  });
  EXPECT_EQ(child.status, 0);
  EXPECT_THAT(child.words, HasSubstr("0 /in belongs to process "));
  EXPECT_THAT(child.errors, HasSubstr("/in belongs to process "));
}

TEST(Fork, AChildMayMakeANodeOfItsOwnAndSoMayItsChild) {
  Daemon daemon(override_model());
  Node node("test");
  auto in = node.input_port<Number>("/in");
  auto low = node.output_port<Number>("/low");
  const Said child = in_child([&] {
    Node own("child");
    auto high = own.output_port<Number>("/high");
    std::string answer = in_words(high.publish(Number{1})) + ", ";
    const Said grandchild = in_child([&] {
      std::string said = in_words(high.publish(Number{2})) + ", " + in_words(low.signal());
      Node third("grandchild");
      auto stop = third.output_port<Number>("/stop");
      return said + ", " + in_words(stop.signal());
    });
    answer += grandchild.words + ": " + std::to_string(count_of("\n", grandchild.errors));
    answer += ", " + in_words(high.publish(Number{3}));
    return answer;
  });
  EXPECT_EQ(child.words, "1 0 0, 0 0 0, 0 0 0, 0 0 0: 2, 0 1 0") << child.errors;
  EXPECT_EQ(child.status, 0);
  EXPECT_FALSE(in.take()) << "the grandchild has said stop";
}

// Names of files that a process has open or mapped.
std::set<std::string> segments_of(pid_t pid) {
  std::set<std::string> found;
  const std::string directory = "/proc/" + std::to_string(pid);
  std::ifstream maps(directory + "/maps");
  for (std::string line; std::getline(maps, line);) {
    if (const auto at = line.find("/memfd:arbiter"); at != std::string::npos) {
      found.insert("mapped " + line.substr(at));
    }
  }
  DIR* const listing = ::opendir((directory + "/fd").c_str());
  while (const dirent* const entry = ::readdir(listing)) {
    char name[256] = {};
    const std::string path = directory + "/fd/" + entry->d_name;
    if (::readlink(path.c_str(), name, sizeof name - 1) <= 0) continue;
    if (std::string(name).find("arbiter") != std::string::npos) found.insert(name);
  }
  ::closedir(listing);
  return found;
}

TEST(Fork, AChildThatLivesOnKeepsNoNameAndNoMemory) {
  Daemon daemon(single_model());
  Node node("test");
  auto in = node.input_port<Number>("/in", {.depth = 64});
  for (int generation = 0; generation < 3; ++generation) {
    Component parent("parent");
    ASSERT_EQ(parent.tell("output /out"), "open") << "free at once";
    EXPECT_EQ(parent.tell("publish /out " + std::to_string(generation)), "1 0 0");
    const pid_t child = std::stoi(parent.tell("fork pause"));
    EXPECT_FALSE(segments_of(parent.process().pid()).empty());
    EXPECT_EQ(segments_of(child), std::set<std::string>());
    parent.kill();
    EXPECT_EQ(::kill(child, SIGKILL), 0) << "it has lived on";
  }
  for (int i = 0; i < 3; ++i) EXPECT_EQ(take_from(in), i);
}

// It keeps the socket: what ends the conversation is not the closing of it.
TEST(Fork, ANodeThatIsDestroyedIsGoneThoughAChildHasItsSocket) {
  Daemon daemon(single_model());
  const auto clients = [&] { return daemon.status()["clients"].get<int>(); };
  const int before = clients();
  auto node = std::make_unique<Node>("test");
  const pid_t child = bare_clone();
  if (child == 0) {
    for (;;) ::pause();
  }
  EXPECT_EQ(clients(), before + 1);
  node.reset();
  await([&] { return clients() == before; });
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
}

TEST(Fork, WhileAllThreadsAreBusyChildrenNeitherHangNorHarm) {
  ConnectedPair pair;
  std::atomic<bool> ends{false};
  std::thread publisher([&] {
    while (!ends) pair.out->publish(Number{1});
  });
  std::thread receiver([&] {
    while (!ends) static_cast<void>(pair.in->take());
  });
  std::thread opener([&] {  // keeps the service thread, and its locks, in use
    while (!ends) static_cast<void>(pair.node->output_port<Number>("/other"));
  });
  for (int i = 0; i < 100; ++i) {
    const Said child = in_child([&] {
      pair.out->publish(Number{2});
      error_of([&] { static_cast<void>(pair.in->take()); });
      return pair.destroy_all();
    });
    ASSERT_EQ(child.words, "destroyed");
    ASSERT_EQ(child.status, 0);
  }
  ends = true;
  publisher.join();
  receiver.join();
  opener.join();
  while (pair.in->take()) {
  }
  const auto connection = pair.daemon.connection("/out", "/in");
  EXPECT_EQ(connection["accepted"], pair.daemon.source("/out")["published"]);
  EXPECT_EQ(connection["accepted"].get<int>(),
            connection["taken"].get<int>() + connection["overtaken"].get<int>());
  pair.expect_that_all_stands();
}

// system(), popen(), posix_spawn() and whatever else calls exec.
TEST(Fork, AProgramThatIsExecutedInheritsNothing) {
  ConnectedPair pair;
  EXPECT_GE(pair.in->fd(), 0);
  std::FILE* const listing = ::popen("ls -l /proc/self/fd && exec cat /proc/self/maps", "r");
  ASSERT_NE(listing, nullptr);
  const std::string text = read_all(::fileno(listing));
  EXPECT_EQ(::pclose(listing), 0);
  EXPECT_THAT(text, HasSubstr("-> pipe:"));
  for (const char* const kind : {"arbiter", "eventfd", "eventpoll", "timerfd"}) {
    EXPECT_THAT(text, Not(HasSubstr(kind)));
  }
  EXPECT_EQ(count_of("socket:", text), 0u) << text;
  pair.expect_that_all_stands();
}

}  // namespace
}  // namespace arbiter::test
