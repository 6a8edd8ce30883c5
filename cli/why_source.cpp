#include "cli/why_source.hpp"

#include <string_view>
#include <vector>

#include "command_line/shell_word.hpp"
#include "rules/ask/source_as_port.hpp"
#include "watch/port.hpp"

namespace arbiter::cli {
namespace {

rules::SourceUses uses_by(const wire::Status& status) {
  rules::SourceUses uses;
  for (const wire::SourceStatus& source : status.sources) uses[source.name];
  for (const wire::InputStatus& input : status.inputs) {
    for (const auto& each : input.connections) uses[each.source].connected_to.push_back(input.name);
    for (const auto& each : input.senses) uses[each.source].read_at.push_back(input.name);
  }
  return uses;
}

std::string command_of(const WhyOptions& options, const std::string& port,
                       const std::string& source) {
  std::string command = "arbiter why " + command_line::shell_word(port);
  command += options.follow ? " --follow" : ' ' + command_line::shell_word(source);
  if (!options.host.empty()) command += " --host " + options.host;
  if (!options.instance.empty()) command += " --instance " + options.instance;
  return command;
}

}  // namespace

void require_no_source(const WhyOptions& options, const wire::Status& status,
                       const std::string& none) {
  if (status.find_input(options.port) != nullptr) return;
  std::vector<std::string_view> ports;
  for (const wire::InputStatus& input : status.inputs) ports.push_back(input.name);
  // Whoever has exchanged the two has named the port, too.
  const bool has_port = status.find_input(options.source) != nullptr;
  const auto command = [&](const std::string& port, const std::string& source) {
    return command_of(options, has_port ? options.source : port, source);
  };
  const auto text =
      rules::about_source_as_port({options.port, none, command}, ports, uses_by(status));
  if (text) throw watch::WatchError(*text);
}

void require_no_source(const WhyOptions& options, watch::Instance& instance) {
  if (instance.find_port(options.port)) return;
  const wire::Status status = instance.status();
  if (!watch::port_of_topic(status, options.port).empty()) return;
  require_no_source(options, status,
                    "no model and no component has named the input port " + options.port);
}

}  // namespace arbiter::cli
