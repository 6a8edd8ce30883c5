// cmd_vel_mux's own decisions, by a small model of it, beside those of the imported model. They
// differ where an input waits for one above it that has lost the mux, and among inputs of equal
// priority, which yocs' takes and kobuki's refuses. The import reports both; the test says exactly
// when.
#include <gtest/gtest.h>

#include <set>
#include <sstream>
#include <tuple>

#include "tests/importing/imported.hpp"
#include "tests/importing/random_messages.hpp"

namespace arbiter::test {
namespace {

using shm::Nanoseconds;

struct Input {
  std::string topic;
  Nanoseconds timeout = 0;
  std::string timeout_written;
  int priority = 0;
  bool has_message = false;
  Nanoseconds stamp = 0;

  [[nodiscard]] bool is_active(Nanoseconds now) const {
    return has_message && now - stamp < timeout;
  }
};

class CmdVelMux {
 public:
  explicit CmdVelMux(std::vector<Input> inputs) : inputs_(std::move(inputs)) {}

  bool receive(std::size_t input, Nanoseconds now) {
    if (owner_ >= 0 && !at(owner_).is_active(now)) owner_ = -1;  // its timer has fired
    inputs_[input].has_message = true;
    inputs_[input].stamp = now;
    const int it = static_cast<int>(input);
    if (owner_ >= 0 && owner_ != it && inputs_[input].priority <= at(owner_).priority) return false;
    owner_ = it;
    return true;
  }

  [[nodiscard]] const std::vector<Input>& inputs() const { return inputs_; }
  // For the imported model the first of equals is above the others.
  [[nodiscard]] bool has_active_above(std::size_t input, Nanoseconds now) const {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      const bool is_above =
          inputs_[i].priority > inputs_[input].priority || (is_equal(i, input) && i < input);
      if (is_above && inputs_[i].is_active(now)) return true;
    }
    return false;
  }
  // Whether another one of its priority has published within its timeout.
  [[nodiscard]] bool has_active_equal(std::size_t input, Nanoseconds now) const {
    for (std::size_t i = 0; i < inputs_.size(); ++i) {
      if (i != input && is_equal(i, input) && inputs_[i].is_active(now)) return true;
    }
    return false;
  }

 private:
  [[nodiscard]] const Input& at(int i) const { return inputs_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] bool is_equal(std::size_t a, std::size_t b) const {
    return inputs_[a].priority == inputs_[b].priority;
  }

  std::vector<Input> inputs_;
  int owner_ = -1;  // nobody
};

std::vector<Input> random_inputs(Random& random) {
  static const std::vector<std::pair<std::string, Nanoseconds>> kTimeouts{
      {"0.1", 100'000'000}, {"0.3", 300'000'000}, {"0.5", 500'000'000}, {"1.0", 1'000'000'000}};
  const bool may_be_equal = random.pick(3) == 0;
  const auto priorities =
      random.shuffled<int>(may_be_equal ? std::vector<int>{0, 0, 1, 1, 1, 8, 65536}
                                        : std::vector<int>{0, 1, 2, 7, 8, 9, 10, 65536});
  std::vector<Input> result(static_cast<std::size_t>(1 + random.pick(5)));
  for (std::size_t i = 0; i < result.size(); ++i) {
    result[i].topic = "/input/i" + std::to_string(i);
    result[i].priority = priorities[i];
    std::tie(result[i].timeout_written, result[i].timeout) = random.any_of(kTimeouts);
  }
  return result;
}

std::vector<Nanoseconds> ends_of(const CmdVelMux& mux) {
  std::vector<Nanoseconds> ends;
  for (const Input& each : mux.inputs()) {
    if (each.has_message) ends.push_back(each.stamp + each.timeout);
  }
  return ends;
}

std::string written(const std::vector<Input>& inputs, bool is_ros2) {
  std::ostringstream yaml;
  yaml << (is_ros2 ? "cmd_vel_mux: {ros__parameters: {subscribers: {" : "subscribers: [");
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    yaml << (i == 0 ? "" : ", ") << (is_ros2 ? "i" : "{name: i") << i << (is_ros2 ? ": {" : ", ")
         << "topic: " << inputs[i].topic << ", timeout: " << inputs[i].timeout_written
         << ", priority: " << inputs[i].priority << ", short_desc: An input}";
  }
  yaml << (is_ros2 ? "}}}" : "]\npublisher: /cmd_vel");
  return yaml.str();
}

bool has_equals(const std::vector<Input>& inputs) {
  std::set<int> priorities;
  for (const Input& each : inputs) priorities.insert(each.priority);
  return priorities.size() < inputs.size();
}

struct InputCount {
  int delivered = 0, discarded = 0, waiting = 0;
  int refused = 0;  // whole files, for equal priorities
  int first_of_equals = 0, waiting_for_equal = 0;
};

// One message that the two decide differently: only where the import has said so.
void judge_difference(const CmdVelMux& mux, std::size_t input, Nanoseconds now, bool passes,
                      const Imported& imported, InputCount& count) {
  if (mux.has_active_equal(input, now)) {
    ++(passes ? count.waiting_for_equal : count.first_of_equals);
    EXPECT_NE(imported.message("equal-priorities"), "");
    return;
  }
  ASSERT_TRUE(passes) << "the model passes on what cmd_vel_mux stops";
  ++count.waiting;
  ASSERT_GE(mux.inputs().size(), 3u);
  EXPECT_NE(imported.message("waits-longer"), "");
}

void compare_cmd_vel_muxes(unsigned seed, InputCount& count) {
  Random random(seed);
  const auto inputs = random_inputs(random);
  const bool is_ros2 = random.pick(2) == 0;
  const std::string yaml = written(inputs, is_ros2);
  SCOPED_TRACE("seed " + std::to_string(seed) + "\n" + yaml);
  CmdVelMux mux(inputs);
  const auto imported = import_texts(Program::kCmdVelMux, {yaml});
  if (is_ros2 && has_equals(inputs)) {
    ++count.refused;
    EXPECT_FALSE(imported.plan);
    EXPECT_NE(imported.message("equal-priorities"), "");
    return;
  }
  ASSERT_TRUE(imported.plan) << testing::PrintToString(imported.findings());
  ImportedRobot robot(*imported.plan);
  Nanoseconds now = 1'000'000'000;
  for (int i = 0; i < 60; ++i) {
    now = random.next_time(now, ends_of(mux));
    const auto input = static_cast<std::size_t>(random.pick(static_cast<int>(inputs.size())));
    const bool passes = mux.receive(input, now);
    const bool waits = mux.has_active_above(input, now);
    ASSERT_EQ(robot.receives(inputs[input].topic, now), !waits) << "message " << i;
    if (passes == !waits) {
      ++(passes ? count.delivered : count.discarded);
    } else {
      ASSERT_NO_FATAL_FAILURE(judge_difference(mux, input, now, passes, imported, count))
          << "message " << i;
    }
  }
}

TEST(RandomCmdVelMux, DecidesAsItsImportButForWhatIsReported) {
  InputCount count;
  for (unsigned seed = 0; seed < 2000 && !HasFailure(); ++seed) compare_cmd_vel_muxes(seed, count);
  EXPECT_GE(count.delivered, 10'000);
  EXPECT_GE(count.discarded, 10'000);
  EXPECT_GE(count.waiting, 100);
  EXPECT_GE(count.refused, 100);
  EXPECT_GE(count.first_of_equals, 100);
  EXPECT_GE(count.waiting_for_equal, 100);
}

}  // namespace
}  // namespace arbiter::test
