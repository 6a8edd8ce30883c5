#include "service/models/model_changes.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/clients/replies.hpp"
#include "service/kept/step.hpp"
#include "service/log/event.hpp"
#include "service/log/log.hpp"
#include "service/policy/users.hpp"

namespace arbiter::service {
namespace {

// File names may be any bytes; JSON may not.
std::string in_bytes(const nlohmann::json& document) {
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

EventKind event_of(const Swap& swap) {
  if (swap.how == "start") return EventKind::kStarted;
  switch (swap.change.kind) {
    case Change::Kind::kSwitch:
      return EventKind::kSwitched;
    case Change::Kind::kRollback:
      return EventKind::kRolledBack;
    case Change::Kind::kReload:
    case Change::Kind::kCompare:  // never in force
      break;
  }
  return EventKind::kReloaded;
}

// What came of it, for those who want all of it.
std::string full_report(const Swap& swap, nlohmann::json document) {
  document["text"] = swap.findings.text();
  document["has_errors"] = swap.findings.has_errors();  // told in the text, in full
  document["findings"] = swap.findings.json();
  return in_bytes(document);
}

}  // namespace

ModelChanges::ModelChanges(Options options, const Parts& parts, std::function<void()> settled)
    : options_(std::move(options)),
      gate_(parts.gate),
      names_(parts.names),
      board_(parts.board),
      switchboard_(parts.switchboard),
      introductions_(parts.introductions),
      clients_(parts.clients),
      settled_(std::move(settled)),
      compiler_(options_.compiles_in) {}

void ModelChanges::start(bool is_fresh) {
  const auto inherited = board_.in_force().generation;
  if (inherited != 0) {
    history_.add({inherited, 0, board_.name(), {}, calendar_ms(), kInherited, {}, {}, nullptr});
  }
  if (is_fresh && !not_read_at_start_.empty()) {
    throw BadModel("not started: " + not_read_at_start_);
  }
  if (options_.files.empty()) {
    log::info("no model was given: {}", is_fresh ? "no port is connected to another (--model FILE)"
                                                 : "the one in force stays");
    switchboard_.link_all(board_.in_force().table);
    settle();
    return;
  }
  try {
    Swap swap = first_swap();
    begin_swap(swap);
  } catch (const std::exception& error) {
    if (is_fresh) throw;
    if (why_refused_.empty()) why_refused_ = error.what();
    log_event({EventKind::kChangeRefused, {}, {}, {}, inherited}, log::level::err,
              "the last daemon's model stays in force: {}; `arbiter reload` reads the files again",
              error.what());
    switchboard_.link_all(board_.in_force().table);
    settle();
  }
}

void ModelChanges::ask(Change change, const Client& client, const wire::Message& message) {
  change.by = client.description() + ", user " + describe_user(client.user());
  change.asking = {asking(client, message)};
  waiting_.add(std::move(change));
}

Change::Asking ModelChanges::asking(const Client& client, const wire::Message& message) {
  return {client.id(), message.request, (message.flags & wire::kWantsReport) != 0};
}

void ModelChanges::reload_for_signal(const std::string& by) {
  waiting_.add({Change::Kind::kReload, {}, 0, by, {}});
}

// One at a time, so that others are served in between.
void ModelChanges::advance() {
  if (preparing_) stop_preparing_for_nobody();
  if (!can_advance()) return;
  Swap swap;
  swap.change = waiting_.take_next();
  attempt(swap, [&] {
    switch (swap.change.kind) {
      case Change::Kind::kReload:
        return prepare_reload(swap);
      case Change::Kind::kCompare:
        return prepare_comparison(swap);
      case Change::Kind::kSwitch:
        return prepare_switch(swap);
      case Change::Kind::kRollback:
        return prepare_rollback(swap);
    }
  });
}

void ModelChanges::attempt(Swap& swap, const std::function<void()>& step) {
  try {
    step();
  } catch (const std::exception& error) {
    if (swap.change.kind == Change::Kind::kReload) {
      ++reloads_refused_;
      if (!why_refused_.empty()) why_refused_ = error.what();
    }
    // What is found in files is in the log when they have been read.
    const std::string why =
        swap.findings.has_errors() ? swap.findings.why_refused() : std::string(error.what());
    if (swap.change.kind == Change::Kind::kCompare) {
      log::info("{} asks what a {} would do: {}", swap.change.by,
                swap.change.of_past ? "rollback" : "reload", why);
    } else {
      log_event({EventKind::kChangeRefused, {}, {}, {}, board_.in_force().generation},
                log::level::err, "the model in force stays: {}", why);
    }
    answer_refused(swap, error.what());
  }
}

// Throws, and then `swap` is as it was.
void ModelChanges::prepare(Swap& swap, Compiler::Job job) {
  compiler_.start(std::move(job));
  preparing_ = std::move(swap);
}

void ModelChanges::finish_preparing() {
  Swap swap = std::move(*std::exchange(preparing_, std::nullopt));
  attempt(swap, [&] {
    Reading reading = compiler_.take();
    swap.findings = std::move(reading.findings);
    if (swap.findings.has_errors()) throw BadModel(swap.findings.first_error());
    switch (swap.change.kind) {
      case Change::Kind::kReload:
        return finish_reload(swap, std::move(reading));
      case Change::Kind::kCompare:
        return finish_comparison(swap, reading);
      case Change::Kind::kSwitch:  // needs no compiler
        return;
      case Change::Kind::kRollback:
        swap.changes = std::move(reading.changes);
        return begin_swap(swap);
    }
  });
}

// A comparison is made for those who asked. A reload or a rollback happens all the same.
void ModelChanges::stop_preparing_for_nobody() {
  if (preparing_->change.kind != Change::Kind::kCompare) return;
  const auto& asking = preparing_->change.asking;
  const bool is_awaited = std::any_of(asking.begin(), asking.end(), [&](const auto& each) {
    return clients_.find(each.client) != nullptr;
  });
  if (!is_awaited) compiler_.stop();
}

// Throws, and then nothing has changed, `swap` neither.
void ModelChanges::begin_swap(Swap& swap) {
  board_.prepare(*swap.to.layout, swap.to.model->name);
  swap_ = std::move(swap);
  auto told = switchboard_.link_all(board_.prepared());
  at_step("links-made-ahead");
  // The table itself, all who will read it have to map.
  for (const auto& [id, client] : clients_) {
    if (!client->ports.empty()) told.insert(client.get());
  }
  introductions_.introduce(told, [this] { put_in_force(); });
}

void ModelChanges::put_in_force() {
  const Swap swap = std::move(*std::exchange(swap_, std::nullopt));
  if (swap.policy) gate_.put_in_force(*swap.policy);
  const auto last = board_.in_force();
  const shm::Nanoseconds last_since = board_.in_force_since();
  board_.put_in_force();
  const ModelPointer before = std::exchange(in_force_, swap.to).model;
  const Model& model = *in_force_.model;
  why_refused_.clear();
  if (swap.library) library_ = *swap.library;
  const auto snapshot = board_.in_force();
  continuity_.change(before == nullptr ? nullptr : &before->compiled, model.compiled, last_since);
  if (last.generation != 0) {
    continuity_.change_timeouts(names_, last.table, snapshot.table, board_.in_force_since());
  }
  // Ports that were opened meanwhile.
  introductions_.introduce(switchboard_.link_all(snapshot.table), [] {});
  at_step("links-made-late");
  switchboard_.unlink(snapshot.table);
  switchboard_.tell_unmentioned(snapshot);
  switchboard_.ring_all();
  at_step("all-rung");
  log_event({event_of(swap), {}, {}, {}, snapshot.generation}, log::level::info,
            "model {} is in force: {} \"{}\"{}", snapshot.generation, swap.how, model.name,
            swap.change.by.empty() ? "" : ", by " + swap.change.by);
  remember(swap, snapshot.generation);
  at_step("change-remembered");
  settle();
  nlohmann::json changes = nlohmann::json::parse(swap.changes);
  if (!changes.is_null()) {
    const std::string summary = changes.at("summary").get<std::string>();
    log::info("model {} compared with the last: {}", snapshot.generation, summary);
    history_.set_changes(snapshot.generation, summary);
  }
  answer_done(swap, std::move(changes));
}

void ModelChanges::settle() {
  has_settled_ = true;
  settled_();
}

void ModelChanges::remember(const Swap& swap, std::uint64_t generation) {
  history_.add({generation,
                swap.content,
                in_force_.model->name,
                in_force_.model->files,
                calendar_ms(),
                swap.how,
                swap.change.by,
                {},
                in_force_.model});
}

std::optional<wire::RefusedFilesStatus> ModelChanges::refused_files() const {
  if (why_refused_.empty()) return std::nullopt;
  wire::RefusedFilesStatus refused{{}, why_refused_};
  for (const NamedFiles& each : options_.files) {
    refused.files.insert(refused.files.end(), each.files.models.begin(), each.files.models.end());
  }
  return refused;
}

const shm::FileDescriptor& ModelChanges::document() {
  return document_.of({board_, library_, in_force_.model, history_, continuity_});
}

nlohmann::json ModelChanges::policy_json(const std::optional<Policy>& policy, bool differs) {
  if (!policy) return nullptr;
  return {{"file", policy->path()}, {"rules", policy->size()}, {"differs", differs}};
}

void ModelChanges::answer_done(const Swap& swap, nlohmann::json changes) {
  answer(swap, {{"ok", true},
                {"generation", board_.in_force().generation},
                {"name", board_.name()},
                {"already", swap.is_in_force_already},
                {"policy", policy_json(swap.policy, swap.changes_policy)},
                {"back_to", swap.back_to ? to_json(*swap.back_to) : nullptr},
                {"changes", std::move(changes)}});
}

void ModelChanges::answer_refused(const Swap& swap, const std::string& why) {
  answer(swap, {{"ok", false}, {"why", why}}, why);
}

void ModelChanges::answer(const Swap& swap, nlohmann::json document, const std::string& why_not) {
  const std::string report = full_report(swap, std::move(document));
  for (const Change::Asking& each : swap.change.asking) {
    Client* const asking = clients_.find(each.client);
    if (asking == nullptr) continue;
    Client& client = *asking;
    if (each.wants_report) {
      try {
        send_document(client, each.request, wire::MessageKind::kReport, report);
      } catch (const std::exception& error) {  // no descriptors are left
        answer_without_report(swap, client, each.request, why_not,
                              std::string("; the report could not be sent: ") + error.what());
      }
    } else {
      answer_without_report(swap, client, each.request, why_not, "");
    }
  }
}

// A refusal says that nothing has changed: what is done is not refused. A comparison is its report.
void ModelChanges::answer_without_report(const Swap& swap, Client& client, std::uint64_t request,
                                         const std::string& why_not, const std::string& lacks) {
  if (!why_not.empty()) return refuse(client, request, why_not + lacks);
  if (swap.change.kind == Change::Kind::kCompare && !lacks.empty()) {
    return refuse(
        client, request,
        (swap.change.of_past ? "the models were compared" : "the files were compared") + lacks);
  }
  auto reply = reply_to(request, wire::MessageKind::kDone);
  reply.value = static_cast<std::uint32_t>(board_.in_force().generation);
  client.send(reply);
}

}  // namespace arbiter::service
