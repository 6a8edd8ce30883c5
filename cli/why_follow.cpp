#include "cli/why_follow.hpp"

#include <algorithm>
#include <iostream>
#include <memory>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/broken_pipe.hpp"
#include "cli/live.hpp"
#include "cli/model_report.hpp"
#include "cli/why_report.hpp"
#include "cli/why_source.hpp"
#include "rules/explain/change.hpp"
#include "shm/clock.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;
using watch::Look;

class Follower {
 public:
  Follower(const WhyOptions& options, shm::FileDescriptor interrupts)
      : options_(options),
        interrupts_(std::move(interrupts)),
        port_(instance_for(options), options.port),
        started_(shm::monotonic_now()),
        last_(port_.look()) {
    static_cast<void>(port_.explain(last_));  // fetches the model while there is a daemon
  }

  int run() {
    write_start();
    std::uint64_t changes = 0;
    while (std::cout && !has_reader_gone()) {
      const shm::Nanoseconds soon = shm::monotonic_now() + kLookEvery;
      const shm::Nanoseconds end = is_model_unknown_ ? soon : last_.picture.next_end();
      if (sleep_until(std::min(soon, end), interrupts_)) return 0;
      port_.instance().update();
      news_.tell(port_.instance());  // decisions do not depend on it
      Look look = port_.look();
      if (look.generation() != last_.generation() && !take_up_model(look)) continue;
      if (look.winner != last_.winner || name_of(look) != name_of(last_)) {
        if (!write_change(look)) continue;
        if (++changes == options_.count) return 0;
      }
      last_ = std::move(look);
    }
    return 0;
  }

 private:
  static std::shared_ptr<watch::Instance> instance_for(const WhyOptions& options) {
    auto instance = follow_instance("why", options.instance);
    require_no_source(options, *instance);
    return instance;
  }

  [[nodiscard]] std::string name_of(const Look& look) const {
    if (look.generation() == 0) return "no model";
    if (!look.is_mentioned) return "not mentioned";  // nothing comes; else all comes:
    if (!look.is_arbitrated) return "not arbitrated";
    return look.winner == shm::kNone ? "idle" : port_.source_name(look.winner);
  }
  [[nodiscard]] json winner_json(const Look& look) const {
    return look.winner == shm::kNone ? json(nullptr) : json(port_.source_name(look.winner));
  }

  void write_start() const {
    if (options_.json) {
      write_line({{"at_ns", last_.sources.now()},
                  {"port", port_.name()},
                  {"mentioned", last_.is_mentioned},
                  {"arbitrated", last_.is_arbitrated},
                  {"winner", winner_json(last_)}});
      return;
    }
    std::cout << seconds_text(last_.sources.now() - started_) << "  " << port_.name() << ": ";
    if (last_.generation() == 0) {
      std::cout << "no model is in force";
    } else if (!last_.is_mentioned) {
      std::cout << port_.model().text() << " does not mention it: no connection leads to it";
    } else {
      std::cout << name_of(last_) << ", by " << port_.model().text();
    }
    std::cout << std::endl;
  }

  static void write_line(const json& line) {
    std::cout << line.dump(-1, ' ', false, json::error_handler_t::replace) << std::endl;
  }

  // Of another model: its names and its texts come from the daemon. False: it does not answer, and
  // is asked again later.
  bool take_up_model(Look& look) {
    constexpr shm::Nanoseconds kAskForModelAgain = 2'000'000'000;
    is_model_unknown_ = true;
    if (!port_.instance().has_daemon() || shm::monotonic_now() < ask_again_) return false;
    try {
      port_.instance().catch_up();
      port_.find_again();
      look = port_.look();
      is_model_unknown_ = !port_.explain(look);
    } catch (const wire::RefusedError&) {
      throw;
    } catch (const wire::CallError&) {
      ask_again_ = shm::monotonic_now() + kAskForModelAgain;
      std::cerr
          << "arbiter: the daemon does not tell of the model that has come into force; asking "
             "it again until it does\n";
    }
    return !is_model_unknown_;
  }

  // False: another model has come into force meanwhile, and it must be looked at again.
  bool write_change(Look& look) {
    const auto explanation = port_.explain(look);
    if (!explanation) return false;
    port_.add_timeouts(look);
    const bool is_new_model = look.generation() != last_.generation();
    const auto causes = rules::causes_of_change(
        look.table(), port_.id(),
        [&](shm::SourceId source) { return last_.picture.is_active(source); },
        [&](shm::SourceId source) { return look.picture.is_active(source); });
    // What has happened has happened before it was seen.
    shm::Nanoseconds at = look.sources.now();
    for (const shm::SourceId source : causes) {
      at = std::min(at,
                    event_time(look.sources.state(port_.source_name(source)), look.sources.now()));
    }
    const watch::ModelInForce& model = port_.model();
    if (is_new_model && model.since() != 0) at = model.since();
    std::string because;
    if (is_new_model) {
      because = model.text() + " came into force" + how_text(model);
    }
    if (!causes.empty() && !is_new_model)
      because = events_text(port_, causes, look, look.sources.now());
    const std::string old = name_of(last_);
    std::string loser;
    for (const auto& each : explanation->connections) {
      if (each.source == old && each.is_active) loser = loss_text(each, look.sources);
    }
    if (options_.json) {
      json events = json::array();
      for (const shm::SourceId source : causes) {
        const std::string name = port_.source_name(source);
        events.push_back(event_json(name, look.sources.state(name), look.sources.now()));
      }
      write_line({{"at_ns", at},
                  {"port", port_.name()},
                  {"mentioned", look.is_mentioned},
                  {"arbitrated", look.is_arbitrated},
                  {"old", winner_json(last_)},
                  {"winner", winner_json(look)},
                  {"because", std::move(events)},
                  {"model", is_new_model ? json(look.generation()) : json(nullptr)},
                  {"old_loses", loser.empty() ? json(nullptr) : json(loser)}});
      return true;
    }
    std::cout << seconds_text(at - started_) << "  " << old << " -> " << name_of(look)
              << "  because " << because << (loser.empty() ? "" : "; " + old + " is " + loser)
              << std::endl;
    return true;
  }

  const WhyOptions& options_;
  const shm::FileDescriptor interrupts_;
  watch::Port port_;
  const shm::Nanoseconds started_;
  Look last_;
  bool is_model_unknown_ = false;  // that is in force now
  shm::Nanoseconds ask_again_ = 0;
  DaemonNews news_{"following"};
};

}  // namespace

std::string events_text(const watch::Port& port, const std::vector<shm::SourceId>& sources,
                        const Look& look, shm::Nanoseconds at) {
  std::string text;
  for (const shm::SourceId source : sources) {
    const std::string& name = port.source_name(source);
    if (!text.empty()) text += " and ";
    text += event_text(name, look.sources.state(name), at);
  }
  return text;
}

int follow_winners(const WhyOptions& options) {
  return Follower(options, catch_interrupts()).run();
}

}  // namespace arbiter::cli
