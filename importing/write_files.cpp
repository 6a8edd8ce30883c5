// The model and the mapping as files that people read and go on from.
#include <algorithm>
#include <filesystem>

#include "importing/import.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"
#include "rules/text/xml.hpp"
#include "shm/utf8.hpp"

namespace arbiter::importing {
namespace {

constexpr std::size_t kWidth = 100;
// A day: a lock that was pressed holds until it is released, however long a gateway was held up.
constexpr const char* kOldestPress = "86400s";
constexpr const char* kDeclaration = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";

using rules::escape_xml;

// Two hyphens would end a comment, and so would one before its end.
std::string in_comment(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '-' && result.ends_with('-')) result += ' ';
    result += c;
  }
  return result.ends_with('-') ? result + ' ' : result;
}

// Words in lines, each behind `indent`.
std::string fill(std::string_view text, const std::string& indent) {
  std::string result, line;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    const std::string_view word = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (!line.empty() && indent.size() + line.size() + 1 + word.size() > kWidth) {
      result += indent + line + '\n';
      line.clear();
    }
    line += (line.empty() ? "" : " ") + std::string(word);
  }
  return line.empty() ? result : result + indent + line + '\n';
}

std::string comment(const std::string& text, const std::string& indent) {
  const std::string safe = in_comment(text);
  if (indent.size() + safe.size() + 9 <= kWidth) return indent + "<!-- " + safe + " -->\n";
  std::string lines = fill(safe, indent + "     ");
  lines.replace(indent.size(), 5, "<!-- ");
  lines.pop_back();
  return lines + " -->\n";
}

// Of a file that may be moved together with what was imported from it.
std::string line_of(const rules::Location& where) {
  return shm::printable(std::filesystem::path(where.file).filename().string()) + ":" +
         std::to_string(where.line);
}

std::string heading(const std::string& what, const Plan& plan) {
  return what + ", imported from " + rules::comma_list(plan.files) + " by `arbiter import " +
         plan.program + "`.";
}

class ModelWriter {
 public:
  explicit ModelWriter(const Plan& plan) : plan_(plan) {}

  std::string write() {
    text_ = kDeclaration;
    write_heading();
    text_ += "<behaviors>\n\n  <define name=\"base\"> " + escape_xml(plan_.output_port) +
             " </define>\n\n";
    write_sources();
    for (std::size_t i = 0; i < plan_.commands.size(); ++i) write_command(i);
    return text_ + "</behaviors>\n";
  }

 private:
  void write_heading() {
    text_ += "<!--\n";
    text_ += fill(in_comment(heading("What " + plan_.program + " decides", plan_)), "  ");
    for (const std::string& remark : plan_.remarks) {
      text_ += "\n" + fill(in_comment(remark), "  ");
    }
    if (!plan_.left_out.empty()) text_ += "\n  Left out, because it has no effect:\n";
    for (const LeftOut& each : plan_.left_out) {
      std::string lines =
          fill(in_comment(each.what + ", " + line_of(each.where) + ": " + each.why + "."), "    ");
      lines[2] = '*';
      text_ += lines;
    }
    text_ += "-->\n";
  }

  void write_source(const std::string& port, shm::Nanoseconds timeout) {
    text_ += "  <source port=\"" + escape_xml(port) + "\" timeout=\"" + rules::to_string(timeout) +
             "\"/>\n";
  }

  void write_sources() {
    if (!plan_.timeout_remark.empty()) text_ += comment(plan_.timeout_remark, "  ");
    for (const Command& command : plan_.commands) write_source(command.port, command.timeout);
    text_ += '\n';
    if (plan_.locks.empty()) return;
    text_ += comment(
        "Locks. One with a heartbeat is free while `released` is active, so that silence locks; "
        "one without is free while `pressed` is not, so that silence leaves it as it is.",
        "  ");
    for (const Lock& lock : plan_.locks) {
      text_ += comment(
          lock.topic + ", " + lock.rank + ", " + lock.silence + ": " + line_of(lock.where), "  ");
      write_source(lock.port, lock.timeout);
    }
    text_ += '\n';
  }

  void write_command(std::size_t i) {
    const Command& command = plan_.commands[i];
    if (!command.description.empty()) {
      text_ += comment(shm::printable(command.description) + ".", "  ");
    }
    text_ += comment(command.topic + ", " + command.rank + ", " + command.silence + ": " +
                         line_of(command.where),
                     "  ");
    text_ += "  <behavior name=\"" + escape_xml(command.name) + "\">\n";
    text_ += "    <config at=\"${base}\">" + escape_xml(command.port) + "</config>\n";
    for (const std::size_t index : command.locks) write_lock(plan_.locks[index]);
    write_inhibition(i + 1);
    text_ += "  </behavior>\n\n";
  }

  void write_lock(const Lock& lock) {
    text_ += "    <condition>" + escape_xml((lock.has_heartbeat ? "" : "not ") + lock.port) +
             "</condition>  <!-- " +
             in_comment(lock.name + ", " + lock.rank + ": " + line_of(lock.where)) + " -->\n";
  }

  void write_inhibition(std::size_t first) {
    std::string names;
    for (std::size_t i = first; i < plan_.commands.size(); ++i) {
      names += (names.empty() ? "" : ", ") + escape_xml(plan_.commands[i].name);
    }
    if (names.empty()) return;
    const std::string indent(6, ' ');
    if (names.size() < kWidth - 32) {
      text_ += "    <inhibition>" + names + "</inhibition>\n";
    } else {
      text_ += "    <inhibition>\n" + fill(names, indent) + "    </inhibition>\n";
    }
  }

  const Plan& plan_;
  std::string text_;
};

std::string attribute(const std::string& name, const std::string& value) {
  return " " + name + "=\"" + escape_xml(value) + "\"";
}

}  // namespace

std::string write_model(const Plan& plan) { return ModelWriter(plan).write(); }

std::string write_mapping(const Plan& plan, const std::string& model_name) {
  std::string text = kDeclaration;
  text += "<!--\n";
  text += fill(in_comment(heading("The topics of the model " + model_name, plan)), "  ");
  text += "\n" + fill(in_comment(plan.mapping_remark), "  ") + "-->\n";
  text += "<gateway" + attribute("kind", "dds") +
          (plan.domain ? attribute("domain", std::to_string(*plan.domain)) : "") + ">\n\n";
  const std::string qos = plan.qos.empty() ? "" : attribute("qos", plan.qos);
  for (const Command& command : plan.commands) {
    text += comment(command.name + ": " + line_of(command.where), "  ");
    text += "  <in" + attribute("topic", command.topic) + attribute("type", plan.type) +
            attribute("port", command.port) + qos + "/>\n";
  }
  if (!plan.locks.empty()) text += '\n';
  for (const Lock& lock : plan.locks) {
    text += comment("lock " + lock.name + ": " + line_of(lock.where), "  ");
    if (!lock.has_heartbeat) {
      text += comment(
          "It is said once, and counts however late it comes: hence max_age, and no qos, so that a "
          "lost datagram is repeated. What is said while no gateway runs, or while it is stopped, "
          "may be lost.",
          "  ");
    }
    text += "  <in" + attribute("topic", lock.topic) + attribute("type", "std_msgs/msg/Bool") +
            "\n     " + attribute(lock.has_heartbeat ? "false" : "true", lock.port) +
            (lock.has_heartbeat ? qos : attribute("max_age", kOldestPress)) + "/>\n";
  }
  text += '\n';
  text += "  <out" + attribute("port", plan.output_port) + attribute("topic", plan.output_topic) +
          attribute("type", plan.type);
  if (!plan.idle.empty()) text += attribute("idle", plan.idle);
  return text + "/>\n\n</gateway>\n";
}

}  // namespace arbiter::importing
