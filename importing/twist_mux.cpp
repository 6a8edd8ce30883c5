// twist_mux, of ROS 1 and ROS 2. What it does, from its sources (4.3.0, and noetic's):
//
// - A topic or lock is expired if its timeout is above 0 and its last message is older than it, or
//   never came. With a timeout of 0 or less it never is, even before its first message.
// - A lock is locked while it is expired, or while its last message says true.
// - A topic is masked while it is expired, or of a lower priority than some lock that is locked.
// - A message is passed on if its topic is not masked, and is the first of those with the highest
//   priority among all that are not. The search begins at 0, so that a topic of priority 0 is never
//   found. Priorities are clamped to 0..255.
//
// So a lock that masks a topic masks each lower one as well. Hence inhibition, which looks at
// activity alone, decides in the same way: where an active topic above is masked, all below it are.
#include <algorithm>
#include <utility>

#include "importing/assembly.hpp"
#include "importing/entries.hpp"
#include "importing/import.hpp"
#include "rules/text/names.hpp"

namespace arbiter::importing {
namespace {

constexpr std::int64_t kHighestPriority = 255;
constexpr std::int64_t kLargestInt = 2147483647;

bool is_untimed(const MuxEntry& entry) { return entry.timeout.value <= 0; }

// It is expired when older than the timeout, not when as old.
shm::Nanoseconds activity_of(const MuxEntry& entry) {
  return is_untimed(entry) ? shm::kForever : entry.timeout.value + 1;
}

std::string silence_of(const MuxEntry& entry) {
  return is_untimed(entry) ? "no timeout" : "timeout " + in_seconds(entry.timeout.value);
}

std::string rank_of(const MuxEntry& entry) {
  return "priority " + std::to_string(entry.priority.value);
}

std::string problem_of_priority(std::int64_t priority) {
  if (priority <= kLargestInt && priority >= -kLargestInt) return "";
  return std::to_string(priority) + " is too large; write a number from 1 to 255";
}

class TwistMuxImport {
 public:
  TwistMuxImport(const std::vector<InputFile>& files, const ImportOptions& options,
                 rules::Diagnostics& diagnostics)
      : diagnostics_(diagnostics),
        parameters_(files, twist_mux_kind, cmd_vel_mux_kind, options.node, diagnostics),
        assembly_(parameters_, options, "twist_mux", Relative::kToNamespace, diagnostics) {
    plan_.program = "twist_mux";
    plan_.files = file_names(files);
  }

  std::optional<Plan> import() {
    if (parameters_.sets().empty()) return {};
    topics_ = entries_of("topics");
    locks_ = entries_of("locks");
    if (!diagnostics_.has_errors() && topics_.empty()) {
      diagnostics_.error("nothing-to-import", parameters_.sets().front().parameters->where,
                         "`topics` is missing or empty; import the file that has it, too");
    }
    read_other_parameters();
    for (MuxEntry& entry : topics_) clamp(entry);
    for (MuxEntry& entry : locks_) clamp(entry);
    // By priority, and of equals in their order: the first one wins.
    std::stable_sort(topics_.begin(), topics_.end(), [](const MuxEntry& a, const MuxEntry& b) {
      return a.priority.value > b.priority.value;
    });
    choose_topics();
    plan_locks();
    for (const Chosen& each : chosen_) plan_.commands.push_back(command_of(each));
    const rules::Location where = topics_.empty() ? parameters_.sets().front().parameters->where
                                                  : topics_.front().topic.where;
    assembly_.set_output(plan_, "cmd_vel_out", where);
    if (!diagnostics_.has_errors()) note_unsaid_stamp();
    assembly_.set_types(plan_, is_stamped_, where);
    // SystemDefaultsQoS(); what crosses from ROS 1 is reliable.
    if (parameters_.is_ros2()) plan_.qos = "system_default";
    plan_.timeout_remark =
        "A message counts until it is older than its timeout, not as old: hence the nanosecond.";
    return std::move(plan_);
  }

 private:
  std::vector<MuxEntry> entries_of(const char* name) {
    const auto parameter = parameters_.find(name, diagnostics_);
    if (!parameter) return {};
    EntryRules rules{"twist_mux", false, true};
    rules.problem_of_priority = problem_of_priority;
    return read_entries(*parameter, rules, diagnostics_);
  }

  void read_other_parameters() {
    for (const ParameterSet& set : parameters_.sets()) {
      for (const YamlEntry& entry : set.parameters->entries) {
        const std::string& key = entry.key.text;
        if (key == "topics" || key == "locks") continue;
        if (key == "use_stamped") {
          says_whether_stamped_ = true;
          if (read_boolean(entry, diagnostics_).value_or(false)) is_stamped_ = true;
        } else if (key == "use_sim_time") {
          if (!read_boolean(entry, diagnostics_).value_or(false)) continue;
          diagnostics_.note("own-clock", entry.key.where,
                            "Arbiter goes by the machine's own clock: a timeout takes as long in a "
                            "simulation that is slower or faster; nothing to do on the robot");
        } else if (const auto meant = rules::find_similar(key, {"topics", "locks"})) {
          diagnostics_.error("unknown-key", entry.key.where,
                             rules::quote(key) + " is nothing that twist_mux reads; did you mean " +
                                 rules::quote(*meant) +
                                 "? Without it, the model would lack what it holds");
        } else {
          diagnostics_.warning(
              "unknown-key", entry.key.where,
              "the import does not read " + rules::quote(key) +
                  rules::advise(key, {"use_stamped"}, "look whether it decides anything"));
        }
      }
    }
  }

  void note_unsaid_stamp() {
    if (says_whether_stamped_ || !parameters_.is_ros2()) return;
    diagnostics_.note("no-use-stamped", parameters_.sets().front().parameters->where,
                      "twist_mux since 4.4 (Jazzy) does not start without use_stamped; the import "
                      "takes the commands for geometry_msgs/msg/Twist, as older ones do; write "
                      "use_stamped: false, or true for TwistStamped");
  }

  void clamp(MuxEntry& entry) {
    const std::int64_t written = entry.priority.value;
    entry.priority.value = std::clamp<std::int64_t>(written, 0, kHighestPriority);
    if (entry.priority.value == written) return;
    diagnostics_.warning("priority-clamped", entry.priority.where,
                         "twist_mux takes priorities from 0 to 255, and " +
                             std::to_string(written) + " for " +
                             std::to_string(entry.priority.value) + "; so does the model: write " +
                             std::to_string(entry.priority.value) + ", or another one");
  }

  void plan_locks() {
    for (const MuxEntry& entry : locks_) {
      Lock lock;
      lock.name = entry.name;
      lock.where = entry.where;
      lock.topic = assembly_.topic_of(entry);
      warn_of_lock(entry, lock.topic);
      const bool masks_some = std::any_of(chosen_.begin(), chosen_.end(), [&](const Chosen& each) {
        return each.entry->priority.value < entry.priority.value;
      });
      if (!masks_some) {
        diagnostics_.warning("lock-without-effect", entry.priority.where,
                             "no topic that can get through has a priority below " +
                                 std::to_string(entry.priority.value) + ", so that " +
                                 rules::quote(entry.name) +
                                 " locks nothing; give it a higher priority");
        plan_.left_out.push_back({"the lock " + entry.name + " (" + lock.topic + ")",
                                  "it holds back no topic", entry.where});
        lock_indices_.push_back(plan_.locks.size());  // asked for by nobody
        continue;
      }
      const std::string folder = assembly_.folder_of(entry, Assembly::Of::kLock);
      lock.has_heartbeat = !is_untimed(entry);
      lock.port = folder + (lock.has_heartbeat ? "/released:o" : "/pressed:o");
      lock.timeout = activity_of(entry);
      lock.rank = rank_of(entry);
      lock.silence = silence_of(entry);
      lock_indices_.push_back(plan_.locks.size());
      plan_.locks.push_back(std::move(lock));
    }
  }

  void warn_of_lock(const MuxEntry& entry, const std::string& topic) {
    warn_of_negative(entry);
    if (!is_untimed(entry)) return;
    diagnostics_.warning("silent-lock", entry.timeout.where,
                         rules::quote(entry.name) + " has no timeout: while nobody publishes " +
                             topic +
                             ", because its publisher died or never started, nothing is "
                             "locked, nor while a best effort publisher does, which the mapping "
                             "does not hear; repeat the message and give the lock a timeout");
  }

  void warn_of_negative(const MuxEntry& entry) {
    if (entry.timeout.value >= 0) return;
    diagnostics_.warning("negative-timeout", entry.timeout.where,
                         "twist_mux takes a timeout below 0 for none at all; so does the model: "
                         "write 0.0, or how long a message counts");
  }

  // Those that can get through. Where one is never expired, twist_mux's search never goes below it.
  void choose_topics() {
    const MuxEntry* untimed = nullptr;
    for (std::size_t i = 0; i < topics_.size(); ++i) {
      const MuxEntry& entry = topics_[i];
      const std::string topic = assembly_.topic_of(entry);
      require_name(entry);
      warn_of_negative(entry);
      warn_of_equal(i);
      if (entry.priority.value == 0) {
        leave_out(entry, topic, "priority-zero", entry.priority.where,
                  "twist_mux looks for a priority above 0, so that a topic of priority 0 never "
                  "gets through; give it 1 or more");
        continue;
      }
      if (untimed != nullptr) {
        leave_out(entry, topic, "shut-out", entry.priority.where,
                  rules::quote(untimed->name) + " (" + rules::describe(untimed->where) +
                      ") has no timeout and is above it, so that it never gets through, even while "
                      "nobody publishes " +
                      rules::quote(untimed->topic.value) + "; give that a timeout");
        continue;
      }
      if (is_untimed(entry)) {
        untimed = &entry;
        warn_of_untimed(entry, i + 1 < topics_.size());
      }
      chosen_.push_back({&entry, topic});
    }
    if (chosen_.empty() && !diagnostics_.has_errors()) {
      diagnostics_.error("nothing-to-import", topics_.front().where,
                         "none of the topics can ever get through; give one a priority above 0");
    }
  }

  void require_name(const MuxEntry& entry) {
    if (parameters_.is_ros2() || entry.name != "NULL") return;
    diagnostics_.error(
        "invalid-name", entry.where,
        "twist_mux means by NULL that nobody has priority, and would pass this topic "
        "on then; give it another name");
  }

  void warn_of_untimed(const MuxEntry& entry, bool is_above_some) {
    std::string message = rules::quote(entry.name) +
                          " has no timeout: when its publisher falls silent its last command stays "
                          "in force";
    if (is_above_some) message += ", and nothing below it ever gets through";
    diagnostics_.warning("never-expires", entry.timeout.where, message + "; give it a timeout");
  }

  void warn_of_equal(std::size_t i) {
    if (i == 0 || topics_[i].priority.value != topics_[i - 1].priority.value) return;
    const MuxEntry& first = topics_[i - 1];
    if (first.priority.value == 0) return;
    diagnostics_.warning(
        "equal-priorities", topics_[i].priority.where,
        rules::quote(topics_[i].name) + " and " + rules::quote(first.name) + " have the priority " +
            std::to_string(first.priority.value) + ": of equals twist_mux prefers the first one " +
            (parameters_.is_ros2() ? "by name" : "in the list") + ", " + rules::quote(first.name) +
            ", and so does the model; give them different priorities");
  }

  void leave_out(const MuxEntry& entry, const std::string& topic, const char* code,
                 const rules::Location& where, const std::string& message) {
    diagnostics_.warning(code, where, message);
    plan_.left_out.push_back({"the topic " + topic + " of " + entry.name,
                              message.substr(0, message.rfind("; ")), entry.where});
  }

  struct Chosen {
    const MuxEntry* entry;
    std::string topic;
  };

  Command command_of(const Chosen& chosen) {
    const MuxEntry& entry = *chosen.entry;
    Command command;
    command.name = assembly_.behaviour_of(entry);
    command.topic = chosen.topic;
    command.port = assembly_.folder_of(entry, Assembly::Of::kTopic) + "/cmd_vel:o";
    command.timeout = activity_of(entry);
    command.rank = rank_of(entry);
    command.silence = silence_of(entry);
    command.where = entry.where;
    for (std::size_t i = 0; i < locks_.size(); ++i) {
      if (locks_[i].priority.value > entry.priority.value)
        command.locks.push_back(lock_indices_[i]);
    }
    return command;
  }

  rules::Diagnostics& diagnostics_;
  const NodeParameters parameters_;
  Assembly assembly_;
  Plan plan_;
  std::vector<MuxEntry> topics_, locks_;
  std::vector<Chosen> chosen_;             // the most important first
  std::vector<std::size_t> lock_indices_;  // in the plan, of each of locks_
  bool is_stamped_ = false;
  bool says_whether_stamped_ = false;
};

}  // namespace

std::optional<Plan> import_twist_mux(const std::vector<InputFile>& files,
                                     const ImportOptions& options,
                                     rules::Diagnostics& diagnostics) {
  return TwistMuxImport(files, options, diagnostics).import();
}

}  // namespace arbiter::importing
