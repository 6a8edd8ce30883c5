// cmd_vel_mux, of yocs (ROS 1) and kobuki (ROS 2). What it does, from its sources:
//
// - At most one input has the mux. A message is passed on if nobody has it, if its input has it, or
//   if its input has a higher priority than the one that has it; its input has it from then on.
// - The input that has it loses it when no message of it has come for its timeout.
//
// yocs also takes it from everybody when no message at all has come for twice the longest timeout,
// which is never before the owner's own.
//
// One thing cannot be said by who is active: when the owner falls silent, the mux forgets all
// others. The next message of any input takes it, even where one with a higher priority has
// published within its timeout, before the owner came or in vain. Arbiter waits until that timeout
// is over. It passes on nothing that cmd_vel_mux would not.
//
// kobuki's refuses equal priorities. In yocs' an input does not take the mux from an equal one,
// which depends on who came first; in the model the first one in the list does.
#include <algorithm>
#include <set>
#include <utility>

#include "importing/assembly.hpp"
#include "importing/entries.hpp"
#include "importing/import.hpp"
#include "rules/text/names.hpp"

namespace arbiter::importing {
namespace {

constexpr std::int64_t kLargestPriority = 4294967295;

std::string problem_of_input_timeout(shm::Nanoseconds timeout) {
  if (timeout > 0) return "";
  return "with " + in_seconds(timeout) +
         " an input loses the mux as soon as it has it; write how long a command counts, such as "
         "0.5";
}

std::string problem_of_input_priority(std::int64_t priority) {
  if (priority >= 0 && priority <= kLargestPriority) return "";
  return "cmd_vel_mux refuses " + std::to_string(priority) +
         "; write a number from 0 to 4294967295";
}

class CmdVelMuxImport {
 public:
  CmdVelMuxImport(const std::vector<InputFile>& files, const ImportOptions& options,
                  rules::Diagnostics& diagnostics)
      : diagnostics_(diagnostics),
        parameters_(files, cmd_vel_mux_kind, twist_mux_kind, options.node, diagnostics),
        assembly_(parameters_, options, "cmd_vel_mux",
                  parameters_.is_ros2() ? Relative::kToNamespace : Relative::kToNode, diagnostics) {
    plan_.program = "cmd_vel_mux";
    plan_.files = file_names(files);
  }

  std::optional<Plan> import() {
    if (parameters_.sets().empty()) return {};
    const auto parameter = parameters_.find("subscribers", diagnostics_);
    if (!parameter) {
      if (!diagnostics_.has_errors()) report_nothing(parameters_.sets().front().parameters->where);
      return {};
    }
    EntryRules rules{"cmd_vel_mux", true, parameters_.is_ros2()};
    rules.problem_of_timeout = problem_of_input_timeout;
    rules.problem_of_priority = problem_of_input_priority;
    inputs_ = read_entries(*parameter, rules, diagnostics_);
    if (inputs_.empty() && !diagnostics_.has_errors()) report_nothing(parameter->entry->key.where);
    read_other_parameters();
    std::stable_sort(inputs_.begin(), inputs_.end(), [](const MuxEntry& a, const MuxEntry& b) {
      return a.priority.value > b.priority.value;
    });
    for (std::size_t i = 0; i < inputs_.size(); ++i) plan_input(i);
    set_output(parameter->entry->key.where);
    assembly_.set_types(plan_, false, parameter->entry->key.where);
    if (!diagnostics_.has_errors()) say_what_is_not_kept();
    return std::move(plan_);
  }

 private:
  void report_nothing(const rules::Location& where) {
    diagnostics_.error("nothing-to-import", where,
                       "`subscribers` has no entry; import the file that has them");
  }

  void read_other_parameters() {
    for (const ParameterSet& set : parameters_.sets()) {
      for (const YamlEntry& entry : set.parameters->entries) {
        const std::string& key = entry.key.text;
        if (key == "subscribers") continue;
        if (key == "publisher" && !parameters_.is_ros2()) {
          publisher_ = &entry;
        } else if (key == "use_sim_time") {
          if (!read_boolean(entry, diagnostics_).value_or(false)) continue;
          diagnostics_.note(
              "own-clock", entry.key.where,
              "Arbiter goes by the machine's own clock, as cmd_vel_mux does in ROS 2; "
              "nothing to do");
        } else {
          diagnostics_.warning("unknown-key", entry.key.where,
                               "the import does not read " + rules::quote(key) +
                                   rules::advise(key, {"subscribers", "publisher"},
                                                 "look whether it decides anything"));
        }
      }
    }
  }

  void set_output(const rules::Location& where) {
    if (publisher_ != nullptr && !publisher_->value.is_scalar()) {
      diagnostics_.error("wrong-type", publisher_->value.where,
                         "`publisher` is a name, such as /cmd_vel; write one");
      return;
    }
    if (publisher_ != nullptr) {
      return assembly_.set_output(plan_, publisher_->value.text, publisher_->value.where);
    }
    assembly_.set_output(plan_, parameters_.is_ros2() ? "cmd_vel" : "output", where);
  }

  void plan_input(std::size_t i) {
    const MuxEntry& entry = inputs_[i];
    check_equal(i);
    Command command;
    command.name = assembly_.behaviour_of(entry);
    command.topic = assembly_.topic_of(entry);
    command.port = assembly_.folder_of(entry, Assembly::Of::kTopic) + "/cmd_vel:o";
    command.timeout = entry.timeout.value;
    command.rank = "priority " + std::to_string(entry.priority.value);
    command.silence = "timeout " + in_seconds(entry.timeout.value);
    command.description = entry.description;
    command.where = entry.where;
    plan_.commands.push_back(std::move(command));
    if (!parameters_.is_ros2() || !entry.description.empty()) return;
    diagnostics_.warning("no-description", entry.where,
                         "cmd_vel_mux does not start where " + rules::quote(entry.name) +
                             " has no short_desc; the model needs none: nothing to do");
  }

  void check_equal(std::size_t i) {
    if (i == 0 || inputs_[i].priority.value != inputs_[i - 1].priority.value) return;
    const std::string both = rules::quote(inputs_[i - 1].name) + " and " +
                             rules::quote(inputs_[i].name) + " have the priority " +
                             std::to_string(inputs_[i].priority.value);
    if (parameters_.is_ros2()) {
      diagnostics_.error("equal-priorities", inputs_[i].priority.where,
                         both + ", which cmd_vel_mux refuses; give them different priorities");
    } else {
      diagnostics_.warning("equal-priorities", inputs_[i].priority.where,
                           both +
                               ": in cmd_vel_mux the one that came first keeps the mux; in the "
                               "model the first one in the list has it: give them different "
                               "priorities");
    }
  }

  // Of an input that has others above and below it.
  void say_what_is_not_kept() {
    if (inputs_.size() < 3) return;
    for (std::size_t i = 1; i + 1 < inputs_.size(); ++i) {
      const MuxEntry& entry = inputs_[i];
      diagnostics_.note(
          "waits-longer", entry.timeout.where,
          "when an input above " + rules::quote(entry.name) +
              " has had the mux and falls silent, cmd_vel_mux passes on the next message of any "
              "input; in the model those below " +
              rules::quote(entry.name) + " wait until that has been silent for " +
              in_seconds(entry.timeout.value) +
              ", too; nothing to do: nothing gets through that cmd_vel_mux would stop");
    }
    plan_.remarks.emplace_back(
        "When the input that commands falls silent, cmd_vel_mux passes on the next message of any "
        "input. Here one that has published within its timeout keeps those below it out.");
  }

  rules::Diagnostics& diagnostics_;
  const NodeParameters parameters_;
  Assembly assembly_;
  Plan plan_;
  std::vector<MuxEntry> inputs_;
  const YamlEntry* publisher_ = nullptr;
};

}  // namespace

std::optional<Plan> import_cmd_vel_mux(const std::vector<InputFile>& files,
                                       const ImportOptions& options,
                                       rules::Diagnostics& diagnostics) {
  return CmdVelMuxImport(files, options, diagnostics).import();
}

}  // namespace arbiter::importing
