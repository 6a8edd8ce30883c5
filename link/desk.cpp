#include "link/desk.hpp"

#include <algorithm>
#include <chrono>
#include <stdexcept>
#include <utility>

#include <nlohmann/json.hpp>

#include "gateway/core/say.hpp"
#include "link/core/topic_names.hpp"
#include "link/host_status.hpp"
#include "link/import.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"
#include "wire/document.hpp"

namespace arbiter::link {
namespace {

constexpr shm::Nanoseconds kPulsePeriod = 1'000'000'000;
// Cards are whole: while ports come and go, not each change is sent.
constexpr shm::Nanoseconds kCardPeriod = 500'000'000;
// Cards may be long. After a change they are compared until all that it can lead to has settled.
constexpr shm::Nanoseconds kCompareEvery = 250'000'000;
constexpr shm::Nanoseconds kComparing =
    Disagreements::kSettles + Disagreements::kNoEarlierLife + 4 * kCompareEvery;
constexpr shm::Nanoseconds kSocketPeriod = 1'000'000'000;
constexpr std::size_t kMostToAnswer = 64;
constexpr std::size_t kMostPulseBytes = 64 + kMaxEchoes * 24;
constexpr std::size_t kMostQuestionBytes = 8192;
constexpr std::size_t kMostAnswerBytes = kMaxAnswer + 64;

}  // namespace

struct Desk::Topics {
  Topics(Desk& desk, const Network& network, const gateway::Bell& bell)
      : cards(
            network, kHostTopic, Delivery::kState, kMaxCardBytes,
            [&desk](Bytes bytes, std::uint64_t writer) { desk.hear_card(bytes, writer); }, bell),
        pulses(
            network, kPulseTopic, Delivery::kPulse, kMostPulseBytes,
            [&desk](Bytes bytes, std::uint64_t) { desk.hear_pulse(bytes); }, bell),
        questions(
            network, kQuestionTopic, Delivery::kMessage, kMostQuestionBytes,
            [&desk](Bytes bytes, std::uint64_t) { desk.hear_question(bytes); }, bell),
        answers(
            network, kAnswerTopic, Delivery::kMessage, kMostAnswerBytes,
            [&desk](Bytes bytes, std::uint64_t) { desk.hear_answer(bytes); }, bell) {}

  MessageTopic cards;
  MessageTopic pulses;
  MessageTopic questions;
  MessageTopic answers;
};

Desk::Desk(HostCard me)
    : me_(std::move(me)),
      began_(shm::monotonic_now()),
      daemon_(me_.instance),
      switching_(me_.host, switch_of_daemon(me_.instance), time_with_sleep),
      card_(me_),
      round_trips_(me_.incarnation) {
  add_verbs();
  answering_ = std::thread([this] { answer_questions(); });
}

Desk::~Desk() {
  socket_.reset();
  pulse_.reset();
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  answering_.join();
}

// What others may ask this host. A verb that changes something has a file of its own.
void Desk::add_verbs() {
  answers_.add("status", "observe", [this](const Question&) -> Answer {
    return {false, daemon_.status()};
  });
  answers_.add("model", "observe", [this](const Question&) -> Answer {
    return {false, daemon_.model()};
  });
  switching_.add_to(answers_);
}

void Desk::join(const Network& network, std::string name, const gateway::Bell& bell) {
  auto topics = std::make_unique<Topics>(*this, network, bell);
  {
    const std::unique_lock using_topics(topics_mutex_);
    topics_ = std::move(topics);
    const std::lock_guard lock(mutex_);
    network_ = std::move(name);
  }
  is_card_sent_ = false;
  pulse_ = std::make_unique<TokenClock>([this] {
    ByteString pulse;
    {
      const std::lock_guard lock(mutex_);
      pulse = write_pulse(round_trips_.next(shm::monotonic_now()));
    }
    topics_->pulses.send(pulse);
  });
  pulse_->set_period(kPulsePeriod);
}

void Desk::leave() {
  pulse_.reset();
  std::unique_ptr<Topics> gone;  // without locks: it waits for what is being heard
  {
    const std::unique_lock using_topics(topics_mutex_);
    gone = std::move(topics_);
    const std::lock_guard lock(mutex_);
    network_.clear();
    neighbours_.keep({}, shm::monotonic_now());
  }
}

void Desk::look(OwnHost own) {
  own.card.host = me_.host;
  own.card.instance = me_.instance;
  own.card.version = me_.version;
  own.card.incarnation = me_.incarnation;
  {
    const std::lock_guard lock(mutex_);
    if (own.card != own_.card) compare_until_ = shm::monotonic_now() + kComparing;
    own_ = std::move(own);
  }
  if (topics_ != nullptr) {
    send_card();
    look_at_others();
  }
  open_socket();
}

void Desk::open_socket() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (socket_ != nullptr || now < open_again_) return;
  open_again_ = now + kSocketPeriod;
  try {
    socket_ = std::make_unique<LocalSocket>(
        me_.instance, [this](const LocalUser& who, const wire::LinkQuestion& question) {
          return serve(who, question);
        });
    said_.clear();
  } catch (const std::exception& error) {
    if (said_ == error.what()) return;
    said_ = error.what();
    gateway::say(gateway::Level::kWarning,
                 std::string("programs of this host cannot ask the link: ") + error.what());
  }
}

void Desk::send_card() {
  const shm::Nanoseconds now = shm::monotonic_now();
  if (now < send_again_) return;
  ByteString bytes;
  {
    const std::lock_guard lock(mutex_);
    if (is_card_sent_ && card_ == own_.card) return;
    card_ = own_.card;
    bytes = write_host_card(card_);
  }
  send_again_ = now + kCardPeriod;
  is_card_sent_ = topics_->cards.send(bytes);
}

void Desk::look_at_others() {
  const std::vector<std::uint64_t> writers = topics_->cards.writers();
  const shm::Nanoseconds now = shm::monotonic_now();
  std::vector<Neighbour> neighbours;
  {
    const std::lock_guard lock(mutex_);
    neighbours_.keep(writers, now);
    if (compared_changes_ != neighbours_.changes()) compare_until_ = now + kComparing;
    compared_changes_ = neighbours_.changes();
    if (now > compare_until_ || now < compare_again_) return;
    compare_again_ = now + kCompareEvery;
    neighbours = neighbours_.all();
  }
  // Without the lock, for which samples may wait: what strangers say may be much.
  std::vector<PresentHost> hosts{{&own_.card, began_}};  // of this thread
  for (const Neighbour& each : neighbours) {
    if (each.is_up) hosts.push_back({each.card.get(), each.since});
  }
  const std::vector<Disagreement> news = disagreements_.look(hosts, now);
  std::vector<Disagreement> standing = disagreements_.standing();
  {
    const std::lock_guard lock(mutex_);
    standing_.swap(standing);
  }
  for (const Disagreement& each : news) {
    say_sparingly(each.is_error() ? gateway::Level::kError : gateway::Level::kWarning, each.text());
  }
}

void Desk::hear_card(Bytes message, std::uint64_t writer) {
  auto card = read_host_card(message);
  if (!card) return;
  const std::lock_guard lock(mutex_);
  neighbours_.note(writer, std::move(*card), shm::monotonic_now());
}

void Desk::hear_pulse(Bytes message) {
  const shm::Nanoseconds now = shm::monotonic_now();
  const auto pulse = read_pulse(message);
  if (!pulse) return;
  const std::lock_guard lock(mutex_);
  round_trips_.note(*pulse, now);
}

void Desk::hear_question(Bytes message) {
  auto question = read_question(message);
  if (!question || question->asker == me_.incarnation) return;
  const bool is_for_us = std::find(question->asked.begin(), question->asked.end(),
                                   me_.incarnation) != question->asked.end();
  if (!is_for_us) return;
  const std::lock_guard lock(mutex_);
  if (network_.empty()) return;  // join() has not returned yet
  const auto verdict = askers_.judge(question->asker, question->number, shm::monotonic_now());
  if (verdict != Askers::Verdict::kAnswer || to_answer_.size() >= kMostToAnswer) return;
  to_answer_.push_back({std::move(*question), false, shm::monotonic_now()});
  changed_.notify_all();
}

void Desk::hear_answer(Bytes message) {
  auto answer = read_answer(message);
  if (!answer || answer->asker != me_.incarnation) return;
  const std::lock_guard lock(mutex_);
  if (open_.note(std::move(*answer), shm::monotonic_now())) changed_.notify_all();
}

void Desk::answer_questions() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return ends_ || !to_answer_.empty(); });
    if (ends_) return;
    const Asked asked = std::move(to_answer_.front());
    to_answer_.pop_front();
    // Nobody waits for it any more: a daemon that is stopped holds up whoever asks after it.
    if (shm::monotonic_now() - asked.came >= OpenQuestions::kPatience) continue;
    lock.unlock();
    answer(asked);
    lock.lock();
  }
}

void Desk::answer(const Asked& asked) {
  const QuestionMessage& message = asked.message;
  Answer given = answers_.answer({message.host, message.asker, message.verb, message.argument});
  AnswerMessage reply{me_.incarnation, message.asker, message.number, given.is_refusal,
                      std::move(given.text)};
  if (!asked.is_ours) {
    send_answer(reply);
    return;
  }
  const std::lock_guard lock(mutex_);
  open_.note(std::move(reply), shm::monotonic_now());
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

wire::HostsDocument Desk::document() const {
  wire::HostsDocument document;
  const std::lock_guard lock(mutex_);
  document.host = me_.host;
  document.instance = me_.instance;
  document.version = me_.version;
  if (!network_.empty()) document.network = network_;
  if (!own_.waits_for.empty()) document.waits_for = own_.waits_for;
  wire::HostStatus& here = document.hosts.emplace_back(status_of(own_.card));
  here.is_this = true;
  here.since = began_;
  for (const Neighbour& each : neighbours_.all()) {
    wire::HostStatus& host = document.hosts.emplace_back(status_of(*each.card));
    host.is_up = each.is_up;
    host.since = each.since;
    if (each.is_up) host.round_trip = round_trips_.of(each.card->incarnation);
  }
  document.imports = own_.imports;
  for (const Disagreement& each : standing_) {
    document.disagreements.push_back(status_of(each));
  }
  return document;
}

std::vector<wire::HostAnswer> Desk::ask_hosts(const wire::LinkQuestion& question) {
  if (question.argument.size() > kMaxArgument) throw std::runtime_error("that is too much to ask");
  const bool is_for_all = question.host == wire::kAllHosts;
  const std::string& wanted = question.host.empty() ? me_.host : question.host;
  std::vector<wire::HostAnswer> answers;
  std::vector<Incarnation> asked;  // of answers, as long as they are not known to be gone
  QuestionMessage message{me_.incarnation, 0, {}, me_.host, question.verb, question.argument};
  {
    const std::lock_guard sending(send_mutex_);
    {
      const std::lock_guard lock(mutex_);
      const auto add = [&](const HostCard& card, bool is_up) {
        if (!is_for_all && card.host != wanted) return;
        wire::HostAnswer& one = answers.emplace_back();
        one.host = card.host;
        one.incarnation = hexadecimal(card.incarnation);
        one.outcome = is_up ? wire::HostOutcome::kSilent : wire::HostOutcome::kGone;
        if (is_up) asked.push_back(card.incarnation);
      };
      add(me_, true);
      if (!network_.empty()) {
        for (const Neighbour& each : neighbours_.all()) add(*each.card, each.is_up);
      }
      if (answers.empty()) {
        throw std::runtime_error("no host is called \"" + wanted + "\": see arbiter hosts");
      }
      message.asked = asked;
      message.number = open_.ask(asked, shm::monotonic_now());
      if (message.number == 0) throw std::runtime_error("too many questions wait for an answer");
    }
    put_question(message);
  }
  const OpenQuestions::Replies replies = await_replies(message);
  for (std::size_t i = 0, next = 0; i < answers.size(); ++i) {
    if (answers[i].outcome == wire::HostOutcome::kGone) continue;
    const OpenQuestions::Reply& reply = replies.at(asked.at(next++));
    answers[i].outcome = outcome_of(reply.outcome);
    answers[i].took = reply.took;
    answers[i].text = reply.text;
  }
  return answers;
}

// Our own answer is made here; others get the question.
void Desk::put_question(const QuestionMessage& message) {
  QuestionMessage others = message;
  const bool is_for_us = std::erase(others.asked, me_.incarnation) != 0;
  if (is_for_us) {
    const std::lock_guard lock(mutex_);
    to_answer_.push_back({message, true, shm::monotonic_now()});
    changed_.notify_all();
  }
  if (!others.asked.empty()) send_question(others);
}

void Desk::send_question(const QuestionMessage& message) {
  const std::shared_lock using_topics(topics_mutex_);
  if (topics_ != nullptr) topics_->questions.send(write_question(message));
}

void Desk::send_answer(const AnswerMessage& message) {
  const std::shared_lock using_topics(topics_mutex_);
  if (topics_ != nullptr) topics_->answers.send(write_answer(message));
}

OpenQuestions::Replies Desk::await_replies(QuestionMessage& message) {
  constexpr auto kStep = std::chrono::milliseconds(50);
  std::unique_lock lock(mutex_);
  while (!open_.is_over(message.number, shm::monotonic_now())) {
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
