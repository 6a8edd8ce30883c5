#include "cli/pub_takers.hpp"

#include <algorithm>

#include "cli/pub_type.hpp"
#include "command_line/shell_word.hpp"
#include "rules/text/names.hpp"
#include "watch/imported.hpp"

namespace arbiter::cli {
namespace {

bool is_payload(const std::string& option) {
  return option == "--hex" || option == "--file" || option == "--text" || option == "--size";
}

std::string advice(const PubCommand& command, const wire::InputStatus& input) {
  const std::size_t size = input.open->type->size;
  std::string text =
      "to send what " + input.name + " takes, run: " + command.like(input.name, size);
  if (input.open->type->alignment == 0) {  // variable
    text += "  (add a sample of that type by --hex, --file or --text)";
  } else if (command.payload_size != size) {
    text += "  (samples of " + std::to_string(size) + (size == 1 ? " byte" : " bytes") +
            ": add them by --hex, --file or --text, or they are zeros)";
  }
  return text;
}

}  // namespace

std::string PubCommand::like(const std::string& port, std::size_t size) const {
  std::string line = "arbiter pub";
  bool is_said = false;
  for (const auto& [option, value] : arguments) {
    if (option == "--type" || option == "--like") continue;
    if (is_payload(option) && (payload_size != size || option == "--size")) continue;
    if (!option.empty()) line += ' ' + option;
    if (!value.empty() || option.empty()) line += ' ' + command_line::shell_word(value);
    if (!option.empty() || is_said) continue;
    line += " --like " + command_line::shell_word(port);
    is_said = true;
  }
  return line;
}

Takers find_takers(const wire::Status& status, const std::string& port, const Type& type,
                   const PubCommand& command, const TakersElsewhere& elsewhere) {
  Takers takers;
  std::vector<std::string> closed, away;
  std::vector<const wire::InputStatus*> refused;
  const auto* const source = status.find_source(port);
  bool has_connections = false;
  for (const auto& input : status.inputs) {
    for (const auto& connection : input.connections) {
      if (connection.source != port) continue;
      has_connections = true;
      takers.is_any |= connection.is_connected();
      if (!input.open) (input.away_pid ? away : closed).push_back(input.name);
      if (connection.mismatch && input.open && input.open->type &&
          !is_same(*input.open->type, type)) {
        refused.push_back(&input);
      }
    }
  }
  if (!has_connections) takers.is_any = source != nullptr && source->mentioned;
  takers.is_any |= elsewhere.is_any();
  if (!takers.is_any && !closed.empty()) {
    takers.messages.push_back("no component has " + rules::enumerate(closed) +
                              " open, which the model connects to " + port +
                              ", so none of these samples is delivered");
  }
  if (!takers.is_any && !away.empty()) {
    takers.messages.push_back("nothing is delivered at " + rules::enumerate(away) +
                              " before its component comes back to this daemon");
  }
  if (command.has_type && takers.is_any) return takers;  // it was chosen for those who can
  std::vector<wire::SampleType> said;
  for (const wire::InputStatus* input : refused) {
    const Type taken(input->open->type->name, input->open->type->size,
                     input->open->type->alignment);
    const bool is_said = std::any_of(said.begin(), said.end(), [&](const wire::SampleType& each) {
      return is_same(each, taken);
    });
    if (is_said) continue;
    said.push_back(*input->open->type);
    takers.messages.push_back(advice(command, *input));
  }
  return takers;
}

TakersElsewhere find_elsewhere(const OtherHosts& others, const std::string& port,
                               const Type& type) {
  TakersElsewhere found;
  const auto is_it = [&](const auto& each) { return each.source == port; };
  for (const OtherHost& other : others.answered) {
    const wire::SourceStatus* const source = other.status.find_source(port);
    const bool has_it = source != nullptr && source->open;
    const std::string from = has_it ? watch::host_of(*source) : watch::kUnknownHost;
    const bool has_own = from != others.here && from != watch::kUnknownHost;
    std::vector<std::string>& takers = has_own ? found.own : found.takers;
    const std::size_t before = takers.size();
    bool reads = false;
    for (const wire::InputStatus& input : other.status.inputs) {
      const bool is_connected =
          std::any_of(input.connections.begin(), input.connections.end(), is_it);
      const bool fits =
          input.open && (has_own || !input.open->type || is_same(*input.open->type, type));
      if (is_connected && fits) takers.push_back(input.name + " of host " + other.name);
      reads = reads || std::any_of(input.senses.begin(), input.senses.end(), is_it);
    }
    if (has_own) continue;
    const bool takes = takers.size() != before;
    if (reads && !takes) found.readers.push_back(other.name);
    const bool is_imported = has_it && from == others.here;
    found.is_imported = found.is_imported && (is_imported || !(takes || reads));
  }
  return found;
}

std::string TakersElsewhere::text(const std::string& port) const {
  std::string text;
  if (!takers.empty()) {
    text = "samples cross to " + rules::enumerate(takers) +
           "; what is delivered there is not counted here";
  }
  const auto add = [&](const std::string& sentence) {
    text += (text.empty() ? "" : ". ") + sentence;
  };
  if (!readers.empty()) {
    add((readers.size() == 1 ? "The rules of host " : "The rules of the hosts ") +
        rules::enumerate(readers) + " read " + port);
  }
  if (!own.empty()) {
    add(rules::enumerate(own) + (own.size() == 1 ? " obeys" : " obey") + " the " + port +
        " of its own host");
  }
  return text;
}

bool is_sent_to_others(const wire::Status& status, const std::string& port) {
  const wire::SourceStatus* const source = status.find_source(port);
  if (source == nullptr || !source->open) return false;
  const auto& taps = source->open->taps;
  return std::any_of(taps.begin(), taps.end(),
                     [](const wire::Component& each) { return each.node == watch::kLinkNode; });
}

}  // namespace arbiter::cli
