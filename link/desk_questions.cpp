// What a desk asks and is asked: by links, and by programs of this host.
#include <algorithm>
#include <chrono>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "link/desk.hpp"
#include "link/desk_topics.hpp"
#include "link/host_status.hpp"
#include "shm/clock.hpp"
#include "wire/document.hpp"
#include "wire/switch_request.hpp"

namespace arbiter::link {
namespace {

// A lease: hosts announce themselves six times in it.
constexpr shm::Nanoseconds kAllAreHeard = 1'500'000'000;

}  // namespace

void Desk::answer_questions() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ends_ || !asked_.is_empty(); });
    if (ends_) return;
    std::optional<Asked> asked = asked_.next(shm::monotonic_now());
    if (!asked) continue;
    lock.unlock();
    answer(*std::move(asked));
    lock.lock();
  }
}

void Desk::answer(Asked asked) {
  const QuestionMessage& message = asked.message;
  if (!asked.answer) {
    Answer given = answers_.answer({message.host, message.asker, message.verb, message.argument});
    asked.answer = {me_.incarnation, message.asker, message.number, given.is_refusal,
                    std::move(given.text)};
  }
  if (!asked.is_ours && send_answer(*asked.answer)) return;
  const std::lock_guard lock(mutex_);
  if (!asked.is_ours) {
    asked_.keep(std::move(asked));
    return;
  }
  open_.note(*std::move(asked.answer), {}, shm::monotonic_now());
  changed_.notify_all();
}

std::string Desk::serve(const LocalUser& who, const wire::LinkQuestion& question) {
  const bool is_about_hosts = question.verb == "hosts" && question.host.empty();
  const std::string* const action = answers_.action_of(question.verb);
  if (!is_about_hosts && action == nullptr) {
    throw std::runtime_error("links cannot be asked for \"" + question.verb + '"');
  }
  daemon_.require(who, is_about_hosts ? "observe" : *action);
  if (!is_about_hosts) return wire::write_host_answers(ask_hosts(question));
  return wire::write_document(to_json(document()));
}

// Cards are long, and whoever hears one waits for the lock: under it only pointers are copied.
wire::HostsDocument Desk::document() const {
  wire::HostsDocument document;
  std::shared_ptr<const OwnHost> own;
  std::shared_ptr<const std::vector<Disagreement>> standing;
  std::vector<Neighbour> neighbours;
  std::vector<std::optional<shm::Nanoseconds>> round_trips;
  std::set<Participant> deaf;
  {
    const std::lock_guard lock(mutex_);
    if (!network_.empty()) document.network = network_;
    own = own_;
    standing = standing_;
    neighbours = neighbours_.all();
    document.without_place = neighbours_.without_place();
    for (const Neighbour& each : neighbours) {
      round_trips.push_back(round_trips_.of(each.participant));
    }
    deaf = round_trips_.deaf();
  }
  document.host = me_.host;
  document.instance = me_.instance;
  document.version = me_.version;
  if (!own->waits_for.empty()) document.waits_for = own->waits_for;
  wire::HostStatus& here = document.hosts.emplace_back(status_of(own->card));
  here.is_this = true;
  here.since = began_;
  for (std::size_t i = 0; i < neighbours.size(); ++i) {
    wire::HostStatus& host = document.hosts.emplace_back(status_of(*neighbours[i].card));
    host.is_up = neighbours[i].is_up;
    host.since = neighbours[i].since;
    host.is_deaf = host.is_up && deaf.contains(neighbours[i].participant);
    // What was measured before nothing gets there any more is not how far away it is.
    if (host.is_up && !host.is_deaf) host.round_trip = round_trips[i];
  }
  document.imports = own->imports;
  for (const Disagreement& each : *standing) document.disagreements.push_back(status_of(each));
  return document;
}

std::vector<wire::HostAnswer> Desk::ask_hosts(const wire::LinkQuestion& question) {
  if (question.argument.size() > kMaxArgument) throw std::runtime_error("that is too much to ask");
  const bool is_for_all = question.host == wire::kAllHosts;
  // No host that is there may be passed over.
  if (is_for_all && question.verb == wire::kPrepareVerb) await_all_hosts();
  const std::string& wanted = question.host.empty() ? me_.host : question.host;
  std::vector<wire::HostAnswer> answers;
  // Of answers, as long as they are not known to be gone.
  std::vector<OpenQuestions::Host> asked;
  QuestionMessage message{me_.incarnation, 0, {}, me_.host, question.verb, question.argument};
  {
    const std::lock_guard sending(send_mutex_);
    {
      const std::lock_guard lock(mutex_);
      const auto add = [&](const HostCard& card, bool is_up, const Participant& participant) {
        if (!is_for_all && card.host != wanted) return;
        wire::HostAnswer& one = answers.emplace_back();
        one.host = card.host;
        one.incarnation = hexadecimal(card.incarnation);
        one.outcome = is_up ? wire::HostOutcome::kSilent : wire::HostOutcome::kGone;
        if (is_up) asked.push_back({card.incarnation, participant});
      };
      add(me_, true, {});
      for (const Neighbour& each : neighbours_.all()) {
        add(*each.card, each.is_up, each.participant);
      }
      if (answers.empty()) {
        throw std::runtime_error(network_.empty()
                                     ? "the link of this host is not on a network yet: see arbiter "
                                       "hosts"
                                     : "no host is called \"" + wanted + "\": see arbiter hosts");
      }
      for (const OpenQuestions::Host& each : asked) message.asked.push_back(each.life);
      message.number = open_.ask(asked, shm::monotonic_now());
      if (message.number == 0) throw std::runtime_error("too many questions wait for an answer");
    }
    put_question(message);
  }
  const OpenQuestions::Replies replies = await_replies(message);
  for (std::size_t i = 0, next = 0; i < answers.size(); ++i) {
    if (answers[i].outcome == wire::HostOutcome::kGone) continue;
    const OpenQuestions::Reply& reply = replies.at(asked.at(next++).life);
    answers[i].outcome = outcome_of(reply.outcome);
    answers[i].took = reply.took;
    answers[i].text = reply.text;
  }
  return answers;
}

void Desk::await_all_hosts() {
  std::unique_lock lock(mutex_);
  for (;;) {
    if (closes_) throw std::runtime_error("the link ends");
    if (network_.empty()) {
      throw std::runtime_error(
          "this link has not joined its network yet, and does not know the other hosts" +
          (own_->waits_for.empty() ? "" : ": " + own_->waits_for));
    }
    const shm::Nanoseconds left = joined_ + kAllAreHeard - shm::monotonic_now();
    if (left <= 0) break;
    changed_.wait_for(lock, std::chrono::nanoseconds(left));
  }
  const std::size_t without_place = neighbours_.without_place();
  if (without_place != 0) throw std::runtime_error(wire::without_place_text(without_place));
}

// Our own answer is made here; others get the question.
void Desk::put_question(const QuestionMessage& message) {
  QuestionMessage others = message;
  const bool is_for_us = std::erase(others.asked, me_.incarnation) != 0;
  if (is_for_us) {
    const std::lock_guard lock(mutex_);
    asked_.add(message, shm::monotonic_now());
    changed_.notify_all();
  }
  if (!others.asked.empty()) send_question(others);
}

void Desk::send_question(const QuestionMessage& message) {
  const std::shared_lock using_topics(topics_mutex_);
  if (topics_ != nullptr) topics_->questions.send(write_question(message));
}

bool Desk::send_answer(const AnswerMessage& message) {
  const std::shared_lock using_topics(topics_mutex_);
  // Without a network nobody hears it, and nobody asks again.
  return topics_ == nullptr || topics_->answers.send(write_answer(message));
}

OpenQuestions::Replies Desk::await_replies(QuestionMessage& message) {
  constexpr auto kStep = std::chrono::milliseconds(50);
  std::unique_lock lock(mutex_);
  while (!closes_ && !open_.is_over(message.number, shm::monotonic_now())) {
    changed_.wait_for(lock, kStep);
    message.asked = open_.due(message.number, shm::monotonic_now());
    std::erase(message.asked, me_.incarnation);
    if (message.asked.empty()) continue;
    lock.unlock();
    {
      const std::lock_guard sending(send_mutex_);
      send_question(message);
    }
    lock.lock();
  }
  return open_.take(message.number);
}

}  // namespace arbiter::link
