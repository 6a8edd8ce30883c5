// How another model, and another policy, come into force: read again, switched to, or gone back to.
//
// Whatever it is, it ends in one swap: the new table is written and its clients are told before it
// counts; they switch all at once. Changes wait for each other.
#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/comparison.hpp"
#include "service/daemon.hpp"
#include "service/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// What came of it, for those who want all of it. File names may be any bytes; JSON may not.
std::string report(const Daemon::Swap& swap, nlohmann::json document) {
  document["text"] = swap.findings.text();
  document["has_errors"] = swap.findings.has_errors();  // told in the text, in full
  document["findings"] = swap.findings.json();
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

// The model is in force: nothing may come of this but words.
nlohmann::json changes_or_why_not(const Model& before, const Model& after) {
  try {
    return changes_json(before.compiled, after.compiled);
  } catch (const std::exception& error) {
    const std::string why_not = std::string("not compared: ") + error.what();
    return {{"summary", why_not}, {"text", why_not + '\n'}, {"diff", nullptr}};
  }
}

}  // namespace

void Daemon::ask_for(Change change, const Client& client, const shm::Message& message) {
  change.by = client.description() + ", user " + describe_user(client.user());
  change.asking = {{client.id(), message.request, (message.flags & shm::kWantsReport) != 0}};
  changes_.add(std::move(change));
}

void Daemon::reload_for_signal(const std::string& by) {
  changes_.add({Change::Kind::kReload, {}, 0, by, {}});
}

// One at a time, so that others are served in between.
void Daemon::advance_changes() {
  if (swap_ || phase_ != Phase::kServing || changes_.empty()) return;
  Swap swap;
  swap.change = changes_.take_next();
  try {
    switch (swap.change.kind) {
      case Change::Kind::kReload:
        return prepare_reload(swap);
      case Change::Kind::kCompare:
        return compare_with_files(swap);
      case Change::Kind::kSwitch:
        return prepare_switch(swap);
      case Change::Kind::kRollback:
        return prepare_rollback(swap);
    }
  } catch (const std::exception& error) {
    if (swap.change.kind == Change::Kind::kReload) ++reloads_refused_;
    // What is found in files is in the log when they have been read.
    const char* const why =
        swap.findings.has_errors() ? "the files have errors, told above" : error.what();
    if (swap.change.kind == Change::Kind::kCompare) {
      log::info("{} asks what a reload would do: {}", swap.change.by, why);
    } else {
      log::error("the model in force stays: {}", why);
    }
    answer_refused(swap, error.what());
  }
}

Reading Daemon::read_files() const {
  if (files_.empty() && !gate_.has_file()) {
    throw std::runtime_error("there is no file to read again; start with --model");
  }
  Reading reading{Findings(is_strict_), {}, {}};
  reading.policy = gate_.read(reading.findings);
  reading.models = read_models(files_, reading.findings);
  return reading;
}

// Throws; then nothing has changed, and `swap` knows the findings.
void Daemon::prepare_reload(Swap& swap) {
  Reading reading = read_files();
  swap.findings = std::move(reading.findings);
  if (swap.findings.has_errors()) throw BadModel(swap.findings.first_error());
  if (files_.empty()) {
    gate_.put_in_force(*reading.policy);
    answer_done(swap, nullptr);
    return;
  }
  Library library(std::move(reading.models), directory_);
  const LoadedModel* next = library.find(models_.name());
  if (next == nullptr) next = library.first();
  swap.to = *next;
  swap.how = "reload";
  swap.is_compared = true;
  swap.content = content_of(*next);
  reserve_tables(library);
  swap.policy = std::move(reading.policy);
  swap.library = std::move(library);
  begin_swap(swap);
}

// What is in force, and comes into force once more as it is, is no step for a rollback. Tables say
// so, and not which object it is: what a rollback has put in force is not the library's. While both
// layouts live, a name has the same id in both.
std::uint64_t Daemon::content_of(const LoadedModel& next) const {
  const PastModel* const latest = history_.latest();
  const bool is_same = latest != nullptr && in_force_.layout != nullptr &&
                       in_force_.model->name == next.model->name &&
                       in_force_.layout->words() == next.layout->words();
  return is_same ? latest->content : 0;
}

// So that a switch does not fail for want of memory, either.
void Daemon::reserve_tables(const Library& library) {
  if (library.models().size() < 2) return;
  std::size_t words = 0;
  for (const LoadedModel& each : library.models()) {
    words = std::max(words, each.layout->words().size());
  }
  models_.reserve(words);
}

void Daemon::prepare_switch(Swap& swap) {
  const LoadedModel* const next = library_.find(swap.change.name);
  if (next == nullptr) {
    const std::string& name = swap.change.name;  // from a client: it must not break lines
    throw std::runtime_error(
        "there is no model " + (is_model_name(name) ? '"' + name + '"' : "of that name") +
        (library_.models().empty() ? "; none is loaded" : "; there are: " + library_.names()));
  }
  if (next->model == in_force_.model) {
    answer_done(swap, nullptr);
    return;
  }
  swap.to = *next;
  swap.how = "switch";
  swap.content = content_of(*next);
  begin_swap(swap);
}

void Daemon::prepare_rollback(Swap& swap) {
  const std::uint64_t asked = swap.change.generation;
  const PastModel* const past = asked == 0 ? history_.previous() : history_.find(asked);
  if (past == nullptr && asked == 0) {
    const PastModel* const oldest = history_.latest();
    if (oldest == nullptr) {
      throw std::runtime_error("there is no model to go back to: none has been in force");
    }
    throw std::runtime_error("model " + std::to_string(oldest->content) +
                             " is the oldest that is kept; arbiter history shows all");
  }
  if (past == nullptr) {
    throw std::runtime_error("model " + std::to_string(asked) +
                             " is not in the history; arbiter history shows what is");
  }
  if (past->model == nullptr) {
    throw std::runtime_error("model " + std::to_string(past->generation) +
                             " is not kept any longer, or was another daemon's; only its name is "
                             "known");
  }
  swap.to = {past->model, std::make_shared<const Layout>(past->model->compiled, directory_)};
  swap.how = "rollback to " + std::to_string(past->generation);
  swap.back_to = *past;
  swap.content = past->content;
  swap.is_compared = true;
  begin_swap(swap);
}

// Throws, and then nothing has changed, `swap` neither.
void Daemon::begin_swap(Swap& swap) {
  models_.prepare(*swap.to.layout, swap.to.model->name);
  swap_ = std::move(swap);
  auto told = switchboard_.link_all(models_.prepared());
  // The table itself, all who will read it have to map.
  for (const auto& [id, client] : clients_) {
    if (!client->ports.empty()) told.insert(client.get());
  }
  introduce(told, [this] { put_in_force(); });
}

void Daemon::put_in_force() {
  const Swap swap = std::move(*std::exchange(swap_, std::nullopt));
  if (swap.policy) gate_.put_in_force(*swap.policy);
  const auto last = models_.in_force();
  const shm::Nanoseconds last_since = models_.in_force_since();
  models_.put_in_force();
  const ModelPointer before = std::exchange(in_force_, swap.to).model;
  const Model& model = *in_force_.model;
  if (swap.library) library_ = *swap.library;
  const auto snapshot = models_.in_force();
  continuity_.change(before == nullptr ? nullptr : &before->compiled, model.compiled, last_since);
  if (last.generation != 0) {
    continuity_.change_timeouts(directory_, last.table, snapshot.table, models_.in_force_since());
  }
  introduce(switchboard_.link_all(snapshot.table), [] {});  // ports that were opened meanwhile
  switchboard_.unlink(snapshot.table);
  switchboard_.tell_unmentioned(snapshot);
  switchboard_.ring_all();
  log::info("model {} is in force: {} \"{}\"{}", snapshot.generation, swap.how, model.name,
            swap.change.by.empty() ? "" : ", by " + swap.change.by);
  history_.add({snapshot.generation,
                swap.content,
                model.name,
                model.files,
                calendar_ms(),
                swap.how,
                swap.change.by,
                {},
                in_force_.model});
  welcome_waiting();
  nlohmann::json changes;
  if (swap.is_compared && before != nullptr) {
    changes = changes_or_why_not(*before, model);
    const std::string summary = changes.at("summary").get<std::string>();
    log::info("model {} compared with the last: {}", snapshot.generation, summary);
    history_.set_changes(snapshot.generation, summary);
  }
  answer_done(swap, std::move(changes));
}

// What `arbiter reload --dry-run` shows.
void Daemon::compare_with_files(Swap& swap) {
  Reading reading = read_files();
  swap.findings = std::move(reading.findings);
  if (swap.findings.has_errors()) throw BadModel(swap.findings.first_error());
  nlohmann::json models = nlohmann::json::array();
  for (const ModelPointer& read : reading.models) {
    const bool is_in_force = read->name == models_.name();
    const LoadedModel* const loaded = library_.find(read->name);
    ModelPointer before = loaded == nullptr ? nullptr : loaded->model;
    if (is_in_force) before = in_force_.model;
    nlohmann::json model{{"name", read->name}, {"in_force", is_in_force}, {"changes", nullptr}};
    if (before != nullptr) model["changes"] = changes_json(before->compiled, read->compiled);
    models.push_back(std::move(model));
  }
  answer(swap, report(swap, {{"ok", true}, {"models", std::move(models)}}));
}

void Daemon::answer_done(const Swap& swap, nlohmann::json changes) {
  answer(swap, report(swap, {{"ok", true},
                             {"generation", models_.in_force().generation},
                             {"name", models_.name()},
                             {"back_to", swap.back_to ? to_json(*swap.back_to) : nullptr},
                             {"changes", std::move(changes)}}));
}

void Daemon::answer_refused(const Swap& swap, const std::string& why) {
  answer(swap, report(swap, {{"ok", false}, {"why", why}}), why);
}

// `why_not`: of what was refused.
void Daemon::answer(const Swap& swap, const std::string& report, const std::string& why_not) {
  for (const Change::Asking& each : swap.change.asking) {
    const auto found = clients_.find(each.client);
    if (found == clients_.end()) continue;
    Client& client = *found->second;
    if (each.wants_report) {
      try {
        send_document(client, each.request, shm::MessageKind::kReport, report);
      } catch (const std::exception& error) {  // no descriptors are left
        refuse(client, each.request,
               (why_not.empty() ? "it is done" : why_not) +
                   "; the report could not be sent: " + error.what());
      }
    } else if (!why_not.empty()) {
      refuse(client, each.request, why_not);
    } else {
      auto reply = reply_to(each.request, shm::MessageKind::kDone);
      reply.value = static_cast<std::uint32_t>(models_.in_force().generation);
      client.send(reply);
    }
  }
}

}  // namespace arbiter::service
