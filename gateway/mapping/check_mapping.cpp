#include "gateway/mapping/check_mapping.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/mapping/check_topics.hpp"
#include "gateway/mapping/ros_names.hpp"
#include "rules/model/polarity.hpp"
#include "rules/text/duration.hpp"
#include "rules/text/names.hpp"

namespace arbiter::gateway {
namespace {

class MappingCheck {
 public:
  MappingCheck(const std::vector<Mapping>& mappings, const rules::RuleSet* model,
               rules::Diagnostics& diagnostics)
      : model_(model), diagnostics_(diagnostics) {
    for (const Mapping& mapping : mappings) {
      for (const Gateway& gateway : mapping.gateways) {
        for (const Entry& entry : gateway.entries) {
          // What it lacks, because it was refused, would seem to be wrong, too.
          if (!entry.has_errors) entries_.push_back(&entry);
        }
      }
    }
  }

  void check() {
    check_ports();
    for (const Entry* each : entries_) {
      check_idle(*each);
      check_history(*each);
    }
    if (model_ == nullptr) return;
    list_model();
    for (const Entry* each : entries_) check_names(*each);
    for (const Entry* each : entries_) check_boolean(*each);
    check_choices();
    check_latched();
    check_types();
  }

 private:
  void check_ports() {
    std::map<std::pair<bool, std::string>, const Port*> known;
    for (const Entry* each : entries_) {
      for (const Port* port : each->ports()) {
        const auto [first, is_new] = known.try_emplace({each->is_in(), port->name}, port);
        if (is_new) continue;
        diagnostics_.error("duplicate-port", port->where,
                           "the port " + rules::quote(port->name) + " has an entry already, at " +
                               rules::describe(first->second->where) +
                               "; a port is opened once: remove one of the two, or rename it",
                           {.ports = {port->name}});
      }
    }
  }

  void check_idle(const Entry& entry) {
    if (entry.is_in() || entry.idle.kind != Idle::Kind::kNothing) return;
    const bool may_be_zero = !entry.type || !has_strings(entry.type->name) ||
                             size_without_frame(entry.type->name).has_value();
    diagnostics_.note("no-idle", entry.where,
                      "while " + entry.port->name + " is idle nothing is sent to " +
                          entry.outside() + ", so that whoever obeys it must stop by itself; add " +
                          (may_be_zero ? "idle=\"zero\", or " : "") +
                          "a sample that says stop: idle=\"file:…\"",
                      {.ports = {entry.port->name}});
  }

  // A writer that keeps all waits for its slowest reader.
  void check_history(const Entry& entry) {
    if (entry.is_in() || !entry.dds || entry.idle.kind == Idle::Kind::kNothing) return;
    const Qos& qos = entry.dds->qos;
    if (qos.history != History::kKeepAll || qos.reliability != Reliability::kReliable) return;
    diagnostics_.warning("held-up-idle", entry.where,
                         "with history=\"keep_all\" one subscriber that does not keep up, or is "
                         "stopped, keeps everything from all others until DDS gives it up, also "
                         "what " +
                             entry.outside() + " is sent while " + entry.port->name +
                             " is idle; write history=\"keep_last\"",
                         {.ports = {entry.port->name}});
  }

  void list_model() {
    sources_.insert(model_->sources.begin(), model_->sources.end());
    for (const auto& [source, timeout] : model_->timeouts) sources_.insert(source);
    for (const rules::PortRules& port : model_->ports) {
      ports_.insert(port.port);
      for (const rules::ConnectionRule& rule : port.rules) {
        sources_.insert(rule.source);
        connections_.emplace_back(rule.source, port.port);
      }
    }
    for (const rules::Connection& connection : model_->other_connections) {
      ports_.insert(connection.port);
      sources_.insert(connection.source);
      connections_.emplace_back(connection.source, connection.port);
    }
  }

  void check_names(const Entry& entry) {
    const std::set<std::string>& right = entry.is_in() ? sources_ : ports_;
    const std::set<std::string>& wrong = entry.is_in() ? ports_ : sources_;
    for (const Port* port : entry.ports()) {
      if (right.contains(port->name)) continue;
      if (wrong.contains(port->name)) {
        diagnostics_.error("wrong-direction", port->where,
                           rules::quote(port->name) +
                               (entry.is_in() ? " is an input port in the model, and <in> feeds an "
                                                "output port; write <out>, or another port"
                                              : " is an output port in the model, and <out> sends "
                                                "what an input port takes; write <in>, or another "
                                                "port"),
                           {.ports = {port->name}});
        continue;
      }
      // Of the two sources that a topic chooses between, a model seldom needs both.
      if (is_any_in(right, entry)) continue;
      std::vector<std::string_view> candidates;
      if (suggestions_++ < rules::kMaxSuggestions) candidates.assign(right.begin(), right.end());
      diagnostics_.warning(
          "unmentioned-port", port->where,
          "the model does not mention " + rules::quote(port->name) + ", so that " +
              what_comes_of(entry) +
              rules::advise(port->name, candidates, "correct the name, or connect it in the model"),
          {.ports = {port->name}});
    }
  }

  static bool is_any_in(const std::set<std::string>& names, const Entry& entry) {
    const auto ports = entry.ports();
    return std::any_of(ports.begin(), ports.end(),
                       [&](const Port* port) { return names.contains(port->name); });
  }

  // Of one that the model does not mention.
  static const char* what_comes_of(const Entry& entry) {
    if (entry.is_in()) return "nothing of it is delivered";
    return entry.idle.kind == Idle::Kind::kNothing ? "nothing comes of it"
                                                   : "nothing but the idle sample comes of it";
  }

  // A source that is only read, of a topic that says yes and no: both would be arrivals.
  void check_boolean(const Entry& entry) {
    if (!entry.is_in() || entry.choice || !entry.type) return;
    const std::string& source = entry.port->name;
    const auto is_of_it = [&](const auto& connection) { return connection.first == source; };
    if (entry.type->name != "std_msgs/msg/Bool" || !sources_.contains(source) ||
        std::any_of(connections_.begin(), connections_.end(), is_of_it)) {
      return;
    }
    diagnostics_.warning("either-way", entry.where,
                         "each sample of " + entry.outside() + " makes " + rules::quote(source) +
                             " active, whether it says true or false; write true=\"…\" or "
                             "false=\"…\" in place of port=\"…\"",
                         {.ports = {}, .source = source});
  }

  // A Boolean that nobody repeats must not stay true for ever: where a condition asks for it, its
  // sender's silence would be taken for consent.
  void check_choices() {
    std::map<std::string, const Port*> forever;
    for (const Entry* each : entries_) {
      if (!each->choice) continue;
      for (const Port* port : each->ports()) {
        if (model_->timeout_of(port->name) == shm::kForever) forever.emplace(port->name, port);
      }
    }
    if (forever.empty()) return;
    rules::Polarity polarity;
    for (const rules::PortRules& port : model_->ports) {
      for (const rules::ConnectionRule& rule : port.rules) {
        polarity.visit(*rule.condition);
        polarity.add(rule.source, true);
      }
    }
    for (const auto& [name, port] : forever) {
      if (!polarity.required().contains(name)) continue;
      diagnostics_.error(
          "forever-choice", port->where,
          "a condition requires " + rules::quote(name) +
              " to be active, and its T is forever: a publisher that dies would be taken for one "
              "that still says so; give the source a timeout in the model, a little longer than "
              "the period of its topic",
          {.ports = {}, .source = name});
    }
  }

  // A topic that keeps samples for those who come later brings old ones. That is right where what
  // was said before still holds, and would otherwise make an old sample an arrival.
  void check_latched() {
    for (const Entry* each : entries_) {
      const Entry& entry = *each;
      if (!entry.is_in() || !entry.dds) continue;
      if (entry.dds->qos.durability == Durability::kVolatile) continue;
      for (const Port* port : entry.ports()) {
        const shm::Nanoseconds timeout = model_->timeout_of(port->name);
        if (timeout == shm::kForever && !entry.max_age) continue;
        diagnostics_.error(
            "late-history", port->where,
            "the topic also brings samples that were published before the gateway came, and " +
                (entry.max_age
                     ? "the entry has a max_age="
                     : "T of " + rules::quote(port->name) + " is " + rules::to_string(timeout)) +
                ": an old sample must not become an arrival; if old samples still hold, give the "
                "source timeout=\"forever\" in the model, and the entry no max_age=; otherwise "
                "write durability=\"volatile\", which matches such publishers, too",
            {.ports = {}, .source = port->name});
      }
    }
  }

  void check_types() {
    std::map<std::string, const Entry*> ins;
    std::map<std::string, const Entry*> outs;
    for (const Entry* each : entries_) {
      for (const Port* port : each->ports()) {
        (each->is_in() ? ins : outs).emplace(port->name, each);
      }
    }
    for (const auto& [source, port] : connections_) {
      const auto in = ins.find(source);
      const auto out = outs.find(port);
      if (in == ins.end() || out == outs.end()) continue;
      check_type(*in->second, source, *out->second, port);
    }
  }

  void check_type(const Entry& in, const std::string& source, const Entry& out,
                  const std::string& port) {
    if (!out.type) {  // takes anything
      check_header(in, source, out, port);
      return;
    }
    const auto describe = [](const std::optional<PortType>& type) {
      if (!type) return std::string("samples without a type");
      return type->name + (type->size == 0 ? "" : " of " + std::to_string(type->size) + " bytes");
    };
    const bool are_equal = in.type && in.type->name == out.type->name &&
                           in.type->size == out.type->size &&
                           (in.type->size == 0 || in.type->alignment == out.type->alignment);
    if (are_equal) {
      check_header(in, source, out, port);
      return;
    }
    diagnostics_.error("types-differ", out.where,
                       "the model connects " + source + " to " + port + ", but " + in.outside() +
                           " (" + rules::describe(in.where) + ") brings " + describe(in.type) +
                           ", and " + out.outside() + " takes " + describe(out.type) +
                           "; such ports are not connected: correct one of the types",
                       {.ports = {port}, .source = source});
  }

  // A type says nothing of where the payload begins.
  void check_header(const Entry& in, const std::string& source, const Entry& out,
                    const std::string& port) {
    if (have_one_header(in, out)) return;
    diagnostics_.error("headers-differ", out.where,
                       "the model connects " + source + " to " + port + ", but " + in.outside() +
                           " (" + rules::describe(in.where) + ") brings samples with " +
                           header_text(in) + ", and " + out.outside() + " sends samples with " +
                           header_text(out) +
                           ": bytes of the header would be sent as data, or data as a header; " +
                           header_advice(in, out),
                       {.ports = {port}, .source = source});
  }

  const rules::RuleSet* const model_;
  rules::Diagnostics& diagnostics_;
  std::vector<const Entry*> entries_;
  std::set<std::string> sources_, ports_;  // of the model
  std::vector<std::pair<std::string, std::string>> connections_;
  std::size_t suggestions_ = 0;
};

}  // namespace

void check_mappings(const std::vector<Mapping>& mappings, const rules::RuleSet* model,
                    rules::Diagnostics& diagnostics) {
  check_topics(mappings, diagnostics);
  MappingCheck(mappings, model, diagnostics).check();
}

}  // namespace arbiter::gateway
