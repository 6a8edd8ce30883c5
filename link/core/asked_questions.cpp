#include "link/core/asked_questions.hpp"

#include <algorithm>
#include <utility>

namespace arbiter::link {

bool AskedQuestions::hear(QuestionMessage question, std::uint64_t writer, shm::Nanoseconds now) {
  const Incarnation asker = question.asker;
  const std::uint64_t number = question.number;
  switch (askers_.judge(asker, writer, number, now)) {
    case Askers::Verdict::kRepeated:
      return ask_again(question);
    case Askers::Verdict::kAnswer:
      break;
    default:
      return false;
  }
  if (waiting_.size() >= kMost) {
    askers_.forget(writer, number);
    return false;
  }
  waiting_.push_back({std::move(question), false, now});
  return true;
}

void AskedQuestions::add(QuestionMessage question, shm::Nanoseconds now) {
  waiting_.push_back({std::move(question), true, now});
}

bool AskedQuestions::is_empty() const noexcept {
  return waiting_.empty() &&
         std::none_of(kept_.begin(), kept_.end(), [](const Kept& each) { return each.is_due; });
}

// Answers first: they are made, and soon nobody waits for them any more.
std::optional<Asked> AskedQuestions::next(shm::Nanoseconds now) {
  forget_old(now);
  const auto due =
      std::find_if(kept_.begin(), kept_.end(), [](const Kept& each) { return each.is_due; });
  if (due != kept_.end()) {
    Asked asked = std::move(due->asked);
    kept_bytes_ -= asked.answer->text.size();
    kept_.erase(due);
    return asked;
  }
  while (!waiting_.empty()) {
    Asked asked = std::move(waiting_.front());
    waiting_.pop_front();
    // A daemon that is stopped holds up whoever asks after it.
    if (now - asked.came < OpenQuestions::kPatience) return asked;
  }
  return std::nullopt;
}

void AskedQuestions::keep(Asked asked) {
  const std::size_t size = asked.answer->text.size();
  if (size > kMostKeptBytes) return;
  while (kept_.size() >= kMostKept || kept_bytes_ + size > kMostKeptBytes) {
    kept_bytes_ -= kept_.front().asked.answer->text.size();
    kept_.pop_front();
  }
  kept_.push_back({std::move(asked), false});
  kept_bytes_ += size;
}

bool AskedQuestions::ask_again(const QuestionMessage& question) {
  const auto kept = std::find_if(kept_.begin(), kept_.end(), [&](const Kept& each) {
    return each.asked.message.asker == question.asker &&
           each.asked.message.number == question.number;
  });
  if (kept == kept_.end() || kept->is_due) return false;
  kept->is_due = true;
  return true;
}

void AskedQuestions::forget_old(shm::Nanoseconds now) {
  std::erase_if(kept_, [&](const Kept& each) {
    const bool is_old = now - each.asked.came >= OpenQuestions::kPatience;
    if (is_old) kept_bytes_ -= each.asked.answer->text.size();
    return is_old;
  });
}

}  // namespace arbiter::link
