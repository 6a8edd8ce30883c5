#include "link/switching.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "link/say_sparingly.hpp"
#include "wire/call.hpp"
#include "wire/change_report.hpp"
#include "wire/document.hpp"

namespace arbiter::link {
namespace {

// Together less than whoever asks waits.
constexpr std::chrono::milliseconds kUntilThere{200};
constexpr std::chrono::milliseconds kUntilDone{700};

Answer refusal(std::string why) { return {true, std::move(why)}; }

Answer left_out() {
  wire::SwitchAnswer answer;
  answer.is_left_out = true;
  return {false, wire::write_switch_answer(answer)};
}

// Each question is another host's: nothing in it is believed.
wire::SwitchRequest request_of(const Question& question) {
  auto request = wire::read_switch_request(question.argument);
  if (!request) throw std::runtime_error("what was asked cannot be read");
  return *std::move(request);
}

}  // namespace

SwitchTo switch_of_daemon(const std::string& instance) {
  return [instance](const std::string& model, bool is_dry_run) {
    wire::Caller caller;
    caller.name = "arbiter-link-switch";
    caller.instance = instance;
    caller.patience = caller.answer_time = kUntilThere;
    wire::Message message;
    message.kind = wire::MessageKind::kSwitch;
    message.flags = wire::kWantsReport | (is_dry_run ? wire::kDryRun : 0u);
    message.set_name(model);
    wire::Call daemon(caller);
    wire::ChangeReport report;
    try {
      report = wire::read_change_report(wire::change_report_text(daemon.ask(message, kUntilDone)));
    } catch (const wire::RefusedError&) {
      throw;
    } catch (const std::exception& error) {
      throw NoAnswer(error.what());
    }
    if (!report.ok) throw std::runtime_error(report.why.value_or("the daemon refuses"));
    wire::SwitchAnswer answer;
    answer.generation = report.generation.value_or(0);
    answer.model = model;
    return answer;
  };
}

void Switching::add_to(Answers& answers) {
  const std::string action = "switch";
  answers.add(wire::kPrepareVerb, action, [this](const Question& each) { return prepare(each); });
  answers.add(wire::kCommitVerb, action, [this](const Question& each) { return commit(each); });
  answers.add(wire::kReleaseVerb, action, [this](const Question& each) { return release(each); });
}

Answer Switching::prepare(const Question& question) {
  const wire::SwitchRequest request = request_of(question);
  if (is_left_out(request)) return left_out();
  const SwitchAttempt attempt{question.asker, request.attempt};
  switch (promise_.judge(attempt, clock_())) {
    case Promise::Verdict::kBusy:
      return refusal("busy: it is prepared for another switch, for 2 s at most");
    case Promise::Verdict::kTooMuch:
      return refusal("busy: host " + question.host +
                     " has prepared it too often and not switched; try again in 10 s");
    case Promise::Verdict::kFree:
      break;
  }
  const wire::SwitchAnswer answer = switch_to_(request.model, true);
  promise_.promise(attempt, request.model, clock_());
  return {false, wire::write_switch_answer(answer)};
}

Answer Switching::commit(const Question& question) {
  const wire::SwitchRequest request = request_of(question);
  if (is_left_out(request)) return left_out();
  const auto model = promise_.keep({question.asker, request.attempt}, clock_());
  if (!model) return refusal("it is not prepared for this switch: it keeps its model");
  say_sparingly(gateway::Level::kInfo,
                "host " + question.host + " has this host switch to model \"" + *model + "\"");
  try {
    return {false, wire::write_switch_answer(switch_to_(*model, false))};
  } catch (const NoAnswer& error) {
    wire::SwitchAnswer answer;
    answer.unknown = error.what();
    return {false, wire::write_switch_answer(answer)};
  }
}

Answer Switching::release(const Question& question) {
  const wire::SwitchRequest request = request_of(question);
  promise_.release({question.asker, request.attempt}, clock_());
  return {false, wire::write_switch_answer({})};
}

bool Switching::is_left_out(const wire::SwitchRequest& request) const {
  return std::find(request.without.begin(), request.without.end(), host_) != request.without.end();
}

}  // namespace arbiter::link
