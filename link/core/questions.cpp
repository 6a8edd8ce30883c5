#include "link/core/questions.hpp"

#include <algorithm>
#include <utility>

#include "link/core/card_bytes.hpp"
#include "shm/utf8.hpp"

namespace arbiter::link {
namespace {

constexpr std::uint32_t kQuestionMagic = 0x51425241;  // "ARBQ"
constexpr std::uint32_t kAnswerMagic = 0x41425241;    // "ARBA"
constexpr shm::Nanoseconds kSecond = 1'000'000'000;

bool is_verb(const std::string& verb) {
  return !verb.empty() && std::all_of(verb.begin(), verb.end(),
                                      [](char c) { return (c >= 'a' && c <= 'z') || c == '-'; });
}

}  // namespace

ByteString write_question(const QuestionMessage& message) {
  CardWriter writer(kQuestionMagic, message.asker);
  writer.number(message.number);
  writer.number(static_cast<std::uint16_t>(message.asked.size()));
  for (const Incarnation asked : message.asked) writer.number(asked);
  writer.text(message.host);
  writer.text(message.verb);
  writer.long_text(message.argument);
  return writer.take();
}

std::optional<QuestionMessage> read_question(Bytes bytes) {
  CardReader reader(bytes, kQuestionMagic);
  QuestionMessage message;
  message.asker = reader.number<std::uint64_t>();
  message.number = reader.number<std::uint64_t>();
  const std::size_t count = reader.number<std::uint16_t>();
  reader.require(count != 0 && count <= kMaxAsked);
  for (std::size_t i = 0; i < count && reader.is_good(); ++i) {
    message.asked.push_back(reader.number<std::uint64_t>());
  }
  message.host = reader.text(shm::kMaxHostName);
  message.verb = reader.text(kMaxVerb);
  message.argument = reader.long_text(kMaxArgument);
  reader.require(message.asker != 0 && message.number != 0 && shm::is_host_name(message.host) &&
                 is_verb(message.verb));
  if (!reader.is_good()) return std::nullopt;
  return message;
}

ByteString write_answer(const AnswerMessage& message) {
  CardWriter writer(kAnswerMagic, message.answerer);
  writer.number(message.asker);
  writer.number(message.number);
  writer.number(static_cast<std::uint8_t>(message.is_refusal ? 0 : 1));
  writer.long_text(message.text);
  return writer.take();
}

std::optional<AnswerMessage> read_answer(Bytes bytes) {
  CardReader reader(bytes, kAnswerMagic);
  AnswerMessage message;
  message.answerer = reader.number<std::uint64_t>();
  message.asker = reader.number<std::uint64_t>();
  message.number = reader.number<std::uint64_t>();
  const auto is_answer = reader.number<std::uint8_t>();
  message.is_refusal = is_answer == 0;
  message.text = reader.long_text(kMaxAnswer);
  reader.require(message.answerer != 0 && message.asker != 0 && message.number != 0 &&
                 is_answer <= 1);
  if (!reader.is_good()) return std::nullopt;
  return message;
}

std::uint64_t OpenQuestions::ask(const std::vector<Host>& asked, shm::Nanoseconds now) {
  if (open_.size() >= kMost) return 0;
  Open& open = open_[++last_];
  open.since = now;
  open.ask_again = now + kAskAgain;
  for (const Host& each : asked) {
    const auto [reply, is_new] = open.replies.try_emplace(each.life);
    if (is_new) reply->second.from = each.participant;
    if (reply->second.from != each.participant) reply->second.from.reset();
  }
  return last_;
}

bool OpenQuestions::note(AnswerMessage answer, const Participant& from, shm::Nanoseconds now) {
  const auto open = open_.find(answer.number);
  if (open == open_.end()) return false;
  const auto reply = open->second.replies.find(answer.answerer);
  if (reply == open->second.replies.end() || reply->second.from != from ||
      reply->second.outcome != Outcome::kWaiting) {
    return false;
  }
  if (answer.text.size() > kMostBytes - bytes_) {
    answer.is_refusal = true;
    answer.text = "the answers of all hosts are too long together; ask for one host";
  }
  reply->second.outcome = answer.is_refusal ? Outcome::kRefused : Outcome::kAnswered;
  reply->second.took = now - open->second.since;
  reply->second.text = std::move(answer.text);
  bytes_ += std::min(reply->second.text.size(), kMostBytes - bytes_);
  return true;
}

bool OpenQuestions::is_over(std::uint64_t number, shm::Nanoseconds now) {
  const auto open = open_.find(number);
  if (open == open_.end()) return true;
  bool is_over = true;
  for (auto& [incarnation, reply] : open->second.replies) {
    if (reply.outcome != Outcome::kWaiting) continue;
    if (now - open->second.since >= kPatience) {
      reply.outcome = Outcome::kSilent;
    } else {
      is_over = false;
    }
  }
  return is_over;
}

std::vector<Incarnation> OpenQuestions::due(std::uint64_t number, shm::Nanoseconds now) {
  std::vector<Incarnation> due;
  const auto open = open_.find(number);
  if (open == open_.end() || now < open->second.ask_again) return due;
  open->second.ask_again = now + kAskAgain;
  for (const auto& [incarnation, reply] : open->second.replies) {
    if (reply.outcome == Outcome::kWaiting) due.push_back(incarnation);
  }
  return due;
}

OpenQuestions::Replies OpenQuestions::take(std::uint64_t number) {
  const auto node = open_.extract(number);
  if (node.empty()) return {};
  Replies replies = std::move(node.mapped().replies);
  for (const auto& [incarnation, reply] : replies) bytes_ -= std::min(bytes_, reply.text.size());
  return replies;
}

Askers::Verdict Askers::judge(Incarnation asker, std::uint64_t writer, std::uint64_t number,
                              shm::Nanoseconds now) {
  if (!may_be_called(asker, writer, now)) return Verdict::kInAnothersName;
  const auto found = askers_.find(writer);
  if (found != askers_.end() && found->second.numbers.have(number)) {
    found->second.heard = now;
    return Verdict::kRepeated;
  }
  if (now - since_ >= kSecond) {
    since_ = now;
    count_ = 0;
  }
  if (count_ >= kMostOfAll) return Verdict::kTooMany;
  if (found == askers_.end()) make_place();
  Asker& one = askers_[writer];
  if (now - one.since >= kSecond) {
    one.since = now;
    one.count = 0;
  }
  one.name = asker;
  one.heard = now;
  if (one.count >= kMostOfOne) return Verdict::kTooMany;
  one.numbers.add(number);
  ++one.count;
  ++count_;
  return Verdict::kAnswer;
}

void Askers::forget(std::uint64_t writer, std::uint64_t number) {
  const auto found = askers_.find(writer);
  if (found != askers_.end()) found->second.numbers.remove(number);
}

// Who had the name, and has been silent for long, loses it.
bool Askers::may_be_called(Incarnation name, std::uint64_t writer, shm::Nanoseconds now) {
  const auto known = askers_.find(writer);
  if (known != askers_.end()) return known->second.name == name;
  const auto other = std::find_if(askers_.begin(), askers_.end(),
                                  [&](const auto& each) { return each.second.name == name; });
  if (other == askers_.end()) return true;
  if (now - other->second.heard < kOtherWriter) return false;
  askers_.erase(other);
  return true;
}

bool Askers::Numbers::have(std::uint64_t number) const noexcept {
  if (number > last_) return false;
  const std::uint64_t back = last_ - number;
  return back >= kKnownNumbers || (known_ >> back & 1) != 0;
}

void Askers::Numbers::add(std::uint64_t number) noexcept {
  if (number > last_) {
    const std::uint64_t further = number - last_;
    known_ = further < kKnownNumbers ? known_ << further : 0;
    last_ = number;
  }
  known_ |= std::uint64_t{1} << (last_ - number);
}

void Askers::Numbers::remove(std::uint64_t number) noexcept {
  if (number > last_ || last_ - number >= kKnownNumbers) return;
  known_ &= ~(std::uint64_t{1} << (last_ - number));
}

// Forgets who has been silent for the longest. Its next question is one of a newcomer; so a
// repetition is answered twice, which the quota of all bounds.
void Askers::make_place() {
  if (askers_.size() < kMostAskers) return;
  askers_.erase(std::min_element(askers_.begin(), askers_.end(), [](const auto& a, const auto& b) {
    return a.second.heard < b.second.heard;
  }));
}

}  // namespace arbiter::link
