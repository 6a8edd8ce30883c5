#include "cli/graph_live.hpp"

#include <algorithm>
#include <cstdint>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/graph_hosts.hpp"
#include "cli/live.hpp"
#include "cli/other_hosts.hpp"
#include "shm/clock.hpp"
#include "watch/imported.hpp"
#include "watch/instance.hpp"
#include "watch/model_in_force.hpp"
#include "watch/picture.hpp"

namespace arbiter::cli {
namespace {

using drawing::Situation;
using nlohmann::json;

constexpr shm::Nanoseconds kFollowPeriod = 100'000'000;
constexpr shm::Nanoseconds kHostsPeriod = 1'000'000'000;
// Behind a question that was not answered: nothing is drawn while it waits.
constexpr shm::Nanoseconds kHostsPause = 5'000'000'000;
// Behind a picture that could not be drawn.
constexpr shm::Nanoseconds kDrawPause = 1'000'000'000;
// Where models change faster than they can be drawn.
constexpr int kMostLoads = 5;

// What the sources do at one moment, and who wins by the rules that are drawn.
struct LiveSituation {
  Situation situation;
  std::map<std::string, std::string> ages;  // by source: since its last event; none if it had none
  std::uint64_t generation = 0;             // of the model in force then
  bool fits = false;                        // the daemon's table has the same winners
};

// Of a port whose name has not come yet nothing is known.
bool fits(const watch::Instance& instance, const watch::Picture& picture,
          const Situation& situation) {
  const auto& names = instance.port_names();
  return std::all_of(names.begin(), names.end(), [&](const auto& port) {
    if (!picture.snapshot.table.is_arbitrated(port.first)) return true;
    const shm::SourceId winner = picture.winner_at(port.first);
    const auto drawn = situation.winners.find(port.second);
    if (drawn == situation.winners.end()) return winner == shm::kNone;
    return winner != shm::kNone && instance.memory()->source_name(winner) == drawn->second;
  });
}

LiveSituation look(const watch::Instance& instance, const rules::RuleSet& rules) {
  const shm::DecisionMemory& memory = *instance.memory();
  for (;;) {
    const watch::Picture picture = watch::take_picture(memory, watch::all_sources);
    std::set<std::string> active;
    for (const auto& [source, word] : picture.words) {
      if (picture.is_active(source)) active.insert(memory.source_name(source));
    }
    LiveSituation seen{drawing::decide(rules, std::move(active)), ages_in(picture, memory),
                       picture.snapshot.generation};
    seen.fits = fits(instance, picture, seen.situation);
    if (memory.tables().is_whole(picture.snapshot)) return seen;
  }
}

// As the daemon sends it: what is not UTF-8 has been replaced.
std::string as_sent(const std::string& text) {
  return json(text).dump(-1, ' ', false, json::error_handler_t::replace);
}

bool same_text(const rules::FileText& ours, const rules::FileText& theirs) {
  return as_sent(ours.content) == as_sent(theirs.content);
}

// An application that is not given may be left out: it decides nothing.
bool same_texts(const rules::ModelTexts& ours, const rules::ModelTexts& theirs) {
  if (ours.application &&
      (!theirs.application || !same_text(*ours.application, *theirs.application))) {
    return false;
  }
  return std::equal(ours.models.begin(), ours.models.end(), theirs.models.begin(),
                    theirs.models.end(), same_text);
}

// The files that the daemon names, where it does not know what was in them.
rules::ModelFiles files_of(const wire::Status& status) {
  rules::ModelFiles files;
  const auto from_here = [&](const std::string& file) {  // the daemon may run in another directory
    return watch::path_from_here(file, status.directory);
  };
  for (const auto& file : status.model.files) files.models.push_back(from_here(file));
  if (status.model.application) files.application = from_here(*status.model.application);
  if (files.models.empty()) throw Error("the daemon has no model; give one: arbiter graph MODEL");
  return files;
}

class LivePicture {
 public:
  LivePicture(const GraphOptions& options, watch::Instance& instance)
      : options_(options), instance_(instance), picture_(options), inquirer_(options.instance) {
    static_cast<void>(inquirer_.ask());
  }
  void heed(const shm::FileDescriptor& interrupts) { picture_.heed(interrupts); }
  // What is to be drawn again and again must not wait for other hosts.
  void begin_to_follow() {
    inquirer_.begin();
    follows_ = true;
  }

  // False: the model cannot be drawn.
  bool update() {
    LiveSituation now;
    int tries = 0;
    do {
      // Another daemon may count its models from one again.
      const bool is_drawn =
          drawn_of_ == instance_.memory() && drawn_ == instance_.memory()->tables().generation();
      if (!is_drawn && !load()) return false;
      now = look(instance_, picture_.rules());
    } while (now.generation != drawn_ && ++tries < kMostLoads);
    fits_ = now.fits;
    const auto seen = inquirer_.last();
    auto places = seen == nullptr ? std::nullopt : places_by(*seen, now.situation);
    if (places) {
      if (std::exchange(seen_, seen) != seen) ages_ = now.ages;
      for (const wire::ImportStatus& each : seen->hosts.imports) {
        const auto age = ages_.find(each.source);
        if (each.is_open && age != ages_.end()) places->notes[each.source] = age->second;
      }
    } else {
      look_at_hosts();
      now.situation.hosts = hosts_;
    }
    if (!fits_ && is_same_ && !std::exchange(warned_, true)) {
      std::cerr << "arbiter: the daemon decides differently from this model; is it the model in "
                   "force, and unchanged since? (arbiter status, arbiter reload)\n";
    }
    picture_.write(&now.situation, places ? &*places : nullptr);
    return true;
  }
  // Whether the picture is of what the daemon does.
  [[nodiscard]] bool is_true() const { return fits_ && is_same_ && picture_.is_good(); }

 private:
  bool load() {
    const auto memory = instance_.memory();
    const auto in_force = watch::ModelInForce::fetch(instance_);
    const std::string title = in_force.text() + (in_force.is_none() ? "" : " in force") +
                              ", instance " + instance_.name();
    if (!options_.files.models.empty()) {
      const rules::ModelTexts given = rules::read_texts(options_.files);
      if (!picture_.load(given, title)) return false;
      warn_if_other(given, in_force);
    } else if (in_force.has_texts()) {
      if (in_force.texts().models.empty() && !in_force.texts().application) {
        throw Error("the daemon has no model; give one: arbiter graph MODEL");
      }
      if (!picture_.load(in_force.texts(), title)) return false;
    } else if (!picture_.load(rules::read_texts(files_of(instance_.status())), title)) {
      return false;
    }
    drawn_of_ = memory;
    drawn_ = in_force.generation();
    warned_ = false;
    return true;
  }

  // Which hosts sources come from, where no link says so: the daemon is asked once a second, and
  // what was known stays, also where it does not answer.
  void look_at_hosts() {
    if (!instance_.has_daemon() || shm::monotonic_now() < ask_again_) return;
    try {
      std::map<std::string, std::string> hosts;
      for (const wire::SourceStatus& source : instance_.status().sources) {
        const std::string host = watch::host_of(source);
        if (!host.empty()) hosts[source.name] = host;
      }
      hosts_ = std::move(hosts);
      has_answered_ = true;
      ask_again_ = shm::monotonic_now() + kHostsPeriod;
    } catch (const wire::CallError& error) {
      if (!follows_) throw;
      ask_again_ = shm::monotonic_now() + kHostsPause;
      if (!instance_.has_daemon() || !std::exchange(has_answered_, false)) return;
      std::cerr << "arbiter: " << error.what() << "; " << options_.output
                << " follows all the same, with the hosts that were known last\n";
    }
  }

  void warn_if_other(const rules::ModelTexts& given, const watch::ModelInForce& in_force) {
    is_same_ =
        !in_force.is_none() && (!in_force.has_texts() || same_texts(given, in_force.texts()));
    if (in_force.is_none()) {
      std::cerr << "arbiter: the daemon has no model in force\n";
    } else if (!is_same_) {
      std::cerr << "arbiter: this is not the text of the model in force, model "
                << in_force.generation() << "; the daemon may decide otherwise than is shown "
                << "(arbiter status names its files; arbiter reload has them read again)\n";
    }
  }

  const GraphOptions& options_;
  watch::Instance& instance_;
  Picture picture_;
  std::shared_ptr<const shm::DecisionMemory> drawn_of_;
  std::uint64_t drawn_ = 0;  // the generation of the model that the picture is of
  HostsInquirer inquirer_;
  std::shared_ptr<const SeenHosts> seen_;
  std::map<std::string, std::string> ages_;  // as they were when that came
  std::map<std::string, std::string> hosts_;
  shm::Nanoseconds ask_again_ = 0;
  bool has_answered_ = true;  // the last time
  bool follows_ = false;
  bool fits_ = false;
  bool is_same_ = true;  // as far as it is known: given is what is in force
  bool warned_ = false;
};

}  // namespace

int draw_live(const GraphOptions& options) {
  const auto instance = watch_instance("graph", options.instance);
  LivePicture picture(options, *instance);
  if (!picture.update()) return 1;
  return picture.is_true() ? 0 : 1;
}

// While there is no daemon, what was decided last goes on, and so does the picture of it.
int draw_and_follow(const GraphOptions& options) try {
  const shm::FileDescriptor interrupts = catch_interrupts();
  const auto instance = follow_instance("graph", options.instance);
  LivePicture picture(options, *instance);
  picture.heed(interrupts);
  if (!picture.update()) return 1;
  picture.begin_to_follow();
  DaemonNews news("drawing");
  std::string said;
  const auto say = [&](const std::string& why) {
    if (std::exchange(said, why) == why) return;
    std::cerr << "arbiter: " << why << "; " << options.output << " stays as it was\n";
  };
  for (shm::Nanoseconds next = shm::monotonic_now();;) {
    next = std::max(next + kFollowPeriod, shm::monotonic_now());
    if (sleep_until(next, interrupts)) return 0;
    instance->update();
    news.tell(*instance);
    try {
      if (!picture.update()) return 1;
      said.clear();
    } catch (const wire::CallError& error) {
      // If it has gone before it could be asked for its model, the next one is asked.
      if (instance->has_daemon()) say(error.what());
    } catch (const rules::FileError&) {
      throw;
    } catch (const std::runtime_error& error) {  // such as of a model that lacks the port
      say(error.what());
      next += kDrawPause;
    }
  }
} catch (const PictureInterrupted&) {
  return 0;
}

}  // namespace arbiter::cli
