// arbiter winners: changes of winner, as samples that components can take.
//
// A component like others: the rules see its ports, and the policy must let it open them. It looks
// as `arbiter wait` does.
#include <algorithm>
#include <cstring>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
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
#include "shm/decision_memory.hpp"
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

// How often ports that could not be opened are tried again; and where the daemon does not answer,
// for each try holds the announcements up for a second.
constexpr shm::Nanoseconds kOpenEvery = 1'000'000'000;
constexpr shm::Nanoseconds kAskEvery = 5'000'000'000;

class Announcer {
 public:
  Announcer(const WinnersOptions& options, shm::FileDescriptor interrupts)
      : options_(options),
        interrupts_(std::move(interrupts)),
        node_(std::in_place, "arbiter-winners", node_options()),
        instance_(follow_instance("winners", options.instance)),
        memory_(instance_->memory()) {
    follow_winners();
  }

  int run() {
    shm::Nanoseconds repeat = shm::monotonic_now() + options_.every;
    for (;;) {
      instance_->update();
      news_.tell(*instance_);
      if (!belongs_to_daemon()) {
        if (sleep_until(shm::monotonic_now() + kLookEvery, interrupts_)) return 0;
        continue;
      }
      const auto changes = winners_->look();
      for (const watch::WinnerAt& change : changes) tell(change);
      look_at_model();
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
      const auto next = std::min({now + kLookEvery, std::max(winners_->next_end(), now), repeat});
      if (sleep_until(next, interrupts_)) return 0;
    }
  }

 private:
  struct Watched {
    OutputPort<WinnerChange> out;
    WinnerChange last{};
  };

  // Why a port could not be opened.
  struct Problem {
    std::string text;
    bool is_silence = false;  // of the daemon
  };

  // Nobody's rules need mention what is told of winners. A daemon that does not answer is waited
  // for aloud at the start only.
  NodeOptions node_options() {
    NodeOptions options = live_options(options_.instance);
    options.on_notice = [say = options.on_notice](const Notice& notice) {
      if (notice.kind != NoticeKind::unmentioned) say(notice);
    };
    options.on_waiting = [this, say = options.on_waiting](const std::string& text) {
      has_waited_ = true;
      if (!has_started_) say(text);
    };
    return options;
  }

  void follow_winners() {
    winners_.emplace(instance_, [this](std::string_view port) { return is_wanted(port); });
  }

  // A daemon that has memory of its own does not take the node of the one before back: what it
  // publishes reaches nobody. False: there is no node yet that belongs to it.
  bool belongs_to_daemon() {
    if (instance_->memory() == memory_) return true;
    const bool is_first = node_.has_value();
    if (is_first) {
      std::cerr << "arbiter: a daemon has come that does not know what was before: announcing "
                   "starts again\n";
      ports_.clear();
      waiting_.clear();
      node_.reset();
      open_again_ = 0;
      has_said_why_not_ = false;
    }
    if (shm::monotonic_now() < open_again_ || !instance_->has_daemon()) return false;
    try {
      begin_again();
      return true;
    } catch (const std::runtime_error& error) {  // it is busy, has gone since, or refuses
      node_.reset();
      open_again_ = shm::monotonic_now() + kAskEvery;
      if (!std::exchange(has_said_why_not_, true)) {
        std::cerr << "arbiter: " << error.what() << "; trying again every 5 seconds\n";
      }
      return false;
    }
  }

  // All names and pages come before the first look: who wins by then is no change.
  void begin_again() {
    const auto memory = instance_->memory();
    node_.emplace("arbiter-winners", node_options());
    instance_->catch_up();
    follow_winners();
    memory_ = memory;
    open_again_ = shm::monotonic_now() + kOpenEvery;
  }

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
      const auto now = winners_->now().find(port);
      if (now == winners_->now().end()) continue;
      watched.last.news = WinnerNews::unchanged;
      watched.last.seen_ns = winners_->looked_at();
      watched.last.generation = now->second.generation;
      watched.out.publish(watched.last);
    }
  }

  // Opens it where it is new. Null: it cannot be opened, or not now.
  Watched* find(const std::string& port) {
    const auto found = ports_.find(port);
    if (found != ports_.end()) return &found->second;
    if (waiting_.count(port) != 0) return nullptr;
    if (is_silent_ && shm::monotonic_now() < open_again_) {
      waiting_[port] = false;
      return nullptr;
    }
    return open(port);
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
    has_waited_ = is_silent_ = false;
    try {
      Watched watched{node_->output_port<WinnerChange>(source)};
      std::cerr << "arbiter: announcing " << port << " as " << source << '\n';
      waiting_.erase(port);
      return &ports_.emplace(port, std::move(watched)).first->second;
    } catch (const Error& error) {
      note_problem(port, error.what());
      return nullptr;
    }
  }

  // Of a silent daemon it is said where a port is new; of what another has, once it is known.
  void note_problem(const std::string& port, const char* why) {
    const auto [waiting, is_new] = waiting_.try_emplace(port, false);
    is_silent_ = has_waited_;
    if (is_silent_) {
      open_again_ = shm::monotonic_now() + kAskEvery;
      if (is_new) problems_.push_back({why, true});
    } else if (!std::exchange(waiting->second, true)) {
      problems_.push_back({why, false});
    }
  }

  // What could not be opened in the last look, said once. False: there is nothing to go on for,
  // for at the start nothing could be opened.
  bool goes_on() {
    const bool is_start = !has_started_ && !winners_->now().empty();
    const bool may_go_on = !is_start || !ports_.empty() || waiting_.empty();
    has_started_ = has_started_ || is_start;
    for (const Problem& problem : std::exchange(problems_, {})) {
      const char* const again =
          problem.is_silence ? "; trying again every 5 seconds" : "; trying again every second";
      std::cerr << "arbiter: " << problem.text << (may_go_on ? again : "") << '\n';
    }
    return may_go_on;
  }

  // Once for each model that comes into force: it may arbitrate other ports than the one before,
  // and a policy may have come with it that keeps us from asking.
  void look_at_model() {
    const auto model = models_.unknown(*instance_);
    if (!model) return;
    try {
      if (options_.patterns == WinnersOptions().patterns) {
        instance_->catch_up();
      } else {
        PatternCheck("--port", instance_->status()).arbitrated_inputs(options_.patterns);
      }
      models_.note(*model);
      if (std::exchange(may_not_observe_, false)) std::cerr << "arbiter: the daemon tells again\n";
    } catch (const wire::RefusedError& error) {
      models_.put_off();
      if (std::exchange(may_not_observe_, true)) return;
      std::cerr << "arbiter: of ports with new sources nothing new is announced, for the daemon "
                   "refuses to tell; trying again every 5 seconds: "
                << error.what() << '\n';
    } catch (const wire::CallError&) {  // it has gone since, or is busy
      models_.put_off();
    }
  }

  // Somebody else may have had them, or the policy may have changed since. Where the daemon does
  // not answer for one, it does not for the others.
  void open_waiting() {
    const auto waiting = waiting_;
    for (const auto& [port, is_said] : waiting) {
      const auto now = winners_->now().find(port);
      if (now == winners_->now().end()) continue;
      if (open(port) != nullptr) tell(now->second);
      if (is_silent_) return;
    }
  }

  const WinnersOptions& options_;
  const shm::FileDescriptor interrupts_;
  bool has_started_ = false;
  bool has_waited_ = false;  // for the daemon, while the last port was opened
  bool is_silent_ = false;   // the daemon: it has not answered for the last port
  std::optional<Node> node_;
  const std::shared_ptr<watch::Instance> instance_;
  std::shared_ptr<const shm::DecisionMemory> memory_;  // that node_ and ports_ belong to
  std::optional<watch::Winners> winners_;
  std::map<std::string, Watched> ports_;
  std::set<std::string> too_long_;
  // Input ports whose output port could not be opened; true: it has been said why.
  std::map<std::string, bool> waiting_;
  std::vector<Problem> problems_;  // why, of the last look
  shm::Nanoseconds open_again_ = shm::monotonic_now() + kOpenEvery;
  bool has_said_why_not_ = false;  // that the daemon that has come last does not let it begin again
  ModelNews models_;               // that it has been warned of
  bool may_not_observe_ = false;
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
          "How often to publish the winner where it has not changed, 2ms or more (default 1s)")
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
