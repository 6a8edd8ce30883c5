#include "link/answers.hpp"

#include <exception>
#include <utility>

#include "link/core/questions.hpp"

namespace arbiter::link {

void Answers::add(const std::string& verb, std::string action, Handler handler) {
  verbs_[verb] = {std::move(action), std::move(handler)};
}

Answer Answers::answer(const Question& question) const {
  const auto verb = verbs_.find(question.verb);
  if (verb == verbs_.end()) return {true, "this link cannot be asked for \"" + question.verb + '"'};
  try {
    Answer answer = verb->second.handler(question);
    if (answer.text.size() <= kMaxAnswer) return answer;
    return {true, "the answer has " + std::to_string(answer.text.size()) +
                      " bytes, and no more than " + std::to_string(kMaxAnswer) +
                      " cross the network"};
  } catch (const std::exception& error) {
    return {true, error.what()};
  }
}

const std::string* Answers::action_of(const std::string& verb) const {
  const auto found = verbs_.find(verb);
  return found == verbs_.end() ? nullptr : &found->second.action;
}

}  // namespace arbiter::link
