// arbiter winners: changes of winner, as samples that components can take.
//
// A component like others: the rules see its ports, and the policy must let it open them. It looks
// as `arbiter wait` does.
#include <algorithm>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <arbiter/arbiter.hpp>

#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/port_patterns.hpp"
#include "cli/verbs.hpp"
#include "rules/model/quantifiers.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "shm/limits.hpp"
#include "watch/winners.hpp"

namespace arbiter::cli {
namespace {

struct WinnersOptions {
  std::vector<std::string> patterns{"*"};
  shm::Nanoseconds every = 1'000'000'000;
  std::string instance;
};

std::string source_of(const std::string& port) { return "/arbiter/winner" + port + ":o"; }

template <std::size_t Size>
void copy(char (&to)[Size], const std::string& from) {
  static_assert(Size > shm::kMaxNameLength);
  std::memcpy(to, from.data(), std::min(from.size(), Size - 1));
}

// How often ports that could not be opened are tried again.
constexpr shm::Nanoseconds kOpenEvery = 1'000'000'000;

// Nobody's rules need mention what is told of winners.
NodeOptions announcer_options(const std::string& instance) {
  NodeOptions options = live_options(instance);
  options.on_notice = [say = options.on_notice](const Notice& notice) {
    if (notice.kind != NoticeKind::unmentioned) say(notice);
  };
  return options;
}

class Announcer {
 public:
  Announcer(const WinnersOptions& options, shm::FileDescriptor interrupts)
      : options_(options),
        interrupts_(std::move(interrupts)),
        node_("arbiter-winners", announcer_options(options.instance)),
        instance_(follow_instance("winners", options.instance)),
        winners_(instance_, [this](std::string_view port) { return is_wanted(port); }) {}

  int run() {
    shm::Nanoseconds repeat = shm::monotonic_now() + options_.every;
    for (;;) {
      instance_->update();
      news_.tell(*instance_);
      const auto changes = winners_.look();
      for (const watch::WinnerAt& change : changes) tell(change);
      warn_of_patterns_without_winners();
      if (!goes_on()) return 1;
      const shm::Nanoseconds now = shm::monotonic_now();
      if (now >= open_again_ && instance_->has_daemon()) {
        open_again_ = now + kOpenEvery;
        open_waiting();
      }
      if (now >= repeat) {
        repeat = now + options_.every;
        tell_again();
      }
      const auto next = std::min({now + kLookEvery, std::max(winners_.next_end(), now), repeat});
      if (sleep_until(next, interrupts_)) return 0;
    }
  }

 private:
  struct Watched {
    OutputPort<WinnerChange> out;
    WinnerChange last{};
  };

  [[nodiscard]] bool is_wanted(std::string_view port) const {
    return std::any_of(options_.patterns.begin(), options_.patterns.end(),
                       [&](const std::string& each) { return rules::matches(each, port); });
  }

  void tell(const watch::WinnerAt& change) {
    Watched* watched = find(change.port);
    if (watched == nullptr) return;
    WinnerChange& sample = watched->last;
    const bool is_start = sample.seen_ns == 0;
    const std::uint64_t changes = sample.changes;
    sample = {};
    sample.news = is_start ? WinnerNews::start : WinnerNews::change;
    sample.changes = changes + (is_start ? 0 : 1);
    sample.time_ns = change.time;
    sample.seen_ns = change.seen;
    sample.generation = change.generation;
    sample.is_arbitrated = change.is_arbitrated ? 1 : 0;
    copy(sample.port, change.port);
    copy(sample.winner, change.winner.value_or(""));
    if (!is_start) copy(sample.before, change.before.value_or(""));
    watched->out.publish(sample);
  }

  void tell_again() {
    for (auto& [port, watched] : ports_) {
      const auto now = winners_.now().find(port);
      if (now == winners_.now().end()) continue;
      watched.last.news = WinnerNews::unchanged;
      watched.last.seen_ns = winners_.looked_at();
      watched.last.generation = now->second.generation;
      watched.out.publish(watched.last);
    }
  }

  // Opens it where it is new. Null: it cannot be opened.
  Watched* find(const std::string& port) {
    const auto found = ports_.find(port);
    if (found != ports_.end()) return &found->second;
    return waiting_.count(port) != 0 ? nullptr : open(port);
  }

  Watched* open(const std::string& port) {
    const std::string source = source_of(port);
    if (source.size() > shm::kMaxNameLength) {
      if (too_long_.insert(port).second) {
        std::cerr << "arbiter: " << rules::quote(port)
                  << " cannot be announced: with what goes around it, its name has more than "
                  << shm::kMaxNameLength << " bytes\n";
      }
      return nullptr;
    }
    try {
      Watched watched{node_.output_port<WinnerChange>(source)};
      std::cerr << "arbiter: announcing " << port << " as " << source << '\n';
      waiting_.erase(port);
      return &ports_.emplace(port, std::move(watched)).first->second;
    } catch (const Error& error) {
      if (waiting_.insert(port).second) problems_.emplace_back(error.what());
      return nullptr;
    }
  }

  // What could not be opened in the last look, said once. False: there is nothing to go on for,
  // for at the start nothing could be opened.
  bool goes_on() {
    const bool is_start = !has_started_ && !winners_.now().empty();
    const bool may_go_on = !is_start || !ports_.empty() || waiting_.empty();
    has_started_ = has_started_ || is_start;
    for (const std::string& problem : std::exchange(problems_, {})) {
      std::cerr << "arbiter: " << problem << (may_go_on ? "; trying again every second" : "")
                << '\n';
    }
    return may_go_on;
  }

  // Once for each model that comes into force: it may arbitrate other ports than the one before.
  void warn_of_patterns_without_winners() {
    if (options_.patterns == WinnersOptions().patterns) return;
    const auto model = models_.unknown(*instance_);
    if (!model) return;
    try {
      PatternCheck("--port", instance_->status()).arbitrated_inputs(options_.patterns);
      models_.note(*model);
    } catch (const wire::CallError&) {  // it has gone since, or is busy
      models_.put_off();
    }
  }

  // Somebody else may have had them, or the policy may have changed since.
  void open_waiting() {
    const auto waiting = waiting_;
    for (const std::string& port : waiting) {
      const auto now = winners_.now().find(port);
      if (now != winners_.now().end() && open(port) != nullptr) tell(now->second);
    }
  }

  const WinnersOptions& options_;
  const shm::FileDescriptor interrupts_;
  Node node_;
  const std::shared_ptr<watch::Instance> instance_;
  watch::Winners winners_;
  std::map<std::string, Watched> ports_;
  std::set<std::string> too_long_;
  std::set<std::string> waiting_;      // input ports whose output port could not be opened
  std::vector<std::string> problems_;  // why, of the last look
  shm::Nanoseconds open_again_ = shm::monotonic_now() + kOpenEvery;
  bool has_started_ = false;
  ModelNews models_;  // that it has been warned of
  DaemonNews news_{"announcing"};
};

int winners(const WinnersOptions& options) { return Announcer(options, catch_interrupts()).run(); }

}  // namespace

void add_winners(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WinnersOptions>();
  CLI::App* verb = app.add_subcommand(
      "winners", "Publish each change of winner, for components that want to know who commands");
  verb->add_option(
          "--port", options->patterns,
          "The input ports, by name or pattern with *; by default, all that are arbitrated")
      ->type_name("PATTERN");
  verb->add_option_function<std::string>(
          "--every",
          [options](const std::string& text) {
            options->every = read_time("--every", text);
            if (options->every >= kLookEvery) return;
            throw CLI::ValidationError("--every", "must be at least 2ms");
          },
          "How often to publish the winner where it has not changed (default 1s)")
      ->type_name("DURATION");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter winners --port '/Base/*'\n\n"
      "The changes at /Base/cmd:i come from the output port /arbiter/winner/Base/cmd:i:o, as "
      "samples "
      "of\ntype arbiter/WinnerChange (arbiter/winner_change.hpp). Connect it in the model as any "
      "source.\nOne that lasts for less than about 2 ms may be missed.\n\n"
      "Exit codes: 0 interrupted; 1 no daemon, or the policy does not let you observe, or none of "
      "these\nports can be opened at the start; 2 wrong use");
  verb->callback([options, &exit_code] { exit_code = winners(*options); });
}

}  // namespace arbiter::cli
