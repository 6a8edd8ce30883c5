// arbiter wait: sleeps until a condition about a running instance is true.
//
// Nobody rings for those who merely observe, so this looks every 2 ms and at each time at which it
// knows that an activity ends, in memory. The daemon is asked once for each model that comes into
// force, for its names.
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <exception>
#include <iostream>
#include <memory>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/condition.hpp"
#include "cli/live.hpp"
#include "cli/numbers.hpp"
#include "cli/verbs.hpp"
#include "rules/ask/report.hpp"
#include "rules/text/names.hpp"
#include "shm/clock.hpp"
#include "watch/live_statement.hpp"
#include "wire/rendezvous.hpp"

namespace arbiter::cli {
namespace {

using nlohmann::json;
using rules::Truth;
using watch::LiveStatement;

constexpr int kTimedOut = 3;
constexpr const char* kArgument = "--until";

struct WaitOptions {
  std::string condition;
  std::string instance;
  std::optional<shm::Nanoseconds> timeout;  // nothing: never, and a daemon must be there
  shm::Nanoseconds hold = 0;
  std::string timeout_text, hold_text;  // as they were typed
  bool json = false;
};

shm::Nanoseconds end_of(const WaitOptions& options, shm::Nanoseconds started) {
  return time_after(started, options.timeout.value_or(shm::kForever));
}

// How long the daemon has for an answer: not beyond the end, but for as long as one is looked for,
// lest a short time be over before one that is busy has let us in.
std::chrono::milliseconds time_to_answer(const WaitOptions& options, shm::Nanoseconds deadline) {
  if (!options.timeout || *options.timeout == 0) return kMostHeldUp;
  const std::chrono::nanoseconds left(deadline - shm::monotonic_now());
  return std::clamp(std::chrono::ceil<std::chrono::milliseconds>(left), kConnectTimeout,
                    kMostHeldUp);
}

// How long one is looked for at a time: not beyond the end either.
std::chrono::milliseconds time_to_look(const WaitOptions& options, shm::Nanoseconds deadline) {
  if (!options.timeout || *options.timeout == 0) return kConnectTimeout;
  const std::chrono::nanoseconds left(deadline - shm::monotonic_now());
  return std::clamp(std::chrono::ceil<std::chrono::milliseconds>(left),
                    std::chrono::milliseconds(1), kConnectTimeout);
}

// The instance; with --timeout, one whose daemon comes in time. Null: interrupted meanwhile.
std::shared_ptr<watch::Instance> find_instance(const WaitOptions& options,
                                               shm::Nanoseconds deadline,
                                               const shm::FileDescriptor& interrupts) {
  constexpr shm::Nanoseconds kLookAgain = 50'000'000;
  for (bool has_said = false;;) {
    try {
      return follow_instance("wait", options.instance, time_to_answer(options, deadline),
                             time_to_look(options, deadline));
    } catch (const wire::RefusedError&) {
      throw;
    } catch (const wire::CallError& error) {
      const shm::Nanoseconds now = shm::monotonic_now();
      if (!options.timeout || *options.timeout == 0) throw;
      if (now >= deadline) {
        throw std::runtime_error("timed out after " + seconds_text(*options.timeout) +
                                 "; at the last try: " + error.what());
      }
      if (!std::exchange(has_said, true)) {
        std::cerr << "arbiter: no arbiterd of instance "
                  << rules::quote(wire::instance_name(options.instance))
                  << " answers yet; waiting for one\n";
      }
      if (sleep_until(std::min(now + kLookAgain, deadline), interrupts)) return nullptr;
    }
  }
}

class Waiting {
 public:
  Waiting(const WaitOptions& options, rules::Statement condition, shm::Nanoseconds started,
          std::shared_ptr<watch::Instance> instance, const shm::FileDescriptor& interrupts)
      : options_(options),
        condition_(std::move(condition)),
        started_(started),
        instance_(std::move(instance)),
        interrupts_(interrupts),
        statement_(instance_, condition_) {}

  int run() {
    const shm::Nanoseconds deadline = end_of(options_, started_);
    for (;;) {
      instance_->update();
      news_.tell(*instance_);
      const LiveStatement::Look look = take_look();
      const shm::Nanoseconds now = shm::monotonic_now();
      if (is_fulfilled(look)) return report(true, look, now);
      if (now >= deadline) return report(false, look, now);
      const auto next = std::min({now + kLookEvery, next_event(look, now), deadline});
      if (sleep_until(next, interrupts_)) return interrupted_exit_code(interrupts_);
    }
  }

 private:
  LiveStatement::Look take_look() {
    LiveStatement::Look look = statement_.look();
    if (warned_of_ != statement_.generation()) {
      warned_of_ = statement_.generation();
      rules::write_text(std::cerr, statement_.diagnostics());
    }
    return look;
  }

  // What is not known is not true: it may have been false just then.
  bool is_fulfilled(const LiveStatement::Look& look) {
    if (look.truth != Truth::kTrue) {
      held_since_.reset();
      return false;
    }
    if (!held_since_) held_since_ = look.picture.now;
    return look.picture.now - *held_since_ >= options_.hold;
  }

  [[nodiscard]] shm::Nanoseconds next_event(const LiveStatement::Look& look,
                                            shm::Nanoseconds now) const {
    shm::Nanoseconds next = shm::kForever;
    if (look.truth != Truth::kUnknown) next = std::max(look.picture.next_end(), now);
    if (held_since_) next = std::min(next, time_after(*held_since_, options_.hold));
    return next;
  }

  [[nodiscard]] int report(bool fulfilled, const LiveStatement::Look& look,
                           shm::Nanoseconds now) const {
    if (options_.json) {
      write_json(fulfilled, look, now);
    } else if (!fulfilled) {
      write_why_not(look);
    }
    return fulfilled ? 0 : kTimedOut;
  }

  void write_json(bool fulfilled, const LiveStatement::Look& look, shm::Nanoseconds now) const {
    json winners = json::object();
    for (const auto& [port, winner] : look.winners) {
      winners[port] = winner ? json(*winner) : json(nullptr);
    }
    const json answer{
        {"condition", condition_.text},
        {"fulfilled", fulfilled},
        {"holds", look.truth == Truth::kUnknown ? json(nullptr) : json(look.truth == Truth::kTrue)},
        {"at_ns", look.truth == Truth::kUnknown ? now : look.picture.now},
        {"waited_ns", now - started_},
        {"model", statement_.generation()},
        {"winners", std::move(winners)},
        {"active", look.active}};
    std::cout << answer.dump(2, ' ', false, json::error_handler_t::replace) << '\n';
  }

  void write_why_not(const LiveStatement::Look& look) const {
    std::cerr << "arbiter: timed out after " << seconds_text(options_.timeout.value_or(0)) << ": "
              << rules::quote(condition_.text) << ' ';
    if (look.truth == Truth::kUnknown) {
      std::cerr << (instance_->has_daemon()
                        ? "cannot be judged: the sources change too fast for one picture of them"
                        : "cannot be judged: the daemon that put this model in force has gone")
                << '\n';
      return;
    }
    std::cerr << (look.truth == Truth::kTrue
                      ? "holds, but has not done so for " + seconds_text(options_.hold)
                      : std::string("does not hold"))
              << '\n';
    const auto useless = winners_that_cannot_deliver();
    for (const auto& [port, winner] : look.winners) {
      const bool is_useless = winner && useless.contains({port, *winner});
      std::cerr << "  " << winner.value_or("nobody")
                << (is_useless ? " is selected at " : " wins at ") << port
                << (is_useless ? ", but cannot deliver" : "") << "  (arbiter why " << port << ")\n";
    }
    for (const auto& [source, is_active] : look.active) {
      std::cerr << "  " << source << (is_active ? " is active\n" : " is inactive\n");
    }
  }

  // By port and source. Only the daemon knows; empty where it cannot be asked.
  [[nodiscard]] std::set<std::pair<std::string, std::string>> winners_that_cannot_deliver() const {
    std::set<std::pair<std::string, std::string>> found;
    if (!instance_->has_daemon()) return found;
    try {
      for (const wire::InputStatus& input : instance_->status().inputs) {
        if (input.cannot_deliver) found.emplace(input.name, input.cannot_deliver->source);
      }
    } catch (const std::exception&) {  // it has gone since, or does not answer
    }
    return found;
  }

  const WaitOptions& options_;
  const rules::Statement condition_;
  const shm::Nanoseconds started_;
  const std::shared_ptr<watch::Instance> instance_;
  const shm::FileDescriptor& interrupts_;
  LiveStatement statement_;
  std::optional<shm::Nanoseconds> held_since_;
  std::uint64_t warned_of_ = 0;
  DaemonNews news_{"watching"};
};

int wait(const WaitOptions& options) {
  auto condition = read_condition(kArgument, options.condition);
  if (options.timeout && options.hold > *options.timeout) {
    throw CLI::ValidationError("--for " + options.hold_text + " is longer than --timeout " +
                               options.timeout_text + ", so it could never be true");
  }
  const shm::FileDescriptor interrupts = catch_interrupts();
  const shm::Nanoseconds started = shm::monotonic_now();
  auto instance = find_instance(options, end_of(options, started), interrupts);
  if (instance == nullptr) return interrupted_exit_code(interrupts);
  try {
    return Waiting(options, std::move(condition), started, std::move(instance), interrupts).run();
  } catch (const watch::StatementError& error) {
    rules::write_text(std::cerr, error.diagnostics());
    throw;
  }
}

}  // namespace

void add_wait(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<WaitOptions>();
  CLI::App* verb =
      app.add_subcommand("wait", "Wait until a condition about winners and active sources is true");
  verb->add_option(kArgument, options->condition,
                   "What to wait for: a statement as `arbiter check --assert` reads it")
      ->type_name("CONDITION")
      ->required();
  verb->add_option_function<std::string>(
          "--timeout",
          [options](const std::string& text) {
            options->timeout = read_time("--timeout", text);
            options->timeout_text = text;
          },
          "Give up after this time, such as 500ms or 5s, and until then wait for a daemon, too; 0s "
          "looks once; by default, never")
      ->type_name("DURATION");
  verb->add_option_function<std::string>(
          "--for",
          [options](const std::string& text) {
            options->hold = read_time("--for", text);
            options->hold_text = text;
          },
          "Wait until the condition has been true for this time, at every look")
      ->type_name("DURATION");
  verb->add_flag("--json", options->json,
                 "Write what was seen at the end as JSON: {condition, fulfilled, holds, at_ns, "
                 "waited_ns, model, winners, active}");
  add_instance_option(*verb, options->instance);
  verb->footer(
      "Example:\n"
      "  arbiter wait --until 'winner(/Gaze/pos:i) = /Face/pos:o' --timeout 5s\n"
      "  arbiter wait --until 'idle(/Arm/pos:i) and not /collision:o' --for 200ms\n\n"
      "A source's name says that it is active; winner(PORT) = SOURCE, winner(PORT) = any(GLOB),\n"
      "idle(PORT), and, or, not, implies, iff, any(GLOB), all(GLOB) and none(GLOB) are as in\n"
      "statements. A change is seen within about 2 ms. One that lasts for less may be missed.\n\n"
      "Exit codes: 0 the condition is true; 1 no daemon (with --timeout, none has come by then), "
      "you may\nnot observe, or the model in force does not have a name of the condition; 2 wrong "
      "use, or a\ncondition that cannot be read; 3 timed out; 130 stopped by Ctrl-C (143 by "
      "SIGTERM)");
  verb->callback([options, &exit_code] { exit_code = wait(*options); });
}

}  // namespace arbiter::cli
