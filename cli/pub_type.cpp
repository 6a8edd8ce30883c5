#include "cli/pub_type.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <vector>

#include <CLI/CLI.hpp>
#include <arbiter/result.hpp>

#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::cli {
namespace {

[[noreturn]] void refuse_form(const std::string& text) {
  throw CLI::ValidationError("--type", rules::quote(text) + " is not of the form " + kTypeForm +
                                           ": write the type's name, the bytes of a sample and "
                                           "its alignment, such as geometry/Twist:48:8");
}

// Takes the last of the fields that colons separate off; nothing: it is no number.
std::optional<std::size_t> take_number(std::string_view& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return {};
  const std::string_view field = text.substr(colon + 1);
  std::size_t value = 0;
  const auto read = std::from_chars(field.data(), field.data() + field.size(), value);
  if (read.ec != std::errc() || read.ptr != field.data() + field.size()) return {};
  text.remove_suffix(field.size() + 1);
  return value;
}

// One end of which the type is known.
struct Known {
  std::string port;
  const wire::Component* component;
  const std::optional<wire::SampleType>* type;
  bool is_input;

  [[nodiscard]] std::string text() const {
    return (is_input ? "the input port " : "the output port ") + port + " of \"" + component->node +
           "\" " + (is_input ? "takes " : "sends ") +
           (*type ? describe(**type) : "untyped samples");
  }
};

bool are_same(const Known& one, const Known& other) {
  if (!*one.type || !*other.type) return !*one.type && !*other.type;
  return is_same(**one.type,
                 Type((*other.type)->name, (*other.type)->size, (*other.type)->alignment));
}

std::string enumerate(const std::vector<Known>& all) {
  std::vector<std::string> texts(all.size());
  std::transform(all.begin(), all.end(), texts.begin(),
                 [](const Known& each) { return each.text(); });
  return rules::enumerate(texts);
}

// The ports of that name that are open: an input and an output port may share it.
std::vector<Known> open_ports(const wire::Status& status, const std::string& port) {
  std::vector<Known> found;
  const auto* const input = status.find_input(port);
  if (input != nullptr && input->open) {
    found.push_back({port, &input->open->component, &input->open->type, true});
  }
  const auto* const source = status.find_source(port);
  if (source != nullptr && source->open) {
    found.push_back({port, &source->open->component, &source->open->type, false});
  }
  return found;
}

struct Receivers {
  std::vector<Known> typed, untyped;  // open
  std::vector<std::string> closed;
};

Receivers receivers_of(const wire::Status& status, const std::string& source) {
  Receivers result;
  for (const auto& input : status.inputs) {
    for (const auto& connection : input.connections) {
      if (connection.source != source) continue;
      if (!input.open) {
        result.closed.push_back(input.name);
      } else {
        auto& known = input.open->type ? result.typed : result.untyped;
        known.push_back({input.name, &input.open->component, &input.open->type, true});
      }
    }
  }
  return result;
}

[[noreturn]] void fail_like(const std::string& why, const std::string& what_to_do) {
  throw std::runtime_error("--like: " + why + "; " + what_to_do);
}

const std::string or_name_it = std::string("or name the type with --type ") + kTypeForm;

[[noreturn]] void fail_without_ports(const wire::Status& status, const std::string& port,
                                     const std::vector<std::string>& closed) {
  const auto* const input = status.find_input(port);
  const auto* const source = status.find_source(port);
  const int away = input != nullptr && input->away_pid     ? *input->away_pid
                   : source != nullptr && source->away_pid ? *source->away_pid
                                                           : 0;
  if (away != 0) {
    fail_like("the component that has " + port + " open (process " + std::to_string(away) +
                  ") has not come back to this daemon yet",
              "try again, " + or_name_it);
  }
  if (!closed.empty()) {
    fail_like("no component has " + port + " open, nor " + rules::enumerate(closed) +
                  ", which the model connects to it, so its type is not known",
              "start one of the components, " + or_name_it);
  }
  if (input != nullptr || source != nullptr) {
    fail_like("no component has " + port + " open, so its type is not known",
              "start its component, " + or_name_it);
  }
  std::vector<std::string_view> names;
  for (const auto& each : status.inputs) names.emplace_back(each.name);
  for (const auto& each : status.sources) names.emplace_back(each.name);
  throw std::runtime_error(
      "--like: no component has " + port + " open, and the model does not mention it" +
      rules::advise(port, names, "`arbiter status` shows the ports that there are"));
}

Type known_type(const Known& port) {
  return {(*port.type)->name, (*port.type)->size, (*port.type)->alignment};
}

}  // namespace

Type parse_type(const std::string& text) {
  std::string_view rest = text;
  const auto alignment = take_number(rest);
  const auto size = alignment ? take_number(rest) : std::nullopt;
  if (!size || rest.empty()) refuse_form(text);
  try {
    return {rest, *size, *alignment};
  } catch (const Error& error) {
    throw CLI::ValidationError("--type", error.what());
  }
}

Type type_like(const wire::Status& status, const std::string& port) {
  std::vector<Known> known = open_ports(status, port);
  if (known.size() == 2 && !are_same(known[0], known[1])) {
    fail_like("two ports have that name: " + enumerate(known),
              std::string("name the type with --type ") + kTypeForm);
  }
  if (known.empty()) {
    Receivers receivers = receivers_of(status, port);
    for (const Known& each : receivers.typed) {
      if (are_same(each, receivers.typed.front())) continue;
      fail_like("the model connects " + port +
                    " to input ports that take different types: " + enumerate(receivers.typed),
                "choose one of them, such as --like " + each.port);
    }
    known = receivers.typed.empty() ? receivers.untyped : receivers.typed;
    if (known.empty()) fail_without_ports(status, port, receivers.closed);
  }
  const Known& model = known.front();
  if (!*model.type) {
    fail_like(model.text(), "leave --like out to send untyped samples, " + or_name_it);
  }
  return known_type(model);
}

std::optional<Type> type_of_receivers(const wire::Status& status, const std::string& source) {
  const std::vector<Known> typed = receivers_of(status, source).typed;
  const bool is_one = !typed.empty() &&
                      std::all_of(typed.begin(), typed.end(),
                                  [&](const auto& each) { return are_same(each, typed.front()); });
  if (!is_one || (*typed.front().type)->alignment == 0) return {};  // as of a variable type
  return known_type(typed.front());
}

std::string describe(const Type& type) {
  return describe(wire::SampleType{type.name(), type.size(), type.alignment()});
}

std::string describe(const wire::SampleType& type) {
  shm::TypeInfo info;
  info.set_name(type.name);
  info.size = type.size;
  info.alignment = type.alignment;
  return shm::describe(info);
}

bool is_same(const wire::SampleType& one, const Type& other) {
  return one.name == other.name() && one.alignment == other.alignment() &&
         (one.size == other.size() || other.is_variable());
}

}  // namespace arbiter::cli
