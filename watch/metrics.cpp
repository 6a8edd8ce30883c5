#include "watch/metrics.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <initializer_list>
#include <string_view>
#include <utility>

#include "shm/activity.hpp"

namespace arbiter::watch {
namespace {

constexpr std::string_view kPrefix = "arbiter_";

struct Label {
  std::string_view name;
  std::string_view value;
};
using Labels = std::initializer_list<Label>;

// Backslash, quote and line feed are all that the format asks for.
std::string escaped(std::string_view value) {
  std::string text;
  for (const char c : value) {
    if (c == '\n') {
      text += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') text += '\\';
    text += c;
  }
  return text;
}

std::string seconds(std::int64_t count, std::int64_t per_second, int digits) {
  char text[64];
  const std::int64_t rest = count % per_second;
  std::snprintf(text, sizeof text, "%s%lld.%0*lld", count < 0 && count / per_second == 0 ? "-" : "",
                static_cast<long long>(count / per_second), digits,
                static_cast<long long>(rest < 0 ? -rest : rest));
  return text;
}

// Samples of one metric must stand together, below its HELP and TYPE.
class Exposition {
 public:
  enum class Kind : std::uint8_t { kGauge, kCounter };

  void begin(std::string_view name, Kind kind, std::string_view help) {
    name_ = std::string(kPrefix) + std::string(name);
    text_ += "# HELP " + name_ + ' ' + std::string(help) + "\n# TYPE " + name_ +
             (kind == Kind::kCounter ? " counter\n" : " gauge\n");
  }
  void add(Labels labels, std::string_view value) {
    text_ += name_;
    char separator = '{';
    for (const Label& label : labels) {
      text_ += separator + std::string(label.name) + "=\"" + escaped(label.value) + '"';
      separator = ',';
    }
    text_ += labels.size() == 0 ? " " : "} ";
    text_ += std::string(value) + '\n';
  }
  void add(Labels labels, std::uint64_t value) { add(labels, std::to_string(value)); }

  std::string take() { return std::move(text_); }

 private:
  std::string name_;
  std::string text_;
};

using Kind = Exposition::Kind;
using wire::ConnectionStatus;
using wire::InputStatus;
using wire::OpenInput;
using wire::OpenOutput;
using wire::SourceStatus;

// A number in each object of one kind.
template <typename Object>
struct Number {
  std::string_view name;
  Kind kind;
  std::string_view help;
  std::uint64_t (*value)(const Object&);
};

constexpr std::array kOutputNumbers{
    Number<OpenOutput>{"source_samples_published_total", Kind::kCounter,
                       "Samples that the output port has published.",
                       [](const OpenOutput& o) { return o.published; }},
    Number<OpenOutput>{"source_signals_total", Kind::kCounter, "Arrivals without a sample.",
                       [](const OpenOutput& o) { return o.signals; }},
    Number<OpenOutput>{"source_samples_delivered_total", Kind::kCounter,
                       "Samples that an input port accepted.",
                       [](const OpenOutput& o) { return o.delivered; }},
    Number<OpenOutput>{"source_samples_discarded_total", Kind::kCounter,
                       "Samples that lost the decision at an input port.",
                       [](const OpenOutput& o) { return o.discarded; }},
    Number<OpenOutput>{"source_samples_refused_total", Kind::kCounter,
                       "Samples that won, and were refused.",
                       [](const OpenOutput& o) { return o.refused; }},
    Number<OpenOutput>{"source_decisions_blind_total", Kind::kCounter,
                       "Decisions that needed a source which the port could not see yet.",
                       [](const OpenOutput& o) { return o.blind; }},
    Number<OpenOutput>{"source_decisions_unsettled_total", Kind::kCounter,
                       "Decisions without a consistent picture of all activities.",
                       [](const OpenOutput& o) { return o.unsettled; }},
    Number<OpenOutput>{"source_loans_without_slot_total", Kind::kCounter,
                       "Samples for which no slot was free.",
                       [](const OpenOutput& o) { return o.no_slot; }},
    Number<OpenOutput>{"source_arrivals_late_total", Kind::kCounter,
                       "Samples and signals that came after their deadlines.",
                       [](const OpenOutput& o) { return o.late; }},
    Number<OpenOutput>{"source_sample_bytes", Kind::kGauge,
                       "Size of a sample by its type; 0 for an untyped port.",
                       [](const OpenOutput& o) { return o.type ? o.type->size : 0; }},
    Number<OpenOutput>{"source_taps", Kind::kGauge, "Taps that watch the output port.",
                       [](const OpenOutput& o) { return std::uint64_t{o.taps.size()}; }}};

constexpr std::array kInputNumbers{
    Number<OpenInput>{"port_samples_taken_total", Kind::kCounter,
                      "Samples that the component has taken.",
                      [](const OpenInput& i) { return i.taken; }},
    Number<OpenInput>{"port_samples_dropped_total", Kind::kCounter,
                      "Samples that lost the decision when they were to be taken.",
                      [](const OpenInput& i) { return i.dropped; }},
    Number<OpenInput>{"port_samples_overtaken_total", Kind::kCounter,
                      "Samples that were lost to newer ones because the queue was full.",
                      [](const OpenInput& i) { return i.overtaken; }},
    Number<OpenInput>{"port_takes_blind_total", Kind::kCounter,
                      "Takes that needed a source which the port could not see yet.",
                      [](const OpenInput& i) { return i.blind; }},
    Number<OpenInput>{"port_takes_unsettled_total", Kind::kCounter,
                      "Takes without a consistent picture of all activities.",
                      [](const OpenInput& i) { return i.unsettled; }},
    Number<OpenInput>{"port_entries_misbehaved_total", Kind::kCounter,
                      "Entries of queues that no honest publisher writes.",
                      [](const OpenInput& i) { return i.misbehaved; }},
    Number<OpenInput>{"port_idles_total", Kind::kCounter,
                      "Times that the component was told that the port became idle.",
                      [](const OpenInput& i) { return i.idles; }},
    Number<OpenInput>{"port_depth_samples", Kind::kGauge,
                      "Samples that may wait on each connection of the port.",
                      [](const OpenInput& i) { return std::uint64_t{i.depth}; }},
    Number<OpenInput>{"port_sample_bytes", Kind::kGauge,
                      "Size of a sample by the type that the port takes; 0 for an untyped port.",
                      [](const OpenInput& i) { return i.type ? i.type->size : 0; }}};

std::uint64_t has_trouble(const auto& open) { return open && open->trouble.value_or(false); }

constexpr std::array kSourceNumbers{
    Number<SourceStatus>{"source_active", Kind::kGauge, "Whether the source is active now.",
                         [](const SourceStatus& s) { return std::uint64_t{s.active}; }},
    Number<SourceStatus>{"source_mentioned", Kind::kGauge,
                         "Whether the model in force mentions the source.",
                         [](const SourceStatus& s) { return std::uint64_t{s.mentioned}; }},
    Number<SourceStatus>{"source_open", Kind::kGauge,
                         "Whether a component has the output port open.",
                         [](const SourceStatus& s) { return std::uint64_t{s.open.has_value()}; }},
    Number<SourceStatus>{
        "source_away", Kind::kGauge,
        "Whether its component lives, and has not come back to this daemon yet.",
        [](const SourceStatus& s) { return std::uint64_t{s.away_pid.has_value()}; }},
    Number<SourceStatus>{"source_trouble", Kind::kGauge,
                         "Whether its component says that something is wrong behind the port.",
                         [](const SourceStatus& s) { return has_trouble(s.open); }}};

constexpr std::array kPortNumbers{
    Number<InputStatus>{"port_idle", Kind::kGauge, "Whether nobody commands the input port.",
                        [](const InputStatus& p) { return std::uint64_t{p.idle}; }},
    Number<InputStatus>{
        "port_winner_cannot_deliver", Kind::kGauge,
        "Whether a connection is selected that cannot deliver.",
        [](const InputStatus& p) { return std::uint64_t{p.cannot_deliver.has_value()}; }},
    Number<InputStatus>{"port_mentioned", Kind::kGauge,
                        "Whether the model in force mentions the port.",
                        [](const InputStatus& p) { return std::uint64_t{p.mentioned}; }},
    Number<InputStatus>{"port_arbitrated", Kind::kGauge,
                        "Whether the model in force has rules for the port.",
                        [](const InputStatus& p) { return std::uint64_t{p.arbitrated}; }},
    Number<InputStatus>{"port_rules_in_order", Kind::kGauge,
                        "Whether the rules of the port are tried in order.",
                        [](const InputStatus& p) { return std::uint64_t{p.in_order}; }},
    Number<InputStatus>{"port_open", Kind::kGauge, "Whether a component has the input port open.",
                        [](const InputStatus& p) { return std::uint64_t{p.open.has_value()}; }},
    Number<InputStatus>{"port_away", Kind::kGauge,
                        "Whether its component lives, and has not come back to this daemon yet.",
                        [](const InputStatus& p) { return std::uint64_t{p.away_pid.has_value()}; }},
    Number<InputStatus>{"port_trouble", Kind::kGauge,
                        "Whether its component says that something is wrong behind the port.",
                        [](const InputStatus& p) { return has_trouble(p.open); }}};

constexpr std::array kConnectionNumbers{
    Number<ConnectionStatus>{"connection_winner", Kind::kGauge,
                             "Whether the connection commands the port.",
                             [](const ConnectionStatus& c) { return std::uint64_t{c.winner}; }},
    Number<ConnectionStatus>{
        "connection_connected", Kind::kGauge, "Whether both ends are open and connected.",
        [](const ConnectionStatus& c) { return std::uint64_t{c.is_connected()}; }},
    Number<ConnectionStatus>{
        "connection_mismatch", Kind::kGauge, "Whether both ends are open and cannot be connected.",
        [](const ConnectionStatus& c) { return std::uint64_t{c.mismatch.has_value()}; }},
    Number<ConnectionStatus>{"connection_samples_accepted_total", Kind::kCounter,
                             "Samples that were put into the queue.",
                             [](const ConnectionStatus& c) { return c.accepted; }},
    Number<ConnectionStatus>{"connection_samples_discarded_total", Kind::kCounter,
                             "Samples that lost the decision when they arrived.",
                             [](const ConnectionStatus& c) { return c.discarded; }},
    Number<ConnectionStatus>{"connection_samples_refused_total", Kind::kCounter,
                             "Samples that won, and were refused because the queue was full.",
                             [](const ConnectionStatus& c) { return c.refused; }},
    Number<ConnectionStatus>{"connection_samples_taken_total", Kind::kCounter,
                             "Samples that the component has taken.",
                             [](const ConnectionStatus& c) { return c.taken; }},
    Number<ConnectionStatus>{"connection_samples_dropped_total", Kind::kCounter,
                             "Samples that lost the decision when they were to be taken.",
                             [](const ConnectionStatus& c) { return c.dropped; }},
    Number<ConnectionStatus>{"connection_samples_overtaken_total", Kind::kCounter,
                             "Samples that were lost to newer ones because the queue was full.",
                             [](const ConnectionStatus& c) { return c.overtaken; }},
    Number<ConnectionStatus>{"connection_samples_waiting", Kind::kGauge,
                             "Samples in the queue now.",
                             [](const ConnectionStatus& c) { return c.waiting; }},
    Number<ConnectionStatus>{
        "connection_depth_samples", Kind::kGauge,
        "Samples that the queue can hold; 0 while not connected.",
        [](const ConnectionStatus& c) { return std::uint64_t{c.depth.value_or(0)}; }}};

// A metric that has one value.
void add_one(Exposition& out, std::string_view name, Kind kind, std::string_view help,
             std::string_view value) {
  out.begin(name, kind, help);
  out.add({}, value);
}

void add_up(Exposition& out, bool is_up) {
  add_one(out, "up", Kind::kGauge, "Whether arbiterd answers.", is_up ? "1" : "0");
}

void add_daemon(Exposition& out, const wire::Status& status) {
  out.begin("daemon_info", Kind::kGauge, "The instance and the process of the daemon; always 1.");
  out.add({{"name", status.instance}, {"pid", std::to_string(status.pid)}}, 1);
  add_one(out, "clients", Kind::kGauge, "Connections to the daemon's socket.",
          std::to_string(status.clients));
  add_one(out, "strangers", Kind::kGauge, "Components that the daemon cannot take back.",
          std::to_string(status.strangers.size()));
}

void add_model(Exposition& out, const wire::Status& status) {
  const wire::ModelStatus& model = status.model;
  add_one(out, "model_generation", Kind::kGauge, "Number of the model in force; 0: none is.",
          std::to_string(model.generation));
  out.begin("model_info", Kind::kGauge, "The model in force.");
  std::string files;
  for (const std::string& file : model.files) files += (files.empty() ? "" : ",") + file;
  if (model.generation != 0) {
    out.add({{"name", model.name.value_or("")},
             {"files", files},
             {"application", model.application.value_or("")}},
            1);
  }
  out.begin("model_in_force_timestamp_seconds", Kind::kGauge,
            "When the model came into force, in seconds since 1970.");
  if (!status.history.empty()) out.add({}, seconds(status.history.front().since_ms, 1000, 3));
  add_one(out, "models_loaded", Kind::kGauge, "Models that can be switched to.",
          std::to_string(status.models.size()));
  add_one(out, "reloads_refused_total", Kind::kCounter,
          "Reloads that were refused since the daemon started.",
          std::to_string(model.reloads_refused));
}

std::string type_name(const auto& open) { return open.type ? open.type->name : ""; }

void add_sources(Exposition& out, const std::vector<SourceStatus>& sources) {
  for (const auto& number : kSourceNumbers) {
    out.begin(number.name, number.kind, number.help);
    for (const SourceStatus& source : sources)
      out.add({{"source", source.name}}, number.value(source));
  }
  out.begin("source_timeout_seconds", Kind::kGauge,
            "How long an arrival keeps the source active; +Inf: until it is deactivated.");
  for (const SourceStatus& source : sources) {
    const bool is_forever = source.timeout == shm::kForever;
    out.add({{"source", source.name}},
            is_forever ? "+Inf" : seconds(source.timeout, 1'000'000'000, 9));
  }
  out.begin("source_info", Kind::kGauge, "Who has the output port open, and its type.");
  for (const SourceStatus& source : sources) {
    if (!source.open) continue;
    const wire::Component& component = source.open->component;
    out.add({{"source", source.name},
             {"node", component.node},
             {"pid", std::to_string(component.pid)},
             {"user", std::to_string(component.user)},
             {"type", type_name(*source.open)}},
            1);
  }
  for (const auto& number : kOutputNumbers) {
    out.begin(number.name, number.kind, number.help);
    for (const SourceStatus& source : sources) {
      if (source.open) out.add({{"source", source.name}}, number.value(*source.open));
    }
  }
}

void add_ports(Exposition& out, const std::vector<InputStatus>& ports) {
  for (const auto& number : kPortNumbers) {
    out.begin(number.name, number.kind, number.help);
    for (const InputStatus& port : ports) out.add({{"port", port.name}}, number.value(port));
  }
  out.begin("port_info", Kind::kGauge, "Who has the input port open, and how.");
  for (const InputStatus& port : ports) {
    if (!port.open) continue;
    const OpenInput& open = *port.open;
    const bool drops = open.when_full == wire::WhenFull::kDropOldest;
    out.add({{"port", port.name},
             {"node", open.component.node},
             {"pid", std::to_string(open.component.pid)},
             {"user", std::to_string(open.component.user)},
             {"type", type_name(open)},
             {"keep", open.keep ? "true" : "false"},
             {"when_full", drops ? "drop_oldest" : "refuse_new"}},
            1);
  }
  for (const auto& number : kInputNumbers) {
    out.begin(number.name, number.kind, number.help);
    for (const InputStatus& port : ports) {
      if (port.open) out.add({{"port", port.name}}, number.value(*port.open));
    }
  }
}

void add_connections(Exposition& out, const std::vector<InputStatus>& ports) {
  for (const auto& number : kConnectionNumbers) {
    out.begin(number.name, number.kind, number.help);
    for (const InputStatus& port : ports) {
      for (const ConnectionStatus& connection : port.connections) {
        out.add({{"port", port.name}, {"source", connection.source}}, number.value(connection));
      }
    }
  }
}

}  // namespace

std::string metrics_of(const wire::Status& status) {
  Exposition out;
  add_up(out, true);
  add_daemon(out, status);
  add_model(out, status);
  add_sources(out, status.sources);
  add_ports(out, status.inputs);
  add_connections(out, status.inputs);
  return out.take();
}

std::string metrics_of_no_daemon() {
  Exposition out;
  add_up(out, false);
  return out.take();
}

}  // namespace arbiter::watch
