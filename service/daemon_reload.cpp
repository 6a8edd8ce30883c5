// How another model, and another policy, come into force: read again, switched to, or gone back to.
//
// What takes long (reading, proving, comparing) the compiler does in its thread, while the loop
// serves others. Whatever it is, it ends in one swap: the new table is written and its clients are
// told before it counts; they switch all at once. Changes wait for each other.
#include <poll.h>

#include <algorithm>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/comparison.hpp"
#include "service/daemon.hpp"
#include "service/log.hpp"
#include "shm/clock.hpp"

namespace arbiter::service {
namespace {

// File names may be any bytes; JSON may not.
std::string in_bytes(const nlohmann::json& document) {
  return document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
}

// What came of it, for those who want all of it.
std::string report(const Daemon::Swap& swap, nlohmann::json document) {
  document["text"] = swap.findings.text();
  document["has_errors"] = swap.findings.has_errors();  // told in the text, in full
  document["findings"] = swap.findings.json();
  return in_bytes(document);
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
  if (preparing_) stop_preparing_for_nobody();
  if (swap_ || preparing_ || phase_ != Phase::kServing || changes_.empty()) return;
  Swap swap;
  swap.change = changes_.take_next();
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

void Daemon::attempt(Swap& swap, const std::function<void()>& step) {
  try {
    step();
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

// Throws, and then `swap` is as it was.
void Daemon::prepare(Swap& swap, Compiler::Job job) {
  compiler_.start(std::move(job));
  preparing_ = std::move(swap);
}

void Daemon::finish_preparing() {
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
void Daemon::stop_preparing_for_nobody() {
  if (preparing_->change.kind != Change::Kind::kCompare) return;
  const auto& asking = preparing_->change.asking;
  const bool is_awaited = std::any_of(asking.begin(), asking.end(), [&](const auto& each) {
    return clients_.contains(each.client);
  });
  if (!is_awaited) compiler_.stop();
}

// The job has copies of all that it needs: it may outlive this, if a file holds it up.
Compiler::Job Daemon::reading_job(
    std::function<void(Reading&, const std::stop_token&)> after_reading) const {
  if (files_.empty() && !gate_.has_file()) {
    throw std::runtime_error("there is no file to read again; start with --model");
  }
  return
      [files = files_, gate = gate_, steps = steps_, is_strict = is_strict_, instance = instance_,
       before = before_reading_, after = std::move(after_reading)](const std::stop_token& stop) {
        if (before) before(stop);
        StatusLine line(instance);
        Reading reading = read_files(files, gate, {steps, line.watch(), is_strict}, stop);
        if (!reading.findings.has_errors()) after(reading, stop);
        return reading;
      };
}

// Before anybody is served, who could be kept waiting; but signals are heard.
void Daemon::read_first_models(int stop_descriptor) {
  compiler_.start(reading_job([](Reading&, const std::stop_token&) {}));
  for (bool is_over = false; !is_over;) {
    pollfd watched[2] = {{compiler_.descriptor(), POLLIN, 0}, {stop_descriptor, POLLIN, 0}};
    if (poll(watched, 2, -1) < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "poll");
    }
    if (watched[1].revents != 0 && handle_signal(stop_descriptor)) throw rules::Stopped();
    is_over = watched[0].revents != 0;
  }
  Reading reading = compiler_.take();
  if (reading.findings.has_errors()) {
    throw BadModel(std::string("not started: the files have errors, told above") +
                   (is_strict_ ? "; --strict takes warnings for errors" : ""));
  }
  if (reading.policy) gate_.put_in_force(*reading.policy);
  read_at_start_ = std::move(reading.models);
}

void Daemon::prepare_reload(Swap& swap) {
  prepare(swap, reading_job([before = in_force_.model, name = models_.name()](
                                Reading& reading, const std::stop_token& stop) {
            const ModelPointer after = find_model(reading.models, name);
            if (before == nullptr || after == nullptr) return;
            reading.changes = changes_between(*before, *after, kStepsOfChange, stop);
          }));
}

// Throws; then nothing has changed, and `swap` knows the findings.
void Daemon::finish_reload(Swap& swap, Reading reading) {
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
  swap.changes = std::move(reading.changes);
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
  if (in_force_.model == nullptr) return begin_swap(swap);
  prepare(swap, [before = in_force_.model, after = past->model](const std::stop_token& stop) {
    Reading reading;
    reading.changes = changes_between(*before, *after, kStepsOfChange, stop);
    return reading;
  });
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
  nlohmann::json changes = nlohmann::json::parse(swap.changes);
  if (!changes.is_null()) {
    const std::string summary = changes.at("summary").get<std::string>();
    log::info("model {} compared with the last: {}", snapshot.generation, summary);
    history_.set_changes(snapshot.generation, summary);
  }
  answer_done(swap, std::move(changes));
}

// What `arbiter reload --dry-run` shows.
void Daemon::prepare_comparison(Swap& swap) {
  std::vector<ModelPointer> loaded;
  for (const LoadedModel& each : library_.models()) loaded.push_back(each.model);
  prepare(swap, reading_job([loaded = std::move(loaded), in_force = in_force_.model,
                             name = models_.name()](Reading& reading, const std::stop_token& stop) {
            for (const ModelPointer& read : reading.models) {
              const auto found = std::find_if(loaded.begin(), loaded.end(), [&](const auto& each) {
                return each->name == read->name;
              });
              ModelPointer before = found == loaded.end() ? nullptr : *found;
              if (read->name == name) before = in_force;
              reading.diffs.push_back(before == nullptr
                                          ? "null"
                                          : changes_between(*before, *read, kStepsOfDryRun, stop));
            }
          }));
}

void Daemon::finish_comparison(const Swap& swap, const Reading& reading) {
  nlohmann::json models = nlohmann::json::array();
  for (std::size_t i = 0; i < reading.models.size(); ++i) {
    const std::string& name = reading.models[i]->name;
    models.push_back({{"name", name},
                      {"in_force", name == models_.name()},
                      {"changes", nlohmann::json::parse(reading.diffs[i])}});
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
