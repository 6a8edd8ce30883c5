#include "link/desk.hpp"

#include <algorithm>
#include <exception>
#include <utility>

#include "gateway/core/say.hpp"
#include "link/desk_topics.hpp"
#include "link/import.hpp"
#include "link/say_sparingly.hpp"
#include "shm/clock.hpp"

namespace arbiter::link {
namespace {

// Cards are whole: while ports come and go, not each change is sent.
constexpr shm::Nanoseconds kCardPeriod = 500'000'000;
// Cards may be long. After a change they are compared until all that it can lead to has settled.
constexpr shm::Nanoseconds kCompareEvery = 250'000'000;
constexpr shm::Nanoseconds kComparing =
    Disagreements::kSettles + Disagreements::kNoEarlierLife + 4 * kCompareEvery;
constexpr shm::Nanoseconds kSocketPeriod = 1'000'000'000;

}  // namespace

Desk::Desk(HostCard me, Neighbours known)
    : me_(std::move(me)),
      began_(shm::monotonic_now()),
      daemon_(me_.instance),
      switching_(me_.host, switch_of_daemon(me_.instance), time_with_sleep),
      neighbours_(std::move(known)),
      round_trips_(me_.incarnation) {
  add_verbs();
  answering_ = std::thread([this] { answer_questions(); });
}

// Who has asked would hold it up until all answers of others have come.
Desk::~Desk() {
  close();
  socket_.reset();
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
  using Writer = gateway::dds::SampleWriter;
  auto topics = std::make_unique<DeskTopics>(
      network, bell,
      DeskTopics::Heard{
          [this](Bytes bytes, const Writer& writer) { hear_card(bytes, writer); },
          [this](Bytes bytes, const Writer& writer) { hear_pulse(bytes, writer.participant); },
          [this](Bytes bytes, const Writer& writer) { hear_question(bytes, writer.handle); },
          [this](Bytes bytes, const Writer& writer) { hear_answer(bytes, writer.participant); }});
  {
    const std::unique_lock using_topics(topics_mutex_);
    topics_ = std::move(topics);
    const std::lock_guard lock(mutex_);
    network_ = std::move(name);
    joined_ = shm::monotonic_now();
  }
  sent_ = nullptr;
  pulse_ = std::make_unique<TokenClock>([this] {
    ByteString pulse;
    {
      const std::lock_guard lock(mutex_);
      pulse = write_pulse(round_trips_.next(shm::monotonic_now()));
    }
    topics_->pulses.send(pulse);
  });
  pulse_->set_period(RoundTrips::kPulsePeriod);
}

void Desk::leave() {
  pulse_.reset();
  std::unique_ptr<DeskTopics> gone;
  {
    const std::unique_lock using_topics(topics_mutex_);
    gone = std::move(topics_);
    const std::lock_guard lock(mutex_);
    network_.clear();
  }
  gone.reset();  // without locks: it waits for what is being heard
  const std::lock_guard lock(mutex_);
  neighbours_.keep({}, shm::monotonic_now());
  round_trips_.keep({});
}

void Desk::close() {
  if (socket_ != nullptr) socket_->close();
  {
    const std::lock_guard lock(mutex_);
    closes_ = true;
  }
  changed_.notify_all();
  leave();
}

OtherLinks Desk::others() const {
  const std::lock_guard lock(mutex_);
  OtherLinks others{round_trips_.deaf(), {}, round_trips_.pulsing()};
  for (const Neighbour& each : neighbours_.all()) {
    if (each.is_up) others.cards.emplace(each.participant, each.card);
  }
  return others;
}

Neighbours Desk::known() const {
  const std::lock_guard lock(mutex_);
  return neighbours_;
}

void Desk::look(OwnHost own) {
  own.card.host = me_.host;
  own.card.instance = me_.instance;
  own.card.version = me_.version;
  own.card.incarnation = me_.incarnation;
  auto now_own = std::make_shared<const OwnHost>(std::move(own));
  if (now_own->card != own_->card) compare_until_ = shm::monotonic_now() + kComparing;
  {
    const std::lock_guard lock(mutex_);
    own_.swap(now_own);
  }
  if (topics_ != nullptr) {
    send_card();
    look_at_others();
  } else {
    const std::lock_guard lock(mutex_);
    neighbours_.keep({}, shm::monotonic_now());  // who has been gone for long is forgotten
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
  if (sent_ != nullptr && sent_->card == own_->card) return;
  send_again_ = now + kCardPeriod;
  sent_ = topics_->cards.send(write_host_card(own_->card)) ? own_ : nullptr;
}

void Desk::look_at_others() {
  const shm::Nanoseconds now = shm::monotonic_now();  // before: meanwhile others may come
  look_who_is_there(now);
  compare_with_others(now);
}

void Desk::look_who_is_there(shm::Nanoseconds now) {
  const std::vector<std::uint64_t> writers = topics_->cards.writers();
  std::size_t without_place = 0;
  std::set<std::string> deaf_hosts;
  std::set<std::string> hosts_there;
  {
    const std::lock_guard lock(mutex_);
    neighbours_.keep(writers, now, round_trips_.pulsing());
    without_place = neighbours_.without_place();
    std::set<Participant> there;
    for (const Neighbour& each : neighbours_.all()) {
      if (each.is_up) there.insert(each.participant);
    }
    round_trips_.keep(there);
    const std::set<Participant> deaf = round_trips_.deaf();
    for (const Neighbour& each : neighbours_.all()) {
      if (each.is_up) hosts_there.insert(each.card->host);
      if (each.is_up && deaf.contains(each.participant)) deaf_hosts.insert(each.card->host);
    }
  }
  say_without_place(without_place);
  say_who_is_there(hosts_there);
  say_deaf(deaf_hosts);
}

// For a while after each change; and without the lock, for which samples may wait: what strangers
// say may be much.
void Desk::compare_with_others(shm::Nanoseconds now) {
  std::vector<Neighbour> neighbours;
  {
    const std::lock_guard lock(mutex_);
    if (compared_changes_ != neighbours_.changes()) compare_until_ = now + kComparing;
    compared_changes_ = neighbours_.changes();
    if (now > compare_until_ || now < compare_again_) return;
    compare_again_ = now + kCompareEvery;
    neighbours = neighbours_.all();
  }
  std::vector<PresentHost> hosts{{&own_->card, began_}};
  for (const Neighbour& each : neighbours) {
    if (each.is_up) hosts.push_back({each.card.get(), each.since});
  }
  const std::vector<Disagreement> news = disagreements_.look(hosts, now);
  auto standing = std::make_shared<const std::vector<Disagreement>>(disagreements_.standing());
  {
    const std::lock_guard lock(mutex_);
    standing_.swap(standing);
  }
  for (const Disagreement& each : news) {
    const auto level = each.is_error() ? gateway::Level::kError : gateway::Level::kWarning;
    if (say_sooner_or_later(level, each.text())) continue;
    disagreements_.take_back(each);
    compare_until_ = now + kComparing;
  }
}

// When it begins, and not for each card: strangers may send many.
void Desk::say_without_place(std::size_t count) {
  is_without_place_said_ = count != 0 && (is_without_place_said_ ||
                                          say_sooner_or_later(gateway::Level::kWarning,
                                                              wire::without_place_text(count)));
}

// What there is no room for is said later.
void Desk::say_deaf(const std::set<std::string>& hosts) {
  std::erase_if(deaf_said_, [&](const std::string& host) { return !hosts.contains(host); });
  for (const std::string& host : hosts) {
    if (deaf_said_.contains(host)) continue;
    const bool is_said = say_sooner_or_later(
        gateway::Level::kWarning,
        "host " + host +
            " is there, and has not heard this one for 2 s: nothing is imported from "
            "it until it does");
    if (is_said) deaf_said_.insert(host);
  }
}

// A host whose link is started again goes on being there. Hosts that come and go must not keep
// other messages from being said.
void Desk::say_who_is_there(const std::set<std::string>& hosts) {
  const shm::Nanoseconds now = shm::monotonic_now();
  for (const std::string& host : hosts) {
    if (there_said_.contains(host)) continue;
    if (!presences_.take_without_count(now)) return;
    gateway::say(gateway::Level::kInfo, "host " + host + " is there");
    there_said_.insert(host);
  }
  for (auto each = there_said_.begin(); each != there_said_.end();) {
    if (hosts.contains(*each)) {
      ++each;
      continue;
    }
    if (!presences_.take_without_count(now)) return;
    gateway::say(gateway::Level::kWarning,
                 "host " + *each +
                     " is gone: its link has ended, or nothing has been heard of it for 1.5 s");
    each = there_said_.erase(each);
  }
}

void Desk::hear_card(Bytes message, const gateway::dds::SampleWriter& writer) {
  auto card = read_host_card(message);
  if (!card) {
    if (is_of_other_version(message)) {
      say_sparingly(gateway::Level::kWarning,
                    "a link of another version of Arbiter is on this network, which this one "
                    "cannot read: install the same version on all hosts");
    }
    return;
  }
  const std::lock_guard lock(mutex_);
  // One that finds no place is counted there, and said by look().
  static_cast<void>(
      neighbours_.note(writer.handle, std::move(*card), shm::monotonic_now(), writer.participant));
}

void Desk::hear_pulse(Bytes message, const Participant& from) {
  const shm::Nanoseconds now = shm::monotonic_now();
  const auto pulse = read_pulse(message);
  if (!pulse) return;
  const std::lock_guard lock(mutex_);
  round_trips_.note(*pulse, from, now);
}

void Desk::hear_question(Bytes message, std::uint64_t writer) {
  auto question = read_question(message);
  if (!question || question->asker == me_.incarnation) return;
  const bool is_for_us = std::find(question->asked.begin(), question->asked.end(),
                                   me_.incarnation) != question->asked.end();
  if (!is_for_us) return;
  const std::lock_guard lock(mutex_);
  if (network_.empty()) return;  // join() has not returned yet
  if (asked_.hear(std::move(*question), writer, shm::monotonic_now())) changed_.notify_all();
}

// Nobody else answers for this host.
void Desk::hear_answer(Bytes message, const Participant& from) {
  auto answer = read_answer(message);
  if (!answer || answer->asker != me_.incarnation || answer->answerer == me_.incarnation) return;
  const std::lock_guard lock(mutex_);
  if (open_.note(std::move(*answer), from, shm::monotonic_now())) changed_.notify_all();
}

}  // namespace arbiter::link
