// twist_mux's own decisions, by a small model of it that knows nothing of the import, beside those
// of the model that is imported: random parameters, random messages, and times at which a message
// is exactly as old as a timeout.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <tuple>

#include "tests/importing/imported.hpp"
#include "tests/importing/random_messages.hpp"

namespace arbiter::test {
namespace {

using shm::Nanoseconds;

// What twist_mux keeps for a topic or a lock. Its time of the last message begins at 0, which is
// decades ago: the message that never came is too old, if there is a timeout.
struct Handle {
  std::string name, topic;
  Nanoseconds timeout = 0;
  std::string timeout_written;
  int priority_written = 0;
  bool has_message = false;
  Nanoseconds stamp = 0;
  bool data = false;

  [[nodiscard]] int priority() const { return std::min(std::max(priority_written, 0), 255); }
  [[nodiscard]] bool has_expired(Nanoseconds now) const {
    return timeout > 0 && (!has_message || now - stamp > timeout);
  }
};

class TwistMux {
 public:
  // In the order in which it has them.
  TwistMux(std::vector<Handle> topics, std::vector<Handle> locks)
      : topics_(std::move(topics)), locks_(std::move(locks)) {}

  bool receive(std::size_t topic, Nanoseconds now) {
    topics_[topic].has_message = true;
    topics_[topic].stamp = now;
    return winner(now) == static_cast<int>(topic);
  }
  void receive_lock(std::size_t lock, bool data, Nanoseconds now) {
    locks_[lock].has_message = true;
    locks_[lock].stamp = now;
    locks_[lock].data = data;
  }

  [[nodiscard]] const std::vector<Handle>& topics() const { return topics_; }
  [[nodiscard]] const std::vector<Handle>& locks() const { return locks_; }

 private:
  [[nodiscard]] int winner(Nanoseconds now) const {
    int locked = 0;
    for (const Handle& lock : locks_) {
      if (lock.has_expired(now) || lock.data) locked = std::max(locked, lock.priority());
    }
    int highest = 0;
    int found = -1;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      const Handle& topic = topics_[i];
      if (topic.has_expired(now) || topic.priority() < locked) continue;
      if (topic.priority() > highest) {
        highest = topic.priority();
        found = static_cast<int>(i);
      }
    }
    return found;
  }

  std::vector<Handle> topics_, locks_;
};

std::vector<Handle> random_handles(Random& random, const std::string& prefix, int least, int most) {
  static const std::vector<std::string> kNames{"a",   "a-b", "a.b", "ab", "B",
                                               "joy", "nav", "z_1", "0"};
  static const std::vector<int> kPriorities{0, 1, 2, 2, 5, 10, 10, 100, 254, 255, 256, 1000, -7};
  static const std::vector<std::pair<std::string, Nanoseconds>> kTimeouts{
      {"0.1", 100'000'000}, {"0.25", 250'000'000},  {"0.3", 300'000'000},
      {"0.5", 500'000'000}, {"1.0", 1'000'000'000}, {"0.000000001", 1}};
  static const std::vector<std::pair<std::string, Nanoseconds>> kNone{{"0.0", 0},
                                                                      {"-1.0", -1'000'000'000}};
  const auto names = random.shuffled(kNames);
  std::vector<Handle> result;
  for (int count = least + random.pick(most - least + 1); count > 0; --count) {
    Handle handle;
    handle.name = names[static_cast<std::size_t>(count - 1)];
    handle.topic = "/" + prefix + std::to_string(count);
    handle.priority_written = random.any_of(kPriorities);
    // Mostly timed: an untimed one ends the list of those that can get through.
    std::tie(handle.timeout_written, handle.timeout) =
        random.any_of(random.pick(8) == 0 ? kNone : kTimeouts);
    result.push_back(handle);
  }
  return result;
}

void write_ros1(std::ostream& out, const char* list, const std::vector<Handle>& handles) {
  if (handles.empty()) return;
  out << list << ":\n";
  for (const Handle& each : handles) {
    out << "- name: '" << each.name << "'\n  topic: " << each.topic.substr(1)
        << "\n  timeout: " << each.timeout_written << "\n  priority: " << each.priority_written
        << "\n";
  }
}

void write_ros2(std::ostream& out, const char* list, const std::vector<Handle>& handles) {
  if (handles.empty()) return;
  out << "    " << list << ":\n";
  for (const Handle& each : handles) {
    out << "      '" << each.name << "': {priority: " << each.priority_written
        << ", topic: " << each.topic << ", timeout: " << each.timeout_written << "}\n";
  }
}

// As rclcpp keeps them: a map of all parameters by their whole names.
std::vector<Handle> in_order_of_ros2(const std::vector<Handle>& handles) {
  std::map<std::string, Handle> parameters;
  for (const Handle& each : handles) {
    for (const char* last : {"topic", "timeout", "priority"}) {
      parameters["topics." + each.name + "." + last] = each;
    }
  }
  std::vector<Handle> result;
  for (const auto& parameter : parameters) {
    const Handle& handle = parameter.second;
    const auto is_it = [&](const Handle& other) { return other.name == handle.name; };
    if (std::none_of(result.begin(), result.end(), is_it)) result.push_back(handle);
  }
  return result;
}

std::vector<Nanoseconds> ends_of(const TwistMux& mux) {
  std::vector<Nanoseconds> ends;
  for (const auto* handles : {&mux.topics(), &mux.locks()}) {
    for (const Handle& each : *handles) {
      if (each.has_message && each.timeout > 0) ends.push_back(each.stamp + each.timeout);
    }
  }
  return ends;
}

struct TwistMuxCount {
  int delivered = 0, discarded = 0, without_any = 0;
};

void compare_twist_muxes(unsigned seed, TwistMuxCount& count) {
  Random random(seed);
  auto topics = random_handles(random, "topic", 1, 6);
  auto locks = random_handles(random, "lock", 0, 4);
  const bool is_ros2 = random.pick(2) == 0;
  std::ostringstream yaml;
  if (is_ros2) {
    yaml << "twist_mux:\n  ros__parameters:\n";
    write_ros2(yaml, "topics", topics);
    write_ros2(yaml, "locks", locks);
    topics = in_order_of_ros2(topics);
    locks = in_order_of_ros2(locks);
  } else {
    write_ros1(yaml, "topics", topics);
    write_ros1(yaml, "locks", locks);
  }
  SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + yaml.str());
  TwistMux mux(topics, locks);
  const auto imported = import_texts(Program::kTwistMux, {yaml.str()});
  if (!imported.plan) {
    ++count.without_any;
    EXPECT_EQ(imported.message("nothing-to-import"),
              "none of the topics can ever get through; give one a priority above 0");
    EXPECT_TRUE(std::all_of(topics.begin(), topics.end(),
                            [](const Handle& each) { return each.priority() == 0; }));
    return;
  }
  ImportedRobot robot(*imported.plan);
  Nanoseconds now = 1'000'000'000;
  for (int i = 0; i < 60; ++i) {
    now = random.next_time(now, ends_of(mux));
    if (!locks.empty() && random.pick(3) == 0) {
      const auto lock = static_cast<std::size_t>(random.pick(static_cast<int>(locks.size())));
      const bool pressed = random.pick(3) == 0;
      mux.receive_lock(lock, pressed, now);
      robot.receives_lock(locks[lock].topic, pressed, now);
      continue;
    }
    const auto topic = static_cast<std::size_t>(random.pick(static_cast<int>(topics.size())));
    const bool expected = mux.receive(topic, now);
    ++(expected ? count.delivered : count.discarded);
    ASSERT_EQ(robot.receives(topics[topic].topic, now), expected)
        << topics[topic].name << " at " << now << ", message " << i << "\n"
        << importing::write_model(*imported.plan);
  }
}

TEST(RandomTwistMux, DecidesAsItsImport) {
  TwistMuxCount count;
  for (unsigned seed = 0; seed < 3000 && !HasFailure(); ++seed) compare_twist_muxes(seed, count);
  EXPECT_GE(count.delivered, 20'000);
  EXPECT_GE(count.discarded, 20'000);
  EXPECT_GE(count.without_any, 10);
}

}  // namespace
}  // namespace arbiter::test
