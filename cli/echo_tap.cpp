// What a tap tells, event by event.
#include <algorithm>
#include <exception>
#include <iostream>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "cli/echo.hpp"
#include "cli/echo_hosts.hpp"
#include "cli/live.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/limits.hpp"
#include "watch/port.hpp"

namespace arbiter::cli {
namespace {

const char* name_of(TapEventKind kind) {
  switch (kind) {
    case TapEventKind::sample:
      return "sample";
    case TapEventKind::signal:
      return "signal";
    case TapEventKind::deactivation:
      return "deactivation";
    case TapEventKind::closed:
      return "closed";
    case TapEventKind::destinations:
      return "destinations";
    case TapEventKind::dropped:
      return "dropped";
    case TapEventKind::overtaken:
      return "overtaken";
    case TapEventKind::state:
      break;
  }
  return "state";
}

const char* name_of(Fate fate) {
  switch (fate) {
    case Fate::accepted:
      return "accepted";
    case Fate::discarded:
      return "discarded";
    case Fate::refused:
      return "refused";
    case Fate::blind:
      return "blind";
    case Fate::none:
      break;
  }
  return "none";
}

class TapEcho {
 public:
  TapEcho(const EchoOptions& options, TapOf of, EchoNews& news,
          const shm::FileDescriptor& interrupts)
      : options_(options),
        is_input_(of == TapOf::input),
        news_(news),
        interrupts_(interrupts),
        node_("arbiter-echo", echo_node_options(options)),
        tap_(node_.tap(options.port, tap_options(of))),
        started_(shm::monotonic_now()) {}

  int run() {
    echo_while(
        options_, [this] { return tap_.fd(); }, interrupts_, news_, [this] { return look(); });
    return finish();
  }

 private:
  Looked look() {
    for (int i = 0; i < kMostOfLook; ++i) {
      const auto event = tap_.take();
      if (!event) return Looked::kNothing;
      lost_ += event->lost();
      if (is_shown(*event)) print(*event);
      if ((options_.count != 0 && printed_ == options_.count) || !std::cout) return Looked::kEnough;
    }
    return Looked::kMore;
  }

  static TapOptions tap_options(TapOf of) {
    TapOptions options;
    options.of = of;
    return options;
  }

  // Of an input port: what it accepts, unless losers are asked for.
  [[nodiscard]] bool is_shown(const TapEvent<>& event) const {
    switch (event.kind()) {
      case TapEventKind::sample:
        return !is_input_ || options_.losers || event.at(options_.port) == Fate::accepted;
      case TapEventKind::signal:
      case TapEventKind::deactivation:
      case TapEventKind::dropped:
      case TapEventKind::overtaken:
        return !is_input_ || options_.losers;
      default:
        return false;
    }
  }

  void print(const TapEvent<>& event) {
    ++printed_;
    ++by_source_[event.source()];
    options_.json ? print_json(event) : print_text(event);
  }

  void print_json(const TapEvent<>& event) {
    nlohmann::json fates = nlohmann::json::object();
    for (const TapDestination& met : event.destinations()) {
      if (met.fate != Fate::none) fates[std::string(met.port)] = name_of(met.fate);
    }
    nlohmann::json line{{"port", options_.port},
                        {"source", event.source()},
                        {"kind", name_of(event.kind())},
                        {"sequence", event.sequence()},
                        {"stamp_ns", event.time().time_since_epoch().count()},
                        {"size", event.size()},
                        {"generation", event.generation()},
                        {"fates", fates}};
    line["type"] =
        event.type().is_untyped() ? nlohmann::json() : nlohmann::json(event.type().name());
    if (event.count() != 0) line["count"] = event.count();
    if (event.origin().publisher != 0) {
      line["origin"] = hosts_.json_of(std::string(event.source()), event.origin());
    }
    if (options_.hex && event.sample()) {
      line["data"] = hex_of(*event.sample(), event.sample()->size());
    }
    std::cout << line.dump() << '\n';
  }

  void print_text(const TapEvent<>& event) {
    std::cout << seconds_text(event.time().time_since_epoch().count() - started_) << "  "
              << (event.source().empty() ? "(source not known)" : event.source());
    if (event.count() != 0) {
      std::cout << "  " << rules::counted(event.count(), "sample") << ' ' << name_of(event.kind())
                << '\n';
      return;
    }
    if (event.kind() != TapEventKind::sample) {
      std::cout << "  " << name_of(event.kind()) << fates_text(event) << '\n';
      return;
    }
    std::cout << "  #" << event.sequence()
              << hosts_.text(std::string(event.source()), event.origin()) << "  "
              << rules::counted(event.size(), "byte");
    if (!event.sample()) {
      std::cout << "  (overwritten)" << fates_text(event) << '\n';
    } else if (options_.hex) {
      std::cout << fates_text(event) << '\n' << hex_dump(*event.sample());
    } else {
      std::cout << "  " << preview(*event.sample()) << fates_text(event) << '\n';
    }
  }

  // "  accepted at /Arm/pos:i". What was accepted at the port in question goes without saying.
  [[nodiscard]] std::string fates_text(const TapEvent<>& event) const {
    if (is_input_) {
      return options_.losers && event.at(options_.port) != Fate::none
                 ? std::string("  ") + name_of(event.at(options_.port))
                 : "";
    }
    std::string text;
    for (const TapDestination& met : event.destinations()) {
      if (met.fate == Fate::none) continue;
      text += (text.empty() ? "  " : ", ") + std::string(name_of(met.fate)) + " at ";
      text += met.port;
    }
    return text;
  }

  // On standard error beside JSON, which is for programs.
  int finish() {
    if (!std::cout) return 0;  // nobody reads it
    std::ostream& out = options_.json ? std::cerr : std::cout;
    out << rules::counted(printed_, is_input_ && !options_.losers ? "sample" : "event") << " in "
        << seconds_text(shm::monotonic_now() - started_);
    for (const auto& [source, count] : by_source_) out << ", " << count << " from " << source;
    out << '\n';
    if (lost_ != 0) {
      std::cerr << "arbiter: " << lost_ << " more came faster than they could be printed\n";
    }
    return 0;
  }

  const EchoOptions& options_;
  const bool is_input_;
  EchoNews& news_;
  const shm::FileDescriptor& interrupts_;
  EchoHosts hosts_{options_.instance};
  Node node_;
  Tap<> tap_;
  const shm::Nanoseconds started_;
  std::uint64_t printed_ = 0;
  std::uint64_t lost_ = 0;
  std::map<std::string, std::uint64_t> by_source_;
};

}  // namespace

namespace {

// Empty: the policy does not let us ask, or the daemon has just gone.
std::optional<wire::Status> status_of(watch::Instance& instance) {
  try {
    return instance.status();
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

// Nothing comes then until somebody opens it. A name that only a watcher has given may be misspelt.
void say_if_nobody_has_it(const std::string& port, watch::Instance& instance, bool is_in_model) {
  const auto status = status_of(instance);
  if (!status) return;
  std::vector<std::string_view> open;
  for (const auto& each : status->sources) {
    if (each.open) open.emplace_back(each.name);
  }
  for (const auto& each : status->inputs) {
    if (each.open) open.emplace_back(each.name);
  }
  if (std::find(open.begin(), open.end(), port) != open.end()) return;
  const auto similar = is_in_model ? std::nullopt : rules::find_similar(port, open);
  std::cerr << "arbiter: no component has " << port << " open"
            << (similar ? "; did you mean " + rules::quote(*similar) + "?" : "; waiting for one")
            << '\n';
}

}  // namespace

TapOf kind_of_port(const EchoOptions& options, watch::Instance* instance) {
  const auto by_name = [&] {
    const std::string& port = options.port;
    const bool is_input = port.size() > 2 && port.compare(port.size() - 2, 2, ":i") == 0;
    return is_input ? TapOf::input : TapOf::output;
  };
  if (instance == nullptr) return by_name();  // or the tap will say what is wrong
  const auto source = instance->find_source(options.port);
  const auto port = instance->find_port(options.port);
  if (source || port) {
    const auto table = instance->memory()->tables().snapshot().table;
    const bool is_in_model = source ? table.knows_source(*source) : table.knows_port(*port);
    say_if_nobody_has_it(options.port, *instance, is_in_model);
    return source ? TapOf::output : TapOf::input;
  }
  const auto status = status_of(*instance);
  if (const auto meant = status ? watch::port_of_topic(*status, options.port) : std::string();
      !meant.empty()) {
    std::cerr << "arbiter: " << options.port << " is no port: " << meant << '\n';
    return by_name();
  }
  std::vector<std::string_view> known;
  for (const auto& [id, name] : instance->port_names()) known.emplace_back(name);
  for (shm::SourceId id = 0; id < shm::kMaxSources; ++id) {
    const std::string& name = instance->memory()->source_name(id);
    if (!name.empty()) known.emplace_back(name);
  }
  const bool is_pattern = options.port.find('*') != std::string::npos;
  std::cerr << "arbiter: no model and no component has named " << options.port << " yet"
            << (is_pattern ? "; echo takes one port, not a pattern" : "")
            << rules::advise(options.port, known, "`arbiter status` shows the ports that there are")
            << '\n';
  return by_name();
}

int echo_tap(const EchoOptions& options, const shm::FileDescriptor& interrupts) {
  EchoNews news(options.instance, options.port, interrupts);
  return TapEcho(options, kind_of_port(options, news.instance()), news, interrupts).run();
}

}  // namespace arbiter::cli
