#include "recorder/statement_watch.hpp"

#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <string>
#include <utility>

#include "watch/live_statement.hpp"

namespace arbiter::recorder {
namespace {

constexpr std::chrono::milliseconds kLookEvery{2};

// For as long as it is the same, so is what the daemon says.
struct Moment {
  std::shared_ptr<const shm::DecisionMemory> memory{};
  std::uint64_t generation = 0;
  std::uint64_t daemons = 0;

  bool operator==(const Moment&) const = default;
};

Moment moment_of(const watch::Instance& instance) {
  return {instance.memory(), instance.memory()->tables().generation(), instance.daemons()};
}

// With what is wrong in the statement: which name this model lacks.
std::string reason_of(const watch::StatementError& error) {
  std::string reason = error.what();
  for (const rules::Diagnostic& found : error.diagnostics().items()) {
    if (found.severity == rules::Severity::kError) reason.append(": ").append(found.message);
  }
  return reason;
}

}  // namespace

StatementWatch::StatementWatch(const wire::Caller& caller, rules::Statement statement,
                               std::function<void()> came_true,
                               std::function<void(const std::string&)> say)
    : statement_(std::move(statement)),
      came_true_(std::move(came_true)),
      say_(std::move(say)),
      instance_(std::make_shared<watch::Instance>(caller)),
      thread_([this] { run(); }) {}

StatementWatch::~StatementWatch() {
  {
    const std::lock_guard lock(mutex_);
    is_stopping_ = true;
    stopping_.notify_one();
  }
  thread_.join();
}

// What is not known is not true; nor does it count as having become false. Of a model that gives it
// no meaning, the daemon is asked once.
void StatementWatch::run() {
  watch::LiveStatement statement(instance_, statement_);
  bool was_true = false;
  std::string reason;
  Moment meaningless;
  const auto say_once = [&](const std::string& why, Moment moment) {
    meaningless = std::move(moment);
    if (std::exchange(reason, why) != why) say_(why);
  };
  for (;;) {
    {
      std::unique_lock lock(mutex_);
      if (stopping_.wait_for(lock, kLookEvery, [this] { return is_stopping_; })) return;
    }
    Moment moment;
    try {
      instance_->update();
      moment = moment_of(*instance_);
      if (moment == meaningless) continue;
      const rules::Truth truth = statement.look().truth;
      if (truth == rules::Truth::kUnknown) continue;
      const bool is_true = truth == rules::Truth::kTrue;
      if (is_true && !was_true) came_true_();
      was_true = is_true;
    } catch (const watch::StatementError& error) {  // another model may have its names
      const std::string why = reason_of(error);
      say_once(why + (why.ends_with('?') ? " " : "; ") + "--when waits for a model that has it",
               std::move(moment));
    } catch (const std::exception& error) {  // there is no model, or the daemon may not be asked
      say_once(error.what(), std::move(moment));
    }
  }
}

}  // namespace arbiter::recorder
