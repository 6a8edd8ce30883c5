#include "cli/live_port.hpp"

#include <algorithm>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/name_warnings.hpp"
#include "rules/explain/tenure.hpp"
#include "rules/model/load.hpp"
#include "rules/prove/table_rules.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/decision.hpp"

namespace arbiter::cli {
namespace {

// Observes, and finds the port among the names that the daemon tells.
shm::PortId find_port(detail::NodeCore& node, const std::string& name) {
  shm::Message observe;
  observe.kind = shm::MessageKind::kObserve;
  static_cast<void>(node.ask(observe, {-1, -1}));
  const auto names = node.port_names();
  std::vector<std::string_view> known;
  for (const auto& [id, each] : names) {
    if (each == name) return id;
    known.push_back(each);
  }
  const nlohmann::json status = fetch_status(node);
  for (const auto& source : status.at("sources")) {
    if (source.at("name") == name) {
      std::string message = name + " is an output port; give the input port first";
      message += ": arbiter why PORT " + name;
      throw Error(message);
    }
  }
  const auto model = ModelInForce::fetch(node);
  throw Error("no model and no component has named the input port " + name + " (" + model.text() +
              " is in force)" +
              rules::advise(name, known, "`arbiter status` shows those that there are"));
}

}  // namespace

shm::Nanoseconds Look::next_end() const {
  shm::Nanoseconds next = shm::kForever;
  for (const auto& [source, word] : words) {
    if (shm::is_finite(word) && shm::is_active(word, sources.now())) next = std::min(next, word);
  }
  return next;
}

LivePort::LivePort(std::shared_ptr<detail::NodeCore> node, std::string port)
    : node_(std::move(node)),
      memory_(node_->memory()),
      name_(std::move(port)),
      id_(find_port(*node_, name_)) {}

std::string LivePort::source_name(shm::SourceId source) const {
  return memory_->source_name(source);
}

// All words are collected, the clock is read, and all are looked at again: if they stand, they
// stood together when the clock was read.
Look LivePort::look() const {
  if (node_->memory() != memory_) {
    throw Error("another daemon has come, without the memory of the last one; ask again");
  }
  Look look;
  for (int tries = 0; tries < shm::kMaxPictures; ++tries) {
    look = {};
    look.snapshot = memory_->tables().snapshot();
    const shm::TableView& table = look.snapshot.table;
    look.is_arbitrated = table.is_arbitrated(id_);
    look.is_mentioned = table.knows_port(id_);
    std::map<shm::SourceId, const shm::Activity*> pages;
    std::map<shm::SourceId, shm::SeenActivity> seen;
    const auto sources = rules::sources_heeded(table, id_);
    for (const shm::SourceId source : sources) {
      const shm::Activity* activity = memory_->pages().find(source);
      if (activity == nullptr) continue;
      pages.emplace(source, activity);
      seen.emplace(source, shm::SeenActivity::of(*activity));
    }
    const shm::Nanoseconds now = shm::monotonic_now();
    look.is_settled = std::all_of(seen.begin(), seen.end(), [&](const auto& each) {
      const auto later = shm::SeenActivity::of(*pages.at(each.first));
      return each.second.stands(later, table.timeout(each.first), now);
    });
    look.sources.set_time(now);
    for (const shm::SourceId source : sources) {
      const auto found = seen.find(source);
      const bool is_visible = found != seen.end();
      const shm::ActivityWord word = is_visible ? found->second.word : shm::kNeverActive;
      look.words[source] = word;
      look.sources.set(source_name(source), {word, table.timeout(source), is_visible});
    }
    look.winner =
        look.is_arbitrated
            ? rules::winner_at(table, id_,
                               [&](shm::SourceId source) { return look.is_active(source); })
            : shm::kNone;
    if (memory_->tables().is_in_force(look.snapshot) && look.is_settled) break;
  }
  return look;
}

void LivePort::fetch_model() {
  model_ = ModelInForce::fetch(*node_);
  generation_ = model_.generation();
  rules_ = {};
  name_warnings_.clear();
  if (!model_.has_texts()) return;
  rules::Diagnostics diagnostics;
  rules_ = rules::load(model_.texts(), diagnostics, rules::Keep::kProvenance);
  if (diagnostics.has_errors()) {
    throw Error("the daemon's model is none to this program; are both of one version?");
  }
  name_warnings_ = cli::name_warnings(diagnostics);
}

void LivePort::add_timeouts(Look& look) const {
  const rules::Explainer explainer(rules_);
  for (const auto& [source, word] : look.words) {
    const std::string name = source_name(source);
    SourceState state = look.sources.state(name);
    if (model_.has_texts()) {
      const auto where = explainer.place_of_timeout(name);
      state.timeout_place =
          where.file.empty() ? "default" : where.file + ":" + std::to_string(where.line);
    }
    if (const auto before = model_.timeout_before(name)) {
      state.timeout_before = before->timeout;
      state.timeout_changed = before->until;
      state.word_at_change = before->word;
    }
    look.sources.set(name, state);
  }
}

std::optional<rules::PortExplanation> LivePort::explain(const Look& look) {
  if (generation_ != look.snapshot.generation) fetch_model();
  if (generation_ != look.snapshot.generation) return std::nullopt;
  const auto is_active = [&](const std::string& source) { return look.sources.is_active(source); };
  if (!model_.has_texts()) {
    const auto source_name = [this](shm::SourceId source) { return this->source_name(source); };
    const auto rules = rules::rules_of_table(look.snapshot.table, id_, name_, source_name);
    return rules::Explainer(rules).explain(name_, is_active);
  }
  auto explanation = rules::Explainer(rules_).explain(name_, is_active);
  const auto winner =
      look.winner == shm::kNone ? std::nullopt : std::optional(source_name(look.winner));
  if (explanation.winner != winner) {
    throw Error("the decision table and the model that it was made of differ at " + name_ +
                "; this is a mistake in arbiter: please report it");
  }
  return explanation;
}

}  // namespace arbiter::cli
