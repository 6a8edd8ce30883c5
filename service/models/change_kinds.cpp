// What each kind of change prepares, before its model is swapped in: by the compiler, in its
// thread, or at once.
#include <poll.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

#include <nlohmann/json.hpp>

#include "service/kept/model_name.hpp"
#include "service/log/log.hpp"
#include "service/models/comparison.hpp"
#include "service/models/model_changes.hpp"
#include "service/models/preparation.hpp"

namespace arbiter::service {

// The job has copies of all that it needs: it may outlive this, if a file holds it up.
Compiler::Job ModelChanges::reading_job(
    std::function<void(Reading&, const std::stop_token&)> after_reading) const {
  if (options_.files.empty() && !gate_.has_file()) {
    throw std::runtime_error("there is no file to read again; start with --model");
  }
  return [options = options_, gate = gate_,
          after = std::move(after_reading)](const std::stop_token& stop) {
    if (options.before_reading) options.before_reading(stop);
    StatusLine line(options.instance);
    Reading reading =
        read_files(options.files, gate, {options.steps, line.watch(), options.is_strict}, stop);
    if (!reading.findings.has_errors()) after(reading, stop);
    return reading;
  };
}

// Nobody is kept waiting by it; but signals are heard.
void ModelChanges::read_first(int stop_descriptor, const std::function<bool()>& is_to_stop,
                              bool may_inherit) {
  if (options_.files.empty() && !gate_.has_file()) return;
  compiler_.start(reading_job([](Reading&, const std::stop_token&) {}));
  for (bool is_over = false; !is_over;) {
    pollfd watched[2] = {{compiler_.descriptor(), POLLIN, 0}, {stop_descriptor, POLLIN, 0}};
    if (poll(watched, 2, -1) < 0 && errno != EINTR) {
      throw std::system_error(errno, std::generic_category(), "poll");
    }
    if (watched[1].revents != 0 && is_to_stop()) throw rules::Stopped();
    is_over = watched[0].revents != 0;
  }
  Reading reading = compiler_.take();
  if (reading.findings.has_errors()) {
    not_read_at_start_ = reading.findings.why_refused();
    why_refused_ = reading.findings.first_error();
    const bool lacks_policy = gate_.has_file() && !reading.policy;
    if (lacks_policy || !may_inherit) throw BadModel("not started: " + not_read_at_start_);
    reading.models.clear();
  }
  if (reading.policy) gate_.put_in_force(*reading.policy);
  read_at_start_ = std::move(reading.models);
}

// The model that the last daemon had in force, if this one has it by that name, too.
Swap ModelChanges::first_swap() {
  if (!not_read_at_start_.empty()) throw BadModel(not_read_at_start_);
  Library library(std::exchange(read_at_start_, {}), names_);
  const std::string last = board_.name();
  const LoadedModel* next = library.find(last);
  if (next == nullptr) {
    next = library.first();
    if (!last.empty()) {
      log::warn(R"(the last daemon's model "{}" is not among those given: "{}" takes its place)",
                last, next->model->name);
    }
  }
  Swap swap;
  swap.to = *next;
  swap.how = "start";
  reserve_tables(library);
  swap.library = std::move(library);
  return swap;
}

void ModelChanges::prepare_reload(Swap& swap) {
  prepare(swap, reading_job([before = in_force_.model, name = board_.name()](
                                Reading& reading, const std::stop_token& stop) {
            const ModelPointer after = find_model(reading.models, name);
            if (before == nullptr || after == nullptr) return;
            reading.changes = changes_between(*before, *after, kStepsOfChange, stop);
          }));
}

bool ModelChanges::changes_policy(const std::optional<Policy>& policy) const {
  return policy && !policy->has_rules_of(gate_.policy());
}

// Throws; then nothing has changed, and `swap` knows the findings.
void ModelChanges::finish_reload(Swap& swap, Reading reading) {
  swap.policy = std::move(reading.policy);
  swap.changes_policy = changes_policy(swap.policy);
  if (options_.files.empty()) {
    gate_.put_in_force(*swap.policy);
    answer_done(swap, nullptr);
    return;
  }
  Library library(std::move(reading.models), names_);
  const LoadedModel* next = library.find(board_.name());
  if (next == nullptr) next = library.first();
  swap.to = *next;
  swap.how = "reload";
  swap.changes = std::move(reading.changes);
  swap.content = content_of(*next);
  reserve_tables(library);
  swap.library = std::move(library);
  begin_swap(swap);
}

// What is in force, and comes into force once more as it is, is no step for a rollback. Tables say
// so, and not which object it is: what a rollback has put in force is not the library's. While both
// layouts live, a name has the same id in both.
std::uint64_t ModelChanges::content_of(const LoadedModel& next) const {
  const PastModel* const latest = history_.latest();
  const bool is_same = latest != nullptr && in_force_.layout != nullptr &&
                       in_force_.model->name == next.model->name &&
                       in_force_.layout->words() == next.layout->words();
  return is_same ? latest->content : 0;
}

// So that a switch does not fail for want of memory, either.
void ModelChanges::reserve_tables(const Library& library) {
  if (library.models().size() < 2) return;
  std::size_t words = 0;
  for (const LoadedModel& each : library.models()) {
    words = std::max(words, each.layout->words().size());
  }
  board_.reserve(words);
}

// The one to switch to. Throws std::runtime_error where there is none.
const LoadedModel& ModelChanges::loaded_model(const std::string& name) const {
  const LoadedModel* const found = library_.find(name);
  if (found != nullptr) return *found;
  const std::string loaded =
      !library_.models().empty() ? "; there are: " + library_.names()
      : why_refused_.empty()     ? "; none is loaded"
                             : "; none is loaded, because the files of --model were refused, and "
                               "the last daemon's model stays in force; mend them, then run "
                               "arbiter reload; the first error: " +
                                   why_refused_;
  // The name is a client's: it must not break lines.
  throw std::runtime_error(
      "there is no model " + (is_model_name(name) ? '"' + name + '"' : "of that name") + loaded +
      (name.ends_with(".xml") ? "; arbiterd --model NAME=FILE gives a file a name" : ""));
}

void ModelChanges::prepare_switch(Swap& swap) {
  const LoadedModel& next = loaded_model(swap.change.name);
  if (next.model == in_force_.model) {
    swap.is_in_force_already = true;
    answer_done(swap, nullptr);
    return;
  }
  swap.to = next;
  swap.how = "switch";
  swap.content = content_of(next);
  begin_swap(swap);
}

// Nothing is logged: nothing happens.
void ModelChanges::ask_ahead(Change change, const Client& client, const wire::Message& message) {
  change.asking = {asking(client, message)};
  Swap swap;
  swap.change = std::move(change);
  try {
    static_cast<void>(loaded_model(swap.change.name));
    if (swap_ || preparing_ || !waiting_.empty()) {
      throw std::runtime_error("another change of the model is under way");
    }
  } catch (const std::runtime_error& error) {
    answer_refused(swap, error.what());
    return;
  }
  answer_done(swap, nullptr);
}

// Where a rollback names none.
std::string ModelChanges::why_none_before() const {
  const PastModel* const latest = history_.latest();
  if (latest == nullptr) return "there is no model to go back to: none has been in force";
  if (history_.begins_with_predecessor()) {
    return "there is no model to go back to: this daemon keeps none from before its start";
  }
  const std::string generation = "model " + std::to_string(latest->generation);
  const std::string content = "model " + std::to_string(latest->content);
  if (history_.find(latest->content) == nullptr) {
    return "there is no older model to go back to: " + generation + " decides as " + content +
           " did, which has left the history; arbiter history shows what is in it";
  }
  if (latest->generation == latest->content) {
    return content + " is the oldest that is kept; arbiter history shows all";
  }
  return generation + " decides as " + content +
         " does, the oldest that is kept; to go to another, say which: arbiter history shows all";
}

// The one to go back to. Throws std::runtime_error saying why there is none.
const PastModel& ModelChanges::past_model(std::uint64_t asked) const {
  const PastModel* const past = asked == 0 ? history_.previous() : history_.find(asked);
  if (past == nullptr && asked == 0) throw std::runtime_error(why_none_before());
  if (past == nullptr) {
    throw std::runtime_error("model " + std::to_string(asked) +
                             " is not in the history; arbiter history shows what is");
  }
  if (past->model == nullptr) {
    throw std::runtime_error("model " + std::to_string(past->generation) +
                             (past->how == kInherited ? " was in force before this daemon started"
                                                      : " is not kept any longer") +
                             "; only its name is known");
  }
  return *past;
}

void ModelChanges::prepare_rollback(Swap& swap) {
  const PastModel& past = past_model(swap.change.generation);
  swap.to = {past.model, std::make_shared<const Layout>(past.model->compiled, names_)};
  swap.how = "rollback to " + std::to_string(past.generation);
  swap.back_to = past;
  swap.content = past.content;
  if (in_force_.model == nullptr) return begin_swap(swap);
  prepare(swap, [before = in_force_.model, after = past.model](const std::stop_token& stop) {
    Reading reading;
    reading.changes = changes_between(*before, *after, kStepsOfChange, stop);
    return reading;
  });
}

// What `arbiter rollback --dry-run` shows.
void ModelChanges::prepare_look_back(Swap& swap) {
  const PastModel& past = past_model(swap.change.generation);
  swap.back_to = past;
  prepare(swap, [before = in_force_.model, after = past.model](const std::stop_token& stop) {
    Reading reading;
    reading.models.push_back(after);
    reading.diffs.push_back(
        before == nullptr ? "null" : changes_between(*before, *after, kStepsOfDryRun, stop));
    return reading;
  });
}

// What `arbiter reload --dry-run` shows.
void ModelChanges::prepare_comparison(Swap& swap) {
  if (swap.change.of_past) return prepare_look_back(swap);
  std::vector<ModelPointer> loaded;
  for (const LoadedModel& each : library_.models()) loaded.push_back(each.model);
  prepare(swap, reading_job([loaded = std::move(loaded), in_force = in_force_.model,
                             name = board_.name()](Reading& reading, const std::stop_token& stop) {
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

void ModelChanges::finish_comparison(const Swap& swap, const Reading& reading) {
  nlohmann::json models = nlohmann::json::array();
  for (std::size_t i = 0; i < reading.models.size(); ++i) {
    const std::string& name = reading.models[i]->name;
    models.push_back({{"name", name},
                      {"in_force", !swap.change.of_past && name == board_.name()},
                      {"changes", nlohmann::json::parse(reading.diffs[i])}});
  }
  answer(swap, {{"ok", true},
                {"models", std::move(models)},
                {"back_to", swap.back_to ? to_json(*swap.back_to) : nullptr},
                {"policy", policy_json(reading.policy, changes_policy(reading.policy))}});
}

}  // namespace arbiter::service
