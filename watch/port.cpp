#include "watch/port.hpp"

#include <string>
#include <string_view>
#include <utility>

#include "rules/prove/table_rules.hpp"
#include "rules/text/names.hpp"
#include "shm/utf8.hpp"

namespace arbiter::watch {
namespace {

// Whether it is called so by what a component says of its port: its last word before a comma.
bool is_topic(std::string_view described, std::string_view name) {
  described = described.substr(0, described.find(','));
  const std::string word(described.substr(described.find_last_of(' ') + 1));
  return word == name || word == "rt" + std::string(name) || '/' + word == name;
}

std::string port_of_topic_among(const auto& ports, const char* how, std::string_view name) {
  for (const auto& port : ports) {
    if (!port.open || !is_topic(port.open->described.value_or(""), name)) continue;
    const std::string& described = *port.open->described;
    return port.name + how + shm::printable(described.substr(0, described.find(',')));
  }
  return {};
}

shm::PortId require_port(Instance& instance, const std::string& name) {
  if (const auto found = instance.find_port(name)) return *found;
  const wire::Status status = instance.status();
  if (const std::string port = port_of_topic(status, name); !port.empty()) {
    throw WatchError(name + " is no port: " + port);
  }
  std::vector<std::string_view> known;
  for (const auto& [id, each] : instance.port_names()) known.push_back(each);
  const auto model = ModelInForce::fetch(instance);
  throw WatchError("no model and no component has named the input port " + name + " (" +
                   model.text() + " is in force)" +
                   rules::advise(name, known, "`arbiter status` lists the ports that exist"));
}

}  // namespace

std::string port_of_topic(const wire::Status& status, std::string_view name) {
  const std::string source = port_of_topic_among(status.sources, " comes from ", name);
  return source.empty() ? port_of_topic_among(status.inputs, " goes to ", name) : source;
}

Port::Port(std::shared_ptr<Instance> instance, std::string name,
           std::shared_ptr<ModelLoader> models)
    : instance_(std::move(instance)),
      memory_(instance_->memory()),
      name_(std::move(name)),
      id_(require_port(*instance_, name_)),
      models_(models != nullptr ? std::move(models) : std::make_shared<ModelLoader>(instance_)) {}

void Port::find_again() { id_ = instance_->find_port(name_).value_or(id_); }

void Port::require_memory() const {
  if (instance_->memory() != memory_) {
    throw WatchError("another daemon has started without the memory of the last one; ask again");
  }
}

// What the table says of the picture.
void Port::read_table(Look& look) const {
  look.is_arbitrated = look.table().is_arbitrated(id_);
  look.is_mentioned = look.table().knows_port(id_);
  look.winner = look.picture.winner_at(id_);
  look.sources.set_time(look.picture.now);
  for (const auto& [source, word] : look.picture.words) {
    SourceState state{word, look.table().timeout(source), !look.picture.is_unseen(source)};
    state.began = look.picture.beginning_of(source);
    look.sources.set(source_name(source), state);
  }
}

Look Port::look() const {
  require_memory();
  Look look;
  do {
    look = {};
    look.picture = take_picture(*memory_, sources_at(id_));
    read_table(look);
  } while (!is_whole(look.picture.snapshot));
  return look;
}

Look Port::look_back(const KeptPicture& kept) const {
  require_memory();
  Look look;
  do {
    look = {};
    look.picture.snapshot = memory_->tables().snapshot();
    if (look.generation() != kept.generation) {
      throw WatchError("another model has come into force since; ask about now");
    }
    look.picture.now = kept.now;
    look.picture.is_settled = kept.is_settled;
    std::vector<shm::SourceId> sources;
    if (kept.generation != 0) sources = sources_at(id_)(look.table());
    for (const shm::SourceId source : sources) {
      const auto word = kept.words.find(source_name(source));
      look.picture.words[source] = word == kept.words.end() ? shm::kNeverActive : word->second;
      if (word == kept.words.end()) look.picture.unseen.push_back(source);
    }
    read_table(look);
  } while (!is_whole(look.picture.snapshot));
  return look;
}

void Port::add_timeouts(Look& look) const {
  const rules::Explainer explainer(model_->rules);
  for (const auto& [source, word] : look.picture.words) {
    const std::string& name = source_name(source);
    SourceState state = look.sources.state(name);
    if (model().has_texts()) {
      const auto where = explainer.place_of_timeout(name);
      state.timeout_place =
          where.file.empty() ? "default" : where.file + ":" + std::to_string(where.line);
    }
    if (const auto before = model().timeout_before(name)) {
      state.timeout_before = before->timeout;
      state.timeout_changed = before->until;
      state.word_at_change = before->word;
    }
    look.sources.set(name, state);
  }
}

std::optional<rules::PortExplanation> Port::explain(const Look& look) {
  if (model_ == nullptr || model().generation() != look.generation()) {
    auto loaded = models_->load(look.generation());
    require_memory();  // a daemon with memory of its own may have a model of that number
    model_ = std::move(loaded);
  }
  if (model().generation() != look.generation()) return std::nullopt;
  const auto is_active = [&](const std::string& source) { return look.sources.is_active(source); };
  if (!model().has_texts()) {
    const auto name_of = [this](shm::SourceId source) { return source_name(source); };
    const auto rules = rules::rules_of_table(look.table(), id_, name_, name_of);
    return rules::Explainer(rules).explain(name_, is_active);
  }
  auto explanation = rules::Explainer(model_->rules).explain(name_, is_active);
  const auto winner =
      look.winner == shm::kNone ? std::nullopt : std::optional(source_name(look.winner));
  if (explanation.winner != winner) {
    throw WatchError("the decision table and the model that it was made from differ at " + name_ +
                     "; this is a bug in arbiter: please report it");
  }
  return explanation;
}

}  // namespace arbiter::watch
